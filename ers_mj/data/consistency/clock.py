"""What a clock tells of itself: another unit than seconds, jumps, and rows that lie alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ers_mj.data.consistency.sheet import Fault, Found, Sheet
from ers_mj.errors import InputError


@dataclass(frozen=True)
class Clock:
    """How servos are logged."""

    fastest: float = 1e-7  # [s] a step of time, below which no servo is logged
    slowest: float = 0.5  # [s] a step of time, from which it is no log of a servo's motion
    usual: tuple[float, float] = (1e-4, 0.2)  # [s] the steps of one, by which a unit is guessed
    gap: float = 3.0  # median steps, above which a step is a gap
    lone: int = 10  # samples: fewer at an end, beside a long gap, tell nothing
    long_gap: float = 20.0  # median steps
    fewest: int = 100  # samples that the longest part must have
    thinnest: float = 20.0  # median steps of time a sample, all in all: what is laid out over time stays that small


CLOCK = Clock()
UNITS = {"ms": ("milliseconds", 1e-3), "us": ("microseconds", 1e-6), "ns": ("nanoseconds", 1e-9)}


def scale(sheet: Sheet) -> Found:
    """Refuse a time whose steps are those of another unit."""
    step = float(np.median(np.diff(sheet.t)))
    column = sheet.labels["t"]
    if step < CLOCK.fastest:
        raise InputError(
            f"{sheet.name}: the time {column} steps by {step:.3g} s, at least {CLOCK.fastest:g} s were expected: give"
            f' its unit as in --map "t_s={column} [min]"'
        )
    if "t" in sheet.sure or step < CLOCK.slowest:
        return sheet, []
    for unit, (words, factor) in UNITS.items():
        if CLOCK.usual[0] <= step * factor <= CLOCK.usual[1]:
            raise InputError(
                f"{sheet.name}: the time {column} steps by {step:.6g} s, which looks like {words}: give"
                f' --map "t_s={column} [{unit}]", or insist with --map "t_s={column} [s]"'
            )
    raise InputError(
        f"{sheet.name}: the time {column} steps by {step:.6g} s, which is no log of a servo: give its unit as in"
        f' --map "t_s={column} [ms]", or insist with --map "t_s={column} [s]"'
    )


def jumps(sheet: Sheet) -> Found:
    """Where one step of time is longer than all the others together, the longest part stays."""
    faults: list[Fault] = []
    while True:
        dt = np.diff(sheet.t)
        k = int(np.argmax(dt))
        if dt[k] <= max(float(np.sum(np.delete(dt, k))), CLOCK.long_gap * float(np.median(dt))):
            return sheet, faults
        parts = np.arange(k + 1), np.arange(k + 1, sheet.t.size)
        keep, drop = sorted(parts, key=len, reverse=True)
        what = f"the time {sheet.labels['t']} jumps by {dt[k]:.4g} s behind data row {sheet.row(k)}"
        if keep.size < CLOCK.fewest:
            raise InputError(
                f"{sheet.name}: {what}, which leaves {keep.size} samples in one piece, at least {CLOCK.fewest} are"
                " needed"
            )
        sentence = f"{what}: the {drop.size} rows on its shorter side are left out"
        faults.append(sheet.fault("time_jump", "t", drop, sentence))
        sheet = sheet.only(keep)


def pieces(sheet: Sheet) -> Found:
    """Where long gaps take up nearly all of the time, the longest piece between them stays."""
    dt = np.diff(sheet.t)
    step = float(np.median(dt))
    if sheet.t[-1] - sheet.t[0] <= CLOCK.thinnest * step * sheet.t.size:
        return sheet, []
    ends = np.r_[0, np.flatnonzero(dt > CLOCK.long_gap * step) + 1, sheet.t.size]
    longest = int(np.argmax(np.diff(ends)))
    keep = np.arange(ends[longest], ends[longest + 1])
    what = (
        f"the time {sheet.labels['t']} spans {sheet.t[-1] - sheet.t[0]:.4g} s in {ends.size - 1} pieces apart, of at"
        f" most {keep.size} samples"
    )
    if keep.size < CLOCK.fewest:
        raise InputError(f"{sheet.name}: {what}, at least {CLOCK.fewest} in one piece are needed")
    drop = np.setdiff1d(np.arange(sheet.t.size), keep)
    sentence = f"{what}: the {drop.size} rows of the others are left out"
    return sheet.only(keep), [sheet.fault("time_jump", "t", drop, sentence)]


def lone_rows(sheet: Sheet) -> Found:
    """A few rows at either end, beside a long gap, are left out."""
    dt = np.diff(sheet.t)
    long = np.flatnonzero(dt > CLOCK.long_gap * np.median(dt))
    first = max((int(k) + 1 for k in long if k + 1 < CLOCK.lone), default=0)
    last = min((int(k) + 1 for k in long if dt.size - k < CLOCK.lone), default=sheet.t.size)
    lone = np.r_[:first, last : sheet.t.size]
    if not lone.size:
        return sheet, []
    longest = max(float(dt[k - 1]) for k in (first, last) if 0 < k < sheet.t.size)
    sentence = (
        f"{lone.size} row{'s'[: lone.size > 1]} at the {'beginning' if first else 'end'} lie"
        f"{'s'[: lone.size == 1]} alone beside a gap of {longest:.4g} s and {'are' if lone.size > 1 else 'is'} left out"
    )
    faults = [sheet.fault("gap", "t", lone, sentence)]
    return sheet.only(np.arange(first, last)), faults
