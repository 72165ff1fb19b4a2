"""What no effect explains, as tables over place, speed and direction.

    answer -> one table at a time, refitted beside everything else, while one buys its price -> held-out data decides

A table says nothing of what makes it: it is kept so that a simulation is nearer, and never named.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ers_mj.data.prepared import Trace
from ers_mj.decisions.confirmation import Pair, Won, paired_p, table_pays
from ers_mj.decisions.explained import score
from ers_mj.decisions.thresholds import Policy
from ers_mj.effects import BY_NAME, TABLES
from ers_mj.estimation.fit import fit
from ers_mj.estimation.objective import Fit
from ers_mj.estimation.sparse import few_of
from ers_mj.selection.cross_validation import Fold, Score, pooled, recalibrated, refits, scored
from ers_mj.selection.measure import Measure
from ers_mj.servo.model import Model

STEPS = 15  # of a refit with a table


@dataclass(frozen=True)
class Unknown:
    """The answer with tables beside it, fitted to all training recordings, and its score there; its models of each
    fold, and their held-out scores as they are and recalibrated.
    """

    model: Model
    models: list[Model]
    trained: Score
    held: Score
    again: Score

    @property
    def tables(self) -> list[tuple[str, np.ndarray]]:
        """The tables, by name."""
        return [(name, values) for name, values in self.model.effects if name in TABLES]


def unknown(
    answer: Model,
    models: Sequence[Model],
    traces: Sequence[Trace],
    parts: Sequence[Fold],
    measure: Measure,
    tau: float,
    policy: Policy,
) -> Unknown | None:
    """Tables beside an answer, whose ``models`` of each part have not seen what is held out there; None where nothing
    buys its price, or held-out data does not confirm it.
    """
    few = few_of(answer, traces, tau)
    found = _grown(fit(answer, few, tau=tau, steps=STEPS), few, tau)
    if not any(name in TABLES for name in found.model.names):
        return None
    if few is not traces:
        found = fit(found.model, traces, tau=tau, steps=STEPS)
    if measure.window_s is not None:  # what is scored as it drifts is fitted over as long
        found = fit(found.model, traces, tau=tau, rate=1.0 / measure.window_s, steps=STEPS)
    with_it = refits(found.model, parts, tau, 1)
    held, again = (_held(some, parts, measure) for some in (with_it, models))
    pairs = [Pair(a.rmse, b.rmse, _chance(a, b, policy)) for a, b in zip(held, again, strict=True)]
    trained, before = (_trained(model, traces, measure) for model in (found.model, answer))
    noise = math.sqrt(float(np.mean([fold.held_out.sigma**2 for fold in parts])))
    pays = table_pays(pairs, Pair(trained.rmse, before.rmse, 1.0), noise, policy)
    return Unknown(found.model, with_it, trained, *held) if pays else None


def _grown(current: Fit, traces: Sequence[Trace], tau: float) -> Fit:
    """The fit with those tables that buy more than half the logarithm of the blocks for every number (Schwarz)."""
    price = 0.5 * math.log(current.misfit.size)
    while left := [name for name in TABLES if name not in current.model.names]:
        blank = {name: BY_NAME[name].blank(current.model.scales) for name in left}
        fits = [fit(current.model.with_effect(name, blank[name]), traces, tau=tau, steps=STEPS) for name in left]
        best = min(fits, key=lambda one: one.cost + price * one.size)
        if current.cost - best.cost <= price * (best.size - current.size):
            break
        current = best
    return current


def _trained(model: Model, traces: Sequence[Trace], measure: Measure) -> Score:
    """The score on what the model was fitted to."""
    return pooled([scored(model, trace, k, measure=measure) for k, trace in enumerate(traces)])


def _held(models: Sequence[Model], parts: Sequence[Fold], measure: Measure) -> tuple[Score, Score]:
    """The held-out scores as they are, and recalibrated."""
    pairs = list(zip(models, parts, strict=True))
    raw = pooled([scored(model, fold.held_out, measure=measure) for model, fold in pairs])
    return raw, pooled([recalibrated(model, fold.held_out, measure).score for model, fold in pairs])


def _chance(with_it: Score, without: Score, policy: Policy) -> float:
    return paired_p(Won.of(score(without.misfit, 1.0) - score(with_it.misfit, 1.0)), policy=policy)
