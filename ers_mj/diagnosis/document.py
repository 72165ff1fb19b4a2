"""What a diagnosis tells: diagnosis.json (version 1), the evidence that the report draws, and the improved model."""

from __future__ import annotations

import math
import platform
from dataclasses import dataclass

import numpy as np

from ers_mj import __version__
from ers_mj.data.columns import per
from ers_mj.data.prepared import Trace
from ers_mj.decisions.confirmation import is_no_size
from ers_mj.decisions.explained import cost
from ers_mj.diagnosis import unknown_told
from ers_mj.diagnosis.case import Case
from ers_mj.diagnosis.data_told import data_of
from ers_mj.diagnosis.errors_told import as_named
from ers_mj.diagnosis.evidence import Evidence
from ers_mj.diagnosis.latent_force_told import latent_forces
from ers_mj.diagnosis.localisation import Place, gather, over_frequency, places, residual_map
from ers_mj.diagnosis.record_state import record_state
from ers_mj.diagnosis.remainder import beyond_training, remainder
from ers_mj.diagnosis.sentences import of_another_day, of_its_own, sentence, shown
from ers_mj.diagnosis.told_model import with_diagnosis
from ers_mj.diagnosis.unexcited import is_unexcited, moving_input, told_together
from ers_mj.diagnosis.views import ladder, views
from ers_mj.effects import BY_NAME, Parameter
from ers_mj.experiment_design.next_recording import next_recording
from ers_mj.plants.mujoco.looped import LoopedPlant
from ers_mj.plants.mujoco.plant import MechanicalPlant
from ers_mj.selection.comparison import kin_of
from ers_mj.selection.confirmation import delta_bic
from ers_mj.selection.cross_validation import pooled
from ers_mj.selection.moves import Move
from ers_mj.selection.posterior import isolability
from ers_mj.servo.datasheet import SHEET_UNITS, Datasheet
from ers_mj.servo.model import BASE
from ers_mj.servo.simulation import PER_INERTIA, unit_of


@dataclass(frozen=True)
class Diagnosis:
    """The document (diagnosis.json, version 1), what the report draws, the improved model, and the same in MuJoCo
    (plant.xml).
    """

    document: dict
    evidence: Evidence
    model: Datasheet
    plant: MechanicalPlant | LoopedPlant


def told(case: Case, held: list[Trace]) -> Diagnosis:
    """The document, the evidence and the model."""
    base, model, traces = case.start.fit.model, case.model, case.start.traces
    samples = gather(base, model, traces)
    verdict, missing, states = case.verdict, _missing(case), record_state(case, held)
    spectrum = over_frequency(samples, traces)
    found = places(
        samples,
        traces,
        case.selection.rounds,
        case.start.fit.cost,
        [m["effect"] for m in missing],
        case.output_unit,
        case.input_unit,
        spectrum,
    )
    changed = of_another_day(case.fits, states, case.output_unit, case.policy) if case.holdout else ""
    data = data_of(case.recordings, case.holdout, case.datasheet)
    document = {
        "version": 1,
        "verdict": verdict,
        "sentence": sentence(case, missing, found) + changed,
        "where": [] if verdict == "consistent" else [place_of(p) for p in found],
        "missing": missing,
        "remainder": _remainder(case),
        "record_state": states,
        "fit": as_named(case.fits, case.names, case.told_effects) | unknown_told.fits(case),
        "parameters": _parameters(case),
        "next_recording": _next_recording(case),
        "data": data,
        "trail": [_move(move) for move in case.selection.trail],
        "seed": case.seed,
        "versions": versions_of(),
    }
    if verdict == "unexplained" or case.suspects:
        document["suspects"] = _suspects(case)
    if left_out := case.search.left_out(case.cut_short):
        document["left_out"] = [{"part": part, "sentence": sentence} for part, sentence in left_out]
    evidence = Evidence(
        tuple(views(case, samples)),
        tuple(ladder(case)),
        residual_map(samples),
        case.noise,
        case.output_unit,
        case.recordings[0].input_unit,
        spectrum,
        latent_forces(case),
    )
    model_told = with_diagnosis(_improved(case), document)
    delivered = case.unknown.model if case.unknown is not None else case.answer
    return Diagnosis(document, evidence, model_told, case.rig.plant(delivered))


def _remainder(case: Case) -> dict:
    """What the answer leaves, beside what memory tells of it by sensor."""
    beyond = beyond_training(case.recordings, case.holdout)
    left_sigma = {kind: math.sqrt(math.expm1(max(left, 0.0))) for kind, left in case.left.items()}
    own = of_its_own(case) if case.verdict == "parameters_only" and case.more_is_left else ""
    fits = as_named(case.fits, case.names, case.told_effects)
    explained = case.explained if fits is case.fits else 0.0
    levels = fits["heldout_rmse_after_rad"] / case.noise
    told = remainder(explained, case.more_is_left, levels, [*beyond, *unknown_told.sentences(case)], own)
    return {**told, "left_sigma": left_sigma, "tables": unknown_told.tables(case)}


def _missing(case: Case) -> list[dict]:
    sensors = [_symptom(case, name, values) for name, values in case.sensors.items()]
    effects = [_effect(case, name) for name in case.told_effects]
    effects.sort(key=lambda e: -cost(case.confirmed.without[e["effect"]].misfit, 1.0))
    return effects + sensors


def _suspects(case: Case) -> list[dict]:
    """The laws without a name that act here, then what else the first round found."""
    first = case.selection.rounds[0] if case.selection.rounds else ()
    others = [c for c in first[:3] if c.name in BY_NAME] if case.verdict == "unexplained" else []
    return [
        {"effect": c.name, "sentence": f"{BY_NAME[c.name].sentence}: lowers the robust cost by {c.gain:.1f}"}
        for c in case.suspects
    ] + [
        {"effect": c.name, "sentence": f"lowers the robust cost by {c.gain:.1f} of {case.start.fit.cost:.1f}"}
        for c in others
    ]


def _effect(case: Case, name: str) -> dict:
    effect, c = BY_NAME[name], case.confirmed
    parameters = {p["name"]: p["entry"] for p in _effect_parameters(case, name)}
    without = c.without[name]
    with_and_without = (None, None) if effect.local else (pooled(c.after).rmse, without.rmse)
    told = {k: shown(e["value"], e["unit"]) for k, e in parameters.items()}
    return {
        "effect": name,
        "sentence": effect.describe(told),
        "subsystem": effect.subsystem,
        "parameters": parameters,
        "evidence": {
            "heldout_rmse_without_rad": with_and_without[1],
            "heldout_rmse_with_rad": with_and_without[0],
            "delta_bic": delta_bic(name, case.model, pooled(c.after), without),
            "p_value": c.p[name],
        },
        "probability": case.found(name)[1].get(name),
        "alternatives": _alternatives(case, name),
    }


def _effect_parameters(case: Case, name: str):
    values, errors = dict(case.model.effects_of())[name], case.errors
    for parameter, value in zip(BY_NAME[name].parameters, values):
        as_torque = bool(case.inertia) and parameter.kind in PER_INERTIA
        factor, doubt = (case.inertia or 1.0, 1.96 * case.scatter) if as_torque else (1.0, 0.0)
        finite = bool(np.isfinite(value))
        low_high = errors.get((name, parameter.name))
        is_told = finite and low_high is not None and not (parameter.positive and is_no_size(*low_high, case.policy))
        yield {
            "name": parameter.name,
            "entry": (
                _per_recording(case, name, parameter, factor)
                | {
                    "value": float(value) * factor if finite else None,
                    "unit": unit_of(parameter.kind, case.output_unit, case.input_unit, bool(case.inertia)),
                    "ci95": _as_told(float(value), low_high, factor, doubt) if is_told and low_high else [None, None],
                    "meaning": parameter.meaning,
                }
            ),
        }


def _as_told(value: float, ends: tuple[float, float], factor: float, doubt: float) -> list[float]:
    """An interval times the datasheet's inertia, which no recording tells and which is off by a share ``doubt``."""
    low, high = (math.hypot(value - end, doubt * value) for end in ends)
    return [(value - low) * factor, (value + high) * factor]


def _per_recording(case: Case, name: str, parameter: Parameter, factor: float) -> dict:
    """The values in every training recording of a parameter that has one of its own in each; null where the effect is
    absent.
    """
    if not parameter.per_record:
        return {}
    columns = [p.name for p in BY_NAME[name].parameters if p.per_record]
    values = case.model.local[name][:, columns.index(parameter.name)]
    return {"per_recording": [float(v) * factor if np.isfinite(v) else None for v in values]}


def _symptom(case: Case, name: str, values: np.ndarray) -> dict:
    """A sensor effect that was found in the data itself."""
    effect = BY_NAME[name]
    entries: dict[str, dict] = {
        p.name: {
            "value": float(v),
            "unit": unit_of(p.kind, case.output_unit, case.input_unit),
            "ci95": [None, None],
            "meaning": p.meaning,
        }
        for p, v in zip(effect.parameters, values)
    }
    return {
        "effect": name,
        "sentence": effect.describe({k: shown(e["value"], e["unit"]) for k, e in entries.items()}),
        "subsystem": effect.subsystem,
        "parameters": entries,
        "evidence": {
            "heldout_rmse_without_rad": None,
            "heldout_rmse_with_rad": None,
            "delta_bic": None,
            "p_value": None,
        },
        "alternatives": [],
    }


def _alternatives(case: Case, name: str) -> list[dict]:
    """What of the round in which the effect was found the recordings do not exclude, and how far it is from the answer
    on them; then what is easily taken for it and was compared in no round.
    """
    ranked, weights = case.found(name)
    others = [c for c in ranked[1:] if weights[c.name] > case.policy.tied]
    apart = isolability(ranked[0].fit, [c.fit for c in others], case.start.traces) if others else []
    left = [
        {
            "effect": c.name,
            "probability": weights[c.name],
            "why_not_excluded": (
                f"costs {abs(d.cost):.2f} {'more' if d.cost >= 0 else 'less'} than {name}, which explains"
                f" {ranked[0].gain:.1f}; the two simulations differ by {d.sigmas:.2g} times the noise on these"
                " recordings"
            ),
            "difference_sigma": d.sigmas,
            "cost_difference": d.cost,
        }
        for c, d in zip(others, apart)
    ]
    known = {*case.model.names, *(c.name for compared in case.selection.rounds for c in compared)}
    return left + [
        {
            "effect": kin,
            "probability": None,
            "why_not_excluded": f"was not compared; what tells them apart: {BY_NAME[kin].apart}",
        }
        for kin in sorted(kin_of(name) - known)
    ]


def _parameters(case: Case) -> dict:
    known = case.datasheet.to_lumped() if case.datasheet is not None else {}
    y, u = case.output_unit, case.input_unit
    units = {
        "a_1": "1/s^2",
        "a_2": "1/s",
        "b": f"{y}/s^2/{per(u)}",
        "c_1": f"{y}/s^2",
        "c_2": f"{y}/s^2",
        "theta_0": y,
        "tau_e": "s",
        "emf_share": "-",
        "ampere": f"{y}/s^2/A",
    }
    rows: dict[str, dict] = {}
    errors = case.errors
    apart = _apart(case)
    for name in BASE:
        fitted = name in apart
        is_told = fitted and (name == "theta_0" or not is_no_size(*errors[("base", name)], case.policy))
        if not fitted and name in ("tau_e", "emf_share", "ampere"):
            continue
        told = float(case.answer.values[name])
        absent = name in ("a_1", "c_1") and told == 0
        value = told if is_told or absent else None
        rows[name] = {
            "value": value,
            "unit": units[name],
            "ci95": _around(told, *errors[("base", name)]) if is_told else 2 * [value],
            "datasheet": known.get(name),
            "identifiable": is_told or absent,
        }
    for name, value in (case.datasheet.parameters if case.datasheet is not None else {}).items():
        if name != "theta_0":
            rows[name] = {
                "value": None,
                "unit": SHEET_UNITS[name],
                "ci95": [None, None],
                "datasheet": value,
                "identifiable": False,
            }
    rows |= _combinations(case, rows)
    return rows


def _apart(case: Case) -> set[str]:
    """The baseline's fitted numbers, without those that these recordings tell only together."""
    return {name for owner, name in case.errors if owner == "base"}.difference(told_together(case.start.traces))


def _around(value: float, low: float, high: float) -> list[float]:
    """An interval with what is told in it: where nothing is named it was found beside what might have been."""
    return [min(low, value), max(high, value)]


def _combinations(case: Case, rows: dict) -> dict:
    """The combinations of Table 1's letters that position and voltage can tell (notes in the README)."""
    if case.datasheet is None or not case.datasheet.parameters:
        return {}
    named = {"k_s/J": "a_1", "n K_t/(J R)": "b", "T_LH/J": "c_1", "F_c/J": "c_2", "L/R": "tau_e", "n K_t/J": "ampere"}
    return {combination: rows[name] for combination, name in named.items() if name in rows}


def _next_recording(case: Case) -> dict:
    """What to record next, where that is designed."""
    if not case.search.advised:
        return {"sentence": "not designed in a quick look", "excitation": None}
    if is_unexcited(case.start.traces):
        return moving_input(case.start.traces, case.input_unit, case.output_unit)
    return next_recording(*case.rivals(), case.start.traces, case.input_unit, case.output_unit)


def _move(move: Move) -> dict:
    """One move of the selection."""
    return {
        "kind": move.kind,
        "before": list(move.before),
        "after": list(move.after),
        "gain": move.gain,
        "accepted": move.accepted,
        "because": move.because,
    }


def place_of(p: Place) -> dict:
    return {
        "axis": p.axis,
        "region": list(p.region) if p.region else None,
        "unit": p.unit,
        "label": p.label,
        "share_of_error": p.share_of_error,
        "share_of_time": p.share_of_time,
        "sentence": p.sentence,
    }


def _improved(case: Case) -> Datasheet:
    """The improved model: refitted lumped values in [lumped], effects in a reader's units."""
    model = case.unknown.model if case.unknown is not None else case.answer
    lumped = {k: float(model.values[k]) for k in ("a_1", "a_2", "b", "c_1", "c_2", "theta_0")}
    extra = {k: float(model.values[k]) for k in ("tau_e", "emf_share")}
    effects = []
    for name in case.told_effects:
        effects.append((name, unknown_told.in_readers_units(case, name, dict(model.effects_of())[name])))
    effects += [
        (name, {p.name: float(v) for p, v in zip(BY_NAME[name].parameters, values)})
        for name, values in case.sensors.items()
    ]
    tables = case.unknown.tables if case.unknown is not None else []
    effects += [(name, unknown_told.in_readers_units(case, name, values)) for name, values in tables]
    parameters = dict(case.datasheet.parameters) if case.datasheet is not None else {}
    return Datasheet(parameters=parameters, lumped=lumped, effects=tuple(effects), baseline=extra, name="model.toml")


def versions_of() -> dict:
    from importlib.metadata import version

    return {
        "ers-mj": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        **{package: version(package) for package in ("scipy", "numba")},
    }
