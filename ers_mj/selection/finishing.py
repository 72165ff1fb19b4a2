"""What leads a round is fitted to the end, in each of its forms, beside its limits and its like; then it is told."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ers_mj.data.prepared import Trace
from ers_mj.decisions.thresholds import Policy
from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import Along, converged
from ers_mj.estimation.objective import Fit, residuals_in
from ers_mj.selection.bench import Bench
from ers_mj.selection.comparison import Candidate, bends_and_twists, likeliest_first, rivals_of, shows
from ers_mj.selection.multistart import anew, form_of, other_forms, other_waves, wider
from ers_mj.selection.refits import Label, Named, Refits
from ers_mj.selection.screening import Begin
from ers_mj.servo.model import OBSERVER_RATE
from ers_mj.solvers.successive_halving import Stage, halved

Early = tuple[Label, Begin, Fit]  # of a refit that ran ahead: its label, where it began, where it ended


def finished(
    refits: Refits, rough: Sequence[Named], early: Sequence[Early], starts: Mapping[Label, Sequence[Begin]], spent: bool
) -> list[Candidate]:
    """What leads the ``rough`` order is fitted to the end, in each of its forms, with what has it as a limit and what
    waves like it; rivals until they have converged. No more than the first of that where the budget is ``spent``.
    """
    gains = [refits.won(found) for _, found in rough]
    close = sum(g >= 0.5 * gains[0] for g in gains[: refits.bench.search.finished])
    ends = dict(refits.finished([item for item in rough[:close] if not (spent and bends_and_twists(item[1]))]))
    if spent:
        return refits.judged({**dict(rough), **ends}.items())
    broader = _in_its_forms(refits, ends, early, starts)
    best = dict(rough)
    _wider(refits, ends, best, broader)
    ranked = sorted(refits.judged({**best, **ends}.items()), key=lambda c: -c.worth)
    return _to_the_floor(refits, ranked)


def _in_its_forms(
    refits: Refits, ends: dict[str, Fit], early: Sequence[Early], starts: Mapping[Label, Sequence[Begin]]
) -> list[tuple[str, Begin]]:
    """Take into ``ends`` what further starts and other forms of the same effects find; the starts of what has these as
    its limit.
    """
    if not (refits.explains_all(min(map(refits.total, ends.values()))) or bends_and_twists(refits.base)):
        for name, found in refits.finished(anew(refits.bench, ends)):
            ends[name] = min(ends[name], found, key=refits.total)
    others = other_forms(ends, {name: begins for (name, place), begins in starts.items() if place == 0})
    others = [(name, begin) for name, begin in others if not any(begin is its for _, its, _ in early)]
    known, broader = (
        [(label[0], found) for label, _, found in early if label[0] in ends],
        wider(ends, refits.bench.exclude),
    )
    for name, found in (*known, *refits.finished(others)):
        if refits.priced(found) < refits.priced(ends[name]):
            ends[name] = found
    return broader


def _wider(refits: Refits, ends: dict[str, Fit], best: Mapping[str, Fit], broader: Sequence[tuple[str, Begin]]) -> None:
    """Take into ``ends`` what is ``broader`` than they, or waves as they do; what is dear to simulate only beyond a
    tie.
    """
    policy = refits.bench.policy
    begun = [*broader, *other_waves(ends, refits.bench.exclude)]
    for name, found in finished_if_near(refits, begun, {**best, **ends}):
        kept = ends.get(name, best.get(name))
        if kept is not None:
            tie = max(policy.tie, policy.near_tie * refits.won(kept)) if BY_NAME[name].dear else 0.0
        if kept is None or refits.priced(found) < refits.priced(kept) - tie:
            ends[name] = found


def finished_if_near(refits: Refits, begun: Sequence[tuple[str, Begin]], kept: Mapping[str, Fit]) -> list[Named]:
    """Of the starts of each form of an effect the one that a few steps bring furthest, fitted to the end if it is not
    far behind what the effect, or else the leader, has won.
    """
    search, least = refits.bench.search, refits.bench.policy.least_gain
    most, won = refits.most_won(kept), {name: refits.won(found) for name, found in kept.items()}

    def best_forms(ended: Sequence[Named]) -> list[Named]:
        best: dict[tuple, Named] = {}
        for name, found in ended:
            form = name, form_of(found.model, name)
            best[form] = min(best.get(form, (name, found)), (name, found), key=lambda item: refits.total(item[1]))
        goals = {name: won.get(name, most) for name, _ in best.values()}
        return [
            (name, found)
            for name, found in best.values()
            if refits.won(found) >= goals[name] - max(search.behind * goals[name], least)
        ]

    stages = [
        Stage(lambda item: (item[0], refits.on(item[1], search.glance, Along(renewals=search.glance))), best_forms),
        Stage(lambda item: (item[0], refits.on(item[1], 20))),
    ]
    return halved(begun, stages, refits.bench.each)


def _to_the_floor(refits: Refits, ranked: list[Candidate]) -> list[Candidate]:
    """The candidates, rivals among them fitted until they have converged."""
    rivals = rivals_of(ranked, refits.bench.policy)
    if rivals > 1:
        bench, lead, second = refits.bench, ranked[0].fit, ranked[1].fit

        def to_the_floor(c: Candidate) -> Candidate:
            found = converged(c.fit, second if c.fit is lead else lead, bench.traces, bench.tau)
            return bench.judged(c.name, found, refits.base)

        ranked[:rivals] = bench.each(to_the_floor, ranked[:rivals])
    return ranked


def told(bench: Bench, found: Sequence[Candidate]) -> list[Candidate]:
    """Those that the recordings can show, the likeliest first."""
    shown = (c for c in found if shows(c) and not is_within_a_step(c, bench.traces, bench.policy))
    return likeliest_first(sorted(shown, key=lambda c: -c.worth), bench.policy)


def is_within_a_step(candidate: Candidate, traces: Sequence[Trace], policy: Policy) -> bool:
    """Whether a candidate moves the reading by less than a coarse converter's step, if it acts once, or by less than
    half a step: what is so small is no more than what a model's own error makes of the moments at which thresholds are
    passed, or of where within a step the rudder began, unless it gains much.

    Of effects of the sensor itself confirmation judges (confirmation.py).
    """
    if candidate.gain >= policy.step_gain or candidate.name not in BY_NAME:
        return False
    effect, model = BY_NAME[candidate.name], candidate.fit.model
    if effect.subsystem == "sensor" or all(trace.converter is None for trace in traces):
        return False
    models, share = (model, model.without_effect(effect.name)), 1.0 if effect.once else policy.half_step
    for k, trace in enumerate(traces):
        with_it, without = (trace.plain(residuals_in(m, trace, k, OBSERVER_RATE)) for m in models)
        moved = with_it - without
        if np.any(moved):
            furthest = float(np.max(np.abs(moved[: trace.t.size]))) * trace.sigma
            if trace.converter is None or furthest >= share * trace.converter.step:
                return False
    return True
