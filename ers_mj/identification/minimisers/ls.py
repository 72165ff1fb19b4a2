"""Least squares: a bounded trust region (Levenberg-Marquardt) from many starts, for objectives that are sums of
squares.

Slopes are forward differences at first, then Broyden's updates as long as the decrease keeps what it promised. An
objective's ``stages`` are gone through before it, each until a step gains little.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ers_mj.identification.minimisers.base import Meter, Minimiser, Objective
from ers_mj.solvers.levenberg_marquardt import Damping, Descent


@dataclass(frozen=True)
class Multistart:
    """How a search steps, when its attempts end, and how many there are."""

    difference: float = 1e-5  # of the coordinates, or of the box's width where that is less
    longest: float = 2.0  # step in any coordinate,
    damped: int = 20  # and how often the damping may be raised for it
    promising: float = 0.3  # of the least gain, which a step along fresh slopes must promise to be tried
    stage_gain: float = 0.01  # share of the value below which a step ends a stage,
    end_gain: float = 1e-9  # and the search
    stage_left: float = 1e-5  # share of the first value of an attempt that is enough for a stage,
    exact: float = 1e-22  # and all that rounding leaves of it
    below_target: float = 1e-14  # share of the target that is as good as nothing
    wide: float = 100.0  # differences: slopes that see over a kink, tried once where others lead no further
    attempts: int = 6  # starts at most
    alike: float = 0.01  # of the value, within which attempts have ended in one place,
    often: int = 2  # and how many make it the bottom


MULTISTART = Multistart()

DAMPING = Damping(first=1e-2, raised=6.0, from_=1e-7, lowered=6.0, least=1e-12)


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

    def __init__(self, attempts: int = MULTISTART.attempts, staged: bool = True, gain: float = MULTISTART.end_gain):
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
                x, _, begun = _descend(meter, stage, x, MULTISTART.stage_gain, MULTISTART.stage_left)
                first = first or begun
            x, value, _ = _descend(meter, None, x, self.gain, MULTISTART.exact, first)
            ends.append(value)
            if value <= target or sum(end <= min(ends) * (1.0 + MULTISTART.alike) for end in ends) >= MULTISTART.often:
                return


@dataclass(frozen=True)
class _Place:
    """A place in the box: z (k,), the residuals there (N,), and their squares, infinite where there are none."""

    z: np.ndarray
    e: np.ndarray
    cost: float


class _Squares:
    """The squares of an objective, or of a ``stage`` of it, as solvers.levenberg_marquardt has a problem.

    A step along fresh slopes that promises less than a share of ``least_gain`` is not tried: where the slopes are not
    ``given`` the first one alone is asked.
    """

    def __init__(self, meter: Meter, stage: Objective | None, least_gain: float):
        self.meter, self.stage, self.least_gain = meter, stage, least_gain
        self.lower, self.upper = meter.lower, meter.lower + meter.width
        self.given = getattr(stage or meter.objective, "slopes", None)
        self.may_look_wider = not self.given and stage is None
        self.asks, self.hopeless = False, False

    def reach(self, z: np.ndarray) -> _Place:
        near = 1e-12 * (self.upper - self.lower)  # of a bound that a clipped step leads to, rounding aside
        there = np.where(z >= self.upper - near, self.upper, np.where(z <= self.lower + near, self.lower, z))
        e = self.meter.residuals(there, self.stage)
        return _Place(there, e, _squares(e))

    def slopes(self, point: _Place, wide: float) -> np.ndarray:
        """Slopes (N, k) at a place, its columns' numbers side by side."""
        self.asks = True
        if self.given:
            return np.array(self.given(point.z, point.e), order="F")
        return _slopes(self.meter, self.stage, point.z, point.e, wide * MULTISTART.difference)

    def normal(self, point: _Place, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return 2.0 * (slopes.T @ slopes), 2.0 * (slopes.T @ point.e)

    def step(self, point: _Place, curvature: np.ndarray, slope: np.ndarray, damping: float) -> np.ndarray | None:
        held = (point.z <= self.lower) & (slope > 0) | (point.z >= self.upper) & (slope < 0)
        move = np.clip(point.z + _step(curvature, slope, damping, held), self.lower, self.upper) - point.z
        if self.asks:
            promised = -(slope @ move + 0.5 * move @ curvature @ move)
            self.hopeless = bool(promised < MULTISTART.promising * self.least_gain * point.cost)
            self.asks = bool(self.given)
        return None if self.hopeless else move


def _descend(
    meter: Meter, stage: Objective | None, x: np.ndarray, least_gain: float, enough: float, first: float | None = None
) -> tuple[np.ndarray, float, float]:
    """Marquardt's steps from x (k,) until one along fresh slopes gains less than a share ``least_gain``, or a share
    ``enough`` of the ``first`` value is left (of that at x where it is not given); the end, its value, and the first.
    """
    problem = _Squares(meter, stage, least_gain)
    e = meter.residuals(x, stage)
    descent, wide = Descent(problem, _Place(x, e, _squares(e)), DAMPING), 1.0
    first = descent.point.cost if first is None else first
    exact = max(enough * first, MULTISTART.below_target * getattr(meter.objective, "target", 0.0))
    while np.isfinite(descent.point.cost) and descent.point.cost > exact:
        if descent.slopes is None:
            descent.renew(problem.slopes(descent.point, wide))
        before = descent.point.cost
        step = descent.advance(8 if descent.fresh else 2)
        problem.asks = False
        if step is None:
            if problem.hopeless or descent.fresh and (wide > 1.0 or not problem.may_look_wider):
                break
            if descent.fresh:
                wide, descent.damping = MULTISTART.wide, DAMPING.first
            descent.slopes = None
        elif step.gain < least_gain * before:
            if step.fresh or descent.slopes is None:
                break
            descent.slopes = None
    return descent.point.z, descent.point.cost, first


def _squares(e: np.ndarray) -> float:
    value = float(e @ e)
    return value if np.isfinite(value) else np.inf


def _slopes(meter: Meter, stage: Objective | None, x: np.ndarray, e: np.ndarray, step: float) -> np.ndarray:
    """Forward differences (N, k), backward ones at an upper bound."""
    out = np.empty((e.size, x.size), order="F")
    for k, h in enumerate(step * np.minimum(meter.width, 1.0)):
        there = x.copy()
        there[k] += h if x[k] + h <= meter.lower[k] + meter.width[k] else -h
        out[:, k] = (meter.residuals(there, stage) - e) / (there[k] - x[k])
    out[~np.isfinite(out)] = 0.0
    return out


def _step(hessian: np.ndarray, slope: np.ndarray, damping: float, held: np.ndarray) -> np.ndarray:
    """Marquardt's step (k,), none in what a bound holds, damped further until it is no longer than MULTISTART.longest.

    (Scaled to that length it would crawl in all directions where one is soft.)
    """
    step, free = np.zeros(slope.size), np.flatnonzero(~held)
    if free.size:
        part = hessian[np.ix_(free, free)]
        scale = np.diag(part) + 1e-9 * np.trace(part) / free.size + 1e-300
        for _ in range(MULTISTART.damped):
            step[free] = -np.linalg.lstsq(part + damping * np.diag(scale), slope[free], rcond=1e-14)[0]
            if np.abs(step).max() <= MULTISTART.longest:
                break
            damping *= 4.0
    return step / max(1.0, float(np.abs(step).max()) / MULTISTART.longest)
