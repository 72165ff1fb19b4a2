"""What the rounds have named is looked at again: is something else in its place, or fewer, or a pair that no round
begins with, the better model?
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import combinations

from ers_mj.data.prepared import Trace
from ers_mj.effects import BY_NAME, EQUIVALENT
from ers_mj.estimation.fit import Fit, fit, hopped, is_rough, score
from ers_mj.plants.reduced import EFFORT, ReducedModel
from ers_mj.selection.candidates import LEAST_GAIN
from ers_mj.selection.comparison import (
    FORKED,
    RIVAL,
    TIE,
    Candidate,
    is_clocked,
    is_dear,
    judged,
    likeliest,
    likeliest_first,
    priced,
    really,
    shows,
)
from ers_mj.servo.model import Model

MISSED = 100.0  # of C by which a model is worse without an effect that nothing else will stand for
SWEEP, BY_SCREEN = (
    12,
    12,
)  # steps of a refit in the sweep, and the number of starts from which only a screening can choose
GLANCE, GO_ON = 4, 2  # of these steps, the first ones, and how many of an effect's starts go on after them
AT_BOUND = 1  # of an effect's numbers in the sweep, at most
REVERSED, MOST_REVERSED, FEWER_REVERSED = (
    0.1,
    5,
    2,
)  # share of the leader's gain from which a rival is begun with, the leader put in, how many are, and if dear
MOST_RIVALS = 3  # candidates that may take a leader's place later, tried at most
PAIRED, FAR, MOST_PAIRS = (
    0.5,
    0.2,
    6,
    # share of what all chosen effects buy, that two rivals must buy one by one to be tried as a pair, and by which the
    # first refit of one
)
# that is carried on may be behind; how many are tried
SIZED = tuple(
    name for name, effect in BY_NAME.items() if effect.sized or effect.wave
)  # in proportion to a number, which a secant shows; what has a threshold it may miss


def any_body(plant: ReducedModel) -> bool:
    return True


def of_one_body(plant: ReducedModel) -> bool:
    """Whether a plant is simulated fast."""
    return not plant.coupled


def of_two_bodies(plant: ReducedModel) -> bool:
    return plant.has_motor_side


def swept(
    base: Fit,
    ranked: Sequence[Candidate],
    traces: Sequence[Trace],
    tau: float,
    exclude: Sequence[str],
    jobs: int,
    end: float = math.inf,
    kinds: Callable[[ReducedModel], bool] = any_body,
    hops: bool = False,
) -> list[Candidate]:
    """What a screening missed when it found nothing to add: where stick and slip fork, the secant of the very effect
    that acts may promise nothing.

    Every effect that makes a plant of these ``kinds``, is not dear and has few starts is refitted from these as they
    are, whatever they make worse on the way, those of one body first and from the best that a GLANCE shows, until the
    EFFORT reaches ``end``; those are returned that gain more than the screening's refit of the same effect. One whose
    several numbers end at their bounds is none: a shaft of 1000 Hz without a resonance. With ``hops`` a refit does not
    rest in the first dent of C. Beside a bristle, where a refit takes long, every other start will do.
    """
    effects = [
        effect for effect in BY_NAME.values() if not effect.dear and not effect.once and effect.name not in exclude
    ]
    starts = [
        (effect.name, base.model.with_effect(effect.name, start))
        for effect in effects
        if len(few := effect.starts(base.model.scales)) < BY_SCREEN
        for start in few
    ]
    starts = [(name, model) for name, model in starts if kinds(model.plant())]
    if base.model.plant().bends:
        starts = starts[1::2]
    begun: dict[str, list[Model]] = {}
    for name, model in sorted(starts, key=lambda start: of_two_bodies(start[1].plant())):
        begun.setdefault(name, []).append(model)

    def glanced(model):
        return fit(model, traces, tau=tau, steps=GLANCE)

    def refitted(found):
        return fit(found.model, traces, tau=tau, steps=SWEEP - GLANCE)

    def carried_on(candidate):
        found = fit(candidate.fit.model, traces, tau=tau, steps=20)
        return judged(candidate.name, hopped(found, traces, tau, 1, quiet=-math.inf)[0] if hops else found, base, tau)

    known, best = {c.name: c.gain for c in ranked}, []
    with ThreadPoolExecutor(jobs) as pool:
        for name, models in begun.items():
            if EFFORT.spent >= end:
                break
            ahead = sorted(pool.map(glanced, models), key=lambda found: found.cost)[:GO_ON]
            found = max((judged(name, found, base, tau) for found in pool.map(refitted, ahead)), key=lambda c: c.gain)
            if found.gain > max(known.get(name, 0.0), 0.0):
                best.append(found)
        ended = list(pool.map(carried_on, best))
        ended = list(pool.map(lambda c: carried_on(c) if c.gain >= LEAST_GAIN else c, ended))
    return [
        c
        for c in ended
        if shows(c) and sum(c.fit.model.at_bound(f) for f in c.fit.model.layout() if f.owner == c.name) <= AT_BOUND
    ]


def reviewed(
    current: Fit,
    rounds: list[tuple[Candidate, ...]],
    traces: Sequence[Trace],
    tau: float,
    exclude: Sequence[str],
    jobs: int,
    end: float = math.inf,
) -> tuple[Fit, list[tuple[Candidate, ...]]] | None:
    """The model with what a sweep finds in place of the effect found last, and the rounds up to there, if that is
    better than an effect beside which more than noise is left and nothing is found: the first that a screening promises
    is not always the one that acts.
    """
    k = max((k for k, ranked in enumerate(rounds) if ranked and ranked[0].name in current.model.names), default=None)
    if k is None:
        return None
    without = fit(current.model.without_effect(rounds[k][0].name), traces, tau=tau, steps=20)
    found = swept(without, (), traces, tau, (*exclude, *current.model.names), jobs, end, of_one_body)
    best = min(found, key=lambda c: priced(c.fit), default=None)
    if best is None or priced(best.fit) >= priced(current) - TIE:
        return None
    return best.fit, [*rounds[:k], (best, *(c for c in rounds[k] if c.name != best.name))]


def paired(
    current: Fit, rounds: list[tuple[Candidate, ...]], traces: Sequence[Trace], tau: float, jobs: int
) -> tuple[Fit, list[tuple[Candidate, ...]]] | None:
    """The model with two rivals of the first leader without a clock of its own in the place of it and all that came
    later, and their rounds, if that is better: what leads may do much of what two others do together, neither of which
    does as much alone.
    """
    k = next(
        (
            k
            for k, ranked in enumerate(rounds)
            if ranked and ranked[0].name in current.model.names and not is_clocked(ranked[0].name)
        ),
        None,
    )
    if (
        k is None
        or is_dear(current)
        or len({ranked[0].name for ranked in rounds[k:] if ranked} & {*current.model.names}) < 2
        and not is_doubtful(current, tau)
    ):
        return None
    leader, *others = rounds[k]
    won = leader.gain + float(score(leader.fit.misfit, tau).sum()) - current.cost
    rivals = [
        c
        for c in others
        if c.name in BY_NAME
        and not (is_clocked(c.name) or BY_NAME[c.name].dear or c.fit.model.plant().coupled)
        and c.gain >= RIVAL * leader.gain
    ]
    pairs = [
        (a, b)
        for a, b in combinations(rivals, 2)
        if a.gain + b.gain >= PAIRED * won and not any({a.name, b.name} <= group for group in EQUIVALENT)
    ]

    def together(pair):
        a, b = pair
        found = fit(
            a.fit.model.with_effect(b.name, dict(b.fit.model.effects)[b.name]), traces, tau=tau, steps=20, renewals=4
        )
        return fit(found.model, traces, tau=tau, steps=20) if found.cost - current.cost < FAR * won else found

    with ThreadPoolExecutor(jobs) as pool:
        ends = list(zip(pool.map(together, pairs[:MOST_PAIRS]), pairs))
    found, (a, b) = min(ends, key=lambda end: priced(end[0]), default=(current, (leader, leader)))
    if priced(found) >= priced(current) - TIE:
        return None
    return found, [*rounds[:k], (a, *(c for c in rounds[k] if c is not a)), (judged(b.name, found, a.fit, tau),)]


def other_way_round(
    current: Fit,
    earlier: Sequence[Candidate],
    ranked: Sequence[Candidate],
    traces: Sequence[Trace],
    tau: float,
    jobs: int,
) -> list[Candidate]:
    """The candidates with those that come of the last round's rivals, each with the newest effect put into its own fit:
    a baseline that was bent by one of two effects leads away from the other, and not both ways alike.
    """
    newest, names = earlier[0].name, current.model.names
    if newest not in names or BY_NAME[newest].dear or BY_NAME[newest].local:
        return list(ranked)
    p = dict(current.model.effects)[newest]
    rivals = [
        c
        for c in earlier[1:]
        if c.name in BY_NAME
        and c.name not in names
        and not BY_NAME[c.name].dear
        and not BY_NAME[c.name].once
        and c.gain >= REVERSED * earlier[0].gain
    ][: FEWER_REVERSED if is_dear(current) else MOST_REVERSED]

    def begun(c):
        return judged(
            c.name, fit(c.fit.model.with_effect(newest, p), traces, tau=tau, steps=20, renewals=20), current, tau
        )

    def finished(c):
        return judged(c.name, fit(c.fit.model, traces, tau=tau, steps=20), current, tau) if c.worth >= best - TIE else c

    with ThreadPoolExecutor(jobs) as pool:
        ends = list(pool.map(begun, rivals))
        best = max((c.worth for c in (*ranked, *ends)), default=0.0)
        ends = list(pool.map(finished, ends))
    return joined(ranked, ends)


def exchanged(current: Fit, rounds: list[tuple[Candidate, ...]], traces: Sequence[Trace], tau: float, jobs: int) -> Fit:
    """With earlier effects exchanged for rivals of their round that are likelier beside what came later, and the newest
    where one was, or where it has told a coarse converter's recordings anew where they begin; they lead their rounds
    then."""

    def lent(model, name, owner):
        """A model with an effect of another's, as large as it is there."""
        model = model.with_effect(name, dict(owner.effects)[name])
        return replace(model, local={**model.local, name: owner.local[name]}) if BY_NAME[name].local else model

    def beside(candidate):
        """A rival beside the servo that it was fitted with, and what came later."""
        model = candidate.fit.model
        for name in current.model.names:
            model = model if name in (leader, *model.names) else lent(model, name, current.model)
        return model

    def refitted(item):
        found = fit(item[1], traces, tau=tau, steps=4, renewals=1)
        return item[0], found if found.cost - current.cost > MISSED else fit(found.model, traces, tau=tau, steps=12)

    before = current
    for k, ranked in enumerate(rounds):
        if k == len(rounds) - 1 and current is before and not is_rough(traces):
            break
        leader = ranked[0].name
        if leader not in current.model.names:
            continue
        rivals = [
            c
            for c in ranked[1:]
            if c.name in BY_NAME
            and c.name not in current.model.names
            and really(c.name, c.fit) != leader
            and c.gain >= RIVAL * ranked[0].gain
        ][:MOST_RIVALS]
        without = current.model.without_effect(leader)
        begun = [(c.name, lent(without, c.name, c.fit.model)) for c in rivals]
        begun += [(c.name, beside(c)) for c in rivals if {*c.fit.model.names} <= {c.name, *without.names}]
        begun += [(name, model) for name in (leader, *(c.name for c in rivals)) for model in _begun_anew(name, without)]
        fits = {leader: current}
        with ThreadPoolExecutor(jobs) as pool:
            for name, found in pool.map(refitted, begun):
                fits[name] = min(fits.get(name, found), found, key=priced)
        least = min(map(priced, fits.values())) + TIE
        name = likeliest({n: found for n, found in fits.items() if priced(found) < least})
        current = fits[name]
        if name != leader:
            rounds[k] = tuple(
                sorted((replace(c, beside=fits.get(c.name)) for c in ranked), key=lambda c: c.name != name)
            )
    return current


def widened(current: Fit, newest: str, traces: Sequence[Trace], tau: float, jobs: int) -> Fit:
    """With earlier effects in wider forms of their own (Effect.grown) that pay beside the newest: the damping of a
    bristle or a second harmonic may show only when what hid it is gone."""

    def refitted(model):
        found = fit(model, traces, tau=tau, steps=4, renewals=2)
        return found if found.cost - current.cost > MISSED else fit(found.model, traces, tau=tau, steps=SWEEP)

    for name in (n for n in current.model.names if n != newest):
        begun = [
            current.model.with_form(name, start)
            for start in BY_NAME[name].grown(name, dict(current.model.effects)[name], current.model.scales)
        ]
        with ThreadPoolExecutor(jobs) as pool:
            best = min(pool.map(refitted, begun), key=priced, default=current)
        if priced(best) < priced(current) - TIE:
            current = best
    return current


def _begun_anew(name: str, without: Model) -> list[Model]:
    """A play or a shaft from its own starts beside all that has been found since: the numbers that it took alone may
    lie in a dent of C, from which the descent does not lead out."""
    begun = [without.with_effect(name, start) for start in BY_NAME[name].starts(without.scales)]
    return (
        [model for model in begun if of_two_bodies(plant := model.plant()) and not plant.bends]
        if not without.plant().has_motor_side
        else []
    )


def pruned(current: Fit, newest: str, traces: Sequence[Trace], tau: float) -> Fit:
    """Without the earlier effects that no longer pay; what a few steps along one Jacobian show to be sorely MISSED is
    not tried to the end.
    """
    for name in (n for n in current.model.names if n != newest):
        without = fit(current.model.without_effect(name), traces, tau=tau, steps=4, renewals=1)
        if without.cost - current.cost < MISSED:
            without = fit(without.model, traces, tau=tau, steps=12, ceiling=current.misfit)
        if without.cost - current.cost < LEAST_GAIN:
            current = without
    return current


def leaves_more_than_forks(current: Fit, tau: float) -> bool:
    """Whether effects leave more than forks of stick and slip in two blocks do."""
    return bool(current.model.names) and float(score(current.misfit, tau).sum()) > FORKED


def is_doubtful(current: Fit, tau: float) -> bool:
    """Whether a model of one body does, beside which a sweep takes little time."""
    return not current.model.plant().coupled and leaves_more_than_forks(current, tau)


def joined(ranked: Sequence[Candidate], others: Sequence[Candidate]) -> list[Candidate]:
    """The better one of each name, the likeliest first."""
    best = {c.name: c for c in ranked}
    for c in others:
        if c.name not in best or c.worth > best[c.name].worth:
            best[c.name] = c
    return likeliest_first(sorted(best.values(), key=lambda c: -c.worth))
