"""Which effects does the data ask for? A round at a time (candidates.py), as long as the winner buys more than chance offers;
what is named is looked at again (moves.py).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.prepared import Blocks, Trace
from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import Fit, fit, hopped, is_rough, near_noise, residuals_in, score, tau_of
from ers_mj.estimation.initial_state import with_starts
from ers_mj.plants.reduced import EFFORT, ReducedModel
from ers_mj.selection import moves as reviews
from ers_mj.selection.candidates import LEAST_GAIN, NEAR_LEAST, candidates
from ers_mj.selection.comparison import (
    LEAST_Z,
    RIVAL,
    TIE,
    Candidate,
    bends_and_twists,
    is_clocked,
    is_dear,
    is_quiet,
    judged,
    likeliest_first,
    priced,
    really,
    stands_alone,
)
from ers_mj.selection.screening import PEAK, attainable, stands_out
from ers_mj.selection.whiteness import left_by_sensor, more_is_missing
from ers_mj.servo.model import OBSERVER_RATE, Model

LATER_GAIN = 4.0  # and beside an effect, whose law is hardly ever exactly the one that acts
FAINT_GAIN = 1.5  # there too, where it stands alone (see ranking.stands_alone)
STEADY_GAIN, STEADY_Z = (
    3.0,
    3.0,
    # or where a law buys this in so many blocks that its z-score is as high: of 294 servos of tuning seeds one offers that,
    # and rightly
)
LEAST_SHARE, THIRD_SHARE = (
    0.1,
    1 / 6,
    # and the share of what is left to explain, and that of a third effect: of 59 sets of several and three later seeds,
    # three took less, none of them true
)
LATER_Z = 2.0  # and beside an effect
# noise levels of what a model leaves of a coarse converter's readings, rounding being noise, from which it is wrong
PLAIN = 1.3
# share of the gain that the blocks which lose may lose, where it falls in so few blocks that their z-score cannot be
# large
LOST = 0.2
AMPLE, LOST_OF_AMPLE = (
    2.0,
    0.3,
    # times the gain that matters from which it may be more: of 275 servos without missing physics one offers a lasting law
    # as much, and its z-score asks for that as well
)
ONCE = 6.0  # of C that an effect which acts once must buy, or screening.PEAK
# of C by which a knock beside an effect must be ahead of a law that is asked for too: it chooses its moment where that
# law is missed most
ANYWHERE = 3.0
MOST_ROUNDS, FEWER_ROUNDS = (
    3,
    2,
    # effects at most, and where the model itself stays wrong (see identification.ROUGH), one that takes a GOOD_PART aside
)
MOST_EFFORT, LAST_RACED, LAST_BEGUN, LONGEST = (
    60_000_000,
    50_000_000,
    140_000_000,
    220_000_000,
)  # [us] of simulation (plants.reduced.Effort) after which nothing is looked
# for that does not show by itself, a round beside a bristle is left at its first refits, none is begun, and none where
# effects without a bristle leave more than forks do; more by as much as the recordings last longer than a MINUTE
# together
MINUTE = 60.0  # [s]
GOOD_PART = 0.35  # share of C that a third effect must take away where the model stays wrong, if the second did not
OUTWEIGHED = 0.2  # share of a later law's gain below which that of what has its own clock was found in a bent model
MOST_PARTED = 2  # rivals of a lone effect of two bodies beside which a round is run
MODEST, DENT, MOST_MENDED = (
    30.0,
    1.0,
    2,
)  # gain of C up to which, and how much of it, the model itself may win on its way back; how often (see _most_mended)


@dataclass(frozen=True)
class Selection:
    """The chosen model, the baseline it grew from, each round's candidates, the tau at which the last was judged, and
    the traces with the starts that the chosen model gives them."""

    base: Fit
    chosen: Fit
    rounds: tuple[tuple[Candidate, ...], ...]
    tau: float
    traces: Sequence[Trace]


def select(
    base: Fit,
    traces: Sequence[Trace],
    *,
    anchors: Sequence[Mapping[str, float]] = (),
    exclude: Sequence[str] = (),
    jobs: int = 1,
    progress: Callable[[str, float], None] = lambda text, share: None,
) -> Selection:
    """Grow the model while the data asks for it, dropping what later additions make needless.

    What takes longest, the sweeps, what is begun once more the other way round, and a shaft or a play beside a bristle,
    is left out after MOST_EFFORT, and no round begins after LAST_BEGUN; where effects without a bristle leave more than
    forks of stick and slip do, one for what takes a good part of that may until LONGEST. One beside a bristle that is
    under way at LAST_RACED goes little further than its first refits.
    """
    longer = max(1.0, sum(float(trace.t[-1] - trace.t[0]) for trace in traces) / MINUTE)
    end, raced, last, longest = (
        EFFORT.spent + longer * effort for effort in (MOST_EFFORT, LAST_RACED, LAST_BEGUN, LONGEST)
    )
    current, rounds, mended, swept, reviewed, paired, parted, took = base, [], 0, False, False, False, False, 0.0
    tau = tau_of(base.misfit)
    while EFFORT.spent < (longest if not is_dear(current) and reviews.leaves_more_than_forks(current, tau) else last):
        if (taken := _taken(current, rounds)) >= MOST_ROUNDS:
            other = None if paired else reviews.paired(current, rounds, traces, tau, jobs)
            if other is None:
                break
            (current, rounds), paired = other, True
            continue
        progress(f"round {len(rounds) + 1}: comparing effects", 0.15 + 0.12 * len(rounds))
        in_order = EFFORT.spent < last and (taken < FEWER_ROUNDS or near_noise(current) or took >= GOOD_PART)
        least, faint = _gains_that_matter(current, tau, in_order)
        unsought = (
            *exclude,
            *current.model.names,
            *(_bending_and_twisting(current.model) if EFFORT.spent >= end else ()),
        )
        ranked = candidates(
            current,
            traces,
            tau,
            jobs,
            unsought,
            anchors if not rounds else (),
            faint,
            raced if is_dear(current) else math.inf,
        )
        leader, may_mend = ranked[0] if ranked else None, mended < _most_mended(current)
        if may_mend and (again := _way_back(ranked, current, traces, tau, faint)) is not None:
            won = float(score(current.misfit, tau).sum() - score(again.misfit, tau).sum())
            base, current, mended = base if current.model.names else again, again, mended + 1
            if leader.gain - won < faint or any(c.worth >= leader.worth - won for c in ranked[1:]):
                continue
            ranked, may_mend = [judged(c.name, c.fit, current, tau) for c in ranked], False
            leader = ranked[0]
        least_z = LATER_Z if current.model.names else LEAST_Z
        outstanding = stands_out(current.misfit, tau)
        rough = (
            not swept
            and EFFORT.spent < end
            and _is_rough_and_wrong(current, traces)
            and not (ranked and is_quiet(ranked[0].fit, tau))
        )
        nothing = not (ranked and _asked_for(ranked[0], least, least_z, outstanding))
        if rough or nothing and EFFORT.spent < end and _is_cheap_and_wrong(current, base, traces):
            kinds = (
                reviews.of_one_body if swept else reviews.any_body
            )  # the second body, which takes most of the time, once a case
            ranked, swept = (
                reviews.joined(
                    ranked,
                    reviews.swept(
                        current, ranked, traces, tau, (*exclude, *current.model.names), jobs, end, kinds, rough
                    ),
                ),
                True,
            )
        elif ranked and EFFORT.spent < end and _may_twist(current) and not ranked[0].fit.model.plant().has_motor_side:
            ranked = reviews.joined(
                ranked,
                reviews.swept(
                    current, ranked, traces, tau, (*exclude, *current.model.names), jobs, end, reviews.of_two_bodies
                ),
            )
        elif (
            nothing and reviews.is_doubtful(current, tau) or _knocks_beside(current, ranked)
        ):  # what has a threshold no secant shows
            ranked = reviews.joined(
                ranked,
                reviews.swept(
                    current,
                    ranked,
                    traces,
                    tau,
                    (*exclude, *current.model.names, *reviews.SIZED),
                    jobs,
                    longest,
                    reviews.of_one_body,
                ),
            )
        if (
            may_mend
            and ranked
            and ranked[0] is not leader
            and (again := _way_back(ranked, current, traces, tau, faint)) is not None
        ):
            base, current, mended = base if current.model.names else again, again, mended + 1
            continue
        if (
            rounds
            and ranked
            and EFFORT.spent < end
            and attainable(current.misfit, Blocks.of(traces).counts, tau) >= least
        ):
            ranked = reviews.other_way_round(current, rounds[-1], ranked, traces, tau, jobs)
        asked = _asked(ranked, current, (least, faint), least_z, outstanding)
        rounds.append(tuple(sorted(ranked, key=lambda c: c is not asked)))
        if asked is None:
            other = (
                None
                if reviewed or EFFORT.spent >= end or not reviews.is_doubtful(current, tau)
                else reviews.reviewed(current, rounds, traces, tau, exclude, jobs, end)
            )
            if other is None and not paired:
                other, paired = reviews.paired(current, rounds, traces, tau, jobs), True
            if other is None and not parted and EFFORT.spent < last and reviews.leaves_more_than_forks(current, tau):
                other, parted = _beside_a_rival(current, rounds, traces, tau, exclude, jobs), True
            if other is None:
                break
            (current, rounds), reviewed = other, True
            continue
        ranked = rounds[-1]
        took = ranked[0].gain / max(ranked[0].gain, float(score(current.misfit, tau).sum()))
        before, judged_at = current, tau
        current = reviews.pruned(ranked[0].fit, ranked[0].name, traces, tau)
        current, rounds = _reconsidered(current, rounds, traces, tau)
        tau = tau_of(current.misfit)
        traces = _restarted(current.model, traces)
        current = fit(current.model, traces, tau=tau, steps=20)
        if (other := _in_its_place(current, before, rounds[-1], judged_at)) is not None:
            rounds[-1] = other
            current = fit(other[0].fit.model, traces, tau=tau, steps=20)
        if not is_dear(current):
            current, _ = hopped(current, traces, tau, jobs)
        if float(score(current.misfit, tau).sum()) > LATER_GAIN:
            current = reviews.widened(current, ranked[0].name, traces, tau, jobs)
        if near_noise(current):
            current = reviews.exchanged(current, rounds, traces, tau, jobs)
    return Selection(base, current, tuple(rounds), tau, traces)


def _beside_a_rival(
    current: Fit,
    rounds: Sequence[tuple[Candidate, ...]],
    traces: Sequence[Trace],
    tau: float,
    exclude: Sequence[str],
    jobs: int,
) -> tuple[Fit, list[tuple[Candidate, ...]]] | None:
    """A rival of one body in the place of a lone play, shaft or bristle beside which nothing is found, with what a
    round finds beside it, and their rounds, if that is
    better: a second body does a part of much, and what acts with the rival need not show alone.
    """
    if (
        not current.model.plant().coupled
        or len(current.model.names) != 1
        or rounds[0][0].name not in current.model.names
    ):
        return None
    leader, *others = rounds[0]
    rivals = [
        c
        for c in others
        if c.name in BY_NAME
        and not (is_dear(c.fit) or BY_NAME[c.name].once or c.fit.model.plant().coupled)
        and c.gain >= RIVAL * leader.gain
    ]
    ends = [
        (rival, ranked)
        for rival in rivals[:MOST_PARTED]
        if (ranked := candidates(rival.fit, traces, tau, jobs, (*exclude, rival.name, *_coupled(rival.fit.model))))
    ]
    if not ends:
        return None
    rival, ranked = min(ends, key=lambda end: priced(end[1][0].fit))
    if priced(ranked[0].fit) >= priced(current) - TIE:
        return None
    return ranked[0].fit, [(rival, *(c for c in rounds[0] if c is not rival)), tuple(ranked)]


def _gains_that_matter(current: Fit, tau: float, in_order: bool) -> tuple[float, float]:
    """What an effect must buy beside this model, and what one that stands alone must; a good part of all that is left
    where this is not ``in_order``.
    """
    usual_share = THIRD_SHARE if len(current.model.names) >= FEWER_ROUNDS else LEAST_SHARE
    share = (usual_share if in_order else GOOD_PART) * float(score(current.misfit, tau).sum())
    usual = LATER_GAIN if current.model.names else LEAST_GAIN
    return max(usual, share), max(FAINT_GAIN if current.model.names and not is_dear(current) else usual, share)


def _restarted(model: Model, traces: Sequence[Trace]) -> Sequence[Trace]:
    """The traces with new starts where converters are coarse: within a step a model tells where the rudder began, and a
    wrong one tells it wrongly.
    """
    return with_starts(model, traces) if is_rough(traces) else traces


def _reconsidered(
    current: Fit, rounds: list[tuple[Candidate, ...]], traces: Sequence[Trace], tau: float
) -> tuple[Fit, list[tuple[Candidate, ...]]]:
    """Without earlier effects with a clock of their own that the newest, a law of the servo, outweighs by far: they
    were found in what it had bent, and a round beside it finds again what is there.
    """
    newest = rounds[-1][0]
    early = [
        ranked[0].name
        for ranked in rounds[:-1]
        if ranked[0].name in BY_NAME
        and ranked[0].name in current.model.names
        and is_clocked(ranked[0].name)
        and ranked[0].gain < OUTWEIGHED * newest.gain
    ]
    if not early or is_clocked(newest.name):
        return current, rounds
    model = current.model
    for name in early:
        model = model.without_effect(name)
    return fit(model, traces, tau=tau, steps=20), [ranked for ranked in rounds if ranked[0].name not in early]


def _in_its_place(current: Fit, before: Fit, ranked: tuple[Candidate, ...], tau: float) -> tuple[Candidate, ...] | None:
    """The candidates of a round that added its leader to the model ``before``, with a rival first where the refit has
    made of the leader a form of another effect (see Effect.really); None where it is still itself, or still the
    likeliest.
    """
    name = ranked[0].name
    if name not in current.model.names or really(name, current) == name:
        return None
    others = likeliest_first(sorted((judged(name, current, before, tau), *ranked[1:]), key=lambda c: -c.worth))
    return None if others[0].name == name else tuple(others)


def _is_cheap_and_wrong(current: Fit, base: Fit, traces: Sequence[Trace]) -> bool:
    """Whether a model of one body, which is simulated fast, leaves more than noise (see whiteness.py)."""
    without = left_by_sensor(base.model, traces) if current.model.names else None
    return not current.model.plant().coupled and more_is_missing(left_by_sensor(current.model, traces), without)


def _is_rough_and_wrong(current: Fit, traces: Sequence[Trace]) -> bool:
    """Whether a model of one body is further from the readings of a coarse converter than their noise is (PLAIN):
    behind one, C is so rough that a screening promises nothing of what acts, and what is left has lost its memory (see
    whiteness.py).
    """
    if current.model.plant().coupled or not is_rough(traces):
        return False
    parts = [
        trace.plain(residuals_in(current.model, trace, k, OBSERVER_RATE)[: trace.t.size])[trace.valid]
        for k, trace in enumerate(traces)
    ]
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) > PLAIN


def _bending_and_twisting(model: Model) -> list[str]:
    """The effects that make a plant whose friction bends a bristle and whose shaft twists, which the model's has only
    one of.
    """
    return [name for name, plant in _plants_beside(model) if plant.bends and plant.has_motor_side]


def _coupled(model: Model) -> list[str]:
    """The effects that make a plant of more than one body, which takes long to simulate."""
    return [name for name, plant in _plants_beside(model) if plant.coupled]


def _plants_beside(model: Model) -> list[tuple[str, ReducedModel]]:
    """The plants that a model's becomes with what may give it more than one body."""
    starts = (
        (name, effect.starts(model.scales)[:1])
        for name, effect in BY_NAME.items()
        if effect.subsystem == "transmission" or effect.dear
    )
    return [
        (name, model.with_effect(name, start).plant())
        for name, some in starts
        if name not in model.names
        for start in some
    ]


def _knocks_beside(current: Fit, ranked: Sequence[Candidate]) -> bool:
    """Whether a knock leads beside effects of one body: in the blocks where a law is missed most it may do what that
    would do in all.
    """
    return (
        bool(ranked and current.model.names and ranked[0].name in BY_NAME and BY_NAME[ranked[0].name].once)
        and not current.model.plant().coupled
    )


def _may_twist(current: Fit) -> bool:
    """Whether a rudder whose friction bends a bristle is explained so badly that a play or a shaft may be there, which
    beside it no secant shows.
    """
    return current.model.plant().bends and not bends_and_twists(current) and not near_noise(current)


def _taken(current: Fit, rounds: Sequence[tuple[Candidate, ...]]) -> int:
    """Rounds that count: those for what differs between recordings do not, nor, once, one whose effect a later one made
    needless.
    """
    effects = len(rounds) - len(current.model.states or {})
    return effects - (effects > len(current.model.names))


def _most_mended(current: Fit) -> int:
    """How often the model itself may win on its way back from a candidate."""
    return 0 if bends_and_twists(current) else 1 if is_dear(current) else MOST_MENDED


def _way_back(
    ranked: Sequence[Candidate], current: Fit, traces: Sequence[Trace], tau: float, faint: float
) -> Fit | None:
    """The model itself, refitted from where a leader of MODEST gain stands, if that wins more than a DENT: the way out
    of one is no gain of an effect's.
    """
    if not ranked or not faint <= ranked[0].gain <= MODEST:
        return None
    model, name = ranked[0].fit.model, ranked[0].name
    without = (
        model.without_effect(name)
        if name in BY_NAME
        else replace(model, states={k: v for k, v in model.states.items() if k != name} or None)
    )
    again = fit(without, traces, tau=tau, steps=12)
    return again if float(score(current.misfit, tau).sum() - score(again.misfit, tau).sum()) > DENT else None


def _asked(
    ranked: Sequence[Candidate], current: Fit, gains: tuple[float, float], least_z: float, outstanding: bool
) -> Candidate | None:
    """What is named in this round: the first that is asked for at the ``gains`` that matter, and that one alone which
    leads where nothing is named yet.

    A knock shows that something is missing; where the law that leads explains more of it by a TIE, that is named, and
    beside an effect a law that is asked for as well and explains not much less (ANYWHERE).
    """
    least, faint = gains
    asked = [
        c
        for c in ranked
        if (c is ranked[0] or current.model.names and c.name in BY_NAME)
        and _asked_for(
            c, faint if c.gain < least and (stands_alone(c, ranked) or _is_steady(c)) else least, least_z, outstanding
        )
    ]
    if not asked or asked[0].name not in BY_NAME or not BY_NAME[asked[0].name].once:
        return asked[0] if asked else None
    knock, leader = asked[0], ranked[0]
    if leader is not knock and leader.name in BY_NAME and leader.worth > knock.worth + TIE:
        return leader
    return next((c for c in asked[1:] if not BY_NAME[c.name].once and c.worth > knock.worth - ANYWHERE), knock)


def _is_steady(candidate: Candidate) -> bool:
    """Whether a law of the servo buys little, but nearly everywhere."""
    return not is_clocked(candidate.name) and candidate.gain >= STEADY_GAIN and candidate.z >= STEADY_Z


def _asked_for(candidate: Candidate, least: float, least_z: float, outstanding: bool) -> bool:
    """Whether the gain matters and is more than chance: over the blocks, or, of what acts in few of them, since hardly
    any is worse.

    A knock must gain ONCE, or take away what no fork of stick and slip makes (PEAK): that is enough where little else
    is left, so that the ``least`` gain is no share of it, and where a block is ``outstanding`` among much that is (see
    screening.py).
    """
    if candidate.name in BY_NAME and BY_NAME[candidate.name].once:
        if candidate.best < math.log(PEAK):
            return candidate.gain >= max(least, ONCE)
        least = min(least, ONCE) if outstanding else least
        return candidate.gain >= (least if least > LEAST_GAIN else NEAR_LEAST * least)
    lost = LOST_OF_AMPLE if candidate.gain >= AMPLE * least else LOST
    return candidate.gain >= least and (candidate.z >= least_z or candidate.lost <= lost * candidate.gain)
