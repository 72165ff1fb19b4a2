"""Which of the candidates of a round leads? What each has won, block by block, and what it may be a form of.
 Two models are compared block by block on the same noise (a paired test in the manner of Vuong 1989), so that the
verdict does not rest on a model of the noise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ers_mj.effects import BY_NAME, EQUIVALENT
from ers_mj.estimation.fit import Fit, score
from ers_mj.selection.posterior import PARAMETER_PRICE, probabilities
from ers_mj.servo.model import STATES

ALONE = 1.5  # times what the best other explanation buys, that an effect buys which stands alone
SAME = 0.5  # share of its gain by which the scores of all blocks differ at most, summed, of one that explains the same
LEAST_Z = (
    1.7  # and the paired z-score of that decrease over the blocks: that of three blocks won clearly, the rest untouched
)
# C per block up to which a round goes on only for a candidate whose secant promises much (screening.LEAST_PROMISE)
QUIET = 0.04
# of C that forks of stick and slip leave: two blocks off by 5.8 sigma, as the worst of 61 servos without missing
# physics is in one
FORKED = 6.0
TIE, NEAR_TIE = (
    1.0,
    0.02,
    # of C, and share of the best one's gain, within which candidates are rivals, which only converged fits can tell apart
)
RIVAL = 0.3  # share of the leader's gain from which a candidate may take its place later
# share of the gain of a form of another effect (Effect.really) that this other must win itself to be told in its place
NEARLY = 0.5
# times the probability of a torque that is constant, from which one that changes along the travel (Effect.curves) is
# told in its place: of 54 torques of 4178 to 4192 none reaches it, of 33 gravities eight
CURVED = 1.06
CLOCKED = (
    0.5  # share of the gain of an effect with its own clock that a law of the servo must explain to come before it
)


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

    @property
    def worth(self) -> float:
        """Gain less the price of the parameters."""
        return self.gain - PARAMETER_PRICE * self.fit.size


def paired_z(better: np.ndarray, worse: np.ndarray, tau: float) -> float:
    """z-score over blocks of the mean decrease in score from ``worse`` to ``better`` (misfits (B,) on the same
    data).
    """
    d = score(worse, tau) - score(better, tau)
    spread = float(np.std(d, ddof=1)) if d.size > 1 else math.inf
    return float(np.mean(d)) * math.sqrt(d.size) / spread if spread > 0 else 0.0


def judged(name: str, found: Fit, base: Fit, tau: float) -> Candidate:
    """What a fit has won over the model that it extends."""
    won = score(base.misfit, tau) - score(found.misfit, tau)
    lost = -float(np.sum(np.minimum(won, 0.0)))
    return Candidate(name, found, float(np.sum(won)), paired_z(found.misfit, base.misfit, tau), lost, float(won.max()))


def priced(found: Fit) -> float:
    """The cost and the price of the parameters."""
    return found.cost + PARAMETER_PRICE * found.size


def shows(candidate: Candidate) -> bool:
    """Whether the recordings can show what it adds at all (see Effect.shows)."""
    model = candidate.fit.model
    return candidate.name not in BY_NAME or BY_NAME[candidate.name].shows(
        dict(model.effects)[candidate.name], model.scales
    )


def stands_alone(candidate: Candidate, ranked: Sequence[Candidate]) -> bool:
    """Whether a law buys ALONE times what any other of its round does, those aside that are one with it
    (effects.EQUIVALENT) or leave the same in all blocks, as a small imbalance and a torque do: chance, forks of stick
    and slip and a law of somewhat another form offer much the same to several, what acts offers it to its own.
    """
    if candidate.name not in BY_NAME or is_clocked(candidate.name):
        return False
    own = next((group for group in EQUIVALENT if candidate.name in group), {candidate.name})
    left = score(candidate.fit.misfit, 1.0)

    def is_one(other):
        return other.name in own or float(np.abs(score(other.fit.misfit, 1.0) - left).sum()) < SAME * candidate.gain

    return all(candidate.gain >= ALONE * c.gain or is_one(c) for c in ranked)


def likeliest_first(ranked: list[Candidate]) -> list[Candidate]:
    """Of rivals the most probable leads (see isolability.probabilities), together with those that are one with it
    (effects.EQUIVALENT): which of them the worth prefers may rest on one stick or slip.

    What has a clock of its own (a gust, a knock) or differs from recording to recording leads only where no law of the
    servo itself explains CLOCKED of what it does: a swing bends to whatever a repeated excitation leaves over, a
    friction of each recording's own to any law of its speed.
    """
    if not ranked:
        return ranked
    if is_clocked(ranked[0].name):
        lawful = [c for c in ranked if not is_clocked(c.name) and c.gain >= CLOCKED * ranked[0].gain and c.z >= LEAST_Z]
        ranked = sorted(ranked, key=lambda c: c not in lawful)
    gains = {c.name: c.gain for c in ranked}
    ranked = sorted(
        ranked, key=lambda c: (real := really(c.name, c.fit)) != c.name and gains.get(real, 0.0) >= NEARLY * c.gain
    )
    rivals = [c for c in rivals_of(ranked) if really(c.name, c.fit) != ranked[0].name or c is ranked[0]] or ranked[:1]
    name = likeliest({c.name: c.fit for c in rivals})
    first = next(c for c in rivals if c.name == name)
    return [first, *(c for c in ranked if c is not first)]


def likeliest(fits: Mapping[str, Fit]) -> str:
    """The most probable of what is not clocked, or else of all; the probabilities of those that are one with it count
    as its own, but beside what is a form of one of them that changes along the travel (CURVED)."""
    chances = probabilities(fits)
    kinds = {name: next((group for group in EQUIVALENT if name in group), {name}) for name in fits}
    first = max(
        fits,
        key=lambda name: (
            not is_clocked(name),
            sum(chances[other] for other in kinds[name] if other in chances),
            chances[name],
        ),
    )
    curved = (name for name in fits if name in BY_NAME and BY_NAME[name].curves in kinds[first])
    return next(
        (
            name
            for name in curved
            if chances[name] >= CURVED * max(chances[other] for other in kinds[first] if other in chances)
        ),
        first,
    )


def rivals_of(ranked: Sequence[Candidate]) -> list[Candidate]:
    """The candidates that the best one does not beat clearly, itself among them."""
    least = max(ranked[0].worth - max(TIE, NEAR_TIE * ranked[0].gain), 0.0)
    return [c for c in ranked if c.worth > least]


def really(name: str, found: Fit) -> str:
    """The effect of which a fit's is a form (see Effect.really)."""
    return (
        BY_NAME[name].really(dict(found.model.effects)[name], found.model.values.get("c_2", 0.0))
        if name in BY_NAME
        else name
    )


def is_clocked(name: str) -> bool:
    return name in STATES or BY_NAME[name].local


def is_dear(current: Fit) -> bool:
    """Whether the model takes many times as long to simulate as others."""
    return any(BY_NAME[name].dear for name in current.model.names)


def bends_and_twists(current: Fit) -> bool:
    """Whether the model has a play or a shaft beside a bristle, whose refits take longest of all."""
    plant = current.model.plant()
    return plant.bends and plant.has_motor_side


def is_quiet(current: Fit, tau: float) -> bool:
    """Whether little is left."""
    return float(score(current.misfit, tau).sum()) <= QUIET * current.misfit.size
