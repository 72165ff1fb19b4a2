"""The simplex of Nelder and Mead (1965) within bounds: for costs without slopes that few numbers decide.

Written here since the one of scipy.optimize brings half a second of imports; the steps are the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np


def lowest(
    cost: Callable[[np.ndarray], float],
    simplex: np.ndarray,
    bounds: Sequence[tuple[float, float]],
    *,
    most: int,
    within: float,
) -> np.ndarray:
    """The best place (k,) that is met from a ``simplex`` (k + 1, k) on, in ``most`` costs at most, or until those of
    all its corners lie ``within`` so much.
    """
    lower, upper = np.transpose(bounds)
    search = _Simplex(cost, simplex, lower, upper, most)
    with np.errstate(invalid="ignore"):  # of places without a cost
        while search.left > 0 and not np.max(np.abs(search.costs[1:] - search.costs[0])) <= within:
            search.move()
    return search.corners[0]


class _Simplex:
    """The corners, the best first, their costs, and how many more may be asked for."""

    def __init__(self, cost: Callable, simplex: np.ndarray, lower: np.ndarray, upper: np.ndarray, most: int):
        self.cost, self.lower, self.upper, self.left = cost, lower, upper, most
        self.corners, self.costs = np.array(simplex, float), np.full(len(simplex), np.inf)
        for k, corner in enumerate(self.corners):
            self.costs[k] = self._asked(corner)[1]
        self._sort()

    def _asked(self, place: np.ndarray) -> tuple[np.ndarray, float]:
        """A place within the bounds, and its cost; infinite where no more may be asked for."""
        place = np.clip(place, self.lower, self.upper)
        if self.left <= 0:
            return place, np.inf
        self.left -= 1
        return place, self.cost(place)

    def _sort(self) -> None:
        order = np.argsort(self.costs)
        self.corners, self.costs = self.corners[order], self.costs[order]

    def move(self) -> None:
        """Put another corner in the place of the worst, or draw all towards the best."""
        worst, centre = self.corners[-1], np.mean(self.corners[:-1], axis=0)
        along = lambda share: self._asked(centre + share * (centre - worst))
        found = along(1.0)
        if found[1] < self.costs[0]:
            found = min(along(2.0), found, key=lambda one: one[1])
        elif not found[1] < self.costs[-2]:
            is_beyond, bar = found[1] < self.costs[-1], min(found[1], self.costs[-1])
            found = along(0.5 if is_beyond else -0.5)
            if not (found[1] <= bar if is_beyond else found[1] < bar):
                self._shrink()
                return
        self.corners[-1], self.costs[-1] = found
        self._sort()

    def _shrink(self) -> None:
        for k in range(1, len(self.corners)):
            self.corners[k], self.costs[k] = self._asked(0.5 * (self.corners[0] + self.corners[k]))
        self._sort()
