"""What a signal shows of the instrument that took it: held spans, noise, and the step of its converter."""

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Holds:
    """When repeats of a reading are no chance."""

    neighbours: int = 20  # samples on either side of a held span that say how the signal usually moves
    shortest: int = 5  # samples
    dither: float = 0.35  # of a step, from which noise moves the reading wherever within a step it lies
    coloured: float = 3.0  # how much longer coloured noise may let it stay
    fewest_turns: int = 5  # of the reading within neighbours, as noise makes them and motion does not
    beside: int = 4  # changes on either side of a span that show a servo come to rest and start again
    slowed: float = 0.5  # of the usual speed, below which it comes to rest


HOLDS = Holds()


@dataclass(frozen=True)
class Repeats:
    """When readings that stay alike from one sample to the next are more than chance."""

    near: float = 0.5  # of the noise, to either side: changes that tell how often chance gives one of none
    most_cells: int = 12  # steps to either side that are enough to tell it
    times: float = 1.5  # that; the print may make the least change of a converter a third smaller than its step
    chance: float = 1e-6  # that as many repeats come of noise
    noise: float = 4.0  # steps of noise, from which a reading seldom stays
    most: float = 0.2  # share of the samples, above which a reading is refreshed slowly and not lost


REPEATS = Repeats()


@dataclass(frozen=True)
class Leaps:
    """When the change after a span is the catching up of one that was held."""

    # grid steps, noise levels beyond the usual change, and usual changes that it must exceed
    least: tuple[float, float, float] = (3.5, 6.0, 1.5)
    sides: int = 4  # samples before and after that tell the speed
    way: tuple[float, float] = (0.5, 2.0)  # share of the way made at that speed that it may be


LEAPS = Leaps()


@dataclass(frozen=True)
class Lattice:
    """When the levels of a reading lie on the lattice of a converter."""

    fewest_levels: int = 3  # distinct values below which no lattice can be told
    fewest_revisited: float = 0.05  # share of the distinct values that a converter shows twice or more
    coarse: int = 200  # levels of travel below which even a decimal grid acts as a converter
    # of a step, by which a gap may miss a multiple: a converter behind of a seventh of the step misses that
    near: float = 0.18
    one_step: float = 0.3  # of a step, by which gaps of one step, seen through a finer converter, may differ
    finer: int = 8  # steps between any two neighbours, from which a lattice is chance, or that of a converter behind
    # times the smallest gap between rounded levels up to which one is one step of the converter ahead
    within: float = 1.75
    # steps up to which gaps are counted, one after the other, to know the step ahead
    reaches: tuple[float, ...] = (2.5, 5.0, 10.0, 20.0)
    # of the gaps between levels: where a step may show
    quantiles: tuple[float, ...] = (0.0, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5)


LATTICE = Lattice()


@dataclass(frozen=True)
class Jumps:
    """When a reading leaves its course and comes back."""

    least: float = 8.0  # noise levels of a jump
    calm: int = 6  # changes on either side that are usual
    longest: int = 50  # samples


JUMPS = Jumps()

FLOAT32 = float(np.finfo(np.float32).eps)


def frozen_spans(y: np.ndarray, grid: float) -> list[slice]:
    """Spans of exact repeats too long for chance, amid noise that should have varied them.

    A grid (of the converter or of the print) coarser than the noise, and a rudder at rest without noise,
    repeat by themselves: there the samples around do not dither and nothing can be told.
    """
    if _noise(y) < grid:
        return []
    by_chance = 0.3 if grid else 1 / len(y)  # a grid below the noise repeats up to 28 % of the samples at rest
    repeats = np.clip(np.mean(np.diff(y) == 0), by_chance, 0.9)
    shortest = max(HOLDS.shortest, int(np.ceil(2 * np.log(len(y)) / -np.log(repeats))))
    return [s for s in held_spans(y, shortest) if dithered(y, s) and not _rests(y, s, grid)]


def unmoved_spans(y: np.ndarray, grid: float, sigma: float) -> list[slice]:
    """Repeats of y (N,) longer than noise of HOLDS.dither steps and more, ``sigma`` with the converter's own, leaves a
    reading alone, if it is less than a step, and just before or after which the reading goes to and fro: a rudder at
    rest may be quieter than a moving one.
    """
    noise = math.sqrt(max(sigma**2 - grid**2 / 12.0, 0.0))
    if not HOLDS.dither * grid < noise < grid:
        return []
    repeats = math.erf(grid / (math.sqrt(8.0) * noise))  # in the middle of a step
    shortest = math.ceil(HOLDS.coloured * 2.0 * math.log(len(y)) / -math.log(repeats))
    return [s for s in held_spans(y, shortest) if max(map(_turns, _around(y, s))) >= HOLDS.fewest_turns]


def _turns(changes: np.ndarray) -> int:
    """How often changes from sample to sample turn their sign, those of zero left out."""
    signs = np.sign(changes[changes != 0])
    return int(np.count_nonzero(signs[1:] != signs[:-1]))


def leapt_spans(y: np.ndarray, grid: float, sigma: float) -> list[slice]:
    """Repeats after which y (N,) leaps to where the speed before and after would have brought it meanwhile: a hold that
    a coarse grid or a quiet sensor does not betray by its missing noise. A rudder that sticks and breaks loose has no
    speed before it, and a larger one after it.
    """
    out = []
    for s in held_spans(y, 3):
        first, last = s.start - LEAPS.sides, s.stop + LEAPS.sides
        if first < 0 or last >= y.size:
            continue
        leap, before, after = (
            y[s.stop] - y[s.stop - 1],
            (y[s.start] - y[first]) / LEAPS.sides,
            (y[last] - y[s.stop]) / LEAPS.sides,
        )
        way = (s.stop - s.start) * 0.5 * (before + after)
        usual = max(abs(before), abs(after))
        least = max(LEAPS.least[0] * grid, LEAPS.least[1] * sigma + usual, LEAPS.least[2] * usual)
        if abs(leap) > least and before * after > 0 and LEAPS.way[0] < leap / way < LEAPS.way[1]:
            out.append(slice(s.start + 1, s.stop))
    return out


def repeated_spans(y: np.ndarray, grid: float) -> list[slice]:
    """Repeats of y (N,), single ones too, where changes of exactly none are many more than changes of a step or a few:
    noise of several steps of the ``grid``, or of the least change that there is, makes one as seldom as the other.
    """
    changes = np.abs(np.diff(y))
    grid = max(grid, float(np.min(changes[changes > 0.0], initial=np.inf)))
    noise = _noise(y)
    if noise < REPEATS.noise * grid:
        return []
    cells = min(int(REPEATS.near * noise / grid), REPEATS.most_cells)
    alike, near = (int(np.count_nonzero(some)) for some in (changes == 0.0, changes < (cells + 0.5) * grid))
    if not _is_more_than_chance(alike, near, REPEATS.times / (2 * cells + 1)) or alike > REPEATS.most * y.size:
        return []
    return [slice(s.start + 1, s.stop) for s in held_spans(y, 2) if dithered(y, s)]


def _is_more_than_chance(seen: int, of: int, p: float) -> bool:
    """Whether so many successes of probability p are more than chance, by Chernoff's bound (Ann. Math. Stat. 23,
    1952).
    """
    share = seen / max(of, 1)
    if share <= p:
        return False
    missed = (of - seen) * math.log((1.0 - share) / (1.0 - p)) if seen < of else 0.0
    return -(seen * math.log(share / p) + missed) < math.log(REPEATS.chance)


def held_spans(x: np.ndarray, shortest: int = HOLDS.shortest) -> list[slice]:
    """Runs of at least `shortest` equal samples."""
    starts = np.flatnonzero(np.r_[True, np.diff(x) != 0])
    stops = np.r_[starts[1:], len(x)]
    long = stops - starts >= shortest
    return [slice(int(a), int(b)) for a, b in zip(starts[long], stops[long], strict=True)]


def at_extreme(x: np.ndarray, span: slice) -> bool:
    return bool(x[span.start] in (np.nanmin(x), np.nanmax(x)))


def _around(x: np.ndarray, span: slice) -> tuple[np.ndarray, np.ndarray]:
    """The changes from sample to sample just before and just after a span."""
    return np.diff(x[max(0, span.start - HOLDS.neighbours) : span.start]), np.diff(
        x[span.stop : span.stop + HOLDS.neighbours]
    )


def varied(x: np.ndarray, span: slice) -> bool:
    """Whether x changes at most samples around a span, as no step sequence does."""
    changes = np.concatenate(_around(x, span))
    return bool(np.count_nonzero(changes) > 0.5 * len(changes))


def dithered(x: np.ndarray, span: slice) -> bool:
    """Whether x jerks to and fro on both sides of a span, as noise does whatever the motion under it (4 in 5 turns)."""
    jerks = [np.diff(change, n=2) for change in _around(x, span)]
    return all(np.count_nonzero(jerk[:-1] * jerk[1:] < 0) > 0.4 * max(len(jerk) - 1, 1) for jerk in jerks)


def _rests(y: np.ndarray, span: slice, grid: float) -> bool:
    """Whether y slows down one way into a span, or speeds up one way out of it, turns on neither side and does not leap
    after it: a servo that sticks at the end of its way, whatever the timing of a bus makes of its motion. Noise would
    turn it.
    """
    sides = y[max(0, span.start - HOLDS.neighbours) : span.start + 1][::-1], y[span.stop - 1 :][: HOLDS.neighbours + 1]
    slows = False
    for side in sides:
        change = np.diff(side[np.isfinite(side)])
        near, far = change[: HOLDS.beside], change[HOLDS.beside :]
        if np.max(near, initial=0.0) > 0.75 * grid and np.min(near, initial=0.0) < -0.75 * grid:
            return False
        leaps = near.size > 1 and abs(near[0]) > LEAPS.least[2] * max(grid, np.max(np.abs(near[1:])))
        slows |= far.size > 0 and abs(np.mean(near)) < HOLDS.slowed * abs(np.mean(far))
    return bool(slows and not leaps)


def _noise(y: np.ndarray) -> float:
    """Rms noise, from the lower quartile of the third differences: where y rests for that long, the noise at rest."""
    return float(np.nanquantile(np.abs(np.diff(y, n=3)), 0.25) / (0.3186 * np.sqrt(20)))


def noise_sigma(y: np.ndarray, quantum: float) -> float:
    """Noise of a record (N,): third differences over sqrt(20), their median (or trimmed rms on a lattice), at least q /
    sqrt(12).
    """
    d = np.abs(np.diff(y, 3))
    d = d[np.isfinite(d)]
    if d.size == 0:
        return 1e-9 * float(np.nanstd(y)) + 1e-300
    spread = 1.4826 * float(np.median(d)) / math.sqrt(20.0)
    if quantum > 0:  # the median of a few counts is itself a count
        spread = max(spread, math.sqrt(float(np.mean(d[d <= 4 * (spread * math.sqrt(20.0) + quantum)] ** 2)) / 20.0))
    return max(spread, quantum / math.sqrt(12.0), 1e-9 * float(np.nanstd(y)) + 1e-300)


# -- the converter's step ------------------------------------------------------------------------------------


def converter_step(y: np.ndarray) -> float:
    """The step of the lattice that y (N,) lies on, in y's unit; 0.0 when there is none.

    The differences between neighbouring distinct values must be whole multiples of one step, exactly or, where values
    were rounded in print or by a second converter, nearly (LATTICE.near of it). The decimal grid of the print is a
    lattice too: it counts only where the travel has fewer than 200 of its steps, for then it hides as much as a
    converter would. Pass values in the unit they were printed in.
    """
    levels, counts = np.unique(y[np.isfinite(y)], return_counts=True)
    if len(levels) < LATTICE.fewest_levels or np.mean(counts > 1) < LATTICE.fewest_revisited:
        return 0.0
    grain = decimal_grain(levels)
    multiple = np.gcd.reduce(np.rint(np.diff(levels) / grain).astype(np.int64)) if grain else 1
    if multiple > 1 and np.diff(levels).min() < LATTICE.finer * multiple * grain:
        return _ahead(levels, multiple * grain) or float(multiple * grain)
    return _rounded_lattice(levels, grain) or (grain if np.ptp(levels) < LATTICE.coarse * grain else 0.0)


def decimal_grain(levels: np.ndarray) -> float:
    """The coarsest power of ten that all levels are multiples of; 0.0 when there is none above 1e-12."""
    for decimals in range(int(np.clip(12 - np.log10(np.abs(levels).max()), 0, 13))):
        scaled = levels * 10.0**decimals
        if np.abs(scaled - np.rint(scaled)).max() < 1e-3:
            return 10.0**-decimals
    return 0.0


def _rounded_lattice(levels: np.ndarray, grain: float) -> float:
    """The largest step that nine in ten differences of the levels are multiples of, within LATTICE.near; what two kinds
    of gap differ by may be it as well.
    """
    finest = 8 * max(grain, FLOAT32 * np.abs(levels).max())
    gaps = np.diff(levels)
    gaps = gaps[gaps > finest / 8]
    if not gaps.size:  # every level of the grain was visited
        return 0.0
    usual = np.append(
        np.quantile(gaps, LATTICE.quantiles), np.max(gaps[gaps < LATTICE.within * np.min(gaps)])
    )  # the rarer kind, too, where there are two
    begun = {*usual, *np.abs(usual[:, None] - usual).ravel()}
    steps = [_refined(gaps, step) for step in begun if step >= finest]
    step = max((step for step in steps if np.mean(_on_lattice(gaps, step)) >= 0.9), default=0.0)
    return _ahead(levels, step) or step


def _ahead(levels: np.ndarray, step: float) -> float:
    """The step of a coarser converter ahead of the one of this ``step``, which rounds its levels: neighbours are two or
    three steps apart then, never one.
    0.0 where there is none.
    """
    gaps = np.diff(levels)
    gaps = gaps[gaps > 0.5 * step]
    if not step or gaps.size < LATTICE.fewest_levels or gaps.min() < 1.5 * step:
        return 0.0
    coarse = float(np.mean(gaps[gaps < LATTICE.within * gaps.min()]))
    for reach in LATTICE.reaches:  # the longer a gap, the better must the step be known to count it
        few = gaps[gaps < reach * coarse]
        coarse = float(np.sum(few) / np.sum(np.rint(few / coarse)))
    counts = np.cumsum(np.rint(gaps / coarse))
    slope, offset = np.polyfit(counts, np.cumsum(gaps), 1)
    missed = np.abs(np.cumsum(gaps) - offset - slope * counts)
    return float(slope) if missed.max() < step else 0.0


def _on_lattice(gaps: np.ndarray, step: float) -> np.ndarray:
    return np.abs(gaps / step - np.rint(gaps / step)) < LATTICE.near


def _refined(gaps: np.ndarray, step: float) -> float:
    """The step by least squares over the gaps that are multiples of it, begun with the mean of those that may be one
    step.
    """
    alike = gaps[np.abs(gaps - step) < LATTICE.one_step * step]
    step = float(np.mean(alike)) if alike.size else float(step)
    gaps = gaps[_on_lattice(gaps, step)]
    multiples = np.rint(gaps / step)
    return float(gaps @ multiples / (multiples @ multiples)) if np.any(multiples) else step


# -- samples that are not the signal's -----------------------------------------------------------------------


def spikes(y: np.ndarray, sigma: float) -> list[slice]:
    """Excursions, and single samples that jump: no motion goes and comes back within two, however many there are (at 5
    a second and 200 Hz 4 % of the changes are theirs)."""
    found = excursions(y, sigma)
    alone = excursions(y, sigma, usual=0.9, longest=1)
    return found + [s for s in alone if not any(s.start < other.stop and other.start < s.stop for other in found)]


def excursions(
    y: np.ndarray, sigma: float, times: float = JUMPS.least, usual: float = 0.98, longest: int = JUMPS.longest
) -> list[slice]:
    """Spans of at most ``longest`` samples in which y (N,) jumps away from its course and back again.

    A jump is a change from sample to sample that differs from the usual one around it by more than ``times`` noise
    levels ``sigma``, and as many times what a share ``usual`` of the changes in this recording stays below: quick
    motion.
    """
    known = np.flatnonzero(np.isfinite(y))
    change = np.diff(y[known])
    if change.size < 2 * HOLDS.neighbours:
        return []
    around = np.lib.stride_tricks.sliding_window_view(np.pad(change, JUMPS.calm, mode="edge"), 2 * JUMPS.calm + 1)
    jump = change - np.median(around, axis=1)
    least = times * max(sigma, float(np.quantile(np.abs(jump), usual)))
    large = np.flatnonzero(np.abs(jump) > least)
    out, end = [], -1
    for i, k in enumerate(large):
        if k < end:
            continue
        for back in large[i + 1 :]:
            if back - k > longest:
                break
            if abs(jump[k] + jump[back]) < 0.5 * abs(jump[k]):
                out.append(slice(int(known[k + 1]), int(known[back]) + 1))
                end = back + 1
                break
    return out
