"""What a candidate has won over the model that it extends, block by block, and which of several leads.

Two models are compared block by block on the same noise (a paired test in the manner of Vuong 1989), so that the
verdict does not rest on a model of the noise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ers_mj.decisions import ordering
from ers_mj.decisions.acceptance import Offer
from ers_mj.decisions.explained import score
from ers_mj.decisions.thresholds import POLICY, Policy
from ers_mj.effects import BY_NAME, EQUIVALENT
from ers_mj.estimation.objective import Fit
from ers_mj.selection.posterior import probabilities
from ers_mj.servo.model import STATES


@dataclass(frozen=True)
class Candidate:
    """A model that adds one effect to another: the fit, its gain in C over the reference, the paired z of that gain.

    ``lost`` is the C that the blocks which the effect makes worse lose together, ``best`` what it wins in the block
    that it serves best, ``beside`` its fit beside what later rounds added, where the leader was exchanged for a rival
    there.
    """

    name: str
    fit: Fit
    gain: float
    z: float
    lost: float
    best: float
    beside: Fit | None = None
    policy: Policy = POLICY

    @cached_property
    def offer(self) -> Offer:
        """What a decision reads of it."""
        is_effect = self.name in BY_NAME
        return Offer(
            self.name,
            self.gain,
            self.z,
            self.lost,
            self.best,
            self.fit.size,
            is_effect,
            is_effect and BY_NAME[self.name].once,
            is_clocked(self.name),
            kin_of(self.name),
        )

    @property
    def worth(self) -> float:
        """Gain less the price of the parameters."""
        return self.offer.worth(self.policy)


def kin_of(name: str) -> frozenset[str]:
    """The effects that are one with this one, itself among them (effects.EQUIVALENT)."""
    return next((group for group in EQUIVALENT if name in group), frozenset({name}))


def paired_z(better: np.ndarray, worse: np.ndarray, tau: float) -> float:
    """z-score over blocks of the mean decrease in score from ``worse`` to ``better`` (misfits (B,) on the same
    data).
    """
    d = score(worse, tau) - score(better, tau)
    spread = float(np.std(d, ddof=1)) if d.size > 1 else math.inf
    return float(np.mean(d)) * math.sqrt(d.size) / spread if spread > 0 else 0.0


def judged(name: str, found: Fit, base: Fit, tau: float, policy: Policy = POLICY) -> Candidate:
    """What a fit has won over the model that it extends."""
    won = score(base.misfit, tau) - score(found.misfit, tau)
    lost = -float(np.sum(np.minimum(won, 0.0)))
    gain, best = float(np.sum(won)), float(won.max())
    return Candidate(name, found, gain, paired_z(found.misfit, base.misfit, tau), lost, best, policy=policy)


def priced(found: Fit, policy: Policy = POLICY) -> float:
    """The cost and the price of the parameters."""
    return found.cost + policy.parameter_price * found.size


def shows(candidate: Candidate) -> bool:
    """Whether the recordings can show what it adds at all (see Effect.shows)."""
    model = candidate.fit.model
    return candidate.name not in BY_NAME or BY_NAME[candidate.name].shows(
        dict(model.effects)[candidate.name], model.scales
    )


def stands_alone(candidate: Candidate, ranked: Sequence[Candidate], policy: Policy = POLICY) -> bool:
    """Whether a law buys clearly more than any other of its round (see ordering.stands_alone)."""
    if not candidate.offer.is_effect or candidate.offer.clocked:
        return False
    left = score(candidate.fit.misfit, 1.0)
    apart = [float(np.abs(score(other.fit.misfit, 1.0) - left).sum()) for other in ranked]
    return ordering.stands_alone(candidate.offer, [c.offer for c in ranked], apart, policy)


def likeliest_first(ranked: Sequence[Candidate], policy: Policy = POLICY) -> list[Candidate]:
    """The candidates, the best first, with the most probable of rivals in front (see ordering.likeliest_first)."""
    by_name = {c.name: c for c in ranked}

    def chances(rivals: Sequence[Offer]) -> Mapping[str, float]:
        return probabilities({offer.name: by_name[offer.name].fit for offer in rivals}, policy)

    offers = ordering.likeliest_first(
        [c.offer for c in ranked],
        {c.name: really(c.name, c.fit) for c in ranked},
        {c.name: BY_NAME[c.name].curves for c in ranked if c.offer.is_effect},
        chances,
        policy,
    )
    return [by_name[offer.name] for offer in offers]


def likeliest(fits: Mapping[str, Fit], policy: Policy = POLICY) -> str:
    """The most probable of several explanations (see ordering.likeliest)."""
    offers = [
        Offer(name, 0.0, 0.0, 0.0, 0.0, found.size, name in BY_NAME, False, is_clocked(name), kin_of(name))
        for name, found in fits.items()
    ]
    curves = {name: BY_NAME[name].curves for name in fits if name in BY_NAME}
    return ordering.likeliest(offers, curves, probabilities(fits, policy), policy)


def rivals_of(ranked: Sequence[Candidate], policy: Policy = POLICY) -> int:
    """How many candidates, the best first, that one does not beat clearly, itself among them."""
    return len(ordering.rivals_of([c.offer for c in ranked], policy))


def really(name: str, found: Fit) -> str:
    """The effect of which a fit's is a form (see Effect.really)."""
    if name not in BY_NAME:
        return name
    return BY_NAME[name].really(dict(found.model.effects)[name], found.model.values.get("c_2", 0.0))


def is_clocked(name: str) -> bool:
    """Whether a thing has a clock of its own: it differs from recording to recording."""
    return name in STATES or BY_NAME[name].local


def is_dear(current: Fit) -> bool:
    """Whether the model takes many times as long to simulate as others."""
    return any(BY_NAME[name].dear for name in current.model.names) and current.model.plant().bends


def bends_and_twists(current: Fit) -> bool:
    """Whether the model has a play or a shaft beside a bristle, whose refits take longest of all."""
    plant = current.model.plant()
    return plant.bends and plant.has_motor_side
