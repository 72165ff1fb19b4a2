"""Which effects does the data ask for? A round at a time (race.py), as long as the winner buys more than chance offers; removals and exchanges are tested."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ers_mj.effects import BY_NAME, EQUIVALENT
from ers_mj.identification import Fit, fit, hopped, is_rough, near_noise, residuals_in, score, tau_of
from ers_mj.model import OBSERVER_RATE, Model
from ers_mj.plants.reduced import EFFORT, ReducedModel
from ers_mj.race import (LEAST_GAIN, LEAST_Z, NEAR_LEAST, RIVAL, TIE, Candidate, bends_and_twists, candidates, is_clocked, is_dear, judged,
                         likeliest, likeliest_first, priced, really, shows, stands_alone)
from ers_mj.remainder import left_by_sensor, more_is_missing
from ers_mj.screening import PEAK, attainable, stands_out
from ers_mj.starts import with_starts
from ers_mj.traces import Blocks, Trace

LATER_GAIN = 4.0  # and beside an effect, whose law is hardly ever exactly the one that acts
FAINT_GAIN = 1.5  # there too, where it stands alone (see race.stands_alone)
LEAST_SHARE = 0.1  # and the share of what is left to explain
LATER_Z = 2.0  # and beside an effect
PLAIN = 1.3  # noise levels of what a model leaves of a coarse converter's readings, rounding being noise, from which it is wrong
MISSED = 100.0  # of C by which a model is worse without an effect that nothing else will stand for
LOST = 0.2  # share of the gain that the blocks which lose may lose, where it falls in so few blocks that their z-score cannot be large
ONCE = 6.0  # of C that an effect which acts once must buy, or screening.PEAK
SWEEP, BY_SCREEN = 12, 12  # steps of a refit in the sweep, and the number of starts from which only a screening can choose
AT_BOUND = 1  # of an effect's numbers in the sweep, at most
FORKED = 6.0  # of C that forks of stick and slip leave: two blocks off by 5.8 sigma, as the worst of 61 servos without missing physics is in one
MOST_ROUNDS, FEWER_ROUNDS = 3, 2  # effects at most, and where the model itself stays wrong (see identification.ROUGH)
MOST_EFFORT, LAST_RACED, LAST_BEGUN = 60_000_000, 50_000_000, 160_000_000  # [us] of simulation (plants.reduced.Effort) after which nothing is looked
# for that does not show by itself, a round beside a bristle is left at its first refits, and none is begun; more by as much as the recordings last longer than a MINUTE together
MINUTE, LONGER = 60.0, 1.5  # [s]; times as late a round of one body, which takes less, may begin
GOOD_PART = 0.35  # share of C that a round must take away for a third where the model stays wrong
REVERSED, MOST_REVERSED, FEWER_REVERSED = 0.1, 5, 2  # share of the leader's gain from which a rival is begun with, the leader put in, how many are, and if dear
OUTWEIGHED = 0.2  # share of a later law's gain below which that of what has its own clock was found in a bent model
MOST_RIVALS = 3  # candidates that may take a leader's place later, tried at most
PAIRED, FAR, MOST_PAIRS = 0.5, 0.2, 6  # share of what all chosen effects buy, that two rivals must buy one by one to be tried as a pair, and by which the first refit of one
# that is carried on may be behind; how many are tried
MODEST, DENT, MOST_MENDED = 30.0, 1.0, 2  # gain of C up to which, and how much of it, the model itself may win on its way back; how often (see _most_mended)


@dataclass(frozen=True)
class Selection:
    """The chosen model, the baseline it grew from, each round's candidates, the tau at which the last was judged, and the traces with the starts that
    the chosen model gives them."""

    base: Fit
    chosen: Fit
    rounds: tuple[tuple[Candidate, ...], ...]
    tau: float
    traces: Sequence[Trace]


def select(base: Fit, traces: Sequence[Trace], *, anchors: Sequence[Mapping[str, float]] = (), exclude: Sequence[str] = (),
           jobs: int = 1, progress: Callable[[str, float], None] = lambda text, share: None) -> Selection:
    """Grow the model while the data asks for it, dropping what later additions make needless.

    What takes longest, the sweeps, what is begun once more the other way round, and a shaft or a play beside a bristle, is left out after MOST_EFFORT, and no round
    begins after LAST_BEGUN (LONGER than that, one of one body); one beside a bristle that is under way at LAST_RACED goes no further than its first refits.
    """
    longer = max(1.0, sum(float(trace.t[-1] - trace.t[0]) for trace in traces) / MINUTE)
    end, raced, last, latest = (EFFORT.spent + longer * effort for effort in (MOST_EFFORT, LAST_RACED, LAST_BEGUN, LONGER * LAST_BEGUN))
    current, rounds, mended, swept, reviewed, paired, took = base, [], 0, False, False, False, 0.0
    tau = tau_of(base.misfit)
    while EFFORT.spent < (last if current.model.plant().coupled else latest):
        if _taken(current, rounds) >= _most_rounds(current, took):
            other = None if paired else _paired(current, base, rounds, traces, tau, jobs)
            if other is None:
                break
            (current, rounds), paired = other, True
            continue
        progress(f"round {len(rounds) + 1}: comparing effects", 0.15 + 0.12 * len(rounds))
        least, faint = _gains_that_matter(current, tau)
        unsought = (*exclude, *current.model.names, *(_bending_and_twisting(current.model) if EFFORT.spent >= end else ()))
        ranked = candidates(current, traces, tau, jobs, unsought, anchors if not rounds else (), faint, raced if is_dear(current) else math.inf)
        if ranked and faint <= ranked[0].gain <= MODEST and mended < _most_mended(current):
            again = _less(ranked[0], traces, tau)
            won = float(score(current.misfit, tau).sum() - score(again.misfit, tau).sum())
            if won > DENT:
                base, current, mended = base if current.model.names else again, again, mended + 1
                if ranked[0].gain - won < faint or any(c.worth >= ranked[0].worth - won for c in ranked[1:]):
                    continue
                ranked = [judged(c.name, c.fit, current, tau) for c in ranked]
        least_z = LATER_Z if current.model.names else LEAST_Z
        outstanding = stands_out(current.misfit, tau)
        rough = not swept and EFFORT.spent < end and _is_rough_and_wrong(current, traces)
        if rough or not (ranked and _asked_for(ranked[0], least, least_z, outstanding)) and EFFORT.spent < end and _is_cheap_and_wrong(current, base, traces):
            kinds = _of_one_body if swept else _any  # the second body, which takes most of the time, once a case
            ranked, swept = _joined(ranked, _swept(current, ranked, traces, tau, (*exclude, *current.model.names), jobs, end, kinds, rough)), True
        elif ranked and EFFORT.spent < end and _may_twist(current) and not ranked[0].fit.model.plant().has_motor_side:
            ranked = _joined(ranked, _swept(current, ranked, traces, tau, (*exclude, *current.model.names), jobs, end, _of_two_bodies))
        if rounds and ranked and EFFORT.spent < end and attainable(current.misfit, Blocks.of(traces).counts, tau) >= least:
            ranked = _other_way_round(current, rounds[-1], ranked, traces, tau, jobs)
        asked = [c for c in ranked if (c is ranked[0] or current.model.names and c.name in BY_NAME)
                 and _asked_for(c, faint if c.gain < least and stands_alone(c, ranked) else least, least_z, outstanding)]
        rounds.append(tuple(sorted(ranked, key=lambda c: c not in asked[:1])))
        if not asked:
            other = None if reviewed or EFFORT.spent >= end or not _is_doubtful(current, tau) else _reviewed(current, rounds, traces, tau, exclude, jobs, end)
            if other is None and not paired:
                other, paired = _paired(current, base, rounds, traces, tau, jobs), True
            if other is None:
                break
            (current, rounds), reviewed = other, True
            continue
        ranked = rounds[-1]
        took = ranked[0].gain / max(ranked[0].gain, float(score(current.misfit, tau).sum()))
        before, judged_at = current, tau
        current = pruned(ranked[0].fit, ranked[0].name, traces, tau)
        current, rounds = _reconsidered(current, rounds, traces, tau)
        tau = tau_of(current.misfit)
        traces = _restarted(current.model, traces)
        current = fit(current.model, traces, tau=tau, steps=20)
        if (other := _in_its_place(current, before, rounds[-1], judged_at)) is not None:
            rounds[-1] = other
            current = fit(other[0].fit.model, traces, tau=tau, steps=20)
        if not is_dear(current):
            current, _ = hopped(current, traces, tau, jobs)
        if near_noise(current):
            current = _exchanged(current, rounds, traces, tau, jobs)
    return Selection(base, current, tuple(rounds), tau, traces)


def _gains_that_matter(current: Fit, tau: float) -> tuple[float, float]:
    """What an effect must buy beside this model, and what one that stands alone must."""
    share = LEAST_SHARE * float(score(current.misfit, tau).sum())
    usual = LATER_GAIN if current.model.names else LEAST_GAIN
    return max(usual, share), max(FAINT_GAIN if current.model.names and not is_dear(current) else usual, share)


def _restarted(model: Model, traces: Sequence[Trace]) -> Sequence[Trace]:
    """The traces with new starts where converters are coarse: within a step a model tells where the rudder began, and a wrong one tells it wrongly."""
    return with_starts(model, traces) if is_rough(traces) else traces


def _reconsidered(current: Fit, rounds: list[tuple[Candidate, ...]], traces: Sequence[Trace], tau: float) -> tuple[Fit, list[tuple[Candidate, ...]]]:
    """Without earlier effects with a clock of their own that the newest, a law of the servo, outweighs by far: they were found in what it had bent, and
    a round beside it finds again what is there.
    """
    newest = rounds[-1][0]
    early = [ranked[0].name for ranked in rounds[:-1] if ranked[0].name in BY_NAME and ranked[0].name in current.model.names
             and is_clocked(ranked[0].name) and ranked[0].gain < OUTWEIGHED * newest.gain]
    if not early or is_clocked(newest.name):
        return current, rounds
    model = current.model
    for name in early:
        model = model.without_effect(name)
    return fit(model, traces, tau=tau, steps=20), [ranked for ranked in rounds if ranked[0].name not in early]


def _in_its_place(current: Fit, before: Fit, ranked: tuple[Candidate, ...], tau: float) -> tuple[Candidate, ...] | None:
    """The candidates of a round that added its leader to the model ``before``, with a rival first where the refit has made of the leader a form of another
    effect (see Effect.really); None where it is still itself, or still the likeliest.
    """
    name = ranked[0].name
    if name not in current.model.names or really(name, current) == name:
        return None
    others = likeliest_first(sorted((judged(name, current, before, tau), *ranked[1:]), key=lambda c: -c.worth))
    return None if others[0].name == name else tuple(others)


def _is_cheap_and_wrong(current: Fit, base: Fit, traces: Sequence[Trace]) -> bool:
    """Whether a model of one body, which is simulated fast, leaves more than noise (see remainder.py)."""
    without = left_by_sensor(base.model, traces) if current.model.names else None
    return not current.model.plant().coupled and more_is_missing(left_by_sensor(current.model, traces), without)


def _is_rough_and_wrong(current: Fit, traces: Sequence[Trace]) -> bool:
    """Whether a model of one body is further from the readings of a coarse converter than their noise is (PLAIN): behind one, C is so rough that a screening
    promises nothing of what acts, and what is left has lost its memory (see remainder.py).
    """
    if current.model.plant().coupled or not is_rough(traces):
        return False
    parts = [trace.plain(residuals_in(current.model, trace, k, OBSERVER_RATE)[:trace.t.size])[trace.valid] for k, trace in enumerate(traces)]
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) > PLAIN


def _is_doubtful(current: Fit, tau: float) -> bool:
    """Whether the effects of a model of one body leave more than forks of stick and slip in two blocks do."""
    return bool(current.model.names) and not current.model.plant().coupled and float(score(current.misfit, tau).sum()) > FORKED


def _joined(ranked: Sequence[Candidate], others: Sequence[Candidate]) -> list[Candidate]:
    """The better one of each name, the likeliest first."""
    best = {c.name: c for c in ranked}
    for c in others:
        if c.name not in best or c.worth > best[c.name].worth:
            best[c.name] = c
    return likeliest_first(sorted(best.values(), key=lambda c: -c.worth))


def _any(plant: ReducedModel) -> bool:
    return True


def _of_one_body(plant: ReducedModel) -> bool:
    """Whether a plant is simulated fast."""
    return not plant.coupled


def _of_two_bodies(plant: ReducedModel) -> bool:
    return plant.has_motor_side


def _bending_and_twisting(model: Model) -> list[str]:
    """The effects that make a plant whose friction bends a bristle and whose shaft twists, which the model's has only one of."""
    starts = ((name, effect.starts(model.scales)[:1]) for name, effect in BY_NAME.items() if effect.subsystem == "transmission" or effect.dear)
    plants = ((name, model.with_effect(name, start).plant()) for name, some in starts if name not in model.names for start in some)
    return [name for name, plant in plants if plant.bends and plant.has_motor_side]


def _may_twist(current: Fit) -> bool:
    """Whether a rudder whose friction bends a bristle is explained so badly that a play or a shaft may be there, which beside it no secant shows."""
    return current.model.plant().bends and not bends_and_twists(current) and not near_noise(current)


def _swept(base: Fit, ranked: Sequence[Candidate], traces: Sequence[Trace], tau: float, exclude: Sequence[str], jobs: int, end: float = math.inf,
           kinds: Callable[[ReducedModel], bool] = _any, hops: bool = False) -> list[Candidate]:
    """What a screening missed when it found nothing to add: where stick and slip fork, the secant of the very effect that acts may promise nothing.

    Every effect that makes a plant of these ``kinds``, is not dear and has few starts is refitted from these as they are, whatever they make worse on the way,
    those of one body first, until the EFFORT reaches ``end``; those are returned that gain more than the screening's refit of the same effect. One whose
    several numbers end at their bounds is none: a shaft of 1000 Hz without a resonance. With ``hops``
    a refit does not rest in the first dent of C. Beside a bristle, where a refit takes long, every other start will do.
    """
    effects = [effect for effect in BY_NAME.values() if not effect.dear and not effect.once and effect.name not in exclude]
    starts = [(effect.name, base.model.with_effect(effect.name, start)) for effect in effects
              if len(few := effect.starts(base.model.scales)) < BY_SCREEN for start in few]
    starts = [(name, model) for name, model in starts if kinds(model.plant())]
    if base.model.plant().bends:
        starts = starts[1::2]
    begun: dict[str, list[Model]] = {}
    for name, model in sorted(starts, key=lambda start: _of_two_bodies(start[1].plant())):
        begun.setdefault(name, []).append(model)

    def refitted(model):
        return fit(model, traces, tau=tau, steps=SWEEP)

    def carried_on(candidate):
        found = fit(candidate.fit.model, traces, tau=tau, steps=20)
        return judged(candidate.name, hopped(found, traces, tau, 1, quiet=-math.inf)[0] if hops else found, base, tau)

    known, best = {c.name: c.gain for c in ranked}, []
    with ThreadPoolExecutor(jobs) as pool:
        for name, models in begun.items():
            if EFFORT.spent >= end:
                break
            found = max((judged(name, found, base, tau) for found in pool.map(refitted, models)), key=lambda c: c.gain)
            if found.gain > max(known.get(name, 0.0), 0.0):
                best.append(found)
        ended = list(pool.map(carried_on, best))
        ended = list(pool.map(lambda c: carried_on(c) if c.gain >= LEAST_GAIN else c, ended))
    return [c for c in ended if shows(c) and sum(c.fit.model.at_bound(f) for f in c.fit.model.layout() if f.owner == c.name) <= AT_BOUND]


def _reviewed(current: Fit, rounds: list[tuple[Candidate, ...]], traces: Sequence[Trace], tau: float, exclude: Sequence[str],
              jobs: int, end: float = math.inf) -> tuple[Fit, list[tuple[Candidate, ...]]] | None:
    """The model with what a sweep finds in place of the effect found last, and the rounds up to there, if that is better than an effect beside which more than
    noise is left and nothing is found: the first that a screening promises is not always the one that acts.
    """
    k = max((k for k, ranked in enumerate(rounds) if ranked and ranked[0].name in current.model.names), default=None)
    if k is None:
        return None
    without = fit(current.model.without_effect(rounds[k][0].name), traces, tau=tau, steps=20)
    found = _swept(without, (), traces, tau, (*exclude, *current.model.names), jobs, end, _of_one_body)
    best = min(found, key=lambda c: priced(c.fit), default=None)
    if best is None or priced(best.fit) >= priced(current) - TIE:
        return None
    return best.fit, [*rounds[:k], (best, *(c for c in rounds[k] if c.name != best.name))]


def _paired(current: Fit, base: Fit, rounds: list[tuple[Candidate, ...]], traces: Sequence[Trace], tau: float,
            jobs: int) -> tuple[Fit, list[tuple[Candidate, ...]]] | None:
    """The model with two rivals of the first leader in the place of all that is named, and their rounds, if that is better: what leads may do much of what two
    others do together, neither of which does as much alone.
    """
    if not rounds or not rounds[0] or len(current.model.names) < 2 and not _is_doubtful(current, tau) or is_dear(current):
        return None
    leader, *others = rounds[0]
    if leader.name not in current.model.names or is_clocked(leader.name):
        return None
    won = float(score(base.misfit, tau).sum()) - current.cost
    rivals = [c for c in others if c.name in BY_NAME and not (is_clocked(c.name) or BY_NAME[c.name].dear or c.fit.model.plant().coupled)
              and c.gain >= RIVAL * leader.gain]
    pairs = [(a, b) for a, b in combinations(rivals, 2) if a.gain + b.gain >= PAIRED * won and not any({a.name, b.name} <= group for group in EQUIVALENT)]

    def joined(pair):
        a, b = pair
        found = fit(a.fit.model.with_effect(b.name, dict(b.fit.model.effects)[b.name]), traces, tau=tau, steps=20, renewals=4)
        return fit(found.model, traces, tau=tau, steps=20) if found.cost - current.cost < FAR * won else found

    with ThreadPoolExecutor(jobs) as pool:
        ends = list(zip(pool.map(joined, pairs[:MOST_PAIRS]), pairs))
    found, (a, b) = min(ends, key=lambda end: priced(end[0]), default=(current, (leader, leader)))
    if priced(found) >= priced(current) - TIE:
        return None
    return found, [(a, *(c for c in rounds[0] if c is not a)), (judged(b.name, found, a.fit, tau),)]


def _other_way_round(current: Fit, earlier: Sequence[Candidate], ranked: Sequence[Candidate], traces: Sequence[Trace], tau: float,
                     jobs: int) -> list[Candidate]:
    """The candidates with those that come of the last round's rivals, each with the newest effect put into its own fit: a baseline that was bent by one of
    two effects leads away from the other, and not both ways alike.
    """
    newest, names = earlier[0].name, current.model.names
    if newest not in names or BY_NAME[newest].dear or BY_NAME[newest].local:
        return list(ranked)
    p = dict(current.model.effects)[newest]
    rivals = [c for c in earlier[1:] if c.name in BY_NAME and c.name not in names and not BY_NAME[c.name].dear and not BY_NAME[c.name].once
              and c.gain >= REVERSED * earlier[0].gain][:FEWER_REVERSED if is_dear(current) else MOST_REVERSED]

    def begun(c):
        return judged(c.name, fit(c.fit.model.with_effect(newest, p), traces, tau=tau, steps=20, renewals=20), current, tau)

    def finished(c):
        return judged(c.name, fit(c.fit.model, traces, tau=tau, steps=20), current, tau) if c.worth >= best - TIE else c

    with ThreadPoolExecutor(jobs) as pool:
        ends = list(pool.map(begun, rivals))
        best = max((c.worth for c in (*ranked, *ends)), default=0.0)
        ends = list(pool.map(finished, ends))
    return _joined(ranked, ends)


def _taken(current: Fit, rounds: Sequence[tuple[Candidate, ...]]) -> int:
    """Rounds that count: those for what differs between recordings do not, nor, once, one whose effect a later one made needless."""
    effects = len(rounds) - len(current.model.states or {})
    return effects - (effects > len(current.model.names))


def _most_rounds(current: Fit, took: float) -> int:
    """How many rounds there are at most: fewer where the model itself stays wrong, and the last one took away no good part of that."""
    return MOST_ROUNDS if near_noise(current) or took >= GOOD_PART else FEWER_ROUNDS


def _most_mended(current: Fit) -> int:
    """How often the model itself may win on its way back from a candidate."""
    return 0 if bends_and_twists(current) else 1 if is_dear(current) else MOST_MENDED


def _less(candidate: Candidate, traces: Sequence[Trace], tau: float) -> Fit:
    """The model that a candidate extends, refitted from where the candidate stands: the way out of a dent is no gain of an effect's."""
    model = candidate.fit.model
    if candidate.name in BY_NAME:
        return fit(model.without_effect(candidate.name), traces, tau=tau, steps=12)
    return fit(replace(model, states={k: v for k, v in model.states.items() if k != candidate.name} or None), traces, tau=tau, steps=12)


def _asked_for(candidate: Candidate, least: float, least_z: float, outstanding: bool) -> bool:
    """Whether the gain matters and is more than chance: over the blocks, or, of what acts in few of them, since hardly any is worse.

    A knock must gain ONCE, or take away what no fork of stick and slip makes (PEAK): that is enough where little else is left, so that the
    ``least`` gain is no share of it, and where a block is ``outstanding`` among much that is (see screening.py).
    """
    if candidate.name in BY_NAME and BY_NAME[candidate.name].once:
        if candidate.best < math.log(PEAK):
            return candidate.gain >= max(least, ONCE)
        least = min(least, ONCE) if outstanding else least
        return candidate.gain >= (least if least > LEAST_GAIN else NEAR_LEAST * least)
    return candidate.gain >= least and (candidate.z >= least_z or candidate.lost <= LOST * candidate.gain)


def _exchanged(current: Fit, rounds: list[tuple[Candidate, ...]], traces: Sequence[Trace], tau: float, jobs: int) -> Fit:
    """With earlier effects exchanged for rivals of their round that are likelier beside what came later, and the newest where one was; they lead their rounds
    then."""
    def joined(model, name, owner):
        """A model with an effect of another's, as large as it is there."""
        model = model.with_effect(name, dict(owner.effects)[name])
        return replace(model, local={**model.local, name: owner.local[name]}) if BY_NAME[name].local else model

    def beside(candidate):
        """A rival beside the servo that it was fitted with, and what came later."""
        model = candidate.fit.model
        for name in current.model.names:
            model = model if name in (leader, *model.names) else joined(model, name, current.model)
        return model

    def refitted(item):
        found = fit(item[1], traces, tau=tau, steps=4, renewals=1)
        return item[0], found if found.cost - current.cost > MISSED else fit(found.model, traces, tau=tau, steps=12)

    before = current
    for k, ranked in enumerate(rounds):
        if k == len(rounds) - 1 and current is before:
            break
        leader = ranked[0].name
        if leader not in current.model.names:
            continue
        rivals = [c for c in ranked[1:] if c.name in BY_NAME and c.name not in current.model.names and really(c.name, c.fit) != leader
                  and c.gain >= RIVAL * ranked[0].gain][:MOST_RIVALS]
        without = current.model.without_effect(leader)
        begun = [(c.name, joined(without, c.name, c.fit.model)) for c in rivals]
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
            rounds[k] = tuple(sorted(ranked, key=lambda c: c.name != name))
    return current


def _begun_anew(name: str, without: Model) -> list[Model]:
    """A play or a shaft from its own starts beside all that has been found since: the numbers that it took alone may lie in a dent of C, from which the
    descent does not lead out."""
    begun = [without.with_effect(name, start) for start in BY_NAME[name].starts(without.scales)]
    return [model for model in begun if _of_two_bodies(plant := model.plant()) and not plant.bends] if not without.plant().has_motor_side else []


def pruned(current: Fit, newest: str, traces: Sequence[Trace], tau: float) -> Fit:
    """Without the earlier effects that no longer pay; what a few steps along one Jacobian show to be sorely MISSED is not tried to the end."""
    for name in (n for n in current.model.names if n != newest):
        without = fit(current.model.without_effect(name), traces, tau=tau, steps=4, renewals=1)
        if without.cost - current.cost < MISSED:
            without = fit(without.model, traces, tau=tau, steps=12, ceiling=current.misfit)
        if without.cost - current.cost < LEAST_GAIN:
            current = without
    return current
