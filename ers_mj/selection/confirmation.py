"""Which of the selected effects does held-out data confirm?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.prepared import START, Blocks, Trace
from ers_mj.effects import BY_NAME
from ers_mj.estimation.baseline import Start
from ers_mj.estimation.fit import Fit, fit, polished, residuals_in, score
from ers_mj.estimation.intervals import half_widths
from ers_mj.selection.comparison import stands_alone
from ers_mj.selection.cross_validation import Fold, Score, folds, halves, paired_p, pooled, recalibrated, refits, scored
from ers_mj.selection.stepwise import Selection
from ers_mj.servo.model import OBSERVER_RATE, Model

LARGEST_P = 0.05  # held-out p-value up to which an effect is confirmed
SURE_P = 1e-3  # up to which it is beyond doubt
CLEAR = 3.0  # noise levels of free-run error above which a halved error confirms an effect by itself
WORSE = (
    1.3  # times the raw error that an effect which only recalibration confirms, or blocks beyond doubt, may make of it
)
HALF = 0.5  # share of the squared error that must go
MANY = 10  # periods that a wave's fit is begun from, from which on one of them fits what is left by chance
EDGE = 0.1  # [s] at either end of a recording, in which few samples bear a knock


@dataclass(frozen=True)
class Confirmed:
    """What held-out data says: scores before and after, without each effect, and the p-value of each effect.

    ``shown`` are the scores before and after with the noise of what was held out, by halves where an effect was judged
    so.
    """

    before: list[Score]
    after: list[Score]
    without: dict[str, Score]
    p: dict[str, float]
    models: list[Model]
    base_models: list[Model]
    parts: list[Fold]
    sentence: str
    shown: list[tuple[Score, Score, float]]


def confirmed(start: Start, selection: Selection, held: list[Trace], jobs: int) -> tuple[Selection, Confirmed]:
    """Judge each effect on held-out data; those that do not improve it beyond chance are taken out again."""
    parts, sentence = folds(start.traces, held)
    alone = {ranked[0].name for ranked in selection.rounds if ranked and stands_alone(ranked[0], ranked)}
    base_models = refits(start.fit.model, parts, selection.tau, jobs)
    while True:
        model = selection.chosen.model
        after_models = refits(model, parts, selection.tau, jobs)
        after = _scores(after_models, parts)
        pairs, without, p, lesser_models, by_halves = {}, {}, {}, {}, set()
        for name in model.names:
            less = _without(name, model, start, selection.tau).model if len(model.names) > 1 else start.fit.model
            lesser_models[name] = refits(less, parts, selection.tau, jobs) if len(model.names) > 1 else base_models
            lesser = _scores(lesser_models[name], parts)
            without[name] = pooled(lesser)
            p[name] = _p_of(name, after, lesser, name in alone)
            pairs[name] = after, lesser
            if (p[name] > LARGEST_P or _no_closer(after, lesser, p[name])) and not held and len(start.traces) > 1:
                record, *halved = _halved(model, less, after, lesser, start, selection.tau, jobs)
                if (chance := _p_of(name, *halved, name in alone)) < LARGEST_P:
                    p[name], pairs[name] = chance, halved
                    by_halves.add(record)
        failed = [
            n
            for n in model.names
            if (p[n] > LARGEST_P or _no_closer(*pairs[n], p[n]))
            and not _halves(pooled(after), without[n], parts)
            and not (
                pooled(after).rmse <= WORSE * without[n].rmse
                and _helps_recalibrated(after_models, lesser_models[n], parts)
            )
            or _may_be_none(n, model, start.traces, selection.tau)
            or _is_a_converters(n, model, start.traces)
            or _is_any_wave(n, model, *pairs[n])
        ]
        if not failed:
            before = _scores(base_models, parts)
            shown = [
                (b, a, fold.held_out.sure_noise)
                for b, a, fold in zip(before, after, parts)
                if fold.record not in by_halves
            ]
            for record in sorted(by_halves):
                cut = halves(start.traces, record)
                ends = (_scores(refits(some, cut, selection.tau, jobs), cut) for some in (start.fit.model, model))
                shown += [(b, a, fold.held_out.sure_noise) for b, a, fold in zip(*ends, cut)]
                sentence += f"; {start.traces[record].name}, which teaches most of an effect, by halves as well"
            return selection, Confirmed(before, after, without, p, after_models, base_models, parts, sentence, shown)
        worst = max(failed, key=lambda n: p[n])
        reduced = _without(worst, model, start, selection.tau)
        selection = replace(selection, chosen=reduced if reduced.model.names or reduced.model.states else start.fit)


def _p_of(name: str, after: Sequence[Score], without: Sequence[Score], alone: bool = False) -> float:
    return paired_p(pooled(after).misfit, pooled(without).misfit, BY_NAME[name].once, alone)


def _no_closer(after: Sequence[Score], without: Sequence[Score], p: float) -> bool:
    """Whether an effect brings the free runs no closer.

    Where its blocks leave no doubt, an error that forks of stick and slip make somewhat larger counts as closer, and so
    does one that falls in the geometric mean of the recordings: one of them may teach so much that the others, without
    it, know the rest of the model badly.
    """
    ratio = pooled(after).sure / pooled(without).sure
    if p >= SURE_P or ratio < WORSE:
        return ratio >= (WORSE if p < SURE_P else 1.0)
    return float(np.mean([math.log(a.sure / b.sure) for a, b in zip(after, without, strict=True)])) >= 0.0


def delta_bic(name: str, model: Model, after: Score, without: Score) -> float:
    """What an effect wins of held-out C, as a difference of BIC: twice the gain, less the logarithm of the number of
    blocks for each of its numbers.
    """
    gain = float(np.sum(score(without.misfit, 1.0)) - np.sum(score(after.misfit, 1.0)))
    return 2.0 * gain - sum(np.isfinite(v) for v in dict(model.effects)[name]) * math.log(max(without.misfit.size, 2))


def _is_any_wave(name: str, model: Model, after: Sequence[Score], without: Sequence[Score]) -> bool:
    """Whether a wave whose period was looked for among MANY does not pay for its numbers: one of them fits any
    remainder a little, held out as well, since the recordings are excited alike."""
    effect = BY_NAME[name]
    if effect.wave is None or sum(np.isfinite(start[effect.wave[1]]) for start in effect.starts(model.scales)) < MANY:
        return False
    return delta_bic(name, model, pooled(after), pooled(without)) < 0.0


def _may_be_none(name: str, model: Model, traces: Sequence[Trace], tau: float) -> bool:
    """Whether what acts once acts at the edge of a recording, and the interval of its size holds zero: it bends to
    whatever few samples leave.

    Elsewhere that interval tells little: a rudder that sticks does not feel a push until it breaks loose. What begins
    while the start is read or in the last moment is none.
    """
    if not BY_NAME[name].once:
        return False
    columns = [p.name for p in BY_NAME[name].parameters if p.per_record]
    begun, width, fade = (model.local[name][:, columns.index(column)] for column in ("t_0", "width", "fade"))
    knocks = [
        (b - t.t[0], w, t.t[-1] - b)
        for b, w, t in zip(begun, np.fmin(width, fade), traces, strict=True)
        if np.isfinite(b)
    ]
    if any(before < START or left < START for before, _, left in knocks):
        return True
    if not any(before < EDGE or left - w < EDGE for before, w, left in knocks):
        return False
    layout, size = model.layout(), BY_NAME[name].parameters[0].name
    z, widths = model.vector(layout), half_widths(model, traces, (), tau)
    return all(abs(z[k]) <= widths[k] for k, f in enumerate(layout) if f.owner == name and f.name == size)


def _is_a_converters(name: str, model: Model, traces: Sequence[Trace]) -> bool:
    """Whether a sensor's error along the travel is within half a step of a converter that makes most of the noise: it
    is that converter's own.
    """
    if name != "sensor_nonlinearity" or not all(t.is_coarse for t in traces):
        return False
    y = np.concatenate([t.y[t.valid] for t in traces])
    error = BY_NAME[name].measure(dict(model.effects)[name], None, y) - y
    beside = np.stack([np.ones(y.size), y], axis=1)  # an offset and a gain are no error that position can tell
    error = error - beside @ np.linalg.lstsq(beside, error, rcond=None)[0]
    return float(np.max(np.abs(error))) < 0.5 * max(t.quantum for t in traces)


def _halved(
    model: Model, less: Model, after: Sequence[Score], without: Sequence[Score], start: Start, tau: float, jobs: int
) -> tuple[int, list[Score], list[Score]]:
    """A recording, and the scores with and without an effect where this one, which teaches most of it, is held out by
    halves: left out as a whole, it leaves little to learn the effect from.

    It is the one in which the effect's gain falls most from where all recordings were fitted to where the others were.
    """
    traces = list(start.traces)
    fitted = [
        float(np.sum(score(_misfit(less, t, k), tau) - score(_misfit(model, t, k), tau))) for k, t in enumerate(traces)
    ]
    held = [float(np.sum(score(b.misfit, tau) - score(a.misfit, tau))) for a, b in zip(after, without, strict=True)]
    record = int(np.argmax(np.subtract(fitted, held)))
    parts = halves(traces, record)
    within = (_scores(refits(some, parts, tau, jobs), parts) for some in (model, less))
    with_it, without_it = (
        [*known[:record], *known[record + 1 :], *new] for known, new in zip((list(after), list(without)), within)
    )
    return record, with_it, without_it


def _misfit(model: Model, trace: Trace, record: int) -> np.ndarray:
    return Blocks.of([trace]).misfit(residuals_in(model, trace, record, OBSERVER_RATE))


def _without(name: str, model: Model, start: Start, tau: float) -> Fit:
    return polished(fit(model.without_effect(name), start.traces, tau=tau, steps=15), start.traces)


def _halves(after: Score, without: Score, parts: Sequence[Fold]) -> bool:
    """Whether half of the squared free-run error above the noise goes, in a clear case, and the blocks speak for it on
    balance.

    An effect that one recording shows best is known less well without that recording: it helps there, and is not exact
    to the noise.
    """
    noise = float(np.mean([fold.held_out.sigma**2 for fold in parts]))
    above, left = without.rmse**2 - noise, after.rmse**2 - noise
    return (
        without.rmse > CLEAR * math.sqrt(noise)
        and left < HALF * above
        and float(np.sum(score(after.misfit, 1.0))) < float(np.sum(score(without.misfit, 1.0)))
    )


def _helps_recalibrated(models: Sequence[Model], lesser: Sequence[Model], parts: Sequence[Fold]) -> bool:
    """Whether the models halve the squared error of recordings of another day once gain, offset and friction level of
    that day are known.
    """
    if parts[0].training is not None:
        return False
    after, before = (
        pooled([recalibrated(m, fold.held_out)[0] for m, fold in zip(some, parts)]).rmse for some in (models, lesser)
    )
    return after**2 < HALF * before**2


def _scores(models: Sequence[Model], parts: Sequence[Fold]) -> list[Score]:
    return [scored(model, fold.held_out) for model, fold in zip(models, parts)]
