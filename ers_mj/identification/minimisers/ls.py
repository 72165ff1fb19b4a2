"""Least squares: a bounded trust region (Levenberg-Marquardt) from many starts, for objectives that are sums of
squares.

Slopes are forward differences at first, then Broyden's updates as long as the decrease keeps what it promised. An
objective's ``stages`` are gone through before it, each until a step gains little.
"""

from __future__ import annotations

import numpy as np

from ers_mj.identification.minimisers.base import Meter, Minimiser, Objective

DIFFERENCE = 1e-5  # of the coordinates, or of the box's width where that is less
LONGEST, DAMPED = 2.0, 20  # step in any coordinate, and how often the damping may be raised for it
PROMISING = 0.3  # of that share, which a step along fresh slopes must promise to be tried
KEPT = 0.3  # share of the promised decrease from which a slope is updated, not taken anew
STAGE_GAIN = 0.01  # share of the value below which a step ends a stage
END_GAIN = 1e-9  # and the search
STAGE_LEFT, EXACT = (
    1e-5,
    1e-22,
)  # shares of the first value of an attempt: enough for a stage, and all that rounding leaves
BELOW_TARGET = 1e-14  # share of the target that is as good as nothing
WIDE = 100.0  # times DIFFERENCE: slopes that see over a kink, tried once where others lead no further
ATTEMPTS = 6
ALIKE, OFTEN = 0.01, 2  # of the value, within which attempts have ended in one place, and how many make it the bottom


class LS(Minimiser):
    """Multi-start trust-region least squares. Further starts follow until one meets the objective's ``target`` or two
    end alike.

    Args:
        attempts: starts at most; 1 polishes what another minimiser has found.
        staged: whether the objective's stages are gone through.
        gain: share of the value below which a step ends the search.
    """

    name = "ls"
    sentence = "multi-start trust-region least squares"
    needs_residuals = True

    def __init__(self, attempts: int = ATTEMPTS, staged: bool = True, gain: float = END_GAIN):
        self.attempts, self.staged, self.gain = attempts, staged, gain

    def _search(self, meter: Meter, random: np.random.Generator, start: np.ndarray | None) -> None:
        ends: list[float] = []
        target = getattr(meter.objective, "target", 0.0)
        for _ in range(self.attempts):
            if start is None and hasattr(meter.objective, "draw"):
                x = np.clip(meter.objective.draw(random), meter.lower, meter.lower + meter.width)
            else:
                x = meter.lower + meter.width * (random.random(meter.size) if start is None else start)
            start = None
            first = None
            for stage in getattr(meter.objective, "stages", ()) if self.staged else ():
                x, _, begun = _descend(meter, stage, x, STAGE_GAIN, STAGE_LEFT)
                first = first or begun
            x, value, _ = _descend(meter, None, x, self.gain, EXACT, first)
            ends.append(value)
            if value <= target or sum(end <= min(ends) * (1.0 + ALIKE) for end in ends) >= OFTEN:
                return


def _descend(
    meter: Meter, stage: Objective | None, x: np.ndarray, least_gain: float, enough: float, first: float | None = None
) -> tuple[np.ndarray, float, float]:
    """Marquardt's steps from x (k,) until one along fresh slopes gains less than a share ``least_gain``, or a share
    ``enough`` of the ``first`` value is left (of that at x where it is not given); the end, its value, and the first.
    """
    lower, upper = meter.lower, meter.lower + meter.width
    e = meter.residuals(x, stage)
    value = _squares(e)
    first = value if first is None else first
    if not np.isfinite(value):
        return x, np.inf, first
    damping, slopes, fresh, wide = 1e-2, None, False, 1.0
    exact = max(enough * first, BELOW_TARGET * getattr(meter.objective, "target", 0.0))
    given = getattr(stage or meter.objective, "slopes", None)
    while value > exact:
        if slopes is None:
            slopes, fresh = given(x, e) if given else _slopes(meter, stage, x, e, wide * DIFFERENCE), True
        hessian, slope = slopes.T @ slopes, slopes.T @ e
        for attempt in range(8 if fresh else 2):
            there = np.clip(
                x + _step(hessian, slope, damping, (x <= lower) & (slope > 0) | (x >= upper) & (slope < 0)),
                lower,
                upper,
            )
            move = there - x
            promised = -(2.0 * slope @ move + move @ hessian @ move)
            if fresh and (given or attempt == 0) and promised < PROMISING * least_gain * value:
                return x, value, first
            e_there = meter.residuals(there, stage)
            if _squares(e_there) < value:
                break
            damping = max(6.0 * damping, 1e-7)
        else:
            if fresh and (wide > 1.0 or given or stage is not None):
                break
            wide, damping, slopes = (WIDE, 1e-2, None) if fresh else (wide, damping, None)
            continue
        gain, was_fresh = value - _squares(e_there), fresh
        if gain > KEPT * promised and np.any(move):
            slopes, fresh = slopes + np.outer(e_there - e - slopes @ move, move / (move @ move)), False
        else:
            slopes = None
        small = gain < least_gain * value
        x, e, value = there, e_there, value - gain
        damping = max(damping / 6.0, 1e-12)
        if small:
            if was_fresh or slopes is None:
                break
            slopes = None
    return x, value, first


def _squares(e: np.ndarray) -> float:
    value = float(e @ e)
    return value if np.isfinite(value) else np.inf


def _slopes(meter: Meter, stage: Objective | None, x: np.ndarray, e: np.ndarray, step: float) -> np.ndarray:
    """Forward differences (N, k), backward ones at an upper bound."""
    out = np.empty((e.size, x.size))
    for k, h in enumerate(step * np.minimum(meter.width, 1.0)):
        there = x.copy()
        there[k] += h if x[k] + h <= meter.lower[k] + meter.width[k] else -h
        out[:, k] = (meter.residuals(there, stage) - e) / (there[k] - x[k])
    out[~np.isfinite(out)] = 0.0
    return out


def _step(hessian: np.ndarray, slope: np.ndarray, damping: float, held: np.ndarray) -> np.ndarray:
    """Marquardt's step (k,), none in what a bound holds, damped further until it is no longer than LONGEST.

    (Scaled to that length it would crawl in all directions where one is soft.)
    """
    step, free = np.zeros(slope.size), np.flatnonzero(~held)
    if free.size:
        part = hessian[np.ix_(free, free)]
        scale = np.diag(part) + 1e-9 * np.trace(part) / free.size + 1e-300
        for _ in range(DAMPED):
            step[free] = -np.linalg.lstsq(part + damping * np.diag(scale), slope[free], rcond=1e-14)[0]
            if np.abs(step).max() <= LONGEST:
                break
            damping *= 4.0
    return step / max(1.0, float(np.abs(step).max()) / LONGEST)
