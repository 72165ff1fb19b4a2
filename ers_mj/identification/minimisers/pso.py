"""Particle swarm, as the paper compares it."""

from __future__ import annotations

import numpy as np

from ers_mj.identification.minimisers.base import Meter, Minimiser, population


class PSO(Minimiser):
    """v <- w v + c r_1 (own best - x) + c r_2 (swarm's best - x), x <- x + v; the inertia w falls from 0.9 to 0.4.

    The paper names it without settings: these are the usual ones (Shi and Eberhart 1998). A particle stops at a bound.
    """

    name = "pso"
    sentence = "particle swarm"
    inertia, pull, fastest = (0.9, 0.4), 2.0, 0.2

    def __init__(self, size: int = 40):
        self.size = size

    def _search(self, meter: Meter, random: np.random.Generator, start: np.ndarray | None) -> None:
        x = population(meter, random, start, self.size)
        v = self.fastest * (2.0 * random.random(x.shape) - 1.0)
        best, values = x.copy(), meter(x)
        generations = max(meter.budget // self.size - 1, 1)
        for generation in range(generations + 1):
            w = self.inertia[0] + (self.inertia[1] - self.inertia[0]) * generation / generations
            swarm = best[int(np.argmin(values))]
            v = w * v + self.pull * (random.random(x.shape) * (best - x) + random.random(x.shape) * (swarm - x))
            v = np.clip(v, -self.fastest, self.fastest)
            moved = np.clip(x + v, 0.0, 1.0)
            x, v = moved, np.where(moved == x + v, v, 0.0)
            now = meter(x)
            better = now < values
            best[better], values[better] = x[better], now[better]
