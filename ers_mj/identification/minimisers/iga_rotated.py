"""Our variant of the paper's genetic algorithm: its adaptive probabilities, in the axes of the population."""

from __future__ import annotations

import numpy as np

from ers_mj.identification.minimisers.base import Meter, population
from ers_mj.identification.minimisers.iga import IGA, ranked


class RotatedIGA(IGA):
    """IGA whose operators follow the valley that the population lies in.

    Kept: real coding, linear ranking (14), P_c and P_m of (18). Changed, because a valley that is narrow and lies
    across the parameters is neither followed by (15), which only contracts, nor by (16), whose sigma knows no
    direction:

        axes        genes are exchanged and moved along the principal axes of the better half, not parameter by
        parameter crossover   x + c_1 (a - x) + c_2 (b - d), a, b, d selected by rank: (15) with a difference that keeps
        the spread; gene by gene with P_c mutation    as (16), gene by gene with P_m, sigma the population's own spread
        along that axis instead of (17) survival    a child takes its parent's place if it is better: elitism for
        everyone
    """

    name = "iga-rotated"
    sentence = "our variant of iga: the same adaptive probabilities, in the population's principal axes"
    pressure = 1.9  # eta+
    SCALE = (0.3, 0.9)  # of c_2

    def __init__(
        self, size: int = 40, crossover: tuple[float, float] = (0.9, 1.0), mutation: tuple[float, float] = (0.1, 0.02)
    ):
        super().__init__(size, crossover, mutation)

    def _search(self, meter: Meter, random: np.random.Generator, start: np.ndarray | None) -> None:
        cube = population(meter, random, start, self.size)
        values, generations = meter(cube), max(meter.budget // self.size - 1, 1)
        chances = ranked(self.size, self.pressure)
        for generation in range(generations + 1):
            P_c, P_m = self.probabilities(generation / generations)
            order = np.argsort(values, kind="stable")
            children = self._children(cube, order, chances, P_c, P_m, random)
            now = meter(children)
            better = now <= values
            cube[better], values[better] = children[better], now[better]

    def _children(self, cube, order, chances, P_c, P_m, random) -> np.ndarray:
        """One child for each of the population (m, k)."""
        m, k = cube.shape
        spread, axes = np.linalg.eigh(np.cov(cube[order[: max(m // 2, 2)]].T) + 1e-300 * np.eye(k))
        a, b = (cube[random.choice(order, m, p=chances)] for _ in range(2))
        d = cube[random.integers(0, m, m)]
        c_1, c_2 = random.random((m, 1)), random.uniform(*self.SCALE, (m, 1))
        step = (c_1 * (a - cube) + c_2 * (b - d)) @ axes
        crossed = random.random((m, k)) < P_c
        crossed[np.arange(m), random.integers(0, k, m)] = True
        moved = np.sqrt(np.maximum(spread, 0.0)) * random.standard_normal((m, k))
        step = np.where(crossed, step, 0.0) + np.where(random.random((m, k)) < P_m, moved, 0.0)
        children = cube + step @ axes.T
        outside = (children < 0.0) | (children > 1.0)
        return np.where(outside, 0.5 * (cube + (children > 0.5)), children)
