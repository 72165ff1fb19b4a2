"""How much is left, and whether that is explained: the one place that says so.

m (B,) are the block misfits in noise variances; C = sum of ln((tau + m) / (1 + tau)) (see estimation/objective.py).
"""

from __future__ import annotations

import math

import numpy as np

from ers_mj.decisions.thresholds import POLICY, Policy


def score(misfit: np.ndarray | float, tau: float) -> np.ndarray:
    """Each block's share (B,) of the cost C."""
    return np.log((tau + misfit) / (1.0 + tau))


def cost(misfit: np.ndarray, tau: float) -> float:
    """C of block misfits (B,)."""
    return float(score(misfit, tau).sum())


def is_near_noise(misfit: np.ndarray, policy: Policy = POLICY) -> bool:
    """Whether half the blocks are explained to about their noise, so that details may be told."""
    return float(np.median(misfit)) <= policy.rough


def is_model_error(misfit: np.ndarray, policy: Policy = POLICY) -> bool:
    """Whether the model's error and not the noise decides what is left."""
    return float(np.median(misfit)) >= policy.model_error


def is_quiet(misfit: np.ndarray, tau: float, policy: Policy = POLICY) -> bool:
    """Whether little is left."""
    return cost(misfit, tau) <= policy.quiet * misfit.size


def is_bent(misfit: np.ndarray, tau: float, policy: Policy = POLICY) -> bool:
    """Whether a model stands so far from the noise that its parameters have been bent by what is missing."""
    return not is_near_noise(misfit, policy) or cost(misfit, tau) > policy.bent * misfit.size


def is_more_than_forks(misfit: np.ndarray, tau: float, policy: Policy = POLICY) -> bool:
    """Whether more is left than forks of stick and slip in two blocks leave."""
    return cost(misfit, tau) > policy.forked


def is_consistent(misfit: np.ndarray, policy: Policy = POLICY) -> bool:
    """Whether a model as it stands explains the data within its noise."""
    return bool(np.all(np.isfinite(misfit))) and float(np.mean(score(misfit, 1.0))) < policy.consistent


def stands_out(misfit: np.ndarray, tau: float, policy: Policy = POLICY) -> bool:
    """Whether a block is ``peak`` times beyond what a model that is wrong leaves in many others."""
    scores = score(misfit, tau)
    return float(scores.max()) >= max(float(np.quantile(scores, policy.usual)), 0.0) + math.log(policy.peak)


def attainable(misfit: np.ndarray, counts: np.ndarray, tau: float) -> float:
    """What C would fall by, were no block (B,) worse than the noise, or than half of them where that is less; beyond
    what noise makes of ``counts`` (B,) samples.
    """
    level = min(1.0, float(np.median(misfit)))
    left = float(np.sum(np.maximum(score(misfit, tau) - score(level, tau), 0.0)))
    above_median = 0.4  # mean of what a normal number is above its median, in its standard deviations
    return left - above_median * level / (tau + level) * float(np.sum(np.sqrt(2.0 / counts)))
