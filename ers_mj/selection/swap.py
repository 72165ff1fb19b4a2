"""Is something else the better answer in the place of what was named?"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import Along
from ers_mj.estimation.objective import Fit, is_rough
from ers_mj.selection.bench import Bench
from ers_mj.selection.comparison import Candidate, is_dear, likeliest, likeliest_first, really
from ers_mj.selection.moves import Grown
from ers_mj.selection.sweep import joined, of_one_body, of_two_bodies, swept
from ers_mj.servo.model import Model


def reviewed(
    bench: Bench, current: Fit, rounds: Sequence[tuple[Candidate, ...]], end: float = math.inf
) -> Grown | None:
    """The model with what a sweep finds in place of the effect found last, and the rounds up to there, if that is
    better than an effect beside which more than noise is left and nothing is found: the first that a screening promises
    is not always the one that acts.
    """
    named = current.model.names
    k = max((k for k, ranked in enumerate(rounds) if ranked and ranked[0].name in named), default=None)
    if k is None:
        return None
    without = bench.fit(current.model.without_effect(rounds[k][0].name), 20)
    found = swept(bench.without(named), without, end=end, kinds=of_one_body)
    best = min(found, key=lambda c: bench.priced(c.fit), default=None)
    if best is None or bench.priced(best.fit) >= bench.priced(current) - bench.policy.tie:
        return None
    return best.fit, [*rounds[:k], (best, *(c for c in rounds[k] if c.name != best.name))]


def other_way_round(
    bench: Bench, current: Fit, earlier: Sequence[Candidate], ranked: Sequence[Candidate]
) -> list[Candidate]:
    """The candidates with those that come of the last round's rivals, each with the newest effect put into its own fit:
    a baseline that was bent by one of two effects leads away from the other, and not both ways alike.
    """
    newest, names, search = earlier[0].name, current.model.names, bench.search
    if newest not in names or BY_NAME[newest].dear or BY_NAME[newest].local:
        return list(ranked)
    p, least = dict(current.model.effects)[newest], search.reversed_share * earlier[0].gain
    rivals = [c for c in earlier[1:] if c.gain >= least and _may_come_first(c, names)]

    def begun(c: Candidate) -> Candidate:
        found = bench.fit(c.fit.model.with_effect(newest, p), 20, along=Along(renewals=20))
        return bench.judged(c.name, found, current)

    ends = bench.each(begun, rivals[: search.fewer_reversed if is_dear(current) else search.most_reversed])
    near = max((c.worth for c in (*ranked, *ends)), default=0.0) - bench.policy.tie

    def finished(c: Candidate) -> Candidate:
        return bench.judged(c.name, bench.fit(c.fit.model, 20), current) if c.worth >= near else c

    return joined(ranked, bench.each(finished, ends))


def _may_come_first(candidate: Candidate, names: Sequence[str]) -> bool:
    """Whether a rival is a lasting effect that is not named already, and simulated fast."""
    if candidate.name not in BY_NAME or candidate.name in names:
        return False
    return not (BY_NAME[candidate.name].dear or BY_NAME[candidate.name].once)


def exchanged(bench: Bench, current: Fit, rounds: list[tuple[Candidate, ...]]) -> Fit:
    """With earlier effects exchanged for rivals of their round that are likelier beside what came later, and the newest
    where one was, or where it has told a coarse converter's recordings anew where they begin; they lead their rounds
    then.
    """
    before = current
    for k, ranked in enumerate(rounds):
        if k == len(rounds) - 1 and current is before and not is_rough(bench.traces):
            break
        leader = ranked[0].name
        if leader not in current.model.names:
            continue
        fits = _in_the_place_of(bench, current, ranked)
        least = min(map(bench.priced, fits.values())) + bench.policy.tie
        name = likeliest({n: found for n, found in fits.items() if bench.priced(found) < least}, bench.policy)
        current = fits[name]
        if name != leader:
            rounds[k] = _led_by(name, ranked, fits)
    return current


def _led_by(name: str, ranked: Sequence[Candidate], fits: Mapping[str, Fit]) -> tuple[Candidate, ...]:
    """A round whose lead another takes, with the fits beside what later rounds added."""
    return tuple(sorted((replace(c, beside=fits.get(c.name)) for c in ranked), key=lambda c: c.name != name))


def _in_the_place_of(bench: Bench, current: Fit, ranked: Sequence[Candidate]) -> dict[str, Fit]:
    """Fits of the current model, and with each rival in the place of a round's leader, by name.

    A rival is begun in what the current model is without the leader, and beside the servo that it was fitted with and
    what came later; a play or a shaft from its own starts too.
    """
    leader, named = ranked[0].name, current.model.names
    least = bench.policy.rival * ranked[0].gain
    rivals = [c for c in ranked[1:] if c.name in BY_NAME and c.name not in named and c.gain >= least]
    rivals = [c for c in rivals if really(c.name, c.fit) != leader][: bench.search.most_rivals]
    without = current.model.without_effect(leader)
    begun = [(c.name, _lent(without, c.name, c.fit.model)) for c in rivals]
    begun += [
        (c.name, _beside(c, current.model, leader)) for c in rivals if {*c.fit.model.names} <= {c.name, *without.names}
    ]
    begun += [(name, model) for name in (leader, *(c.name for c in rivals)) for model in begun_anew(name, without)]
    ends = bench.carried_on(
        [model for _, model in begun],
        lambda found: found.cost - current.cost <= bench.search.missed,
        first=4,
        then=12,
        along=Along(renewals=1),
    )
    fits = {leader: current}
    for (name, _), found in zip(begun, ends, strict=True):
        fits[name] = min(fits.get(name, found), found, key=bench.priced)
    return fits


def _lent(model: Model, name: str, owner: Model) -> Model:
    """A model with an effect of another's, as large as it is there."""
    model = model.with_effect(name, dict(owner.effects)[name])
    return replace(model, local={**(model.local or {}), name: owner.local[name]}) if BY_NAME[name].local else model


def _beside(candidate: Candidate, current: Model, leader: str) -> Model:
    """A rival beside the servo that it was fitted with, and what came later."""
    model = candidate.fit.model
    for name in current.names:
        model = model if name in (leader, *model.names) else _lent(model, name, current)
    return model


def begun_anew(name: str, without: Model) -> list[Model]:
    """A play or a shaft from its own starts beside all that has been found since: the numbers that it took alone may
    lie in a local minimum of C, from which the descent does not lead out.
    """
    if without.plant().has_motor_side:
        return []
    begun = [without.with_effect(name, start) for start in BY_NAME[name].starts(without.scales)]
    return [model for model in begun if of_two_bodies(plant := model.plant()) and not plant.bends]


def widened(bench: Bench, current: Fit, newest: str) -> Fit:
    """With earlier effects in wider forms of their own (Effect.grown) that pay beside the newest: the damping of a
    bristle or a second harmonic may show only when what hid it is gone.
    """
    for name in (n for n in current.model.names if n != newest):
        model = current.model
        starts = BY_NAME[name].grown(name, dict(model.effects)[name], model.scales)
        ends = bench.carried_on(
            [model.with_form(name, start) for start in starts],
            lambda found, cost=current.cost: found.cost - cost <= bench.search.missed,
            first=4,
            then=bench.search.sweep,
            along=Along(renewals=2),
        )
        best = min(ends, key=bench.priced, default=current)
        if bench.priced(best) < bench.priced(current) - bench.policy.tie:
            current = best
    return current


def narrowed(bench: Bench, current: Fit) -> Fit:
    """With effects in narrower forms (Effect.narrower) that do as well: what one was widened for may have been what was
    named later, and of two numbers that stand for one nothing is known.
    """
    policy = bench.policy
    for name in (n for n in current.model.names if not BY_NAME[n].dear):
        for less in BY_NAME[name].narrower(dict(current.model.effects)[name]):

            def lost(found: Fit, before: Fit = current) -> float:
                price = policy.wider_price + policy.parameter_price * (before.size - found.size)
                return bench.cost(found) - bench.cost(before) - price

            begun = [current.model.with_form(name, less)]
            (found,) = bench.carried_on(
                begun, lambda x, lost=lost: lost(x) < bench.search.missed, first=4, then=20, along=Along(renewals=2)
            )
            if lost(found) < 0.0:
                return narrowed(bench, found)
    return current


def as_what_it_is(bench: Bench, current: Fit, rounds: Sequence[tuple[Candidate, ...]]) -> Grown | None:
    """The model with the effect itself in the place of one whose numbers are a form of it (see Effect.really), and the
    rounds led by it, where that is as good, or better where it is one that does not change along the travel (see
    Effect.curves); None where nothing is.
    """
    for name in current.model.names:
        other, starts, worse = _what_it_is(bench, current, name)
        if other in current.model.names:
            continue
        without = current.model.without_effect(name)
        begun = (without.with_effect(other, start) for start in starts)
        found = min((bench.fit(model, 20) for model in begun), key=bench.priced, default=None)
        if found is None or bench.priced(found) > bench.priced(current) + worse:
            continue
        one = bench.judged(other, found, bench.fit(without, 20))
        return found, [
            (one, *(c for c in ranked if c.name != other)) if ranked and ranked[0].name == name else ranked
            for ranked in rounds
        ]
    return None


def _what_it_is(bench: Bench, current: Fit, name: str) -> tuple[str, Sequence[np.ndarray], float]:
    """(the effect of which a named one may be a form, where that begins, by how much it may cost more)."""
    if (other := really(name, current)) != name:
        return other, BY_NAME[other].starts(current.model.scales), bench.policy.tie
    if flat := BY_NAME[name].curves:
        return flat, [_at_the_middle(name, current.model)], 0.0
    return name, (), 0.0


def _at_the_middle(name: str, model: Model) -> np.ndarray:
    """The torque (1,) that an effect makes at the middle of the travel."""
    middle = np.array([0.5 * (model.scales.low + model.scales.high)])
    return BY_NAME[name].columns(middle) @ dict(model.effects)[name]


def in_its_place(bench: Bench, current: Fit, before: Fit, ranked: Sequence[Candidate]) -> tuple[Candidate, ...] | None:
    """The candidates of a round that added its leader to the model ``before``, with a rival first where the refit has
    made of the leader a form of another effect (see Effect.really); None where it is still itself, or still the
    likeliest.
    """
    name = ranked[0].name
    if name not in current.model.names or really(name, current) == name:
        return None
    again = [bench.judged(name, current, before), *ranked[1:]]
    others = likeliest_first(sorted(again, key=lambda c: -c.worth), bench.policy)
    return None if others[0].name == name else tuple(others)
