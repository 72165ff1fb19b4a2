"""Which explanations can the recordings at hand tell apart? Two measures: the score that they differ by, and the
motions themselves.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ers_mj.data.prepared import Trace
from ers_mj.decisions.explained import score
from ers_mj.decisions.thresholds import POLICY, Policy
from ers_mj.effects import BY_NAME
from ers_mj.estimation.objective import Fit, residuals_in
from ers_mj.servo.model import OBSERVER_RATE

RUN = 4  # neighbouring blocks that chance strikes together: 1 s, as the intervals take it
DRAWS = 1000  # of weights, in which each run of blocks counts more or less


@dataclass(frozen=True)
class Distance:
    """How far an explanation is from the leading one on the recordings at hand.

    ``cost`` is the C that it costs more (negative: less), ``z`` that over its spread between runs of blocks, ``sigmas``
    the RMS difference of the two simulated outputs over the noise, ``probability`` its share against the leader alone.
    """

    cost: float
    z: float
    sigmas: float
    probability: float


def isolability(leader: Fit, others: Sequence[Fit], traces: Sequence[Trace]) -> list[Distance]:
    """The distance of each other explanation: one simulation of the recordings each, and one of the leader."""

    def shown(model):
        return np.concatenate(
            [trace.plain(residuals_in(model, trace, k, OBSERVER_RATE)) for k, trace in enumerate(traces)]
        )

    e, out = shown(leader.model), []
    seen = np.concatenate([t.seen for t in traces])
    for other in others:
        apart = (shown(other.model) - e)[seen]
        d = _runs(score(other.misfit, 1.0) - score(leader.misfit, 1.0))
        spread = float(np.std(d, ddof=1)) * math.sqrt(d.size) if d.size > 1 else math.inf
        out.append(
            Distance(
                float(d.sum()),
                float(d.sum()) / spread if spread > 0 else 0.0,
                float(np.sqrt(np.mean(apart**2))),
                probabilities({"leader": leader, "other": other})["other"],
            )
        )
    return out


def probabilities(fits: Mapping[str, Fit], policy: Policy = POLICY) -> dict[str, float]:
    """How probable each of these explanations is, if one of them is true; they sum to one.

    C is a logarithm of a likelihood, so exp(-C) weighs, less the price of the parameters, but those that only stand in
    for the baseline's (Effect.redundant); a play closes into a springy shaft, which is likelier unless the play is
    seen, and less likely if it is: a spring that hardens does much of what a play does. What one stick or one slip did
    may not happen
    again: the weights are averaged over draws in which every run of RUN blocks counts by a random share of its own
    (Bayesian bootstrap; pseudo-BMA+ of Yao et al. 2018), so that an advantage won in one place does not exclude the
    rest.
    """
    runs = np.array([_runs(score(f.misfit, 1.0)) for f in fits.values()])
    price = np.array(
        [
            policy.parameter_price * (f.size - sum(BY_NAME[name].redundant for name in f.model.names))
            + policy.wider_price
            * any(_is_limit(other, f, False) or _is_limit(f, other, True) for other in fits.values())
            for f in fits.values()
        ]
    )
    shares = np.random.default_rng(0).dirichlet(np.ones(runs.shape[1]), DRAWS) * runs.shape[1]
    cost = shares @ runs.T + price
    weight = np.exp(-(cost - cost.min(axis=1, keepdims=True)))
    weight /= weight.sum(axis=1, keepdims=True)
    return dict(zip(fits, map(float, weight.mean(axis=0))))


def _is_limit(narrow: Fit, wide: Fit, seen: bool) -> bool:
    """Whether an effect of the wide model, which the narrow one lacks, has one of the narrow model's as its limit, and
    is ``seen`` to be more, or is not.
    """
    return any(
        BY_NAME[name].grown(other, p, wide.model.scales)
        for name, at in wide.model.effects
        if name not in narrow.model.names and seen == BY_NAME[name].seen(at, wide.model.values.get("c_2", 0.0))
        for other, p in narrow.model.effects
        if other not in wide.model.names
    )


def _runs(d: np.ndarray) -> np.ndarray:
    """Sums over RUN neighbouring blocks."""
    return np.add.reduceat(d, np.arange(0, d.size, RUN))
