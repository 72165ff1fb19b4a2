"""The paper's improved genetic algorithm, as printed."""

from __future__ import annotations

import math

import numpy as np

from ers_mj.identification.minimisers.base import Meter, Minimiser, population


def sigmoid(first: float, last: float, share: float, steepness: float = 20.0, middle: float = 0.25) -> float:
    """P_1 - (P_1 - P_2) / (1 + exp(-alpha (t/G - N_s))) of Eq. (18), at t/G = ``share``."""
    return first - (first - last) / (1.0 + math.exp(-steepness * (share - middle)))


def ranked(size: int, best: float) -> np.ndarray:
    """Eq. (14): chance (m,) of each to be selected, the best first; ``best`` is eta+, and eta- = 2 - eta+."""
    return (best - (2.0 * best - 2.0) * np.arange(size) / (size - 1)) / size


class IGA(Minimiser):
    """Real coding, linear ranking (14), arithmetic crossover (15), Gaussian mutation (16) that shrinks (17), adaptive
    probabilities (18).

    The paper gives neither population nor probabilities nor the unit of (17)'s sigma; these are the best settings that
    were found (see analysis/table_2.py). sigma is a tenth of the range times 1 - 0.9 t/G, the mutation acts gene by
    gene, and one elite survives.

    Args:
        size: population m.
        crossover, mutation: (first, last) of P_c and P_m.
        elitist: whether the best of all generations replaces the worst of the next.
    """

    name = "iga"
    sentence = "the paper's genetic algorithm: crossover and mutation whose probabilities and size adapt"
    pressure = 1.5  # eta+

    def __init__(
        self,
        size: int = 40,
        crossover: tuple[float, float] = (0.9, 0.6),
        mutation: tuple[float, float] = (0.3, 0.1),
        elitist: bool = True,
    ):
        self.size, self.crossover, self.mutation, self.elitist = size, crossover, mutation, elitist

    def probabilities(self, share: float) -> tuple[float, float]:
        """(P_c, P_m) at the share t/G of the generations."""
        return sigmoid(*self.crossover, share), sigmoid(*self.mutation, share)

    def _search(self, meter: Meter, random: np.random.Generator, start: np.ndarray | None) -> None:
        cube = population(meter, random, start, self.size)
        values = meter(cube)
        generations = max(meter.budget // self.size - 1, 1)
        chances = ranked(self.size, self.pressure)
        for generation in range(generations + 1):
            share = generation / generations
            P_c, P_m = self.probabilities(share)
            order = np.argsort(values, kind="stable")
            elite, least = cube[order[0]].copy(), values[order[0]]
            children = self._mutated(
                self._crossed(cube[random.choice(order, self.size, p=chances)], P_c, random), P_m, share, random
            )
            cube, values = children, meter(children)
            if self.elitist and least < values.min():
                worst = int(np.argmax(values))
                cube[worst], values[worst] = elite, least

    def _crossed(self, parents: np.ndarray, P_c: float, random: np.random.Generator) -> np.ndarray:
        """Eq. (15) on neighbouring pairs of parents (m, k)."""
        one, two = parents[: self.size // 2 * 2 : 2], parents[1::2]
        c = np.where(random.random((len(two), 1)) < P_c, random.random((len(two), 1)), 1.0)
        return np.concatenate([c * one + (1.0 - c) * two, c * two + (1.0 - c) * one, parents[2 * len(two) :]])

    def _mutated(self, children: np.ndarray, P_m: float, share: float, random: np.random.Generator) -> np.ndarray:
        """Eq. (16) with (17), within the cube."""
        moved = 0.1 * (1.0 - 0.9 * share) * random.standard_normal(children.shape)
        return np.clip(children + np.where(random.random(children.shape) < P_m, moved, 0.0), 0.0, 1.0)
