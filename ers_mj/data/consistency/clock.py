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
    lone: int = 10  # samples: fewer at an end, beside a long gap, tell nothing
    long_gap: float = 20.0  # median steps
    fewest: int = 100  # samples that the longest part must have
    thinnest: float = 20.0  # median steps of time a sample, all in all: what is laid out over time stays that small
    late: float = 0.2  # steps that the stamps of a regular clock may be off,
    told: float = 1e-3  # from where on it matters,
    plain: float = 0.02  # and by how many its last tick may be off where its step is told in fewer digits,
    alike: float = 0.5  # correlation of neighbours, above which the clock itself wanders,
    sure: float = 3.0  # and standard deviations by which the output must move with the stamps to prove them right


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


def regular(sheet: Sheet) -> Found:
    """Stamps that are off a regular clock, one by one, are its ticks, unless the output moves with them: what is put
    in for a little longer turns a motor further.
    """
    dt = np.diff(sheet.t)
    ticks = np.r_[0.0, np.cumsum(np.maximum(np.rint(dt / np.median(dt)), 1.0))]
    step, first = np.polyfit(ticks, sheet.t, 1)
    clock = first + step * ticks
    off = sheet.t - clock
    size, worst = float(np.std(off)) / step, float(np.max(np.abs(off))) / step
    if not CLOCK.told < size or worst > CLOCK.late or abs(np.corrcoef(off[1:], off[:-1])[0, 1]) > CLOCK.alike:
        return sheet, []
    share, spread = _moves_with(sheet.y, off, step)
    if share > 0.5 and share > CLOCK.sure * spread:
        return sheet, []
    jitter = float(np.sqrt(np.mean((dt / (step * np.diff(ticks)) - 1.0) ** 2)))
    sentence = (
        f"the steps of time jitter by {jitter:.1%} rms about a regular clock of {step:.4g} s, and the output does not"
        " move with them: the ticks of that clock are taken"
    )
    fault = sheet.fault("jitter", "t", np.flatnonzero(off), sentence)
    return sheet.changed(t=sheet.t[0] + _plain(step, ticks[-1]) * ticks), [fault]


def _plain(step: float, count: float) -> float:
    """The step in as few digits as leave no doubt after so many: recordings of one clock have one step."""
    plain = (float(f"{step:.{digits}g}") for digits in range(1, 17))
    return next(x for x in plain if abs(x - step) * count <= CLOCK.plain * step)


def _moves_with(y: np.ndarray, off: np.ndarray, step: float) -> tuple[float, float]:
    """Which share of the stamps' deviations (N,) the output (N,) moves by, at its speed, and that share's standard
    deviation.
    """
    bend = lambda x: x[2:] - 2.0 * x[1:-1] + x[:-2]
    speed = (y[2:] - y[:-2]) / (2.0 * step)
    moved, would = bend(y), bend(off) * speed
    seen = np.isfinite(moved) & np.isfinite(would)
    power = float(np.sum(would[seen] ** 2))
    if power == 0.0:
        return 0.0, np.inf
    share = float(moved[seen] @ would[seen]) / power
    return share, float(np.sqrt(np.sum((would[seen] * moved[seen]) ** 2))) / power


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
