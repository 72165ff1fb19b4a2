"""What a servo is told, held against what it does: a magnitude without its sign, a reference of another kind."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ers_mj.data.consistency.motion import lagged, speed
from ers_mj.data.consistency.sheet import Found, Sheet
from ers_mj.errors import InputError


@dataclass(frozen=True)
class Commands:
    """When a command is not what its name says."""

    lag: float = 0.5  # [s] by which a servo may follow late
    lags: int = 12  # of them, tried
    share: float = 0.1  # of the time that an output must move either way
    moving: float = 0.1  # of its top speed, from which it moves
    magnitude: float = 0.5  # correlation of an input with the speed's magnitude, from which it may be one
    signed: float = 0.25  # correlation with any signed motion, up to which it is one
    follows: float = 0.8  # correlation of a reference with the output that it leads
    near: tuple[float, float] = (0.8, 1.25)  # of a ratio of units
    far: float = 0.75  # of the travel, by which a reference's middle lies off the output's
    same: float = 0.95  # of the samples that equal the output, from which a reference is the output


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
    """Refuse an input that goes with the magnitude of the speed and with nothing that has a sign."""
    if "u" in sheet.sure or sheet.kind == "position" or np.min(sheet.u) < 0.0 or np.ptp(sheet.u) == 0.0:
        return sheet, []
    v = speed(sheet)
    least = COMMANDS.moving * float(np.quantile(np.abs(v), 0.98))
    if min(np.mean(v > least), np.mean(v < -least)) < COMMANDS.share:
        return sheet, []
    lags = _lags(sheet)
    acceleration = np.gradient(v, sheet.t)
    signed = max(abs(lagged(sheet.u, x, lags)[1]) for x in (v, sheet.y, acceleration))
    if signed < COMMANDS.signed and lagged(sheet.u, np.abs(v), lags)[1] > COMMANDS.magnitude:
        column = sheet.labels["u"]
        raise InputError(
            f"{sheet.name}: {column} is never negative and goes with the speed's magnitude, whichever way the output"
            f" moves: its sign seems to stand elsewhere, give it with --map direction=COLUMN, or insist with --map"
            f' "{_contract(sheet)}={column} [{ {"pct": "%"}.get(sheet.units["u"], sheet.units["u"]) }]"'
        )
    return sheet, []


def _contract(sheet: Sheet) -> str:
    return {"V": "u_V", "pct": "u_duty_pct", "N m": "tau_cmd_Nm", "A": "i_cmd_A"}[sheet.units["u"]]


def _lags(sheet: Sheet) -> np.ndarray:
    step = float(np.median(np.diff(sheet.t)))
    most = min(round(COMMANDS.lag / step), sheet.t.size // 4)
    return np.unique(np.linspace(0, most, COMMANDS.lags).astype(int))


def reference(sheet: Sheet) -> Found:
    """A position command that is the output itself, or in another unit, is refused; one of another sign or zero,
    mended.
    """
    if sheet.kind != "position":
        return sheet, []
    y, u, column, output = sheet.y, sheet.u, sheet.labels["u"], sheet.labels["y"]
    travel, known = float(np.nanmax(y) - np.nanmin(y)), np.isfinite(y)
    off = np.abs(u - y)[known]
    if np.mean(off <= max(sheet.step, 1e-9 * travel)) > COMMANDS.same and off.max() < 0.01 * travel:
        raise InputError(
            f"{sheet.name}: {column} equals {output}: it is what was measured, not what was commanded; choose the"
            " command with --map or --input"
        )
    lags = _lags(sheet)
    slope, alike = lagged(u, y, lags)
    if abs(alike) < COMMANDS.follows:
        return sheet, []
    if not {"u", "y"} & sheet.sure:
        _refuse_other_unit(sheet, abs(slope))
    faults = []
    if alike < 0.0 and _near(-slope):
        sentence = f"{column} runs against {output} (correlation {alike:.2f}): its sign is turned"
        faults.append(sheet.fault("unit", "u", known, sentence))
        sheet = sheet.changed(u=-u)
    zero = float(np.median(y[known] - sheet.u[known]))
    if _near(abs(slope)) and abs(zero) > COMMANDS.far * travel:
        sentence = f"{column} has another zero than {output}: {zero:.4g} {sheet.units['y']} are added to it"
        faults.append(sheet.fault("unit", "u", known, sentence))
        sheet = sheet.changed(u=sheet.u + zero)
    return sheet, faults


def _near(ratio: float) -> bool:
    return COMMANDS.near[0] < ratio < COMMANDS.near[1]


def _refuse_other_unit(sheet: Sheet, slope: float) -> None:
    """Raise InputError where the output follows the command in the ratio of two units."""
    column, output = sheet.labels["u"], sheet.labels["y"]
    units = (
        (("deg", math.pi / 180), ("counts/4096", 2 * math.pi / 4096)) if sheet.units["y"] == "rad" else (("mm", 1e-3),)
    )
    for unit, factor in units:
        for odd, other, ratio in ((column, output, slope / factor), (output, column, slope * factor)):
            if _near(ratio):
                contract = ("theta_ref_rad", "theta_rad") if sheet.units["y"] == "rad" else ("x_ref_m", "x_m")
                name = contract[0] if odd == column else contract[1]
                given = f"{odd}:{unit}" if "/" in unit else f"{odd} [{unit}]"
                raise InputError(
                    f"{sheet.name}: {odd} moves {1 / factor:.4g} times as far as {other}, which looks like"
                    f' {unit.split("/")[0]}: give --map "{name}={given}", or insist with --map "{name}={odd}'
                    f' [{sheet.units["y"]}]"'
                )
