"""Is what is named a mimic? Laws that no answer names are tried in its place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from ers_mj.data.prepared import Trace
from ers_mj.effects import BY_NAME, SUSPECTS
from ers_mj.estimation.fit import Fit, fit, is_at_observer, near_noise, polished
from ers_mj.selection.candidates import LEAST_GAIN, candidates
from ers_mj.selection.comparison import FORKED, LEAST_Z, Candidate, is_clocked, judged, priced
from ers_mj.selection.moves import pruned
from ers_mj.selection.screening import screen
from ers_mj.selection.stepwise import Selection
from ers_mj.selection.whiteness import left_by_sensor, more_is_missing
from ers_mj.servo.model import Model

NAMELESS_PRICE = 2.0  # of C by which a law without a name must be better: it is less common than those that have one
QUICK, LONG = 8, 20  # steps of a first refit on a borrowed Jacobian, and of one to its end
# names, beyond which, or beside which more than forks of stick and slip leave, one law without a name is tried in the
# place of all
MANY = 2
BEHIND = 0.5  # share of what the named effect buys by which a first refit may be behind it


def unmasked(selection: Selection, traces: Sequence[Trace], jobs: int) -> tuple[Selection, tuple[Candidate, ...]]:
    """The selection without the effects in whose place a law without a name explains more, and these laws, each over
    the model that it extends.

    Tried in place of each law of the servo beside which the model is simulated fast; what the found law makes needless
    goes as well. Where nothing is named and more than noise is left, the one that explains most of it is told, if it
    explains as much as an effect must.
    """
    tau, suspects = selection.tau, []
    current = (
        selection.chosen
        if is_at_observer(selection.chosen)
        else fit(selection.chosen.model, traces, tau=tau, steps=LONG)
    )
    if not current.model.names:
        if _is_slow(current.model) or not more_is_missing(left_by_sensor(current.model, traces), None):
            return selection, ()
        best = max(_in_its_place(current, current, traces, tau, jobs), key=lambda c: c.worth, default=None)
        return selection, (
            (best,) if best is not None and best.gain >= LEAST_GAIN + NAMELESS_PRICE and best.z >= LEAST_Z else ()
        )
    for name in (name for name in selection.chosen.model.names if not is_clocked(name)):
        if name not in current.model.names or _is_slow(less := current.model.without_effect(name)):
            continue
        without = fit(less, traces, tau=tau, steps=LONG)
        best = min(_in_its_place(without, current, traces, tau, jobs), key=lambda c: priced(c.fit), default=None)
        if best is not None and priced(best.fit) + NAMELESS_PRICE < priced(current):
            suspects.append(best)
            current = pruned(best.fit, best.name, traces, tau)
    if (
        not suspects
        and (len(current.model.names) > MANY or current.model.names[1:] and current.cost > FORKED)
        and not _is_slow(current.model)
    ):
        bare = (
            selection.base if is_at_observer(selection.base) else fit(selection.base.model, traces, tau=tau, steps=LONG)
        )
        found = candidates(bare, traces, tau, jobs, [name for name in BY_NAME if name not in SUSPECTS])
        best = min((c for c in found if c.name in SUSPECTS), key=lambda c: priced(c.fit), default=None)
        if best is not None and priced(best.fit) + NAMELESS_PRICE < priced(current):
            suspects, current = [best], best.fit
    if not suspects:
        return selection, ()
    model = current.model
    for suspect in suspects:
        model = model.without_effect(suspect.name)
    told = polished(fit(model, traces, tau=tau, steps=LONG), traces) if model.names or model.states else selection.base
    return replace(selection, chosen=told), tuple(suspects)


def _is_slow(model: Model) -> bool:
    """Whether a model has a second body or a bristle, beside which refits take long."""
    plant = model.plant()
    return plant.coupled or plant.bends


def _in_its_place(without: Fit, current: Fit, traces: Sequence[Trace], tau: float, jobs: int) -> list[Candidate]:
    """The laws without a name, refitted beside the ``current`` model ``without`` one of its effects, or beside all of
    it; those far behind not to the end.
    """
    others = [name for name in BY_NAME if name not in SUSPECTS or name in without.model.names]
    screened = screen([without.model], traces, tau, others, not near_noise(without), False)
    starts = [(name, begin) for name, places in screened.begins.items() for begins in places for begin in begins]
    enough = current.cost + BEHIND * max(without.cost - current.cost, 0.0) if current is not without else math.inf

    def refitted(start):
        name, begin = start
        found = fit(begin.model, traces, tau=tau, steps=QUICK, ceiling=without.misfit, known=begin.known, renewals=0)
        return judged(
            name, fit(found.model, traces, tau=tau, steps=LONG) if found.cost < enough else found, without, tau
        )

    with ThreadPoolExecutor(jobs) as pool:
        return list(pool.map(refitted, starts))
