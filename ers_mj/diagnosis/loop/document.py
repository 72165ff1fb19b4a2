"""What a diagnosis of a position loop tells: diagnosis.json, the evidence that the report draws, the improved model."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ers_mj.diagnosis.data_told import data_of
from ers_mj.diagnosis.document import Diagnosis, place_of, versions_of
from ers_mj.diagnosis.errors_told import as_named
from ers_mj.diagnosis.evidence import Evidence, RecordView, Rung
from ers_mj.diagnosis.localisation import Place, Ranked, Samples, places, residual_map, shaded
from ers_mj.diagnosis.loop.advice import next_recording
from ers_mj.diagnosis.loop.case import LoopCase
from ers_mj.diagnosis.loop.rows import improved, parameters
from ers_mj.diagnosis.loop.state import record_state
from ers_mj.diagnosis.remainder import beyond_training, remainder
from ers_mj.diagnosis.sentences import shown
from ers_mj.diagnosis.told_model import with_diagnosis
from ers_mj.effects import BY_NAME
from ers_mj.effects.gravity_imbalance import GravityImbalance
from ers_mj.position_loop.fit import fitted, gain
from ers_mj.position_loop.intervals import Told
from ers_mj.position_loop.model import LETTERS, LoopModel
from ers_mj.position_loop.runs import Run, speed_of
from ers_mj.position_loop.terms import SPRING, without
from ers_mj.servo.simulation import unit_of

BESIDE = (
    "under a position command the datasheet's numbers stand beside those that were identified; none of them is fitted"
    " from, or held"
)


def told(case: LoopCase) -> Diagnosis:
    """The document, the evidence, the model and the plant."""
    samples = gather(case)
    missing = [_effect(case, name) for name in case.told_effects]
    found, data = _places(case, samples), data_of(case.recordings, case.holdout, None)
    known = case.datasheet.to_lumped() if case.datasheet is not None else {}
    data["problems"] += [BESIDE] if case.datasheet is not None else []
    fits = as_named(case.fits, case.names, case.told_effects)
    document = {
        "version": 1,
        "verdict": case.verdict,
        "sentence": _sentence(case, missing, found),
        "where": [place_of(p) for p in found],
        "missing": missing,
        "remainder": remainder(
            case.explained if fits is case.fits else 0.0,
            case.more_is_left,
            fits["heldout_rmse_after_rad"] / case.noise,
            beyond_training(case.recordings, case.holdout),
        ),
        "record_state": record_state(case),
        "fit": fits,
        "parameters": parameters(case.intervals, case.output_unit, case.selector.data, known),
        "next_recording": next_recording(case),
        "data": data,
        "seed": case.seed,
        "versions": versions_of(),
    }
    if case.verdict == "unexplained":
        document["suspects"] = [{"effect": c.name, "gain": c.gain} for c in _last_round(case)[:3]]
    evidence = Evidence(
        tuple(_views(case, samples)),
        tuple(_ladder(case)),
        residual_map(samples),
        case.noise,
        case.output_unit,
        case.recordings[0].input_unit,
    )
    model = case.model if case.told_effects or not case.names else case.base
    return Diagnosis(document, evidence, with_diagnosis(improved(model), document), case.plant())


# -- the effects ----------------------------------------------------------------------------------------------------


def _effect(case: LoopCase, name: str) -> dict:
    effect, entries = BY_NAME[name], _effect_parameters(case, name)
    values = {k: shown(e["value"], e["unit"]) for k, e in entries.items()}
    if effect.in_loop and name not in case.model.names:
        sentence = effect.loop_sentence.format(value=next(iter(values.values())))
    else:
        sentence = effect.describe(values)
    left = next(x for x in case.selection.named if x.name == name)
    less = case.confirmed.without[name]
    return {
        "effect": name,
        "sentence": sentence,
        "subsystem": effect.subsystem,
        "parameters": entries,
        "evidence": {
            "heldout_rmse_without_rad": less.rmse,
            "heldout_rmse_with_rad": case.confirmed.after.rmse,
            "delta_bic": 2.0 * left.gain,
            "p_value": case.confirmed.p_values[name],
        },
        "alternatives": _alternatives(case, name),
    }


def _effect_parameters(case: LoopCase, name: str) -> dict[str, dict]:
    effect, y = BY_NAME[name], case.output_unit
    if effect.in_loop and name not in case.model.names:
        letter = next(x for x in effect.in_loop if x in case.model.free)
        own = letter if letter in ("L", "R", "creep") else effect.parameters[0].name
        entry = _entry(case.intervals.told("", letter), case.model[letter], LETTERS[letter].unit.format(y=y))
        return {own: entry | ({"meaning": "within the loop"} if letter == "dead_time_s" else {})}
    values = dict(case.model.effects)[name]
    return {
        p.name: _entry(case.intervals.told(name, p.name), float(v), unit_of(p.kind, y, y, False))
        | {"meaning": p.meaning}
        for p, v in zip(effect.parameters, values, strict=True)
    }


def _entry(found: Told | None, value: float, unit: str) -> dict:
    ends = [None, None] if found is None else [float(x) for x in found.ci95]
    value = found.value if found is not None else value
    return {"value": float(value) if math.isfinite(value) else None, "unit": unit, "ci95": ends}


def _alternatives(case: LoopCase, name: str) -> list[dict]:
    """What of the round in which the effect was found explains nearly as much."""
    for ranked in case.selection.rounds:
        if ranked and ranked[0].name == name:
            weights = {c.name: math.exp(max(c.gain - ranked[0].gain, -700.0)) for c in ranked if c.name in BY_NAME}
            total = sum(weights.values())
            return [
                {
                    "effect": c.name,
                    "probability": weights[c.name] / total,
                    "why_not_excluded": f"explains {c.gain:.1f} where {name} explains {ranked[0].gain:.1f}",
                }
                for c in ranked[1:]
                if c.name in BY_NAME and weights[c.name] / total > case.policy.tied
            ]
    return _spring_instead(case) if BY_NAME[name].is_weight else []


def _spring_instead(case: LoopCase) -> list[dict]:
    """A spring in a weight's place, where it does nearly as well: over a small travel their moments are the same."""
    model = without(case.model, GravityImbalance.name).having(a_1=0.0, hold=case.model["hold"])
    more = gain(fitted(model, case.selector.data), case.chosen)
    probability = 1.0 / (1.0 + math.exp(min(more, 700.0)))
    why = f"a spring in its place explains {abs(more):.1f} {'less' if more > 0 else 'more'}"
    is_tied = probability > case.policy.tied
    return [{"effect": SPRING, "probability": probability, "why_not_excluded": why}] if is_tied else []


def _last_round(case: LoopCase) -> list:
    return [c for c in case.selection.rounds[-1] if c.name in BY_NAME] if case.selection.rounds else []


# -- words, places, pictures ----------------------------------------------------------------------------------------


def _sentence(case: LoopCase, missing: list[dict], found: list[Place]) -> str:
    loop = f"a {case.model.kind} position loop"
    if case.verdict == "parameters_only":
        return f"{loop.capitalize()} with the numbers given explains these recordings within their noise."
    if case.verdict == "missing_physics":
        names = "; ".join(m["sentence"] for m in missing)
        before, after = (shown(getattr(case.confirmed, w).rmse, case.output_unit) for w in ("before", "after"))
        return (
            f"Beside {loop}, friction and damping this acts: {names}. With it the held-out error falls from {before} to"
            f" {after}{'; a mismatch is left beside it' if case.more_is_left else ''}."
        )
    place = next((p.sentence for p in found if p.axis != "subsystem"), "it is spread over the whole record")
    return f"Something acts here that no effect of the library accounts for; {place}."


def gather(case: LoopCase) -> Samples:
    """Errors of the free runs before and after at every scored sample, beside where the servo was."""
    parts = []
    for k, run in enumerate(case.runs):
        v = run.scored
        first, second = ((run.y - model.predicted(run))[v] for model in (case.base, case.model))
        speed, error = speed_of(run)[v], np.abs(run.r - run.y)[v]
        parts.append((np.full(v.sum(), k), run.t[v], run.y[v], speed, error, first**2, second**2, first))
    return Samples(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _places(case: LoopCase, samples: Samples) -> list[Place]:
    total = sum(x.gain for x in case.selection.named) or 1.0
    rounds: list[Sequence[Ranked]] = [case.selection.named, *case.selection.rounds]
    return places(samples, case.runs, rounds, total, case.told_effects, case.output_unit, case.output_unit)


def _views(case: LoopCase, samples: Samples) -> list[RecordView]:
    """Held out is only what no part of was fitted; the rest is drawn as the answer has it."""
    out, seen = [], set()
    for base, model, fold in zip(
        case.confirmed.before_models, case.confirmed.models, case.confirmed.folds, strict=True
    ):
        for run in (one for one in fold.held if not fold.fits(one)):
            out.append(_view(case, run, base, model, True, ()))
            seen.add(run.name)
    for k, run in enumerate(case.runs):
        if run.name not in seen:
            out.append(_view(case, run, case.base, case.model, False, shaded(run, k, samples)))
    return out


def _view(case: LoopCase, run: Run, base: LoopModel, model: LoopModel, is_held: bool, spans: tuple) -> RecordView:
    """One recording beside the runs of both models, and of the second without each of the effects that are named."""
    less = {name: without(model, name).predicted(run) for name in case.told_effects}
    runs = base.predicted(run), model.predicted(run)
    return RecordView(run.name, is_held, run.t, run.r, run.y, *runs, spans, less)


def _ladder(case: LoopCase) -> Iterator[Rung]:
    chosen = case.selection.chosen
    yield Rung((), 0.0, math.nan, case.confirmed.before.rmse, not case.names, "bare loop", case.confirmed.base.size)
    for left in case.selection.named:
        yield Rung((left.name,), left.gain, math.nan, None, False, "over the best refit without it", chosen.size)
    if case.names:
        gain = sum(x.gain for x in case.selection.named)
        yield Rung(case.names, gain, math.nan, case.confirmed.after.rmse, True, "the answer", chosen.size)
    for ranked in case.selection.rounds:
        for c in ranked[:6]:
            yield Rung((c.name,), c.gain, math.nan, None, False, "compared", c.fit.size)
