"""A round of the selection: every promising effect is refitted with the whole baseline, and the likeliest leads.

    screening -> first refits -> other starts -> laps -> overlooked laws -> finishing

A candidate's worth is the decrease of the block cost C (estimation/objective.py) after every baseline parameter has
been refitted with it (comparison.py).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from ers_mj.decisions import explained
from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import Along
from ers_mj.estimation.objective import Fit
from ers_mj.selection.bench import Bench
from ers_mj.selection.comparison import Candidate, bends_and_twists, is_dear
from ers_mj.selection.finishing import Early, finished, told
from ers_mj.selection.overlooked import refit_held_taut, refit_the_overlooked
from ers_mj.selection.refits import Label, Refits, is_law_of_dear, is_out_of_reach, leaders
from ers_mj.selection.screening import Begin, screen
from ers_mj.servo.model import DRIFTS, Model


def candidates(
    bench: Bench, base: Fit, anchors: Sequence[Mapping[str, float]] = (), least: float = 0.0, last: float = math.inf
) -> list[Candidate]:
    """The promising effects, and what may differ between recordings, each refitted with the whole baseline, best first.

    They race: each is fitted on as long as it wins something, since the valley of a true effect may be long and narrow
    and a confounder's short; from each place on its own where the baseline is bent far from the noise. Where none comes
    near the ``least`` gain that matters they are left at that, and where no explanation could buy enough none is looked
    for. Once so much has been simulated as ``last`` all but the best are left at their first refits, or where the last
    stage brought them: beside a bristle that stays wrong a race may take minutes.
    """
    if is_out_of_reach(bench, base, least):
        return []
    places = [base.model, *(replace(base.model, values={**base.model.values, **values}) for values in anchors)]
    return _Race(bench, base, least, last).run(places)


class _Race(Refits):
    """The stages of one round, each of which leaves in ``best`` what every label has reached so far.

    What has been simulated is asked for between stages only, so that the answer does not hang on the number of jobs.
    """

    def __init__(self, bench: Bench, base: Fit, least: float, last: float):
        super().__init__(bench, base)
        self.least, self.last = least, last
        self.quiet = explained.is_quiet(base.misfit, bench.tau, bench.policy)
        self.bent = explained.is_bent(base.misfit, bench.tau, bench.policy)
        self.starts: dict[Label, list[Begin]] = {}
        self.best: dict[Label, Fit] = {}

    def run(self, places: Sequence[Model]) -> list[Candidate]:
        policy = self.bench.policy
        self.screened = screen(self.bench, places, self.bent, self.quiet, least=min(policy.least_gain, self.least))
        if self.quiet and not self.screened.promising():
            return []
        failed = self._refit_the_promising()
        self._refit_the_lost()
        early = self._refit_from_other_starts(failed)
        self._run_laps({label for label, _, _ in early})
        best = leaders(self.best, self.total)
        for refit_more in (refit_the_overlooked, refit_held_taut):
            if not self.spent():
                refit_more(self, best, self.screened, self.starts, self.least)
        rough = sorted(best.items(), key=lambda item: self.total(item[1]))
        if not rough or self.won(rough[0][1]) < policy.near_least * self.least:
            return sorted(self.judged(rough), key=lambda c: -c.worth)
        return told(self.bench, finished(self, rough, early, self.starts, self.spent()))

    def spent(self) -> bool:
        return self.bench.budget.spent >= self.last

    def _refit_the_promising(self) -> set[str]:
        """First refits, of further effects as long as a promise was none; the names of those."""
        model, records = self.base.model, len(self.bench.traces)
        states = [s for s in DRIFTS if records > 1 and s not in (model.states or {})]
        self.starts = {(s, 0): [Begin(model.with_state(s, records), {})] for s in states}
        self.best = self.quick([(label, begins[0]) for label, begins in self.starts.items()])
        failed: set[str] = set()
        while new := [name for name in self.screened.promising(failed) if (name, 0) not in self.starts]:
            added = {(name, k): list(begins) for name in new for k, begins in enumerate(self.screened.begins[name])}
            self.starts |= added
            self.best |= self.quick([(label, begins[0]) for label, begins in added.items()])
            least = self.bench.search.failed * max(self.most_won(self.best), 0.0)
            failed = {name for name, found in leaders(self.best, self.total).items() if self.won(found) <= least}
        return failed

    def _refit_the_lost(self) -> None:
        """What stands above the base after its first refit, which it has as its limit, has not been fitted: forks of
        stick and slip lie between it and its start, and a borrowed Jacobian does not lead through them. It is fitted
        from all of its starts on Jacobians of its own.
        """
        lost = [
            label
            for label, found in self.best.items()
            if label[0] in BY_NAME and not BY_NAME[label[0]].dear and self.won(found) < 0.0
        ]
        again = self.lap([(label, begin) for label in lost for begin in self.starts[label]])
        for label, found in again:
            self.best[label] = min(self.best[label], found, key=self.total)

    def _refit_from_other_starts(self, failed: set[str]) -> list[Early]:
        """What may lead is refitted from its other starts: where the base is bent the foremost to the end and on
        Jacobians of their own.
        """
        most = self.most_won(self.best)
        foremost = [name for name in self.screened.promising(failed) if name not in failed][
            : self.bench.search.foremost
        ]
        ahead = self._ahead({*foremost, *self._not_dear_beside_an_effect()}) if self.bent and not self.spent() else []
        early = self._run_ahead(ahead)
        worth = self._worth_other_starts(failed, foremost, most)
        more = [] if self.spent() else [label for label in self.starts if label[0] in worth and label not in ahead]
        again = self.quick([(label, begin) for label in more for begin in self.starts[label][1:]])
        self.best |= {label: min(self.best[label], found, key=self.total) for label, found in again.items()}
        if not self.bent:
            self.best = {(name, 0): found for name, found in leaders(self.best, self.total).items()}
        return early

    def _run_ahead(self, labels: Sequence[Label]) -> list[Early]:
        """All starts of these fitted a few steps, and those to the end, on Jacobians of their own, that are not far
        behind the best of their effect.
        """
        begun = [(label, begin) for label in labels for begin in self.starts[label]]
        search = self.bench.search
        first = [found for _, found in self.fitted(begun, search.glance, Along(renewals=search.renewals))]
        most: dict[str, float] = {}
        for ((name, _), _), found in zip(begun, first, strict=True):
            most[name] = max(most.get(name, 0.0), self.won(found))

        def on(item: tuple[Label, Fit]) -> Fit:
            (name, _), found = item
            near = self.won(found) >= (1.0 - search.behind) * most[name]
            return self.on(found, 20, Along(renewals=20)) if near else found

        ends = self.bench.each(on, [(label, found) for (label, _), found in zip(begun, first, strict=True)])
        for (label, _), found in zip(begun, ends, strict=True):
            self.best[label] = min(self.best[label], found, key=self.total)
        return [(label, begin, found) for (label, begin), found in zip(begun, ends, strict=True)]

    def _not_dear_beside_an_effect(self) -> list[str]:
        """All that promise beside an effect and are not dear: a borrowed Jacobian has been bent by two there."""
        if not self.base.model.names or is_dear(self.base):
            return []
        return [name for name in self.screened.promising() if not BY_NAME[name].dear]

    def _ahead(self, names: set[str]) -> list[Label]:
        return [label for label in self.starts if label[1] == 0 and label[0] in names]

    def _worth_other_starts(self, failed: set[str], foremost: Sequence[str], most: float) -> set[str]:
        """The names that are refitted from their other starts: what has won enough of the ``most`` that was won at
        first and may still be the explanation, the foremost, and what cannot be scaled.
        """
        best, least = leaders(self.best, self.total), self.bench.search.again * most
        worth = {name for name, found in best.items() if self.bent or self.won(found) >= least}
        unsized = (name for name in self.screened.promising(failed) if not BY_NAME[name].sized)
        return {*self.contending(worth, best), *foremost, *unsized}

    def _run_laps(self, ahead: set[Label]) -> None:
        """All but what ran ahead go on, lap by lap, while they win something."""
        search = self.bench.search
        running = self.contending([label for label in self.best if label not in ahead], self.best)
        for _ in range(search.later_laps if self.base.model.names else search.laps):
            if self.spent():
                break
            pace = max(search.pace * self.least, search.pace_share * max(self.most_won(self.best), 0.0))
            ends = dict(self.lap((label, self.best[label]) for label in running))
            gains = {label: self.total(self.best[label]) - self.total(found) for label, found in ends.items()}
            running = [
                n for n in running if gains[n] > pace and not (is_law_of_dear(n[0]) or bends_and_twists(ends[n]))
            ]
            self.best |= {label: found for label, found in ends.items() if gains[label] > 0}
            running = self.contending(running, self.best)
