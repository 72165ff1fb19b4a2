"""What a servo is told, held against what it does: a magnitude without its sign."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ers_mj.data.consistency.motion import lagged, lags_of, speed
from ers_mj.data.consistency.sheet import Found, Sheet
from ers_mj.errors import InputError


@dataclass(frozen=True)
class Commands:
    """When a command is not what its name says."""

    share: float = 0.1  # of the time that an output must move either way
    moving: float = 0.1  # of its top speed, from which it moves
    magnitude: float = 0.5  # correlation of an input with the magnitude of a motion, from which it may be one
    signed: float = 0.6  # share of that, up to which it goes with any signed motion


COMMANDS = Commands()


def directed(sheet: Sheet) -> Found:
    """A duty or voltage without a sign takes that of the direction."""
    if "direction" not in sheet.fields or sheet.kind == "position" or np.min(sheet.u) < 0.0:
        return sheet, []
    direction = sheet.fields["direction"]
    backward = direction <= 0.0 if np.min(direction) >= 0.0 else direction < 0.0
    column = sheet.labels["direction"]
    sentence = (
        f"{sheet.labels['u']} has no sign and takes that of {column}: negative in {np.count_nonzero(backward)} samples"
    )
    mended = sheet.changed(u=np.where(backward, -sheet.u, sheet.u))
    return mended, [sheet.fault("unsigned_input", "u", backward, sentence)]


def unsigned(sheet: Sheet) -> Found:
    """Refuse an input that goes with how fast the output moves, or how far a spring lets it, and far less with anything
    that has a sign.
    """
    if "u" in sheet.sure or sheet.kind == "position" or np.min(sheet.u) < 0.0 or np.ptp(sheet.u) == 0.0:
        return sheet, []
    v = speed(sheet)
    least = COMMANDS.moving * float(np.quantile(np.abs(v), 0.98))
    if min(np.mean(v > least), np.mean(v < -least)) < COMMANDS.share:
        return sheet, []
    lags = lags_of(sheet)
    acceleration = np.gradient(v, sheet.t)
    signed = max(abs(lagged(sheet.u, x, lags)[1]) for x in (v, sheet.y, acceleration))
    sizes = {"speed": np.abs(v), "deflection": np.abs(sheet.y - np.nanmedian(sheet.y))}
    size = max(sizes, key=lambda name: lagged(sheet.u, sizes[name], lags)[1])
    magnitude = lagged(sheet.u, sizes[size], lags)[1]
    if magnitude > COMMANDS.magnitude and signed < COMMANDS.signed * magnitude:
        column = sheet.labels["u"]
        raise InputError(
            f"{sheet.name}: {column} is never negative and goes with the {size}'s magnitude, whichever way the output"
            f" moves: its sign seems to stand elsewhere, give it with --map direction=COLUMN, or insist with --map"
            f' "{_contract(sheet)}={column} [{ {"pct": "%"}.get(sheet.units["u"], sheet.units["u"]) }]"'
        )
    return sheet, []


def _contract(sheet: Sheet) -> str:
    return {"V": "u_V", "pct": "u_duty_pct", "N m": "tau_cmd_Nm", "A": "i_cmd_A"}[sheet.units["u"]]
