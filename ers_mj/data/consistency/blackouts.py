"""Rows that a logger or a bus has repeated, and places where a sensor has lost its zero."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ers_mj.data.consistency.sheet import Found, Sheet

SENSORS = ("y", "omega", "current", "theta_m", "second", "vin")


@dataclass(frozen=True)
class Blackouts:
    """When repeats and leaps are no motion."""

    lively: float = 0.25  # share of exact repeats up to which a column tells of repeated rows
    fewest: int = 3  # rows
    beyond: float = 10.0  # times what chance would repeat
    calm: int = 5  # samples on either side that tell the speed around a leap
    leap: float = 5.0  # times the way that the largest recorded speed makes in a step
    travel: float = 0.05  # of the travel, that a leap is at least


BLACKOUTS = Blackouts()


def repeats(sheet: Sheet) -> Found:
    """Rows in which all sensors repeat at once are no measurement: what they measured is missing there."""
    columns = {f: sheet.fields[f] for f in SENSORS if f in sheet.fields}
    same = {f: np.r_[False, np.diff(x) == 0.0] for f, x in columns.items()}
    lively = [f for f, repeated in same.items() if np.mean(repeated) <= BLACKOUTS.lively]
    if len(lively) < 2 or "y" not in lively:
        return sheet, []
    together = np.logical_and.reduce([same[f] for f in lively])
    chance = together.size * float(np.prod([np.mean(same[f]) for f in lively]))
    count = int(np.count_nonzero(together))
    if count < max(BLACKOUTS.fewest, BLACKOUTS.beyond * chance) or _at_rest(sheet, together):
        return sheet, []
    names = ", ".join(sheet.labels[f] for f in lively)
    sentence = f"{names} repeat together in {count} rows ({count / together.size:.2%}), which are left out"
    fault = sheet.fault("blackout", "y", together, sentence)
    for field in lively:
        if field != "vin":
            sheet = sheet.masked(field, together)
    return sheet, [fault]


def _at_rest(sheet: Sheet, together: np.ndarray) -> bool:
    """Whether the output rests around most of the repeats, where sensors without noise repeat by themselves."""
    before = np.r_[0.0, np.diff(sheet.y)]
    begins = np.flatnonzero(together & ~np.r_[False, together[:-1]])
    moved = before[np.maximum(begins - 1, 0)] != 0.0
    return bool(np.mean(moved) < 0.5)


def leaps(sheet: Sheet) -> Found:
    """Where the output leaps further than its recorded speed allows and stays there, its zero is moved back."""
    if "omega" not in sheet.fields or sheet.units["y"] != "rad":
        return sheet, []
    t, y, omega = sheet.t, sheet.y, sheet.fields["omega"]
    change, dt = np.diff(y), np.diff(t)
    fastest = float(np.nanmax(np.abs(omega)))
    travel = float(np.nanmax(y) - np.nanmin(y))
    least = np.maximum(BLACKOUTS.leap * fastest * dt, BLACKOUTS.travel * travel)
    steps = np.zeros(y.size)
    for k in np.flatnonzero(np.abs(change) > least):
        n = BLACKOUTS.calm
        around = np.abs(np.r_[change[max(k - n, 0) : k], change[k + 1 : k + 1 + n]])
        held = np.count_nonzero(change[max(k - n, 0) : k] == 0.0) >= n - 1
        if around.size == 2 * n and not held and np.nanmax(around) < 0.2 * abs(change[k]):
            steps[k + 1] = -(change[k] - omega[k] * dt[k])
    places = np.flatnonzero(steps)
    if not places.size:
        return sheet, []
    column = sheet.labels["y"]
    sentence = (
        f"{column} leaps by up to {np.max(np.abs(steps)):.4g} rad in {places.size} place{'s'[: places.size > 1]}, which"
        f" {sheet.labels['omega']} (at most {fastest:.4g} rad/s) rules out: its zero is moved back there"
    )
    return sheet.changed(y=y + np.cumsum(steps)), [sheet.fault("leap", "y", places, sentence)]
