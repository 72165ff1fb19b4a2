"""Levenberg-Marquardt, a step at a time: who calls it says when slopes are taken anew and when to end.

curvature, slope = problem.normal(point, slopes)
step = problem.step(curvature, slope, damping)      damped until the cost falls
slopes += (e_there - e - slopes step) step^T / |step|^2     (Broyden), while a step keeps what it promised
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np


class Point(Protocol):
    """A place that was looked at: the numbers z (k,), what is left there e (N,), and its cost, infinite where there is
    none.
    """

    @property
    def z(self) -> np.ndarray: ...
    @property
    def e(self) -> np.ndarray: ...
    @property
    def cost(self) -> float: ...


P = TypeVar("P", bound=Point)


class Problem(Protocol[P]):
    """What is minimised."""

    def normal(self, point: P, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Curvature (k, k) and slope (k,) of the cost at a point, of the slopes (N, k) of what is left there."""
        ...

    def step(self, point: P, curvature: np.ndarray, slope: np.ndarray, damping: float) -> np.ndarray | None:
        """The damped step (k,) from a point; None where it promises too little to be tried."""
        ...

    def reach(self, z: np.ndarray) -> P:
        """The point at z (k,), or at the nearest numbers that are allowed."""
        ...


@dataclass(frozen=True)
class Damping:
    """How the damping goes: its ``first`` value, by how much a step that raised the cost ``raised`` it, to ``from_`` at
    the least, and by how much one that lowered the cost ``lowered`` it, to ``least`` at the least; ``keeps`` is the
    share of the promised decrease from which the slopes are updated instead of taken anew.
    """

    first: float = 1e-3
    raised: float = 8.0
    from_: float = 1e-6
    lowered: float = 8.0
    least: float = 1e-9
    keeps: float = 0.3


@dataclass(frozen=True)
class Step:
    """A step that lowered the cost by ``gain`` where the slopes ``promised`` so much; ``fresh``: not updated ones."""

    gain: float
    promised: float
    fresh: bool


class Descent(Generic[P]):
    """A descent under way: the point that it has reached, the slopes (N, k) that it goes along (None: to be taken
    anew), whether these are ``fresh``, and the last curvature (k, k).
    """

    def __init__(self, problem: Problem[P], point: P, rule: Damping, slopes: np.ndarray | None = None):
        self.problem, self.point, self.rule = problem, point, rule
        self.slopes, self.fresh, self.damping = slopes, False, rule.first
        self.curvature = np.eye(point.z.size)

    def renew(self, slopes: np.ndarray) -> None:
        """Go along slopes (N, k) that were taken here."""
        self.slopes, self.fresh = slopes, True

    def advance(self, tries: int) -> Step | None:
        """One step, from the present damping on raised up to ``tries`` times; None where the cost never fell, or
        a step promised too little.
        """
        before, slopes = self.point, self.slopes
        if slopes is None:
            raise ValueError("a descent needs slopes before it can advance")
        self.curvature, slope = self.problem.normal(before, slopes)
        for _ in range(tries):
            way = self.problem.step(before, self.curvature, slope, self.damping)
            if way is None:
                return None
            there = self.problem.reach(before.z + way)
            if there.cost < before.cost:
                break
            self.damping = max(self.damping * self.rule.raised, self.rule.from_)
        else:
            return None
        return self._gone(before, there, slopes, slope)

    def _gone(self, before: P, there: P, slopes: np.ndarray, slope: np.ndarray) -> Step:
        """Stand where a step has led, on updated slopes if it kept enough of what it promised."""
        moved = there.z - before.z
        promised = float(-(slope @ moved + 0.5 * moved @ self.curvature @ moved))
        step = Step(before.cost - there.cost, promised, self.fresh)
        if step.gain > self.rule.keeps * promised and moved @ moved > 0:
            missed = there.e - before.e - slopes @ moved
            missed /= float(moved @ moved)
            for column, along in zip(slopes.T, moved, strict=True):
                column += along * missed
            self.fresh = False
        else:
            self.slopes = None
        self.point, self.damping = there, max(self.damping / self.rule.lowered, self.rule.least)
        return step
