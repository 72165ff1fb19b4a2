"""Does held-out data confirm an effect?"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from ers_mj.decisions.explained import score
from ers_mj.decisions.thresholds import POLICY, Policy

# errors with and without an effect, recalibrated [output unit]; None where nothing was recorded on another day
Recalibrated = Callable[[], tuple[float, float] | None]


@dataclass(frozen=True)
class HeldOut:
    """What held-out recordings say of an effect.

    ``p`` is its p-value; ``rmse`` the free-run error with and without it [output unit], ``noise`` that of the sensor;
    ``cost`` the held-out C with and without it. Of the scores in which it was judged in the end (by halves, where one
    recording teaches most of it): ``ratio``, the error that no converter has made with it over that without, and
    ``log_ratio``, the mean over recordings of the same ratio's logarithm.
    """

    p: float
    rmse: tuple[float, float]
    noise: float
    cost: tuple[float, float]
    ratio: float
    log_ratio: float


@dataclass(frozen=True)
class Won:
    """What an effect won of the score over held-out blocks: in all, the sum of its squared losses, in its best block,
    and how many blocks there are.
    """

    total: float
    losses: float
    best: float
    blocks: int

    @classmethod
    def of(cls, gain: np.ndarray) -> Won:
        """Of the gain (B,) in each block."""
        return cls(float(np.sum(gain)), float(np.sum(np.minimum(gain, 0.0) ** 2)), float(np.max(gain)), gain.size)


def paired_p(won: Won, once: bool = False, alone: bool = False, policy: Policy = POLICY) -> float:
    """One-sided p-value that what won this predicts held-out blocks no better.

    If neither is better the gains lie alike on both sides of zero, so that the losses alone tell their scatter: sum(d)
    / sqrt(2 sum of the squared losses) is near normal. An effect that acts in a few blocks and harms nowhere is not
    punished for being rare, as it is by the scatter of all. A loss of ``least_loss`` a block is taken for granted.

    Blocks are not independent, and the best of many effects was taken: the p-value is never below the share of servos
    without missing physics in which as large a gain is offered, by an exponential tail (analysis/null_gains.py: of 48
    the largest gain of a law is 1.8; stick and slip that fork offer what acts ``once`` 2.2 to 3.6 in four of them). A
    law whose round offers no other nearly as much, ``alone`` (ordering.stands_alone), has what chance offers to one
    only, in a share ``null_alone`` of them.
    """
    losses = won.losses + won.blocks * policy.least_loss**2
    tail = policy.null_gain_once if once else policy.null_gain
    chance = (policy.null_alone if alone else 1.0) * math.exp(-max(won.total, 0.0) / tail)
    return max(chance, 0.5 * math.erfc(won.total / math.sqrt(2.0 * losses) / math.sqrt(2.0)))


def is_doubtful(held: HeldOut, policy: Policy = POLICY) -> bool:
    """Whether neither the blocks nor the free runs confirm an effect."""
    return held.p > policy.largest_p or is_no_closer(held, policy)


def is_no_closer(held: HeldOut, policy: Policy = POLICY) -> bool:
    """Whether an effect brings the free runs no closer.

    Where its blocks leave no doubt, an error that forks of stick and slip make somewhat larger counts as closer, and so
    does one that falls in the geometric mean of the recordings: one of them may teach so much that the others, without
    it, know the rest of the model badly.
    """
    if held.p >= policy.sure_p or held.ratio < policy.worse:
        return held.ratio >= (policy.worse if held.p < policy.sure_p else 1.0)
    return held.log_ratio >= 0.0


def pays(held: HeldOut, recalibrated: Recalibrated, policy: Policy = POLICY) -> bool:
    """Whether the squared held-out error above the noise rises by a share of itself without an effect: as it is, or,
    where the rig has changed, once gain, offset and friction level of another day are known (asked for only then).

    Where its blocks leave no doubt, forks of stick and slip may swamp the error of one recording: the geometric mean
    over recordings counts as well.
    """

    def is_worth(with_it: float, without: float) -> bool:
        left, lost = (max(rmse**2 - held.noise**2, 0.0) for rmse in (with_it, without))
        return lost >= (1.0 + policy.pays) * left

    if is_worth(*held.rmse) or (held.p < policy.sure_p and math.exp(-2.0 * held.log_ratio) >= 1.0 + policy.pays):
        return True
    again = recalibrated()
    return again is not None and is_worth(*again)


@dataclass(frozen=True)
class Pair:
    """Held-out errors with and without something [output unit], and its p-value."""

    with_it: float
    without: float
    p: float

    def is_worth(self, noise: float, policy: Policy) -> bool:
        """Whether the squared error above the noise rises beyond chance, and by a share of itself, without it."""
        left, lost = (max(rmse**2 - noise**2, 0.0) for rmse in (self.with_it, self.without))
        return self.p <= policy.largest_p and lost >= (1.0 + policy.pays) * left


def table_pays(pairs: Sequence[Pair], trained: Pair, noise: float, policy: Policy = POLICY) -> bool:
    """Whether a table of what is unknown is kept: held-out data, as it is or recalibrated, asks for it, and neither
    that nor what it was fitted to (``trained``) is better by as much without it.
    """
    without = (Pair(pair.without, pair.with_it, 0.0) for pair in (*pairs, trained))
    return any(pair.is_worth(noise, policy) for pair in pairs) and not any(x.is_worth(noise, policy) for x in without)


def is_no_size(low: float, high: float, policy: Policy = POLICY) -> bool:
    """Whether an interval tells no size: it spans zero, or decades."""
    return low <= 0.0 <= high or max(abs(low), abs(high)) > policy.unsure * min(abs(low), abs(high))


def is_one_of_many(after: np.ndarray, without: np.ndarray, policy: Policy = POLICY) -> bool:
    """Whether another moment is left nearly as bad as those that an impulse explains were, by the misfits (B,) with and
    without it: a law that is missed is as far off in several, what acts once in one. What is left of its own moments
    may be its form.
    """
    left, lost = score(after, 1.0), score(without, 1.0)
    own = lost - left >= 0.5 * (lost - left).max()
    return bool(left[~own].max(initial=0.0) > policy.left_elsewhere * lost[own].max())


def is_none_together(sizes: np.ndarray, spread: np.ndarray) -> bool:
    """Whether the joint 95 % region of signed sizes (k,) holds none at all: each may be unknown for itself and their
    sum be known. ``spread`` is their covariance times the squared 95 % quantile of one; rounding may leave it with an
    eigenvalue below zero, which is taken for a known sum.
    """
    least = 1e-9 * np.trace(spread) * np.eye(sizes.size)
    far = float(sizes @ np.linalg.pinv(spread + least, hermitian=True) @ sizes)
    return not far * chdtri(1, 0.05) > chdtri(sizes.size, 0.05)


def are_no_sizes(
    ends: Sequence[tuple[float, float]],
    signed: Sequence[int],
    sizes: np.ndarray,
    spread: np.ndarray,
    policy: Policy = POLICY,
) -> bool:
    """Whether the intervals ``ends`` of all sizes (k,) of an effect tell none, and those that are ``signed`` may be
    none together, by their ``spread`` (k, k).
    """
    if not all(is_no_size(low, high, policy) for low, high in ends):
        return False
    return len(signed) < 2 or is_none_together(sizes[signed], spread[np.ix_(signed, signed)])


def is_confirmed(held: HeldOut, recalibrated: Recalibrated, policy: Policy = POLICY) -> bool:
    """Whether an effect is confirmed: by blocks and free runs, or by an error that is halved once gain, offset and
    friction level of another day are known (asked for only where nothing else confirms it).
    """
    if not is_doubtful(held, policy):
        return True
    if held.rmse[0] > policy.worse * held.rmse[1]:
        return False
    again = recalibrated()
    return again is not None and again[0] ** 2 < policy.half * again[1] ** 2
