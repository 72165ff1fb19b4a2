"""What every minimiser is: a search for the least value of any callable within bounds, by seed, within a budget.

An objective is called with many points at once, x (M, k) -> values (M,). One that is a sum of squares may also have
``residuals(x (k,)) -> (N,)``, which `ls` needs, ``slopes(x, residuals there) -> (N, k)`` where they are cheaper than
differences, ``stages``, easier objectives to go through first, ``draw(random)``, a point to begin again from, and
``target``, a value that is good enough. Nothing here knows of servos.
"""

from __future__ import annotations

import contextlib
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ers_mj.errors import InputError

Objective = Callable[[np.ndarray], np.ndarray]


class Spent(Exception):
    """The budget is used up."""


@dataclass(frozen=True)
class Minimum:
    """The best point found (k,), its value, how many evaluations were made, and the trace (T, 2): evaluations, best
    value until then.
    """

    x: np.ndarray
    value: float
    evaluations: int
    trace: np.ndarray

    def evaluations_to(self, value: float) -> int | None:
        """Evaluations after which the best value was no longer above this one; None where it never was."""
        below = np.flatnonzero(self.trace[:, 1] <= value)
        return int(self.trace[below[0], 0]) if below.size else None


class Meter:
    """The objective as a minimiser sees it: on the unit cube, counted, the best point kept.

    Raises Spent, from any of its calls, where the budget is used up.
    """

    def __init__(self, objective: Objective, lower: np.ndarray, upper: np.ndarray, budget: int):
        self.objective, self.lower, self.width, self.budget = objective, lower, upper - lower, budget
        self.size, self.used, self.best, self.value = lower.size, 0, lower + 0.5 * self.width, np.inf
        self.steps: list[tuple[int, float]] = []

    def __call__(self, cube: np.ndarray) -> np.ndarray:
        """Values (M,) at points (M, k) of the unit cube; what is not finite counts as infinite."""
        allowed = cube[: max(self.budget - self.used, 0)]
        points = self.lower + self.width * allowed
        values = np.empty(0)
        if len(points):
            values = np.asarray(self.objective(points), float)
            values = np.where(np.isfinite(values), values, np.inf)
            self.used += len(points)
            self._keep(points[int(np.argmin(values))], float(values.min()))
        if len(allowed) < len(cube):
            raise Spent
        return values

    def residuals(self, x: np.ndarray, stage: Objective | None = None) -> np.ndarray:
        """Residuals (N,) of the objective, or of one of its stages, at one point x (k,) in its own units."""
        if self.used >= self.budget:
            raise Spent
        e = (stage or self.objective).residuals(x)  # type: ignore[attr-defined]  # told by `minimise`
        self.used += 1
        if stage is None:
            value = float(e @ e)
            self._keep(x, value if np.isfinite(value) else np.inf)
        return e

    def _keep(self, x: np.ndarray, value: float) -> None:
        if value < self.value or not self.steps:
            self.best, self.value = x.copy(), value
            self.steps.append((self.used, value))

    def minimum(self) -> Minimum:
        """What was found."""
        trace = np.array([*self.steps, (self.used, self.value)], float)
        for array in (self.best, trace):
            array.setflags(write=False)
        return Minimum(self.best, self.value, self.used, trace)


class Minimiser(ABC):
    """Abstract base: a member declares its name and a sentence, and searches on the unit cube until the meter is spent
    or it is done.
    """

    name: ClassVar[str] = ""
    sentence: ClassVar[str] = ""
    needs_residuals: ClassVar[bool] = False

    def minimise(
        self,
        objective: Objective,
        lower: np.ndarray,
        upper: np.ndarray,
        *,
        seed: int = 0,
        budget: int = 10_000,
        start: np.ndarray | None = None,
    ) -> Minimum:
        """Search the box.

        Args:
            objective: x (M, k) -> values (M,); see the head of this file.
            lower, upper: ends of the box (k,).
            seed: the same one gives the same result.
            budget: evaluations at most.
            start: a point (k,) to begin with, or None.

        Raises:
            InputError: the box is empty, or the objective lacks what this minimiser needs.
        """
        lower, upper = np.array(lower, float), np.array(upper, float)
        if lower.shape != upper.shape or not np.all(lower < upper):
            raise InputError(
                f"the bounds {lower.tolist()} to {upper.tolist()} enclose nothing, lower ends below upper ones were"
                " expected"
            )
        if self.needs_residuals and not hasattr(objective, "residuals"):
            raise InputError(
                f"{self.name} needs an objective with residuals, this one is a plain function: take a minimiser that"
                " needs values alone"
            )
        meter = Meter(objective, lower, upper, budget)
        cube = None if start is None else np.clip((np.asarray(start, float) - lower) / meter.width, 0.0, 1.0)
        with contextlib.suppress(Spent):
            self._search(meter, np.random.default_rng(seed), cube)
        return meter.minimum()

    @abstractmethod
    def _search(self, meter: Meter, random: np.random.Generator, start: np.ndarray | None) -> None:
        """Search the unit cube, from ``start`` (k,) where it is given."""


def population(meter: Meter, random: np.random.Generator, start: np.ndarray | None, size: int) -> np.ndarray:
    """Points (size, k) drawn evenly from the unit cube, the first one at ``start``."""
    cube = random.random((size, meter.size))
    if start is not None:
        cube[0] = start
    return cube
