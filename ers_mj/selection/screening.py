"""Which effects promise to explain what a model leaves, before anything is refitted?"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.prepared import BLOCK, Blocks
from ers_mj.decisions.explained import attainable, score
from ers_mj.effects import BY_NAME, Effect
from ers_mj.effects.quantities import Scales
from ers_mj.estimation.objective import Run, run_of
from ers_mj.selection.bench import Bench
from ers_mj.selection.budget import SEARCH, Search
from ers_mj.selection.impulse_search import NEARING, impulses
from ers_mj.selection.latent_force import pushes
from ers_mj.selection.secants import View, by_recordings, first_order, hopeful, of_each_form, promise, view_of
from ers_mj.selection.spectrum import rings_of, waves_of
from ers_mj.servo.model import OBSERVER_RATE, Columns, Model

HOTTEST, LENGTHS = 3, (0.08, 0.25)  # blocks in which an impulse is looked for, and lengths [s] from which it is fitted
BEFORE, AFTER = 0.5, NEARING.tail + 0.25  # [s] around such a block in which an impulse may change something
LEAST_IMPULSE = 3.0  # of C that a recording must leave for an impulse to be looked for: half of what one must buy


@dataclass(frozen=True)
class Begin:
    """Where a refit begins: the model, and the Jacobian's columns at the place that it extends."""

    model: Model
    known: Columns


@dataclass(frozen=True)
class Screened:
    """What the screening found: the share that each effect promises, and its models to refit, for every place those of
    its best starts.
    """

    promises: Mapping[str, float]
    begins: Mapping[str, Sequence[Sequence[Begin]]]
    floor: float
    most: int
    search: Search = SEARCH

    def promising(self, failed: Collection[str] = ()) -> list[str]:
        """The effects that are refitted, the most promising first.

        Neither an impulse's promise, what it gains as it is, is a measure for the others' secants, nor that of an
        effect whose refit ``failed``: where stick and slip fork, a secant may be all chance.
        """
        asked = (name for name in self.promises if name in self.begins)
        best = sorted(asked, key=lambda name: self.promises[name], reverse=True)[: self.most]
        lasting = (self.promises[name] for name in best if not BY_NAME[name].once and name not in failed)
        bar = max(lasting, default=0.0)
        return [name for name in best if self.promises[name] >= max(self.floor, self._share(name) * bar)]

    def _share(self, name: str) -> float:
        return self.search.promising_dear if BY_NAME[name].dear else self.search.promising


def screen(
    bench: Bench, places: Sequence[Model], bent: bool, quiet: bool, tries: int = 0, least: float = 0.0
) -> Screened:
    """The promises of all effects, and the models to refit.

    From each place (the refitted baseline first, and where else a fit may start from) the secant e(with effect) -
    e(without) is taken at the start's visible size, and what the place's own parameters could do as well is projected
    out. An effect's promise is the largest share of the weighted residual that a secant explains. Which effects are
    refitted follows from the first place, or from all of them where it is far from the noise, ``bent`` by what is
    missing; where it is ``quiet`` from those whose share of what is left is worth enough of the ``least`` gain that
    matters. (How far C lies above zero is no such sign: it hangs on the noise, which is an estimate.) The sizes are
    those of ``budget.Search``.

    An impulse is looked for from the first place only, what is dear to simulate is refitted from its most promising
    one, and each effect from as many starts as it declares, or ``tries`` if more.
    """
    screening = _Screening(bench, places[0], bent, tries)
    names = [name for name in BY_NAME if name not in bench.exclude]
    for place in places:
        run = run_of(place, bench.traces, OBSERVER_RATE)
        if not np.all(np.isfinite(run.left)):
            continue
        view, known = view_of(run, bench.traces, bench.tau, bench.search)
        if quiet and not screening.floor:
            screening.floor = 2.0 * bench.search.least_promise * least / view.targets[0].power
        screening.look_from(view, known, names)
        names = screening.worth_asking_again(names)
    return screening.screened


class _Screening:
    """A screening under way."""

    def __init__(self, bench: Bench, first: Model, bent: bool, tries: int):
        search = bench.search
        self.bench, self.first, self.bent, self.tries, self.floor = bench, first, bent, tries, 0.0
        self.most = search.later if first.names else search.most_bent if bent else search.most_sent
        self.promises: dict[str, float] = {}
        self.begins: dict[str, list[list[Begin]]] = {}
        self.foremost: dict[str, list[np.ndarray]] = {}  # of an effect's starts, asked from further places

    @property
    def screened(self) -> Screened:
        return Screened(self.promises, self.begins, self.floor, self.most, self.bench.search)

    def worth_asking_again(self, names: Sequence[str]) -> list[str]:
        """The effects that are asked from further places as well."""
        if not self.bent:
            return self.screened.promising()
        bar = self.bench.search.less * max(self.promises.values(), default=0.0)
        return [name for name in names if self.promises.get(name, 0.0) >= bar]

    def look_from(self, view: View, known: Columns, names: Sequence[str]) -> None:
        """Ask the effects what they promise from one place, the likeliest to first order first, and of what happens
        once last.
        """
        is_first, scales, some = view.place is self.first, view.place.scales, view.foremost
        sparse = some.sparse()
        if is_first and self.bent:
            found = view.run, self.bench.traces
            scales = replace(scales, waves=waves_of(*found), rings=rings_of(*found))
        lasting = [BY_NAME[name] for name in names if not BY_NAME[name].once]
        starts = {effect.name: self._starts(effect, scales) for effect in lasting}
        told = {name: self._told(BY_NAME[name], begun, some, sparse) for name, begun in starts.items()}
        shares = {name: max((share for share, _ in each), default=math.inf) for name, each in told.items()}
        for name in sorted(starts, key=lambda name: -shares[name]):
            if shares[name] < self._likely(is_first) and not view.place.plant().bends:
                self.promises.setdefault(name, shares[name])
                continue
            self._keep(BY_NAME[name], self._found(view, BY_NAME[name], starts[name], told[name]), known, is_first)
        if is_first:
            self._look_for_impulses(view, known, names)

    def _starts(self, effect: Effect, scales: Scales) -> Sequence[np.ndarray]:
        """Where an effect is begun: at a further place from what was foremost at the first."""
        return self.foremost.get(effect.name) or effect.starts(scales)

    def _look_for_impulses(self, view: View, known: Columns, names: Sequence[str]) -> None:
        for effect in (BY_NAME[name] for name in names if BY_NAME[name].once):
            self._keep(effect, self._struck(view, effect), known, True)

    def _told(
        self, effect: Effect, starts: Sequence[np.ndarray], some: View, sparse: View
    ) -> list[tuple[float, float]]:
        """What the first order tells of the starts, of a friction that follows the current at all samples."""
        return first_order(some if effect.follows_current else sparse, effect, starts)

    def _second(self) -> float:
        """The second best promise: the best one's may be a fork."""
        lasting = (promise for other, promise in self.promises.items() if not BY_NAME[other].once)
        return sorted((0.0, 0.0, *lasting))[-2]

    def _likely(self, is_first: bool) -> float:
        """What an effect must promise to first order to be simulated."""
        search = self.bench.search
        share = search.unlikely if is_first else search.less
        return share * max(self.floor, search.promising * self._second())

    def _struck(self, view: View, effect: Effect) -> list[tuple[float, Model]]:
        """What impulses gain, where all that is left around a place is enough for one to be refitted."""
        least = self.bench.search.promising * self._second()
        hot = hot_spans(view.run, self.bench, least)
        pushed = pushes(view.place, self.bench.traces, hot)
        starts = effect.starts(replace(view.place.scales, hot=hot, pushed=pushed))
        return impulses(view.run, effect, starts, view.targets[0].power, self.bench.traces, self.bench.tau, least)

    def _found(
        self, view: View, effect: Effect, starts: Sequence[np.ndarray], told: Sequence[tuple[float, float]]
    ) -> list[tuple[float, Model]]:
        """What the starts promise, with the models as large as they ask for, the best first."""
        tries = max(effect.tries, self.tries)
        if not told:
            starts = by_recordings(view, effect, starts, tries + self.bench.search.beside_tries)
        some = hopeful(effect, starts, told, tries)
        found = [
            (p, k) for k, (start, size) in enumerate(some) if (p := promise(view, effect, start, size)) is not None
        ]
        found.sort(key=lambda item: -item[0][0])
        likely = [starts[k] for k in sorted(range(len(told)), key=lambda k: -told[k][0])]
        likely = likely or [some[k][0] for _, k in found]
        self.foremost.setdefault(effect.name, likely[: self.bench.search.asked_again])
        return [p for p, _ in found]

    def _keep(self, effect: Effect, found: list[tuple[float, Model]], known: Columns, is_first: bool) -> None:
        if not found:
            return
        best, name = max(promise for promise, _ in found), effect.name
        of_forms = of_each_form(found, lambda p: p[1].effects[-1][1])[: max(effect.tries, self.tries)]
        begun = [Begin(model, known) for _, model in of_forms]
        if not effect.dear:
            self.begins.setdefault(name, []).append(begun)
        elif best > self.promises.get(name, 0.0):
            self.begins[name] = [begun]
        if self.bent or is_first:
            self.promises[name] = max(self.promises.get(name, 0.0), best)


def hot_spans(run: Run, bench: Bench, least: float = 0.0) -> tuple[tuple[int, float, float], ...]:
    """Spans (recording, begin [s], length [s]) around the blocks of largest misfit, where something may have struck, in
    recordings that leave enough for it; not where the surroundings leave less than the ``least`` share of C.
    """
    traces, blocks, peak = bench.traces, Blocks.of(bench.traces), math.log(bench.policy.peak)
    record = np.repeat(np.arange(len(traces)), [t.counts.size * (1 + len(t.channels)) for t in traces])
    within = np.concatenate([np.tile(np.arange(t.counts.size), 1 + len(t.channels)) for t in traces])
    misfit = blocks.misfit(run.left)
    left = score(misfit, bench.tau)

    def may_hold_one(k: int) -> bool:
        mine = misfit[record == k]
        enough = attainable(mine, blocks.counts[record == k], bench.tau) >= LEAST_IMPULSE
        return enough or left[record == k].max() >= peak

    def leaves_enough(b: int) -> bool:
        after = (within - within[b]) * BLOCK
        around = (record == record[b]) & (after >= -BEFORE) & (after <= AFTER)
        return float(left[around].sum()) >= least * float(left.sum())

    able = [k for k in range(len(traces)) if may_hold_one(k)]
    order = np.argsort(-left, kind="stable")
    worst = [b for b in order[:HOTTEST] if record[b] in able and leaves_enough(b)]
    return tuple(
        (int(record[b]), float(traces[record[b]].t[0] + within[b] * BLOCK), length) for b in worst for length in LENGTHS
    )
