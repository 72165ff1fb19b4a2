"""What a selection stands on: does an effect hold the output where the baseline has a spring, or none?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ers_mj.decisions import acceptance
from ers_mj.estimation.baseline import Held
from ers_mj.estimation.objective import Fit, tau_of
from ers_mj.estimation.scales import free_in
from ers_mj.estimation.search import HOLDING
from ers_mj.selection.bench import Bench
from ers_mj.selection.comparison import Candidate
from ers_mj.selection.drop import pruned


def held_instead(bench: Bench, base: Fit, held: Held) -> tuple[Bench, Fit, Candidate | None]:
    """The bench and the base as a baseline that is held otherwise has them, and that as a candidate, where it is the
    better one; the bench and the base themselves and None where not.
    """
    there = replace(bench, tau=tau_of(held.fit.misfit), traces=held.traces)
    again = there.fit(base.model, 12)
    found = replace(held.fit, model=replace(held.fit.model, effort=bench.budget.effort))
    one = there.judged(found.model.names[-1], found, again)
    if acceptance.holds(one.gain, there.cost(again), again.misfit.size, _is_sprung(base), bench.policy):
        return there, again, one
    return bench, base, None


def held_beside(bench: Bench, current: Fit, held: Fit) -> Fit | None:
    """A baseline that no spring holds, with all that is named beside it, less what it makes needless,
    where it is the better one then; None where not, and where there is no spring.
    """
    if not _is_sprung(current):
        return None
    values, effects = held.model.values, (*held.model.effects, *current.model.effects)
    model = replace(current.model, values=values, free=held.model.free, effects=effects)
    found = pruned(bench, bench.fit(model, 20), held.model.names[-1])
    return found if bench.priced(found) < bench.priced(current) else None


def hung(bench: Bench, base: Fit) -> Fit | None:
    """A sprung baseline refitted with an effect that gives the spring's torque over the travel in its place; None where
    there is no spring, or none may. Over a short travel a spring does as well, until what it lacks asks for a name.
    """
    values = {**base.model.values, "a_1": 0.0, "c_1": 0.0}
    if not (base.model.values["a_1"] > 0 and base.model.scales.is_angle):
        return None
    y = np.concatenate([trace.y[trace.valid] for trace in bench.traces])
    torque = -base.model.values["a_1"] * (y - base.model.values["theta_0"])
    plain = replace(base.model, values=values, free=free_in(values, bench.traces))
    found = [
        bench.fit(plain.with_effect(name, np.linalg.lstsq(effect.columns(y), torque, rcond=None)[0]), 20)
        for name, effect in HOLDING.items()
    ]
    return min(found, key=bench.priced, default=None)


def _is_sprung(found: Fit) -> bool:
    return found.model.values["a_1"] > 0 or found.model.values["c_1"] > 0
