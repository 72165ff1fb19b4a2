"""What a diagnosis tells: diagnosis.json (version 1), the evidence that the report draws, and the improved model."""

from __future__ import annotations

import math
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ers_mj import __version__
from ers_mj.advice import next_recording
from ers_mj.baseline import Start
from ers_mj.confirmation import Confirmed
from ers_mj.datasheet import Datasheet
from ers_mj.effects import BY_NAME, Parameter
from ers_mj.evaluation import free_run, pooled, recalibrated, scored
from ers_mj.evidence import Evidence, RecordView, Rung
from ers_mj.identification import Fit, residuals, score
from ers_mj.model import BASE, STATES, Model
from ers_mj.starts import with_starts
from ers_mj.intervals import half_widths, unseen_widths
from ers_mj.isolability import isolability, probabilities
from ers_mj.localisation import Place, gather, over_frequency, places, residual_map, shaded
from ers_mj.multibody import Rig, run_in_mujoco
from ers_mj.plants.mechanical import MechanicalPlant
from ers_mj.recording import Recording
from ers_mj.remainder import left_by_sensor, more_is_missing
from ers_mj.selection import Candidate, Selection
from ers_mj.simulation import PER_INERTIA, unit_of
from ers_mj.traces import Blocks, Trace

CONSISTENT = 0.05  # cost per block up to which a model explains the data within its noise (an error of 0.3 sigma RMS)
TIED = 0.02  # weight from which a rival is told as an alternative
LEAST_FACTOR, LEAST_OFFSET = 0.02, 0.01  # of a gain or friction level, and of half the travel: a smaller drift is not worth a line
VISIBLE = 1.5  # noise levels of free-run error from which a recording shows a mismatch
ASTRAY = 30.0  # times the noise by which the free run of every held-out recording misses: forks of stick and slip lose one or another
HALF = 0.5  # share of the squared held-out error that the named effects must explain


@dataclass(frozen=True)
class Diagnosis:
    """The document (diagnosis.json, version 1), what the report draws, the improved model, and the same in MuJoCo (plant.xml)."""

    document: dict
    evidence: Evidence
    model: Datasheet
    plant: MechanicalPlant


@dataclass(frozen=True)
class Case:
    """Everything that is known when the work is done, and how it is told."""

    recordings: Sequence[Recording]
    holdout: list[Recording]
    datasheet: Datasheet | None
    start: Start
    selection: Selection
    confirmed: Confirmed
    sensors: Mapping[str, np.ndarray]
    seed: int
    rig: Rig
    multibody: tuple[float | None, float | None]

    @property
    def model(self) -> Model:
        return self.selection.chosen.model

    @property
    def output_unit(self) -> str:
        return self.recordings[0].output_unit

    @property
    def input_unit(self) -> str:
        return {"pct": "%"}.get(self.recordings[0].input_unit, self.recordings[0].input_unit)

    @cached_property
    def left(self) -> dict[str, float]:
        """What the answer leaves beyond the noise, by sensor."""
        return left_by_sensor(self.model, self.start.traces)

    @property
    def inertia(self) -> float | None:
        return self.datasheet.parameters.get("J") if self.datasheet is not None else None

    @property
    def noise(self) -> float:
        traces = [fold.held_out for fold in self.confirmed.parts]
        return math.sqrt(float(np.mean([t.sigma**2 for t in traces])))

    def told(self, held: list[Trace]) -> Diagnosis:
        """The document, the evidence and the model."""
        base, model, traces = self.start.fit.model, self.model, self.start.traces
        samples = gather(base, model, traces)
        verdict, missing, record_state = self._verdict(), self._missing(), self._record_state(held)
        spectrum = over_frequency(samples, traces)
        found = places(samples, traces, self.selection.rounds, self.start.fit.cost, [m["effect"] for m in missing], self.output_unit,
                       self.input_unit, spectrum)
        document = {
            "version": 1, "verdict": verdict, "sentence": self._sentence(verdict, missing, found),
            "where": [] if verdict == "consistent" else [self._place(p) for p in found],
            "missing": missing, "remainder": self._remainder(verdict), "record_state": record_state, "fit": self.fits,
            "parameters": self._parameters(), "next_recording": next_recording(*self._rivals(), self.start.traces, self.input_unit, self.output_unit),
            "data": self._data(), "seed": self.seed, "versions": _versions(),
        }
        if verdict == "unexplained":
            document["suspects"] = [{"effect": c.name, "sentence": f"buys {c.gain:.1f} of {self.start.fit.cost:.1f} of the misfit"}
                                    for c in (self.selection.rounds[0] if self.selection.rounds else ())[:3] if c.name in BY_NAME]
        views = self._views(samples, verdict)
        evidence = Evidence(tuple(views), tuple(self._ladder()), residual_map(samples), self.noise, self.output_unit,
                            self.recordings[0].input_unit, spectrum)
        return Diagnosis(document, evidence, self._improved(), self.rig.plant(model if self.told_effects else base))

    # numbers

    @cached_property
    def fits(self) -> dict:
        """The errors before and after, as diagnosis.json has them."""
        c, base, model = self.confirmed, self.start.fit.model, self.model
        train = [pooled([scored(m, t, k) for k, t in enumerate(self.start.traces)]).rmse for m in (base, model)]
        again = [[recalibrated(m, fold.held_out)[0] for m, fold in zip(models, c.parts)] for models in (c.base_models, c.models)]
        return {"train_rmse_before_rad": train[0], "train_rmse_after_rad": train[1],
                "heldout_rmse_before_rad": pooled(c.before).rmse, "heldout_rmse_after_rad": pooled(c.after).rmse,
                "recalibrated_rmse_before_rad": pooled(again[0]).rmse, "recalibrated_rmse_after_rad": pooled(again[1]).rmse,
                "mujoco_heldout_rmse_before_rad": self.multibody[0], "mujoco_heldout_rmse_after_rad": self.multibody[1],
                "noise_floor_rad": self.noise, "heldout_from": c.sentence,
                "mujoco_heldout_from": f"the MuJoCo plant ran {', '.join(fold.held_out.name for fold in run_in_mujoco(c.parts))} of what was held out",
                "selection_cost_before": self.start.fit.cost, "selection_cost_after": self.selection.chosen.cost}

    @cached_property
    def explained(self) -> float:
        """Share of the squared held-out free-run error above the noise that the named effects take away.

        Where the rig has changed between the days (held-out recordings of their own), raw or recalibrated, whichever tells more. Where stick
        and slip fork in one recording its free run is lost with any model and swamps the rest: the mean over recordings tells more then.
        """
        shares = []
        for kind in ("heldout", "recalibrated") if self.holdout else ("heldout",):
            above, left = (self.fits[f"{kind}_rmse_{when}_rad"] ** 2 - self.noise**2 for when in ("before", "after"))
            shares.append(min(max(1.0 - left / above, 0.0), 1.0) if above > 0 else 0.0)
        return max(*shares, self._explained_each())

    def _explained_each(self) -> float:
        """The mean of that share over the held-out recordings, or halves of one, whose error without the effects is above the noise.

        One whose free run is lost with and without them (ASTRAY) tells nothing, as long as there are others.
        """
        above = [(b.rmse / noise, a.rmse / noise) for b, a, noise in self.confirmed.shown if b.rmse > VISIBLE * noise]
        told = [ends for ends in above if min(ends) < ASTRAY] or above
        return float(np.mean([min(max(1.0 - (a**2 - 1.0) / (b**2 - 1.0), 0.0), 1.0) for b, a in told])) if told else 0.0

    def _more_is_missing(self) -> bool:
        return more_is_missing(self.left, left_by_sensor(self.start.fit.model, self.start.traces) if self.model.names else None)

    @property
    def told_effects(self) -> tuple[str, ...]:
        """The effects that are named: those of the model, if they account for half of what the baseline leaves."""
        return self.model.names if self.explained >= HALF else ()

    def _verdict(self) -> str:
        if self.told_effects or self.sensors:
            return "missing_physics"
        if self.model.names or self._more_is_missing() or self._astray():
            return "unexplained"
        return "consistent" if self._datasheet_explains() else "parameters_only"

    def _astray(self) -> bool:
        """Whether no held-out recording is met by a free run, though the observer, which is set right on the way, sees nothing amiss."""
        return all(s.rmse > ASTRAY * fold.held_out.sigma for s, fold in zip(self.confirmed.before, self.confirmed.parts))

    def _datasheet_explains(self) -> bool:
        known = self.datasheet.to_lumped() if self.datasheet is not None else {}
        if not {"a_2", "b"} <= known.keys():
            return False
        base = self.start.fit.model
        sheet = replace(base, values={**base.values, **{k: v for k, v in known.items() if k in base.values}})
        misfit = Blocks.of(self.start.traces).misfit(residuals(sheet, with_starts(sheet, self.start.traces), 5.0))
        return bool(np.all(np.isfinite(misfit))) and float(np.mean(score(misfit, 1.0))) < CONSISTENT

    def _missing(self) -> list[dict]:
        sensors = [self._symptom(name, values) for name, values in self.sensors.items()]
        effects = [self._effect(name) for name in self.told_effects]
        effects.sort(key=lambda e: (BY_NAME[e["effect"]].once, -float(np.sum(score(self.confirmed.without[e["effect"]].misfit, 1.0)))))
        return effects + sensors

    def _effect(self, name: str) -> dict:
        effect, c = BY_NAME[name], self.confirmed
        parameters = {p["name"]: p["entry"] for p in self._effect_parameters(name)}
        without = c.without[name]
        gain = float(np.sum(score(without.misfit, 1.0)) - np.sum(score(pooled(c.after).misfit, 1.0)))
        size = sum(np.isfinite(v) for v in dict(self.model.effects)[name])
        with_and_without = (None, None) if effect.local else (pooled(c.after).rmse, without.rmse)
        shown = {k: _shown(e["value"], e["unit"]) for k, e in parameters.items()}
        return {"effect": name, "sentence": effect.describe(shown), "subsystem": effect.subsystem, "parameters": parameters,
                "evidence": {"heldout_rmse_without_rad": with_and_without[1], "heldout_rmse_with_rad": with_and_without[0],
                             "delta_bic": 2 * gain - size * math.log(max(without.misfit.size, 2)), "p_value": c.p[name]},
                "probability": self._found(name)[1].get(name), "alternatives": self._alternatives(name)}

    def _effect_parameters(self, name: str):
        values, errors = dict(self.model.effects_of())[name], self._errors()
        for parameter, value in zip(BY_NAME[name].parameters, values):
            factor = self.inertia if self.inertia and parameter.kind in PER_INERTIA else 1.0
            finite = bool(np.isfinite(value))
            low_high = errors.get((name, parameter.name))
            yield {"name": parameter.name, "entry": self._per_recording(name, parameter, factor) | {
                "value": float(value) * factor if finite else None,
                "unit": unit_of(parameter.kind, self.output_unit, self.input_unit, bool(self.inertia)),
                "ci95": [float(v) * factor for v in low_high] if low_high and finite else [None, None],
                "meaning": parameter.meaning}}

    def _per_recording(self, name: str, parameter: Parameter, factor: float) -> dict:
        """The values in every training recording of a parameter that has one of its own in each; null where the effect is absent."""
        if not parameter.per_record:
            return {}
        columns = [p.name for p in BY_NAME[name].parameters if p.per_record]
        values = self.model.local[name][:, columns.index(parameter.name)]
        return {"per_recording": [float(v) * factor if np.isfinite(v) else None for v in values]}

    def _symptom(self, name: str, values: np.ndarray) -> dict:
        """A sensor effect that was found in the data itself."""
        effect = BY_NAME[name]
        entries = {p.name: {"value": float(v), "unit": unit_of(p.kind, self.output_unit, self.input_unit), "ci95": [None, None],
                            "meaning": p.meaning} for p, v in zip(effect.parameters, values)}
        return {"effect": name, "sentence": effect.describe({k: _shown(e["value"], e["unit"]) for k, e in entries.items()}),
                "subsystem": effect.subsystem, "parameters": entries,
                "evidence": {"heldout_rmse_without_rad": None, "heldout_rmse_with_rad": None, "delta_bic": None, "p_value": None},
                "alternatives": []}

    def _alternatives(self, name: str) -> list[dict]:
        """What of the round in which the effect was found the recordings do not exclude, and how far it is from the answer on them."""
        ranked, weights = self._found(name)
        others = [c for c in ranked[1:] if weights[c.name] > TIED]
        apart = isolability(ranked[0].fit, [c.fit for c in others], self.start.traces) if others else []
        return [{"effect": c.name, "probability": weights[c.name],
                 "why_not_excluded": f"costs {abs(d.cost):.2f} {'more' if d.cost >= 0 else 'less'} than {name}, which explains {ranked[0].gain:.1f}; the two "
                                     f"simulations differ by {d.sigmas:.2g} times the noise on these recordings",
                 "difference_sigma": d.sigmas, "cost_difference": d.cost} for c, d in zip(others, apart)]

    def _found(self, name: str) -> tuple[list[Candidate], dict[str, float]]:
        """The effects that were compared when this one was found, itself first, and their probabilities."""
        for ranked in self.selection.rounds:
            named = [c for c in ranked if c.name in BY_NAME and c.gain > 0]
            if named and named[0].name == name:
                return named, probabilities({c.name: c.fit for c in named})
        return [], {}

    def _rivals(self) -> tuple[tuple[str, Fit], list[tuple[str, Fit, float]]]:
        """The answer and what the recordings do not exclude in its place, with probabilities: of the effect with the least certain name."""
        chosen = self.selection.chosen
        best = (" and ".join(self.model.names) or "baseline", chosen), []
        for name in self.model.names or [ranked[0].name for ranked in self.selection.rounds[-1:] if ranked and self._more_is_missing()]:
            ranked, weights = self._found(name)
            rivals = [(c.name, c.fit, weights[c.name]) for c in ranked[1:] if weights[c.name] > TIED]
            if sum(r[2] for r in rivals) > sum(r[2] for r in best[1]):
                best = (name, ranked[0].fit), rivals
        return best

    def _errors(self) -> dict:
        """95 % intervals of every fitted number, by (owner, name)."""
        if not hasattr(self, "_cached"):
            model = replace(self.model, states=None)
            left_out = self.confirmed.models if self.confirmed.parts[0].training is not None and len(self.confirmed.models) > 2 else []
            layout = model.layout()
            z, out = model.vector(layout), {}
            traces, tau = self.start.traces, self.selection.tau
            for f, q, e in zip(layout, z, np.hypot(half_widths(model, traces, left_out, tau), unseen_widths(model, traces, tau))):
                if (f.owner, f.name) in out:  # of a further recording
                    continue
                ends = f.ends(q, e)
                if f.name == "b" and model.values["b"] < 0:
                    ends = (-ends[1], -ends[0])
                out[(f.owner, f.name)] = ends
            object.__setattr__(self, "_cached", out)
        return self._cached

    def _parameters(self) -> dict:
        known = self.datasheet.to_lumped() if self.datasheet is not None else {}
        y, u = self.output_unit, self.input_unit
        units = {"a_1": "1/s^2", "a_2": "1/s", "b": f"{y}/s^2/{u}", "c_1": f"{y}/s^2", "c_2": f"{y}/s^2", "theta_0": y, "tau_e": "s",
                 "emf_share": "-", "ampere": f"{y}/s^2/A"}
        rows, errors = {}, self._errors()
        for name in BASE:
            fitted = ("base", name) in errors
            if not fitted and name in ("tau_e", "emf_share", "ampere"):
                continue
            absent = name in ("a_1", "c_1") and self.model.values[name] == 0
            value = float(self.model.values[name]) if fitted or absent else None
            rows[name] = {"value": value, "unit": units[name], "ci95": list(errors[("base", name)]) if fitted else [None, None],
                          "datasheet": known.get(name), "identifiable": fitted or absent}
        for name, value in (self.datasheet.parameters if self.datasheet is not None else {}).items():
            if name != "theta_0":
                rows[name] = {"value": None, "unit": SHEET_UNITS[name], "ci95": [None, None], "datasheet": value, "identifiable": False}
        rows |= self._combinations(rows)
        return rows

    def _combinations(self, rows: dict) -> dict:
        """The combinations of Table 1's letters that position and voltage can tell (notes in the README)."""
        if self.datasheet is None or not self.datasheet.parameters:
            return {}
        named = {"k_s/J": "a_1", "n K_t/(J R)": "b", "T_LH/J": "c_1", "F_c/J": "c_2", "L/R": "tau_e", "n K_t/J": "ampere"}
        return {combination: rows[name] for combination, name in named.items() if name in rows}

    def _record_state(self, held: list[Trace]) -> list[dict]:
        """What differs between recordings beyond chance: training ones as fitted, held-out ones as recalibrated."""
        out, unknown = [], (None, None)
        states, errors = dict(self.model.states or {}), self._state_errors()
        later = [recalibrated(model, h)[1] for model, h in zip(self.confirmed.models, held)]
        count = len(self.start.traces)
        for name in STATES:
            rest = 0.0 if name == "offset" else 1.0
            values = [*(states[name] if name in states else [rest] * count), *(s.get(name, (rest,))[0] for s in later)]
            ci95 = [*(errors.get((name, k), unknown) for k in range(count)), *(s[name][1:] if name in s else unknown for s in later)]
            least = LEAST_OFFSET * self.start.fit.model.scales.position if name == "offset" else LEAST_FACTOR
            if any(abs(v - rest) > least and not low <= rest <= high for v, (low, high) in zip(values, ci95) if low is not None):
                unit = self.output_unit if name == "offset" else "-"
                spread = _shown(max(values), unit), _shown(min(values), unit)
                out.append({"name": name, "unit": unit, "values": [float(v) for v in values], "ci95": [list(ends) for ends in ci95],
                            "sentence": f"{name.replace('_', ' ')} differs between the recordings: from {spread[1]} to {spread[0]}"})
        return out

    def _state_errors(self) -> dict[tuple[str, int], tuple[float, float]]:
        """95 % intervals of the training recordings' states, by (state, recording)."""
        if not self.model.states:
            return {}
        layout = self.model.layout()
        widths = half_widths(self.model, self.start.traces, (), self.selection.tau)
        return {(f.owner, f.index): f.ends(q, w) for f, q, w in zip(layout, self.model.vector(layout), widths) if f.owner in STATES}

    # words

    def _sentence(self, verdict: str, missing: list, found: list[Place]) -> str:
        fits = self.fits
        before, after = (_shown(fits[f"heldout_rmse_{w}_rad"], self.output_unit) for w in ("before", "after"))
        if verdict == "consistent":
            return "The datasheet's model explains these recordings within their noise: nothing is missing."
        if verdict == "parameters_only":
            return "Only the numbers were off: with refitted parameters the model explains these recordings within their noise."
        if verdict == "missing_physics":
            names = "; ".join(m["sentence"] for m in missing)
            if not self.told_effects:
                return f"Only the sensor shows: {names}."
            told = "held-out error"
            if fits["heldout_rmse_after_rad"] > math.sqrt(HALF) * fits["heldout_rmse_before_rad"] and self.holdout:
                told = "held-out error, once gain, offset and friction level of that day are known,"
                before, after = (_shown(fits[f"recalibrated_rmse_{w}_rad"], self.output_unit) for w in ("before", "after"))
            return f"The model leaves out this: {names}. With it the {told} falls from {before} to {after}."
        place = next((p.sentence for p in found if p.axis != "subsystem"), "")
        return (f"Something acts here that no effect of the library accounts for (the best explains {self.explained:.0%} of the held-out "
                f"error); {place or 'it is spread over the whole record'}.")

    def _remainder(self, verdict: str) -> dict:
        significant = verdict == "unexplained" or self.told_effects != self.model.names or self._more_is_missing()
        words = "nothing beyond the noise is left" if not significant else "a mismatch is left that nothing named accounts for"
        left_sigma = {kind: math.sqrt(math.expm1(max(left, 0.0))) for kind, left in self.left.items()}
        return {"explained_share": self.explained, "significant": significant, "left_sigma": left_sigma,
                "sentence": f"{self.explained:.0%} of the squared held-out error above the noise is explained; {words}."}

    @staticmethod
    def _place(p: Place) -> dict:
        return {"axis": p.axis, "region": list(p.region) if p.region else None, "unit": p.unit, "label": p.label,
                "share_of_error": p.share_of_error, "share_of_time": p.share_of_time, "sentence": p.sentence}

    def _data(self) -> dict:
        every = [*self.recordings, *self.holdout]
        problems = [f"{r.name}: {p}" for r in every for p in r.problems] + self._degrees()
        return {"files": [r.name for r in every], "sha256": [r.sha256 for r in every], "output_unit": self.output_unit,
                "input_unit": self.input_unit, "problems": problems}

    def _degrees(self) -> list[str]:
        """A travel far beyond the datasheet's rest angle looks like degrees that are named radians."""
        y = np.concatenate([t.y[t.valid] for t in self.start.traces])
        if self.output_unit == "rad" and self.datasheet is not None and float(np.max(np.abs(y))) > 2 * math.pi:
            return [f"the output reaches {np.max(np.abs(y)):.3g} rad, more than a turn of a rudder: are these degrees?"]
        return []

    def _views(self, samples, verdict: str) -> list[RecordView]:
        out = []
        for model, base, fold in zip(self.confirmed.models, self.confirmed.base_models, self.confirmed.parts):
            t = fold.held_out
            out.append(RecordView(t.name, True, t.t, t.u, t.y, free_run(base, t), free_run(model, t), ()))
        held_names = {v.name for v in out}
        for k, t in enumerate(self.start.traces):
            spans = shaded(t, k, samples) if verdict in ("missing_physics", "unexplained") else ()
            if t.name in held_names and self.confirmed.parts[0].training is not None and len(self.start.traces) > 1:
                i = [v.name for v in out].index(t.name)
                out[i] = replace(out[i], shaded=spans)
            else:
                out.append(RecordView(t.name, False, t.t, t.u, t.y, free_run(self.start.fit.model, t, k), free_run(self.model, t, k), spans))
        return out

    def _ladder(self):
        c = self.confirmed
        yield Rung((), 0.0, 0.0, pooled(c.before).rmse, not self.model.names, "refitted baseline", self.start.fit.size)
        taken: tuple[str, ...] = ()
        for ranked in self.selection.rounds:
            for candidate in ranked:
                names = candidate.fit.model.names
                chosen = names == self.model.names
                yield Rung(names or (candidate.name,), candidate.gain, candidate.z, pooled(c.after).rmse if chosen else None, chosen,
                           "" if candidate.name in BY_NAME else "differs between recordings", candidate.fit.size)
            taken = ranked[0].fit.model.names if ranked else taken

    def _improved(self) -> Datasheet:
        """The improved model: refitted lumped values in [lumped], effects in a reader's units."""
        lumped = {k: float(self.model.values[k]) for k in ("a_1", "a_2", "b", "c_1", "c_2", "theta_0")}
        extra = {k: float(self.model.values[k]) for k in ("tau_e", "emf_share")}
        effects = []
        for name in self.told_effects:
            entries = {p["name"]: p["entry"]["value"] for p in self._effect_parameters(name)}
            effects.append((name, {k: v for k, v in entries.items() if v is not None}))
        effects += [(name, {p.name: float(v) for p, v in zip(BY_NAME[name].parameters, values)}) for name, values in self.sensors.items()]
        parameters = dict(self.datasheet.parameters) if self.datasheet is not None else {}
        return Datasheet(parameters=parameters, lumped=lumped, effects=tuple(effects), baseline=extra, name="model.toml")


SHEET_UNITS = {"J": "kg m^2", "B": "N m s/rad", "K_t": "N m/A", "K_e": "V s/rad", "k_s": "N m/rad", "T_LH": "N m", "F_c": "N m",
               "R": "ohm", "L": "H", "n": "-"}


def _shown(value: float | None, unit: str) -> str:
    """A number for a sentence: radians as degrees."""
    if value is None:
        return "none"
    if unit.startswith("rad") and not unit.startswith("rad/s^2"):
        return f"{math.degrees(value):.3g} deg{unit[3:]}"
    return f"{value:.3g}" if unit == "-" else f"{value:.3g} {unit}"


def _versions() -> dict:
    import numba
    import scipy

    return {"ers-mj": __version__, "python": platform.python_version(), "numpy": np.__version__, "scipy": scipy.__version__,
            "numba": numba.__version__}
