"""Every effect from its own starts, where a screening found nothing to add: where stick and slip fork, the secant of
the very effect that acts may promise nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import Hops, hopped
from ers_mj.estimation.objective import Fit
from ers_mj.plants.reduced import ReducedModel
from ers_mj.selection.bench import Bench
from ers_mj.selection.comparison import Candidate, likeliest_first, shows
from ers_mj.selection.screening import Begin
from ers_mj.servo.model import Model
from ers_mj.solvers.successive_halving import Stage, halved

Kind = Callable[[ReducedModel], bool]
# in proportion to a number, which a secant shows; what has a threshold it may miss
SIZED = tuple(name for name, effect in BY_NAME.items() if effect.sized or effect.wave)


def any_body(plant: ReducedModel) -> bool:
    return True


def of_one_body(plant: ReducedModel) -> bool:
    """Whether a plant is simulated fast."""
    return not plant.coupled


def of_two_bodies(plant: ReducedModel) -> bool:
    return plant.has_motor_side


def swept(
    bench: Bench,
    base: Fit,
    ranked: Sequence[Candidate] = (),
    end: float = math.inf,
    kinds: Kind = any_body,
    hops: bool = False,
) -> list[Candidate]:
    """What a screening missed.

    Every effect that makes a plant of these ``kinds``, is not dear and has few starts is refitted from these as they
    are, whatever they make worse on the way, those of one body first, until so much has been simulated as ``end``;
    those are returned that gain more than the refits of the same effect that are ``ranked``. One whose several numbers
    end at their bounds is none: a shaft of 1000 Hz without a resonance. With ``hops`` a refit does not rest in the
    first local minimum of C. Beside a bristle, where a refit takes long, every other start will do.
    """
    search, known, best, few = bench.search, {c.name: c.gain for c in ranked}, [], bench.few(base)
    stages = [
        Stage(lambda item: few.fit(item.model, search.sweep_glance), lambda e: _nearest(e, search.go_on)),
        Stage(lambda item: bench.fit(item.model, search.sweep - search.sweep_glance)),
    ]
    for name, begun in _begun(bench, base, kinds).items():
        if bench.budget.spent >= end:
            break
        ended = halved((Begin(model, {}) for model in begun), stages, bench.each)
        found = max((bench.judged(name, one, base) for one in ended), key=lambda c: c.gain)
        if found.gain > max(known.get(name, 0.0), 0.0):
            best.append(found)

    def carried_on(candidate: Candidate) -> Candidate:
        found = bench.fit(candidate.fit.model, 20)
        if hops:
            found, _ = hopped(found, bench.traces, bench.tau, 1, hops=Hops(quiet=-math.inf))
        return bench.judged(candidate.name, found, base)

    swept_on = bench.each(carried_on, best)
    swept_on = bench.each(lambda c: carried_on(c) if c.gain >= bench.policy.least_gain else c, swept_on)
    return [c for c in swept_on if shows(c) and _at_bound(c) <= bench.policy.at_bound]


def _nearest(ended: Sequence[Fit], most: int) -> list[Fit]:
    return sorted(ended, key=lambda found: found.cost)[:most]


def _begun(bench: Bench, base: Fit, kinds: Kind) -> dict[str, list[Model]]:
    """The models that a sweep begins from, by effect, those of one body first."""
    starts = []
    for effect in BY_NAME.values():
        if not (effect.dear or effect.once or effect.name in bench.exclude):
            few = effect.starts(base.model.scales)
            if len(few) < bench.search.by_screen:
                starts += [(effect.name, base.model.with_effect(effect.name, start)) for start in few]
    starts = [(name, model) for name, model in starts if kinds(model.plant())]
    if base.model.plant().bends:
        starts = starts[1::2]
    begun: dict[str, list[Model]] = {}
    for name, model in sorted(starts, key=lambda start: of_two_bodies(start[1].plant())):
        begun.setdefault(name, []).append(model)
    return begun


def _at_bound(candidate: Candidate) -> int:
    """How many of an effect's numbers rest at their bounds."""
    model = candidate.fit.model
    return sum(model.at_bound(f) for f in model.layout() if f.owner == candidate.name)


def joined(ranked: Sequence[Candidate], others: Sequence[Candidate]) -> list[Candidate]:
    """The better one of each name, the likeliest first."""
    best = {c.name: c for c in ranked}
    for c in others:
        if c.name not in best or c.worth > best[c.name].worth:
            best[c.name] = c
    ordered = sorted(best.values(), key=lambda c: -c.worth)
    return likeliest_first(ordered, ordered[0].policy) if ordered else []
