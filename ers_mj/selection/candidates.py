"""A round of the selection: every promising effect is refitted with the whole baseline, and the likeliest leads.
 A candidate's worth is the decrease of the block cost C (fit.py) after every baseline parameter has been
refitted with it (comparison.py).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from ers_mj.data.prepared import Blocks, Trace
from ers_mj.effects import BY_NAME, EQUIVALENT
from ers_mj.estimation.fit import Fit, columns_of, converged, fit, near_noise, residuals_in, score
from ers_mj.plants.reduced import EFFORT
from ers_mj.selection.comparison import (
    CLOCKED,
    FORKED,
    NEAR_TIE,
    QUIET,
    RIVAL,
    TIE,
    Candidate,
    bends_and_twists,
    is_clocked,
    is_dear,
    is_quiet,
    judged,
    likeliest_first,
    rivals_of,
    shows,
)
from ers_mj.selection.multistart import anew, form_of, more_starts, other_forms, other_waves, wider
from ers_mj.selection.posterior import PARAMETER_PRICE
from ers_mj.selection.screening import PEAK, Begin, attainable, screen
from ers_mj.servo.model import OBSERVER_RATE, STATES, Model

# decrease of C that an effect must buy: one servo in forty without missing physics offers as much
# (evaluation.NULL_GAIN)
LEAST_GAIN = 3.0
BENT = 0.5  # C per block from which a model has been bent by what is missing, even if half the blocks are explained
# Jacobians of their own with which the refits go on each lap, and one where they are finite differences beside an
# effect
RENEWALS = 2
LAPS, LATER_LAPS = 8, 3  # the most laps, in the first round and beside an effect
PACE, PACE_SHARE = (
    0.1,
    0.03,
)  # of the gain that matters and of the best gain so far, which a refit must win in a lap to run another
FINISHED = 3  # of those, how many at most are fitted to the end: those with half the best one's gain
# share of the leader's gain that an overlooked law must show in its first steps to be refitted, and of its promise
# beside what takes long to simulate
SEEN = 0.03
# share of the best first refit's gain from which an effect is refitted from its other starts as well; what cannot be
# scaled is in any case
AGAIN = 0.1
FAILED = 0.05  # share of the best first refit's gain below which a promise was none
# effects of the largest promise: refitted from their other starts whatever the first refit's gain, on Jacobians of
# their own if bent (beside an effect that is not dear all that promise and are not: there a borrowed Jacobian has been
# bent by two)
FOREMOST = 2
TAUT = (
    10.0  # times the observer's rate, at which C has few dents: a refit that begins so finds valleys that others miss
)
HELD, LET_GO = (
    20,
    10,
    # of these refits, how many go on with a Jacobian of their own, and how many of those at the observer's own rate (on 72
    # rounds of
)
# tuning seeds each that mattered was among the first eight)
EXPLAINED = 0.25  # share of C that a leader which explains everything leaves at most
NEAR_LEAST = 0.5  # share of the gain that matters below which the best first refit is not carried on
HALF_STEP = 0.5  # of a coarse converter's, by which an effect moves the reading at least
# of C, from which it is told even if that is less: many thresholds together tell what is much smaller than a step
STEP_GAIN = 30.0
GLANCE, BEHIND = (
    5,
    0.4,
    # steps of a first look at further forms of what leads, and the share of what the effect has won by which one may be
    # behind to be fitted to the end
)
QUICK = 8  # steps of a first refit, on a borrowed Jacobian


def candidates(
    base: Fit,
    traces: Sequence[Trace],
    tau: float,
    jobs: int,
    exclude: Sequence[str],
    anchors: Sequence[Mapping[str, float]] = (),
    least: float = 0.0,
    last: float = math.inf,
) -> list[Candidate]:
    """The promising effects, and what may differ between recordings, each refitted with the whole baseline, best first.

    They race: each is fitted on as long as it wins something, since the valley of a true effect may be long and narrow
    and a mimic's short; from each place on its own where the baseline is bent far from the noise. Where none comes near
    the ``least`` gain that matters they are left at that, and where no explanation could buy LEAST_GAIN none is looked
    for. Once the EFFORT reaches ``last`` all but the best are left at their first refits, or where the last stage
    brought them: beside a bristle that stays wrong a race may take minutes.
    """
    if attainable(base.misfit, Blocks.of(traces).counts, tau) < min(LEAST_GAIN, least) and score(
        base.misfit, tau
    ).max() < math.log(PEAK):
        return []
    with ThreadPoolExecutor(jobs) as pool:
        return _Race(base, traces, tau, exclude, least, last, pool).run(
            [base.model, *(replace(base.model, values={**base.model.values, **values}) for values in anchors)]
        )


Label = tuple[
    str, int
]  # of a refit: the effect (or what differs between recordings), and which of the places it began from


class _Race:
    """The stages of one round, each of which leaves in ``best`` what every label has reached so far.

    The effort that is spent is asked for between stages only, so that the answer does not hang on the number of jobs.
    """

    def __init__(
        self,
        base: Fit,
        traces: Sequence[Trace],
        tau: float,
        exclude: Sequence[str],
        least: float,
        last: float,
        pool: Executor,
    ):
        self.base, self.traces, self.tau, self.exclude, self.least, self.last, self.pool = (
            base,
            traces,
            tau,
            exclude,
            least,
            last,
            pool,
        )
        self.reference = self.total(base)
        self.quiet, self.bent = is_quiet(base, tau), not near_noise(base) or self.reference > BENT * base.misfit.size
        self.starts: dict[Label, list[Begin]] = {}
        self.best: dict[Label, Fit] = {}

    def run(self, places: Sequence[Model]) -> list[Candidate]:
        self.screened = screen(
            places, self.traces, self.tau, self.exclude, self.bent, self.quiet, least=min(LEAST_GAIN, self.least)
        )
        if self.quiet and not self.screened.promising():
            return []
        failed = self._refit_the_promising()
        early = self._refit_from_other_starts(failed)
        self._run_laps({label for label, _, _ in early})
        best = _leaders(self.best, self.total)
        self._refit_the_overlooked(best)
        self._refit_held_taut(best)
        rough = sorted(best.items(), key=lambda item: self.total(item[1]))
        if not rough or self.won(rough[0][1]) < NEAR_LEAST * self.least:
            return sorted(self._judged(rough), key=lambda c: -c.worth)
        return self._told(self._finish(rough, early))

    # -- what a fit is worth, and how it is made -------------------------------------------------------------------

    def total(self, found: Fit) -> float:
        return float(score(found.misfit, self.tau).sum())

    def won(self, found: Fit) -> float:
        return self.reference - self.total(found)

    def priced(self, found: Fit) -> float:
        return self.total(found) + PARAMETER_PRICE * found.size

    def spent(self) -> bool:
        return EFFORT.spent >= self.last

    def most_won(self, ends: Mapping[object, Fit]) -> float:
        return max(map(self.won, ends.values()), default=0.0)

    def fitted(self, items: Iterable[tuple], steps: int, **settings) -> list[tuple]:
        """The pairs (label, what has a model) fitted on, each given up that stands above the base after a stage."""
        return self._mapped(items, lambda _: {"steps": steps, "ceiling": self.base.misfit, **settings})

    def _mapped(self, items: Iterable[tuple], settings: Callable[..., Mapping]) -> list[tuple]:
        return list(
            self.pool.map(
                lambda item: (item[0], fit(item[1].model, self.traces, tau=self.tau, **settings(item[1]))), items
            )
        )

    def finished(self, items: Iterable[tuple]) -> list[tuple]:
        return self.fitted(items, 20)

    def lap(self, items: Iterable[tuple]) -> list[tuple]:
        def settings(found):
            return {
                "steps": 6,
                "ceiling": self.base.misfit,
                "renewals": RENEWALS if found.model.has_tangents or not self.base.model.names else 1,
            }

        return self._mapped(items, settings)

    def refitted(self, starts: Sequence[tuple[Label, Begin]]) -> dict[Label, Fit]:
        """The best of quick fits on a borrowed Jacobian, by label; those with the most parameters are begun first since
        they take longest.
        """
        order = sorted(starts, key=lambda start: -len(start[1].model.layout()))
        ends = self._mapped(
            order, lambda begin: {"steps": QUICK, "ceiling": self.base.misfit, "known": begin.known, "renewals": 0}
        )
        return {label: min((found for other, found in ends if other == label), key=self.total) for label, _ in starts}

    def contending(self, labels: Iterable, ends: Mapping[object, Fit]) -> list:
        """Those labels that may still be the explanation: all while none explains everything, then those with RIVAL of
        the best one's gain.
        """
        most = self.reference - min(map(self.total, ends.values()), default=self.reference)
        return [
            label
            for label in labels
            if self.reference - most > QUIET * self.base.misfit.size or self.won(ends[label]) >= RIVAL * most
        ]

    # -- the stages ------------------------------------------------------------------------------------------------

    def _refit_the_promising(self) -> set[str]:
        """First refits, of further effects as long as a promise was none; the names of those."""
        model = self.base.model
        self.starts = {
            (s, 0): [Begin(model.with_state(s, len(self.traces)), {})]
            for s in STATES
            if len(self.traces) > 1 and s not in (model.states or {})
        }
        self.best = self.refitted([(label, begins[0]) for label, begins in self.starts.items()])
        failed: set[str] = set()
        while new := [name for name in self.screened.promising(failed) if (name, 0) not in self.starts]:
            added = {(name, place): begins for name in new for place, begins in enumerate(self.screened.begins[name])}
            self.starts |= added
            self.best |= self.refitted([(label, begins[0]) for label, begins in added.items()])
            most = max(self.most_won(self.best), 0.0)
            failed = {
                name for name, found in _leaders(self.best, self.total).items() if self.won(found) <= FAILED * most
            }
        return failed

    def _refit_from_other_starts(self, failed: set[str]) -> list[tuple[Label, Begin, Fit]]:
        """What may lead is refitted from its other starts: the foremost to the end and on Jacobians of their own where
        the base is bent, as told (label, begin, fit).
        """
        base, most = self.base, self.most_won(self.best)
        foremost = [name for name in self.screened.promising(failed) if name not in failed][:FOREMOST]
        own = {
            *foremost,
            *(
                name
                for name in self.screened.promising()
                if base.model.names and not is_dear(base) and not BY_NAME[name].dear
            ),
        }  # where bent
        ahead = (
            [label for label in self.starts if label[1] == 0 and label[0] in own]
            if self.bent and not self.spent()
            else []
        )
        begun = [(label, begin) for label in ahead for begin in self.starts[label]]
        early = [
            (label, begin, found) for (label, begin), (_, found) in zip(begun, self.fitted(begun, 20, renewals=20))
        ]
        for label, _, found in early:
            self.best[label] = min(self.best[label], found, key=self.total)
        worth = {
            name
            for name, found in _leaders(self.best, self.total).items()
            if self.bent or self.won(found) >= AGAIN * most
        }
        worth = {
            *self.contending(worth, _leaders(self.best, self.total)),
            *foremost,
            *(name for name in self.screened.promising(failed) if not BY_NAME[name].sized),
        }
        more = self.starts.items() if not self.spent() else ()
        again = self.refitted(
            [
                (label, begin)
                for label, begins in more
                if label[0] in worth and label not in ahead
                for begin in begins[1:]
            ]
        )
        self.best |= {label: min(self.best[label], found, key=self.total) for label, found in again.items()}
        if not self.bent:
            self.best = {(name, 0): found for name, found in _leaders(self.best, self.total).items()}
        return early

    def _run_laps(self, ahead: set[Label]) -> None:
        """All but what ran ahead go on, lap by lap, while they win something."""
        running = self.contending([label for label in self.best if label not in ahead], self.best)
        for _ in range(LATER_LAPS if self.base.model.names else LAPS):
            if self.spent():
                break
            pace = max(PACE * self.least, PACE_SHARE * max(self.most_won(self.best), 0.0))
            ends = dict(self.lap((label, self.best[label]) for label in running))
            running = [
                label
                for label in running
                if self.total(self.best[label]) - self.total(ends[label]) > pace
                and not (label[0] in BY_NAME and BY_NAME[label[0]].dear or bends_and_twists(ends[label]))
            ]
            self.best |= {
                label: found for label, found in ends.items() if self.total(found) < self.total(self.best[label])
            }
            running = self.contending(running, self.best)

    def _refit_the_overlooked(self, best: dict[str, Fit]) -> None:
        leading = self.reference - min(map(self.total, best.values()), default=self.reference)
        glances = self._mapped(
            self._overlooked(best) if not self.spent() else [], lambda _: {"steps": 3, "renewals": 1}
        )
        late = self.lap([(name, found) for name, found in glances if self.won(found) >= SEEN * leading])
        for name, found in self.finished([(name, found) for name, found in late if self.won(found) >= AGAIN * leading]):
            best[name] = min(best.get(name, found), found, key=self.total)

    def _overlooked(self, best: Mapping[str, Fit]) -> list[tuple[str, Begin]]:
        """The cheap laws, with models to refit, that explain less than CLOCKED of what leads with a clock of its own,
        or are one with a law that leads and were not refitted: on a borrowed Jacobian, or seen by its secant, what has
        a threshold (a stop, a limit) does nothing until that is passed. Beside what takes long to simulate, those alone
        that were screened, and promise SEEN of what leads.
        """
        leader, model, screened = (
            min(best, key=lambda name: self.total(best[name]), default=None),
            self.base.model,
            self.screened,
        )
        if leader is None or self.won(best[leader]) < max(self.least, LEAST_GAIN):
            return []
        laws = [
            effect
            for effect in BY_NAME.values()
            if not (is_clocked(effect.name) or effect.dear or effect.name in self.exclude)
            and (
                effect.name not in best
                or is_clocked(leader)
                and self.won(best[effect.name]) < CLOCKED * self.won(best[leader])
            )
            and (is_clocked(leader) or any({leader, effect.name} <= group for group in EQUIVALENT))
        ]
        own = {
            effect.name: [Begin(model.with_effect(effect.name, start), {}) for start in effect.starts(model.scales)]
            for effect in laws
            if not (effect.sized or model.plant().coupled)
        }
        if model.plant().coupled and is_clocked(leader):
            own = {
                effect.name: screened.begins[effect.name][0][:1]
                for effect in laws
                if effect.name in screened.begins
                and screened.promises.get(effect.name, 0.0) >= SEEN * screened.promises.get(leader, math.inf)
            }
        twists = model.plant().has_motor_side  # a play or a shaft, which takes longest, is no knock
        return [
            (name, begin)
            for name in (effect.name for effect in laws)
            for begin in self.starts.get((name, 0), own.get(name, []))
            if begin.model.plant().has_motor_side == twists
        ]

    def _refit_held_taut(self, best: dict[str, Fit]) -> None:
        """Where the leader leaves much, fits under an observer that holds the motion to the reading, which hardly lets
        it stick where the rudder slipped: C has few dents then.
        """
        if not best or not self._leaves_much(min(best.values(), key=self.total)) or is_dear(self.base) or self.spent():
            return
        begun = more_starts(
            self.base.model,
            [name for name in BY_NAME if name not in self.exclude],
            self.screened.promising(),
            self.starts,
        )
        rate = TAUT * OBSERVER_RATE
        known = columns_of(self.base.model, self.traces, rate)
        glances = self._mapped(begun, lambda _: {"rate": rate, "steps": QUICK, "known": known, "renewals": 0})
        taut = self._mapped(_cheapest(glances, HELD), lambda _: {"rate": rate, "steps": QUICK, "renewals": 1})
        for name, found in self.fitted(_cheapest(taut, LET_GO), 6, renewals=1):
            best[name] = min(best.get(name, found), found, key=self.total)

    def _leaves_much(self, found: Fit) -> bool:
        """Whether a fit leaves a good part, and more than forks of stick and slip do, or wins what matters."""
        left = self.total(found)
        return left > EXPLAINED * self.reference and (
            left > FORKED or self.won(found) >= NEAR_LEAST * max(self.least, LEAST_GAIN)
        )

    def _finish(self, rough: Sequence[tuple[str, Fit]], early: Sequence[tuple[Label, Begin, Fit]]) -> list[Candidate]:
        """What leads is fitted to the end, in each of its forms, with what has it as a limit and what waves like it;
        rivals until they have converged.
        """
        gains, over = [self.won(found) for _, found in rough], self.spent()
        close = sum(g >= 0.5 * gains[0] for g in gains[:FINISHED])
        ends = dict(self.finished([item for item in rough[:close] if not (over and bends_and_twists(item[1]))]))
        if over:
            return self._judged({**dict(rough), **ends}.items())
        explained = min(map(self.total, ends.values())) <= QUIET * self.base.misfit.size
        for name, found in self.finished(
            [] if explained or bends_and_twists(self.base) else anew(ends, self.traces, self.tau)
        ):
            ends[name] = min(ends[name], found, key=self.total)
        others = other_forms(ends, {name: begins for (name, place), begins in self.starts.items() if place == 0})
        others = [(name, begin) for name, begin in others if not any(begin is known for _, known, _ in early)]
        known, broader = [(label[0], found) for label, _, found in early if label[0] in ends], wider(ends, self.exclude)
        for name, found in (*known, *self.finished(others)):
            if self.priced(found) < self.priced(ends[name]):
                ends[name] = found
        best = dict(rough)
        for name, found in self._finished_if_near([*broader, *other_waves(ends, self.exclude)], {**best, **ends}):
            kept = ends.get(name, best.get(name))
            if kept is None or self.priced(found) < self.priced(kept) - (
                max(TIE, NEAR_TIE * self.won(kept)) if BY_NAME[name].dear else 0.0
            ):
                ends[name] = found
        ranked = sorted(self._judged({**best, **ends}.items()), key=lambda c: -c.worth)
        rivals = len(rivals_of(ranked))
        if rivals > 1:
            lead, second = ranked[0].fit, ranked[1].fit
            ranked[:rivals] = self.pool.map(
                lambda c: judged(
                    c.name,
                    converged(c.fit, second if c.fit is lead else lead, self.traces, self.tau),
                    self.base,
                    self.tau,
                ),
                ranked[:rivals],
            )
        return ranked

    def _finished_if_near(self, begun: Sequence[tuple[str, Begin]], kept: Mapping[str, Fit]) -> list[tuple[str, Fit]]:
        """Of the starts of each form of an effect the one that a few steps bring furthest, fitted to the end if it is
        not far BEHIND what the effect, or else the leader, has won.
        """
        best: dict[tuple, tuple[str, Fit]] = {}
        for name, found in self.fitted(begun, GLANCE, renewals=GLANCE):
            form = name, form_of(found.model, name)
            best[form] = min(best.get(form, (name, found)), (name, found), key=lambda item: self.total(item[1]))
        most, won = self.most_won(kept), {name: self.won(found) for name, found in kept.items()}
        return self.finished(
            [
                (name, found)
                for name, found in best.values()
                if self.won(found) >= won.get(name, most) - max(BEHIND * won.get(name, most), LEAST_GAIN)
            ]
        )

    def _judged(self, ends: Iterable[tuple[str, Fit]]) -> list[Candidate]:
        return [judged(name, found, self.base, self.tau) for name, found in ends]

    def _told(self, found: Iterable[Candidate]) -> list[Candidate]:
        """Those that the recordings can show, the likeliest first."""
        return likeliest_first(
            sorted((c for c in found if shows(c) and not _is_within_a_step(c, self.traces)), key=lambda c: -c.worth)
        )


def _leaders(ends: Mapping[Label, Fit], total: Callable[[Fit], float]) -> dict[str, Fit]:
    """The best fit by name of those by (name, place)."""
    return {name: min((found for (other, _), found in ends.items() if other == name), key=total) for name, _ in ends}


def _cheapest(found: Sequence[tuple[str, Fit]], most: int) -> list[tuple[str, Fit]]:
    return sorted(found, key=lambda item: item[1].cost)[:most]


def _is_within_a_step(candidate: Candidate, traces: Sequence[Trace]) -> bool:
    """Whether a candidate moves the reading by less than a coarse converter's step, if it acts once, or by less than
    half a step: what is so small is no more than what a model's own error makes of the moments at which thresholds are
    passed, or of where within a step the rudder began, unless it gains STEP_GAIN.

    Of effects of the sensor itself confirmation judges (confirmation.py).
    """
    if (
        candidate.gain >= STEP_GAIN
        or candidate.name not in BY_NAME
        or BY_NAME[candidate.name].subsystem == "sensor"
        or all(trace.converter is None for trace in traces)
    ):
        return False
    share = 1.0 if BY_NAME[candidate.name].once else HALF_STEP
    models = candidate.fit.model, candidate.fit.model.without_effect(candidate.name)
    moved = [
        (np.subtract(*(trace.plain(residuals_in(m, trace, k, OBSERVER_RATE)) for m in models)), trace)
        for k, trace in enumerate(traces)
    ]
    return all(
        trace.converter is not None
        and float(np.max(np.abs(d[: trace.t.size]))) * trace.sigma < share * trace.converter.step
        for d, trace in moved
        if np.any(d)
    )
