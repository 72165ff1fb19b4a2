"""Refits of an explanation to a recording that does not exist yet: to first order, and in earnest."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ers_mj.data.prepared import Blocks, Trace
from ers_mj.experiment_design.bench import Bench, Explanation


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


def refitted(answer: Explanation, trace: Trace, bench: Bench) -> tuple[np.ndarray, float]:
    """The numbers z that minimise C over the new recording plus the curvature of the old ones, and that sum."""
    blocks, z, damping = Blocks.of([trace]), answer.z, 1e-3

    def evaluate(z):
        e = bench.misses(answer.at(z), trace)
        if not np.all(np.isfinite(e)):
            return e, None, math.inf
        m = blocks.misfit(e)
        return (
            e,
            m,
            float(np.sum(np.log((bench.tau + m) / bench.floor)))
            + 0.5 * float((z - answer.z) @ answer.known @ (z - answer.z)),
        )

    e, m, cost = evaluate(z)
    slopes, fresh = None, 0
    for _ in range(PATIENCE.steps if m is not None else 0):
        if slopes is None:
            slopes, fresh, new = bench.slopes(answer, z, e, trace), fresh + 1, True
        weighted = slopes * (2.0 / ((bench.tau + m) * blocks.counts))[blocks.index][:, None]
        curvature, slope = weighted.T @ slopes + answer.known, weighted.T @ e + answer.known @ (z - answer.z)
        gain = 0.0
        for _ in range(4 if new else 2):
            step = np.clip(-solved(curvature + damping * np.diag(np.diag(curvature)), slope), -1.0, 1.0)
            goal = answer.at(z + step).vector(answer.layout)
            trial = evaluate(goal)
            if trial[2] < cost:
                moved, gain, damping = goal - z, cost - trial[2], damping / 8
                slopes = slopes + np.outer(trial[0] - e - slopes @ moved, moved / (moved @ moved))
                z, (e, m, cost) = goal, trial
                break
            damping = max(damping * 10, 1e-6)
        if gain < PATIENCE.least_step:
            if new or fresh == PATIENCE.jacobians:
                break
            slopes = None
        new = False
    return z, cost
