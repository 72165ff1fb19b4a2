"""A position command held against the output: of another unit, zero or sign, the output itself, behind a limit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ers_mj.data.consistency.motion import lagged, lags_of
from ers_mj.data.consistency.sheet import Fault, Found, Sheet
from ers_mj.errors import InputError


@dataclass(frozen=True)
class References:
    """When a reference is not what its name says."""

    follows: float = 0.8  # correlation of a reference with the output that it leads
    near: tuple[float, float] = (0.8, 1.25)  # of a ratio of units
    far: float = 0.75  # of the travel, by which a reference's middle lies off the output's
    same: float = 0.95  # of the samples that equal the output, from which a reference is the output
    rows: int = 3  # by which the output may be shifted in that
    equal: float = 1e-3  # of a distance or a speed, within which two are one
    at_limit: float = 0.05  # share of the samples that lie at the largest distance from the output
    varied: float = 0.2  # of their mean, by which speeds vary where a lag would vary with them
    moves: int = 4  # at one speed, from which it is a limit's
    sizes: float = 1.3  # ratio of the longest of them to the shortest


REFERENCES = References()


def itself(sheet: Sheet) -> Found:
    """Refuse a position command that is the output, of the same row or of one beside it."""
    if sheet.kind != "position":
        return sheet, []
    y, u, n = sheet.y, sheet.u, sheet.y.size
    travel = float(np.nanmax(y) - np.nanmin(y))
    for shift in sorted(range(-REFERENCES.rows, REFERENCES.rows + 1), key=abs):
        off = np.abs(u[max(0, -shift) : n - max(0, shift)] - y[max(0, shift) : n - max(0, -shift)])
        off = off[np.isfinite(off)]
        if np.mean(off <= max(sheet.step, 1e-9 * travel)) > REFERENCES.same and off.max() < 0.01 * travel:
            rows = f" {abs(shift)} row{'s'[: abs(shift) > 1]} {'later' if shift > 0 else 'earlier'}" if shift else ""
            raise InputError(
                f"{sheet.name}: {sheet.labels['u']} equals {sheet.labels['y']}{rows}: it is what was measured, not what"
                " was commanded; choose the command with --map or --input"
            )
    return sheet, []


def of_another_kind(sheet: Sheet) -> Found:
    """A position command in another unit is refused; one of another sign or zero, mended."""
    if sheet.kind != "position":
        return sheet, []
    y, u, column, output = sheet.y, sheet.u, sheet.labels["u"], sheet.labels["y"]
    travel, known = float(np.nanmax(y) - np.nanmin(y)), np.isfinite(y)
    slope, alike = lagged(u, y, lags_of(sheet))
    if abs(alike) < REFERENCES.follows:
        return sheet, []
    if not {"u", "y"} & sheet.sure:
        _refuse_other_unit(sheet, abs(slope))
    faults = []
    if alike < 0.0 and _near(-slope):
        sentence = f"{column} runs against {output} (correlation {alike:.2f}): its sign is turned"
        faults.append(sheet.fault("unit", "u", known, sentence))
        sheet = sheet.changed(u=-u)
    zero = float(np.median(y[known] - sheet.u[known]))
    if _near(abs(slope)) and abs(zero) > REFERENCES.far * travel:
        sentence = f"{column} has another zero than {output}: {zero:.4g} {sheet.units['y']} are added to it"
        faults.append(sheet.fault("unit", "u", known, sentence))
        sheet = sheet.changed(u=sheet.u + zero)
    return sheet, faults


def behind_a_limit(sheet: Sheet) -> Found:
    """Tell a position command that was logged behind a limit of its own: of its distance from the output, as robots
    clip what they are asked, or of its speed. What the servo was told is there, what was asked of it is not.
    """
    if sheet.kind != "position":
        return sheet, []
    return sheet, [*_near_the_output(sheet), *_at_one_speed(sheet)]


def _near_the_output(sheet: Sheet) -> list[Fault]:
    """A distance to the output that stays at its largest while the output's speed varies, as no lag would."""
    apart = np.abs(sheet.u - sheet.y)
    most = float(np.nanmax(apart))
    at = np.flatnonzero(apart > most - max(sheet.step, REFERENCES.equal * most))
    both = np.any(sheet.u[at] > sheet.y[at]) and np.any(sheet.u[at] < sheet.y[at])
    if not both or at.size < REFERENCES.at_limit * apart.size or np.ptp(sheet.u[at]) < 2.0 * most:
        return []
    speed = np.abs(np.gradient(sheet.u, sheet.t)[at])
    if np.std(speed) < REFERENCES.varied * np.mean(speed):
        return []
    column, output = sheet.labels["u"], sheet.labels["y"]
    sentence = (
        f"{column} stays {most:.4g} {sheet.units['y']} off {output} in {at.size / apart.size:.0%} of the samples and"
        " never goes further: it was logged behind a limit of that distance, what was asked of it is not known"
    )
    return [sheet.fault("clipped", "u", at, sentence)]


def _at_one_speed(sheet: Sheet) -> list[Fault]:
    """Moves of several lengths at one speed, with rests between: steps behind a limit of their speed, or ramps."""
    speed = np.abs(np.diff(sheet.u) / np.diff(sheet.t))
    most = float(np.max(speed))
    at_most = speed > (1.0 - REFERENCES.equal) * most
    edges = np.flatnonzero(np.diff(np.r_[False, at_most, False].astype(int)))
    sizes = np.array([np.ptp(sheet.u[a : b + 1]) for a, b in zip(edges[::2], edges[1::2]) if b - a > 2])
    rests = [np.any(speed[b:a] == 0.0) for (_, b), (a, _) in pairwise(zip(edges[::2], edges[1::2]))]
    if sizes.size < REFERENCES.moves or not all(rests) or sizes.max() < REFERENCES.sizes * sizes.min():
        return []
    moved = speed > 0.0
    if np.mean(at_most[moved]) < 0.5:
        return []
    sentence = (
        f"{sheet.labels['u']} makes {sizes.size} moves of several lengths at {most:.4g} {sheet.units['u']}/s: it is"
        " made of ramps, or was logged behind a limit of its speed, which cannot be told from it then"
    )
    return [sheet.fault("limit", "u", 1 + np.flatnonzero(at_most), sentence)]


def _near(ratio: float) -> bool:
    return REFERENCES.near[0] < ratio < REFERENCES.near[1]


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
