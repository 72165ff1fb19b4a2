"""Angles that a sensor gives within one turn: put together again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ers_mj.data.consistency.sheet import Fault, Found, Sheet

TURN = 2.0 * np.pi  # [rad]


@dataclass(frozen=True)
class Wrapping:
    """When a leap is that of a sensor which has gone round."""

    within: float = 1.02  # turns that all readings must lie in
    ends: float = 0.25  # turns: it leaps from near one end to near the other
    quick: float = 0.25  # turns of a step that is left when the turn is taken out


WRAPPING = Wrapping()


def unwrapped(sheet: Sheet) -> Found:
    """Every angle that wraps, as one that does not; a reference goes with its output."""
    faults: list[Fault] = []
    for field in ("y", "theta_m", "reference", "u"):
        if field not in sheet.fields or field == "u" and sheet.kind != "position" or sheet.units[field] != "rad":
            continue
        turns, places = _turns(sheet.fields[field])
        if not places.size:
            continue
        sheet = sheet.changed(**{field: sheet.fields[field] + TURN * turns})
        count = f"{places.size} place{'s'[: places.size > 1]}"
        sentence = f"{sheet.labels[field]} wraps at a turn in {count} and is put together again"
        faults.append(sheet.fault("wrap", field, places, sentence))
    if faults:
        sheet = _aligned(sheet)
    return sheet, faults


def _turns(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whole turns to add to x (N,) [rad], and the samples at which it wraps; none where it does not."""
    none = np.zeros(x.size), np.zeros(0, int)
    known = np.flatnonzero(np.isfinite(x))
    low, high = float(np.min(x[known])), float(np.max(x[known]))
    if not 0.5 * TURN < high - low <= WRAPPING.within * TURN:
        return none
    change = np.diff(x[known])
    leaps = np.flatnonzero(np.abs(change) > 0.5 * TURN)
    left = change[leaps] - np.sign(change[leaps]) * TURN
    ends = np.minimum(x[known[leaps]], x[known[leaps + 1]]), np.maximum(x[known[leaps]], x[known[leaps + 1]])
    at_ends = (ends[0] - low < WRAPPING.ends * TURN) & (high - ends[1] < WRAPPING.ends * TURN)
    if not leaps.size or not np.all(at_ends & (np.abs(left) < WRAPPING.quick * TURN)):
        return none
    steps = np.zeros(x.size)
    steps[known[leaps + 1]] = -np.sign(change[leaps])
    return np.cumsum(steps), known[leaps + 1]


def _aligned(sheet: Sheet) -> Sheet:
    """The angles that stand beside the output, moved by whole turns to where it is."""
    for field in ("reference", "u"):
        if field in sheet.fields and (field != "u" or sheet.kind == "position"):
            off = np.nanmedian(sheet.fields[field] - sheet.y)
            if abs(turns := np.round(off / TURN)) > 0:
                sheet = sheet.changed(**{field: sheet.fields[field] - TURN * turns})
    return sheet
