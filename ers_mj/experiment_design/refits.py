"""Refits of an explanation to a recording that does not exist yet: to first order, and in earnest."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ers_mj.data.prepared import Blocks, Trace
from ers_mj.experiment_design.bench import Bench, Explanation
from ers_mj.solvers.levenberg_marquardt import Damping, Descent


@dataclass(frozen=True)
class Patience:
    """How long a refit in earnest goes on."""

    steps: int = 8
    jacobians: int = 2
    least_step: float = 0.05  # of C, at which it ends


PATIENCE = Patience()


def remains(
    e: np.ndarray, slopes: np.ndarray, known: np.ndarray, blocks: Blocks, bench: Bench, gone: np.ndarray | float = 0.0
) -> float:
    """C that is left of e (N,) once the numbers have moved along their slopes (N, k), the price of that move included.

    ``gone`` (k,) is how far they are already from where the recordings at hand have them.
    """
    move, best = np.zeros(known.shape[0]), math.inf
    for _ in range(4):
        m = blocks.misfit(e + slopes @ move)
        best = min(best, bench.cost(m) + 0.5 * float((gone + move) @ known @ (gone + move)))
        weight = (2.0 / ((bench.floor + m) * blocks.counts))[blocks.index]
        weighted = slopes * weight[:, None]
        move = -solved(weighted.T @ slopes + known, weighted.T @ e + known @ (gone + np.zeros_like(move)))
    return best


def solved(curvature: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """curvature^-1 slope, scaled, with what nothing determines left where it is."""
    scaled, scale = _scaled(curvature)
    return scale * np.linalg.solve(scaled, scale * slope)


def drawn(curvature: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Numbers (D, k) of covariance curvature^-1 from ``normal`` ones (D, k): some are known a hundred million times
    better than others.
    """
    scaled, scale = _scaled(curvature)
    return scale * np.linalg.solve(np.linalg.cholesky(scaled).T, normal.T).T


def _scaled(curvature: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The curvature with a diagonal of ones, and hardly more, and the scale (k,) that makes it so: 0 for what nothing
    determines.
    """
    diagonal, unseen = np.diag(curvature), 1e-12
    scale = np.where(diagonal > unseen, 1.0 / np.sqrt(np.maximum(diagonal, unseen)), 0.0)
    return curvature * np.outer(scale, scale) + 1e-10 * np.eye(scale.size), scale


@dataclass(frozen=True)
class _Reached:
    """A place on the way of a refit: z (k,), what is missed there (N,), the block misfits (B,), and the cost."""

    z: np.ndarray
    e: np.ndarray
    misfit: np.ndarray
    cost: float


class _Refit:
    """C over a new recording plus the curvature of the old ones, as solvers.levenberg_marquardt has a problem."""

    def __init__(self, answer: Explanation, trace: Trace, bench: Bench):
        self.answer, self.trace, self.bench, self.blocks = answer, trace, bench, Blocks.of([trace])

    def at(self, z: np.ndarray) -> _Reached:
        e = self.bench.misses(self.answer.at(z), self.trace)
        if not np.all(np.isfinite(e)):
            return _Reached(z, e, np.empty(0), math.inf)
        m, away = self.blocks.misfit(e), z - self.answer.z
        cost = float(np.sum(np.log((self.bench.tau + m) / self.bench.floor)))
        return _Reached(z, e, m, cost + 0.5 * float(away @ self.answer.known @ away))

    def reach(self, z: np.ndarray) -> _Reached:
        return self.at(self.answer.at(z).vector(self.answer.layout))

    def normal(self, point: _Reached, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        weight = (2.0 / ((self.bench.tau + point.misfit) * self.blocks.counts))[self.blocks.index]
        weighted, known = slopes * weight[:, None], self.answer.known
        return weighted.T @ slopes + known, weighted.T @ point.e + known @ (point.z - self.answer.z)

    def step(self, point: _Reached, curvature: np.ndarray, slope: np.ndarray, damping: float) -> np.ndarray:
        return np.clip(-solved(curvature + damping * np.diag(np.diag(curvature)), slope), -1.0, 1.0)


def refitted(answer: Explanation, trace: Trace, bench: Bench) -> tuple[np.ndarray, float]:
    """The numbers z that minimise C over the new recording plus the curvature of the old ones, and that sum."""
    problem = _Refit(answer, trace, bench)
    descent, taken = Descent(problem, problem.at(answer.z), Damping(raised=10.0, least=0.0, keeps=-math.inf)), 0
    for _ in range(PATIENCE.steps if math.isfinite(descent.point.cost) else 0):
        if descent.slopes is None:
            here = descent.point
            descent.renew(np.asfortranarray(bench.slopes(answer, here.z, here.e, trace)))
            taken += 1
        was_fresh = descent.fresh
        step = descent.advance(4 if was_fresh else 2)
        if step is None or step.gain < PATIENCE.least_step:
            if was_fresh or taken == PATIENCE.jacobians:
                break
            descent.slopes = None
    return descent.point.z, descent.point.cost
