"""How a recording, or a part of one, begins: the samples that tell it, and what they tell of the speed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

START = 0.05  # [s] of a record that its initial state is taken from, or BEGINNING.samples, whichever is longer


@dataclass(frozen=True)
class Beginning:
    """What a start is told from, where no model is known."""

    samples: int = 10  # or those of START seconds, whichever is longer
    fewest_seen: int = 6  # samples
    first: int = 2  # changes by which a speed must show
    sure: float = 3.0  # standard deviations within which a speed may lie
    parts: tuple[int, ...] = (1, 2, 4, 8)  # of the samples, through which polynomials are laid
    degrees: int = 5  # of them at most


BEGINNING = Beginning()


def start_samples(t: np.ndarray) -> int:
    """Number of samples that an initial state is taken from: 50 ms or 10 samples, whichever is longer."""
    return min(max(BEGINNING.samples, int(np.searchsorted(t, t[0] + START))), t.size)


def start_seen(t: np.ndarray, y: np.ndarray, sigma: float) -> tuple[float, float]:
    """The least and the largest speed at the first of the samples (N,) that they allow, without a model: both 0 where
    rest is allowed.

    Polynomials of several degrees through heads of several lengths, of which those count that miss the samples by no
    more than their noise; the best one where none does. A speed against which the very first samples go, or the whole
    head without one sample that goes along, is none: it is how a polynomial meets a rudder that is thrown from rest.
    Where none meets the samples, as few of a fast motion, rest is allowed if one without a speed is hardly worse.
    """
    known = np.isfinite(y)
    return _start_seen((t[known] - t[0]).tobytes(), y[known].tobytes(), sigma)


@lru_cache(512)  # asked for again and again of the same beginnings
def _start_seen(times: bytes, outputs: bytes, sigma: float) -> tuple[float, float]:
    """``start_seen`` of the known samples, from the first on."""
    t, y = np.frombuffer(times), np.frombuffer(outputs)
    if t.size < BEGINNING.fewest_seen:
        return 0.0, 0.0
    found, at_rest = [], []
    for n in {max(t.size // part, BEGINNING.fewest_seen) for part in BEGINNING.parts}:
        for degree in range(1, min(n - 3, BEGINNING.degrees + 1)):
            design = np.vander(t[:n] / t[n - 1], degree + 1, increasing=True)
            still, *_ = np.linalg.lstsq(rest := np.delete(design, 1, axis=1), y[:n], rcond=None)
            at_rest.append(math.sqrt(float(np.sum((y[:n] - rest @ still) ** 2)) / (n - degree)) / sigma)
            found.append(_by_polynomial(t[:n] / t[n - 1], y[:n], degree, sigma, t[n - 1]))
    best = min(missed for missed, *_ in found)
    if best > BEGINNING.sure and min(at_rest) < BEGINNING.sure * best:
        return 0.0, 0.0
    low, high = _allowed(found)
    along, seen = np.sign(low) * (y - y[0]), BEGINNING.sure * math.sqrt(2.0) * sigma
    thrown = -np.min(along[1 : 1 + BEGINNING.first]) > seen or -along[-1] > seen >= np.max(along)
    return (0.0, 0.0) if low <= 0.0 <= high or thrown else (float(low), float(high))


def speed_about(t: np.ndarray, y: np.ndarray, at: int, sigma: float) -> tuple[float, float] | None:
    """The least and the largest speed at sample ``at`` of a recording (N,) that the samples up to there or from there
    on allow, whichever tell it better, without a model; None where too few lie before. A part of a motion need not
    begin at rest; and where the input switches at its first sample the motion bends there.
    """
    n = start_samples(t[at:])
    before, after = np.arange(max(at - n + 1, 0), at + 1)[::-1], np.arange(at, min(at + n, t.size))
    told = [_one_sided(t[side] - t[at], y[side], sigma) for side in (before, after)]
    if told[0] is None:
        return None
    return min((one for one in told if one is not None), key=lambda ends: ends[1] - ends[0])


def _one_sided(t: np.ndarray, y: np.ndarray, sigma: float) -> tuple[float, float] | None:
    """The least and the largest slope at the first of the samples (N,); None of too few."""
    known = np.isfinite(y)
    t, y = t[known], y[known]
    if t.size < BEGINNING.fewest_seen:
        return None
    lengths = {max(t.size // part, BEGINNING.fewest_seen) for part in BEGINNING.parts}
    cases = [(n, degree) for n in lengths for degree in range(1, min(n - 3, BEGINNING.degrees + 1))]
    return _allowed([_by_polynomial(t[:n] / t[n - 1], y[:n], degree, sigma, t[n - 1]) for n, degree in cases])


def _by_polynomial(x: np.ndarray, y: np.ndarray, degree: int, sigma: float, scale: float) -> tuple[float, float, float]:
    """(what a polynomial misses in noise levels, less what chance may add; its least and largest slope at 0, x being
    the time over ``scale``).
    """
    design = np.vander(x, degree + 1, increasing=True)
    coefficient, *_ = np.linalg.lstsq(design, y, rcond=None)
    missed = math.sqrt(float(np.sum((y - design @ coefficient) ** 2)) / (x.size - degree - 1)) / sigma
    reach = BEGINNING.sure * max(missed, 1.0) * sigma * math.sqrt(np.linalg.inv(design.T @ design)[1, 1])
    slope, reach = coefficient[1] / scale, reach / abs(scale)
    return missed - 2.0 / math.sqrt(x.size), slope - reach, slope + reach


def _allowed(found: list[tuple[float, float, float]]) -> tuple[float, float]:
    """The least and the largest slope of those polynomials that miss the samples by no more than their noise; of the
    best one where none does.
    """
    enough = max(1.0, min(missed for missed, *_ in found))
    lows, highs = zip(*((low, high) for missed, low, high in found if missed <= enough), strict=True)
    return float(min(lows)), float(max(highs))
