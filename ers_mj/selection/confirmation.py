"""Which of the selected effects does held-out data confirm?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from ers_mj.data.beginnings import START
from ers_mj.data.prepared import Trace
from ers_mj.decisions import confirmation as decisions
from ers_mj.decisions.explained import cost, score
from ers_mj.decisions.thresholds import POLICY, Policy
from ers_mj.effects import BY_NAME
from ers_mj.estimation.baseline import Start
from ers_mj.estimation.fit import fit, polished
from ers_mj.estimation.intervals import at_given, half_widths, told_spreads, widths_of
from ers_mj.estimation.objective import Fit, residuals_in
from ers_mj.selection.comparison import stands_alone
from ers_mj.selection.cross_validation import Fold, Score, folds, halves, pooled, recalibrated, refits, scored
from ers_mj.selection.measure import FREE_RUN, Measure, measure_of
from ers_mj.selection.moves import Move
from ers_mj.selection.stepwise import Selection
from ers_mj.servo.model import OBSERVER_RATE, Model

STEPS = 15  # of a refit without an effect


@dataclass(frozen=True)
class Confirmed:
    """What held-out data says: scores before and after, without each effect, and the p-value of each effect.

    ``base`` is the best refit without the named effects. ``shown`` are the scores before and after with the noise of
    what was held out, by halves where an effect was judged so; ``measure`` is how all of them are taken. ``widths``
    are the 95 % half-widths of the answer's numbers.
    """

    base: Fit
    before: list[Score]
    after: list[Score]
    without: dict[str, Score]
    p: dict[str, float]
    models: list[Model]
    base_models: list[Model]
    parts: list[Fold]
    sentence: str
    shown: list[tuple[Score, Score, float]]
    widths: np.ndarray
    measure: Measure = FREE_RUN


@dataclass
class Judged:
    """One effect on held-out data: the model ``less`` it, that of each part, the scores with and without it, by halves
    of a ``record`` where that one teaches most of it, and its p-value.
    """

    less: Model
    lesser_models: list[Model]
    without: Score
    pair: tuple[Sequence[Score], Sequence[Score]]
    p: float
    record: int | None = None


def confirmed(
    start: Start, selection: Selection, held: list[Trace], jobs: int, policy: Policy = POLICY
) -> tuple[Selection, Confirmed]:
    """Judge each effect on held-out data; those that do not improve it beyond chance are taken out again."""
    court = Court(start, selection, held, jobs, policy)
    while True:
        model = selection.chosen.model
        after_models = court.refits(model)
        after = court.scores(after_models)
        judged = {name: court.judged(name, model, after) for name in model.names}
        against = {name: court.against(name, one, model, after_models, after) for name, one in judged.items()}
        failed = [name for name, because in against.items() if because]
        if not failed:
            return selection, court.told(model, after_models, after, judged)
        worst = max(failed, key=lambda n: judged[n].p)
        kept = court.without(worst, model)
        if not (kept.model.names or kept.model.states):
            kept = court.bare(model)
            court.start = replace(start, fit=kept)
        because = f"{against[worst]} (p {judged[worst].p:.2g})"
        move = Move("drop", model.names, kept.model.names, selection.chosen.cost - kept.cost, True, because)
        selection = replace(selection, chosen=kept, trail=(*selection.trail, move))


@dataclass
class Court:
    """What effects are judged by: the baseline and its refits, what is held out, and what stood alone in its round."""

    start: Start
    selection: Selection
    held: list[Trace]
    jobs: int
    policy: Policy
    parts: list[Fold] = field(init=False)
    sentence: str = field(init=False)
    _bases: dict[tuple[str, ...], tuple[Fit, list[Model]]] = field(init=False, default_factory=dict)
    _wide: tuple[Model, np.ndarray, np.ndarray] | None = field(init=False, default=None)

    def __post_init__(self):
        self.parts, self.sentence = folds(self.start.traces, self.held)
        self.tau, rounds = self.selection.tau, self.selection.rounds
        self.measure = measure_of(self.selection.chosen.model, self.start.traces)
        self.alone = {ranked[0].name for ranked in rounds if ranked and stands_alone(ranked[0], ranked, self.policy)}

    def scores(self, models: Sequence[Model]) -> list[Score]:
        """The score of each part by its model."""
        return _scores(models, self.parts, self.measure)

    def bare(self, model: Model) -> Fit:
        """The better of two fits without any effect, by what they leave of the training recordings: the baseline that
        the search began with, and one that begins at the answer's own parameters, so that what a refit alone buys is
        not counted for the effects.
        """
        own = model
        for name in model.names:
            own = own.without_effect(name)
        if own is model:
            return self.start.fit
        traces = list(self.start.traces)
        begun = polished(fit(own, traces, tau=self.tau, steps=STEPS), traces)

        def left(found: Fit) -> float:
            return pooled([scored(found.model, t, k, measure=self.measure) for k, t in enumerate(traces)]).sure

        return min((self.start.fit, begun), key=left)

    def base(self, model: Model) -> tuple[Fit, list[Model]]:
        """The best fit without the effects of a model, and its refits to each part."""
        if model.names not in self._bases:
            bare = self.bare(model)
            self._bases[model.names] = bare, self.refits(bare.model)
        return self._bases[model.names]

    def refits(self, model: Model) -> list[Model]:
        return refits(model, self.parts, self.tau, self.jobs)

    def without(self, name: str, model: Model) -> Fit:
        """The model without an effect, refitted to all training recordings; of what holds the output in a spring's
        place, the better of none and the spring.
        """
        traces, less = self.start.traces, model.without_effect(name)
        starts = [less]
        if BY_NAME[name].holds_place:
            spring = self.start.fit.model
            starts.append(replace(less, values=spring.values, free=spring.free))
        found = (polished(fit(start, traces, tau=self.tau, steps=STEPS), traces) for start in starts)
        return min(found, key=lambda one: one.cost)

    def judged(self, name: str, model: Model, after: list[Score]) -> Judged:
        """What held-out data says of one effect; where neither it nor the free runs confirm the effect, by halves of
        the recording that teaches most of it.
        """
        is_lone = len(model.names) == 1
        bare, bare_models = self.base(model)
        less = bare.model if is_lone else self.without(name, model).model
        lesser_models = bare_models if is_lone else self.refits(less)
        lesser = self.scores(lesser_models)
        one = Judged(less, lesser_models, pooled(lesser), (after, lesser), self.p_of(name, after, lesser))
        doubtful = decisions.is_doubtful(self.numbers(one, after), self.policy)
        if doubtful and not self.held and len(self.start.traces) > 1:
            record, *halved = self._halved(model, less, after, lesser)
            if (chance := self.p_of(name, *halved)) < self.policy.largest_p:
                one.p, one.pair, one.record = chance, (halved[0], halved[1]), record
        return one

    def p_of(self, name: str, after: Sequence[Score], without: Sequence[Score]) -> float:
        """The p-value of an effect by the scores with and without it."""
        gain = score(pooled(without).misfit, 1.0) - score(pooled(after).misfit, 1.0)
        won = decisions.Won.of(gain)
        return decisions.paired_p(won, BY_NAME[name].once, name in self.alone, self.policy)

    def numbers(self, one: Judged, after: Sequence[Score]) -> decisions.HeldOut:
        """What the decision reads."""
        with_it, without = one.pair
        least = 1e-300
        logs = [math.log(max(a.sure, least) / max(b.sure, least)) for a, b in zip(with_it, without, strict=True)]
        return decisions.HeldOut(
            p=one.p,
            rmse=(pooled(after).rmse, one.without.rmse),
            noise=math.sqrt(float(np.mean([fold.held_out.sigma**2 for fold in self.parts]))),
            cost=(cost(pooled(after).misfit, 1.0), cost(one.without.misfit, 1.0)),
            ratio=pooled(with_it).sure / pooled(without).sure,
            log_ratio=float(np.mean(logs)),
        )

    def against(
        self, name: str, one: Judged, model: Model, after_models: Sequence[Model], after: Sequence[Score]
    ) -> str:
        """What speaks against an effect; empty where it is confirmed, pays, and is none that few samples, a converter
        or any remainder would show.

        What acts in one recording only was judged there: it cannot make another one better.
        """
        numbers = self.numbers(one, after)

        @cache
        def again() -> tuple[float, float] | None:
            return _recalibrated(after_models, one.lesser_models, self.parts, self.measure)

        if not decisions.is_confirmed(numbers, again, self.policy):
            return "held-out data does not confirm that it is needed"
        traces, policy = self.start.traces, self.policy
        with_it, without = (pooled(scores) for scores in one.pair)
        if not BY_NAME[name].local and not decisions.pays(numbers, again, policy):
            return f"without it the squared held-out error rises by less than {policy.pays:.0%}"
        if self.is_unsure(name, model, after_models):
            return "its size may be none"
        if may_be_none(name, model, traces, self.tau, policy):
            return "it acts where a recording begins or ends"
        if BY_NAME[name].once and decisions.is_one_of_many(self._left(model), self._left(one.less), policy):
            return "what it explains in one moment is left in others"
        if is_a_converters(name, model, traces):
            return "it is within half a step of the converter"
        return "a wave fits any remainder as well" if is_any_wave(name, model, with_it, without, policy) else ""

    def _left(self, model: Model) -> np.ndarray:
        """What a model leaves in each block (B,) of what was fitted."""
        return np.concatenate([_misfit(model, trace, k) for k, trace in enumerate(self.start.traces)])

    def is_unsure(self, name: str, model: Model, after_models: Sequence[Model]) -> bool:
        """Whether the interval of each size of an effect spans zero, or decades where it has a sign, and those without
        a sign may be none together.

        Its other numbers, a speed or a place, are held where they are: of an effect that is none nothing tells them, so
        that they say nothing of whether it is.
        """
        if name in model.frozen or BY_NAME[name].local:
            return False
        effect, layout, z = BY_NAME[name], model.layout(), model.vector(model.layout())
        sizes = {effect.parameters[k].name for k in effect.sizes(dict(model.effects)[name])}
        own = [k for k, f in enumerate(layout) if f.owner == name]
        at = [k for k in own if layout[k].name in sizes]
        if not at:
            return False
        spread = at_given(self.spreads(model, after_models)[0], at, [k for k in own if k not in at])
        ends = [layout[k].ends(z[k], width) for k, width in zip(at, widths_of(spread), strict=True)]
        signed = [n for n, k in enumerate(at) if not layout[k].positive]
        return decisions.are_no_sizes(ends, signed, z[at], spread, self.policy)

    def spreads(self, model: Model, after_models: Sequence[Model]) -> tuple[np.ndarray, np.ndarray]:
        """Spreads (k, k) of a model's numbers, and as they are told (estimation/intervals.py), the last model's kept;
        ``after_models`` are its refits to each part, which tell it where each leaves one training recording out.
        """
        if self._wide is None or self._wide[0] is not model:
            left_out = after_models if self.parts[0].training is not None and len(after_models) > 2 else ()
            self._wide = model, *told_spreads(model, self.start.traces, left_out, self.tau)
        return self._wide[1:]

    def widths(self, model: Model, after_models: Sequence[Model]) -> np.ndarray:
        """95 % half-widths (k,) of a model's numbers as they are told: the plant's own may have been moved by whatever
        is left; those of an effect are what its being there was asked by.
        """
        asked, told = map(widths_of, self.spreads(model, after_models))
        widths = {f.key: (asked if f.owner in BY_NAME else told)[k] for k, f in enumerate(model.layout())}
        return np.array([widths[f.key] for f in model.of_records(range(len(self.start.traces))).layout()])

    def _halved(
        self, model: Model, less: Model, after: Sequence[Score], without: Sequence[Score]
    ) -> tuple[int, list[Score], list[Score]]:
        """A recording, and the scores with and without an effect where this one, which teaches most of it, is held out
        by halves: left out as a whole, it leaves little to learn the effect from.

        It is the one in which the effect's gain falls most from where all recordings were fitted to where the others
        were.
        """
        traces, tau = list(self.start.traces), self.tau
        fitted = [
            float(np.sum(score(_misfit(less, t, k), tau) - score(_misfit(model, t, k), tau)))
            for k, t in enumerate(traces)
        ]
        held = [float(np.sum(score(b.misfit, tau) - score(a.misfit, tau))) for a, b in zip(after, without, strict=True)]
        record = int(np.argmax(np.subtract(fitted, held)))
        parts = halves(traces, record)
        within = (_scores(refits(some, parts, tau, self.jobs), parts, self.measure) for some in (model, less))
        with_it, without_it = (
            [*known[:record], *known[record + 1 :], *new] for known, new in zip((list(after), list(without)), within)
        )
        return record, with_it, without_it

    def told(self, model: Model, after_models: list[Model], after: list[Score], judged: dict[str, Judged]) -> Confirmed:
        """What held-out data says in the end."""
        (base, base_models), traces = self.base(model), self.start.traces
        before = self.scores(base_models)
        by_halves = {one.record for one in judged.values() if one.record is not None}
        shown = [
            (b, a, fold.held_out.sure_noise)
            for b, a, fold in zip(before, after, self.parts)
            if fold.record not in by_halves
        ]
        sentence = self.sentence
        for record in sorted(by_halves):
            cut = halves(traces, record)
            some = (refits(model, cut, self.tau, self.jobs) for model in (base.model, model))
            ends = (_scores(models, cut, self.measure) for models in some)
            shown += [(b, a, fold.held_out.sure_noise) for b, a, fold in zip(*ends, cut)]
            sentence += f"; {traces[record].name}, which teaches most of an effect, by halves as well"
        without, p = ({name: getattr(one, of) for name, one in judged.items()} for of in ("without", "p"))
        widths, measure = self.widths(model, after_models), self.measure
        return Confirmed(
            base, before, after, without, p, after_models, base_models, self.parts, sentence, shown, widths, measure
        )


def is_a_converters(name: str, model: Model, traces: Sequence[Trace]) -> bool:
    """Whether a sensor's error along the travel is within half a step of a converter that makes most of the noise: it
    is that converter's own.
    """
    if not all(t.is_coarse for t in traces):
        return False
    y = np.concatenate([t.y[t.valid] for t in traces])
    return BY_NAME[name].is_within(dict(model.effects)[name], y, 0.5 * max(t.quantum for t in traces))


def is_any_wave(name: str, model: Model, after: Score, without: Score, policy: Policy = POLICY) -> bool:
    """Whether a wave whose period was looked for among many does not pay for its numbers: one of them fits any
    remainder a little, held out as well, since the recordings are excited alike.
    """
    effect = BY_NAME[name]
    if effect.wave is None:
        return False
    periods = sum(np.isfinite(start[effect.wave[1]]) for start in effect.starts(model.scales))
    return periods >= policy.many_periods and delta_bic(name, model, after, without) < 0.0


def may_be_none(name: str, model: Model, traces: Sequence[Trace], tau: float, policy: Policy = POLICY) -> bool:
    """Whether what acts once acts at the edge of a recording, and the interval of its size holds zero: it bends to
    whatever few samples leave.

    Elsewhere that interval tells little: a rudder that sticks does not feel a push until it breaks loose. What begins
    while the start is read or in the last moment is none.
    """
    if not BY_NAME[name].once:
        return False
    pushes = _pushes(name, model, traces)
    if any(before < START or left < START for before, _, left in pushes):
        return True
    if not any(before < policy.edge or left - w < policy.edge for before, w, left in pushes):
        return False
    layout, size = model.layout(), BY_NAME[name].parameters[0].name
    z, widths = model.vector(layout), half_widths(model, traces, (), tau)
    return all(abs(z[k]) <= widths[k] for k, f in enumerate(layout) if f.owner == name and f.name == size)


def _pushes(name: str, model: Model, traces: Sequence[Trace]) -> list[tuple[float, float, float]]:
    """What acts once: how long after a recording's beginning, how long, and how long before its end [s]."""
    columns = [p.name for p in BY_NAME[name].parameters if p.per_record]
    begun, width, fade = (model.local[name][:, columns.index(column)] for column in ("t_0", "width", "fade"))
    each = zip(begun, np.fmin(width, fade), traces, strict=True)
    return [(b - t.t[0], w, t.t[-1] - b) for b, w, t in each if np.isfinite(b)]


def delta_bic(name: str, model: Model, after: Score, without: Score) -> float:
    """What an effect wins of held-out C, as a difference of BIC: twice the gain, less the logarithm of the number of
    blocks for each of its numbers.
    """
    gain = cost(without.misfit, 1.0) - cost(after.misfit, 1.0)
    return 2.0 * gain - sum(np.isfinite(v) for v in dict(model.effects)[name]) * math.log(max(without.misfit.size, 2))


def _misfit(model: Model, trace: Trace, record: int) -> np.ndarray:
    return trace.blocks.misfit(residuals_in(model, trace, record, OBSERVER_RATE))


def _recalibrated(
    models: Sequence[Model], lesser: Sequence[Model], parts: Sequence[Fold], measure: Measure
) -> tuple[float, float] | None:
    """Errors of two models on recordings of another day, once gain, offset and friction level of that day are known;
    None where there are none.
    """
    if parts[0].training is not None:
        return None
    with_it, without = (
        pooled([recalibrated(m, fold.held_out, measure).score for m, fold in zip(some, parts)]).rmse
        for some in (models, lesser)
    )
    return with_it, without


def _scores(models: Sequence[Model], parts: Sequence[Fold], measure: Measure) -> list[Score]:
    return [scored(model, fold.held_out, measure=measure) for model, fold in zip(models, parts)]
