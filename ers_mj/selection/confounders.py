"""Does what is named stand for a law that has no name? Such laws are tried in its place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from ers_mj.data.prepared import Trace
from ers_mj.decisions import explained
from ers_mj.decisions.thresholds import POLICY, Policy
from ers_mj.decisions.verdict import is_more_than_noise
from ers_mj.effects import BY_NAME, SUSPECTS
from ers_mj.estimation.fit import Along, polished
from ers_mj.estimation.objective import Fit
from ers_mj.selection.bench import Bench
from ers_mj.selection.budget import SEARCH, Search
from ers_mj.selection.candidates import candidates
from ers_mj.selection.comparison import Candidate, is_clocked
from ers_mj.selection.drop import pruned
from ers_mj.selection.screening import Begin, screen
from ers_mj.selection.stepwise import Selection
from ers_mj.selection.whiteness import left_by_sensor
from ers_mj.servo.model import Model
from ers_mj.solvers.successive_halving import carried_on

QUICK, LONG = 8, 20  # steps of a first refit on a borrowed Jacobian, and of one to its end


def without_confounders(
    selection: Selection, traces: Sequence[Trace], jobs: int, policy: Policy = POLICY, search: Search = SEARCH
) -> tuple[Selection, tuple[Candidate, ...]]:
    """The selection without the effects in whose place a law without a name explains more, and these laws, each over
    the model that it extends.

    Tried in place of each law of the servo beside which the model is simulated fast; what the found law makes needless
    goes as well. Where nothing is named and more than noise is left, the one that explains most of it is told, if it
    explains as much as an effect must.
    """
    bench = Bench(traces, selection.tau, jobs, policy=policy, search=search)
    current = _at_observer(bench, selection.chosen)
    if not current.model.names:
        return selection, _alone(bench, current)
    current, suspects = _in_place_of_each(bench, current, selection.chosen.model.names)
    if not suspects:
        current, suspects = in_place_of_all(bench, current, selection.base)
    if not suspects:
        return selection, ()
    model = current.model
    for suspect in suspects:
        model = model.without_effect(suspect.name)
    told = polished(bench.fit(model, LONG), traces) if model.names or model.states else selection.base
    return replace(selection, chosen=told), tuple(suspects)


def _at_observer(bench: Bench, found: Fit) -> Fit:
    """A fit of the observer form: that of the free run, where the model's error decided, fitted anew."""
    return bench.fit(found.model, LONG) if explained.is_model_error(found.misfit, bench.policy) else found


def _alone(bench: Bench, current: Fit) -> tuple[Candidate, ...]:
    """The law without a name that explains most of what a model without effects leaves, if it explains enough."""
    policy = bench.policy
    if _is_slow(current.model) or not is_more_than_noise(left_by_sensor(current.model, bench.traces), None, policy):
        return ()
    best = max(_in_its_place(bench, current, current), key=lambda c: c.worth, default=None)
    least = policy.least_gain + policy.nameless_price
    return (best,) if best is not None and best.gain >= least and best.z >= policy.least_z else ()


def _in_place_of_each(bench: Bench, current: Fit, names: Sequence[str]) -> tuple[Fit, list[Candidate]]:
    """The model with laws without a name in the place of those of these effects that they explain more than."""
    suspects: list[Candidate] = []
    for name in (name for name in names if not is_clocked(name)):
        if name not in current.model.names or _is_slow(less := current.model.without_effect(name)):
            continue
        best = min(
            _in_its_place(bench, bench.fit(less, LONG), current), key=lambda c: bench.priced(c.fit), default=None
        )
        if best is not None and _is_better(bench, best.fit, current):
            suspects.append(best)
            current = pruned(bench, best.fit, best.name)
    return current, suspects


def in_place_of_all(bench: Bench, current: Fit, base: Fit) -> tuple[Fit, list[Candidate]]:
    """The baseline with one law without a name in the place of all that is named, where that is much or leaves much."""
    names = current.model.names
    forked = names[1:] and current.cost > bench.policy.forked
    if not (len(names) > bench.search.many or forked) or _is_slow(current.model):
        return current, []
    nameless = replace(bench, exclude=[name for name in BY_NAME if name not in SUSPECTS])
    found = candidates(nameless, _at_observer(bench, base))
    best = min((c for c in found if c.name in SUSPECTS), key=lambda c: bench.priced(c.fit), default=None)
    if best is None or not _is_better(bench, best.fit, current):
        return current, []
    return best.fit, [best]


def _is_better(bench: Bench, found: Fit, current: Fit) -> bool:
    """Whether a law without a name is better by more than its price."""
    return bench.priced(found) + bench.policy.nameless_price < bench.priced(current)


def _is_slow(model: Model) -> bool:
    """Whether a model has a second body or a bristle, beside which refits take long."""
    plant = model.plant()
    return plant.coupled or plant.bends


def _in_its_place(bench: Bench, without: Fit, current: Fit) -> list[Candidate]:
    """The laws without a name, refitted beside the ``current`` model ``without`` one of its effects, or beside all of
    it; those far behind not to the end.
    """
    others = [name for name in BY_NAME if name not in SUSPECTS or name in without.model.names]
    bent = not explained.is_near_noise(without.misfit, bench.policy)
    screened = screen(replace(bench, exclude=others), [without.model], bent, False)
    starts = [(name, begin) for name, places in screened.begins.items() for begins in places for begin in begins]
    bought = max(without.cost - current.cost, 0.0)
    enough = current.cost + bench.search.nameless_behind * bought if current is not without else math.inf

    def first(start: tuple[str, Begin]) -> tuple[str, Fit]:
        name, begin = start
        along = Along(known=begin.known, renewals=0)
        return name, bench.fit(begin.model, QUICK, ceiling=without.misfit, along=along)

    def then(ended: tuple[str, Fit]) -> tuple[str, Fit]:
        return ended[0], bench.fit(ended[1].model, LONG)

    ended = carried_on(starts, first, lambda item: item[1].cost < enough, then, bench.each)
    return [bench.judged(name, found, without) for name, found in ended]
