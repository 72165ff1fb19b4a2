"""Laws that a screening passes over: behind a threshold, in the shade of what has a clock, across forks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ers_mj.decisions import explained
from ers_mj.effects import BY_NAME, Effect
from ers_mj.estimation.fit import Along, fit
from ers_mj.estimation.jacobian import columns_of
from ers_mj.estimation.objective import Fit
from ers_mj.estimation.sparse import few_of
from ers_mj.selection.comparison import is_clocked, is_dear, kin_of
from ers_mj.selection.multistart import more_starts
from ers_mj.selection.refits import Label, Named, Refits, cheapest
from ers_mj.selection.screening import Begin, Screened
from ers_mj.servo.model import OBSERVER_RATE, Model
from ers_mj.solvers.successive_halving import Stage, halved

Starts = Mapping[Label, Sequence[Begin]]


def refit_the_overlooked(
    refits: Refits, best: dict[str, Fit], screened: Screened, starts: Starts, least: float
) -> None:
    """Refit what was overlooked, in its first steps to see whether it shows anything; ``best`` takes what it finds."""
    leading = refits.reference - min(map(refits.total, best.values()), default=refits.reference)
    search = refits.bench.search

    def showing(share: float):
        return lambda items: [item for item in items if refits.won(item[1]) >= share * leading]

    def glance(item: tuple[str, Begin]) -> Named:
        return item[0], refits.bench.fit(item[1].model, 3, along=Along(renewals=1))

    def finish(item: Named) -> Named:
        return item[0], refits.on(item[1], 20)

    glances = refits.bench.each(glance, _overlooked(refits, best, screened, starts, least))
    late = refits.lap(showing(search.seen)(glances))
    for name, found in halved(showing(search.again)(late), [Stage(finish)], refits.bench.each):
        best[name] = min(best.get(name, found), found, key=refits.total)


def _overlooked(
    refits: Refits, best: Mapping[str, Fit], screened: Screened, starts: Starts, least: float
) -> list[tuple[str, Begin]]:
    """The cheap laws, with models to refit, that explain little of what leads with a clock of its own, or are one with
    a law that leads and were not refitted: on a borrowed Jacobian, or seen by its secant, what has a threshold (a stop,
    a limit) does nothing until that is passed. Beside what takes long to simulate, those alone that were screened, and
    promise something of what leads.
    """
    model = refits.base.model
    leader = min(best, key=lambda name: refits.total(best[name]), default=None)
    if leader is None or refits.won(best[leader]) < max(least, refits.bench.policy.least_gain):
        return []
    laws = [effect for effect in BY_NAME.values() if _is_in_the_shade(effect, leader, refits, best)]
    if model.plant().coupled and is_clocked(leader):
        own = _screened(refits, screened, laws, leader)
    else:
        own = _whole(model, laws)
    twists = model.plant().has_motor_side  # a play or a shaft, which takes longest, is no impulse
    begun = [(e.name, begin) for e in laws for begin in starts.get((e.name, 0), own.get(e.name, []))]
    return [(name, begin) for name, begin in begun if begin.model.plant().has_motor_side == twists]


def _screened(refits: Refits, screened: Screened, laws: Sequence[Effect], leader: str) -> dict[str, list[Begin]]:
    """The best starts of those laws that were screened, and promise something of what leads."""
    least = refits.bench.search.seen * screened.promises.get(leader, math.inf)
    known = [e.name for e in laws if e.name in screened.begins and screened.promises.get(e.name, 0.0) >= least]
    return {name: list(screened.begins[name][0][:1]) for name in known}


def _whole(model: Model, laws: Sequence[Effect]) -> dict[str, list[Begin]]:
    """The own starts of those laws that are in proportion to no number, beside one body."""
    whole = [effect for effect in laws if not (effect.sized or model.plant().coupled)]
    return {e.name: [Begin(model.with_effect(e.name, p), {}) for p in e.starts(model.scales)] for e in whole}


def _is_in_the_shade(effect: Effect, leader: str, refits: Refits, best: Mapping[str, Fit]) -> bool:
    """Whether a cheap law may be hidden by what leads."""
    if is_clocked(effect.name) or effect.dear or effect.name in refits.bench.exclude:
        return False
    if not is_clocked(leader):
        return effect.name not in best and effect.name in kin_of(leader)
    enough = refits.bench.policy.clocked * refits.won(best[leader])
    return effect.name not in best or refits.won(best[effect.name]) < enough


def refit_held_taut(refits: Refits, best: dict[str, Fit], screened: Screened, starts: Starts, least: float) -> None:
    """Where the leader leaves much, fits under an observer that holds the motion to the reading, which hardly lets it
    stick where the rudder slipped: C has few local minima then. ``best`` takes what they find.
    """
    base, bench = refits.base, refits.bench
    leader = min(best.values(), key=refits.total, default=None)
    if leader is None or is_dear(base) or not _leaves_much(refits, leader, least):
        return

    def taut(begin: Fit | Begin, steps: int, along: Along) -> Fit:
        """A fit under such an observer; nothing gives it up."""
        return fit(begin.model, few, rate=rate, tau=bench.tau, steps=steps, along=along)

    names = [name for name in BY_NAME if name not in bench.exclude]
    begun = more_starts(base.model, names, screened.promising(), starts, bench.search)
    rate, quick = bench.search.taut * OBSERVER_RATE, bench.search.quick
    few = few_of(base.model, bench.traces, bench.tau, rate)
    known = columns_of(base.model, few, rate)
    stages = [
        Stage(
            lambda item: (item[0], taut(item[1], quick, Along(known=known, renewals=0))),
            lambda ended: cheapest(ended, bench.search.held),
        ),
        Stage(
            lambda item: (item[0], taut(item[1], quick, Along(renewals=1))),
            lambda ended: cheapest(ended, bench.search.let_go),
        ),
        Stage(lambda item: (item[0], refits.on(item[1], 6, Along(renewals=1)))),
    ]
    for name, found in halved(begun, stages, bench.each):
        best[name] = min(best.get(name, found), found, key=refits.total)


def _leaves_much(refits: Refits, found: Fit, least: float) -> bool:
    """Whether a fit leaves a good part, and more than forks of stick and slip do, or wins what matters."""
    policy, tau = refits.bench.policy, refits.bench.tau
    if refits.total(found) <= refits.bench.search.unexplained * refits.reference:
        return False
    matters = policy.near_least * max(least, policy.least_gain)
    return explained.is_more_than_forks(found.misfit, tau, policy) or refits.won(found) >= matters
