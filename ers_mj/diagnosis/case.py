"""What is known of a case when the work is done, and what follows from it: the share that is explained, the verdict,
the intervals.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ers_mj.data.prepared import Blocks
from ers_mj.data.recording import Recording
from ers_mj.decisions import verdict as rules
from ers_mj.decisions.explained import is_consistent
from ers_mj.decisions.thresholds import POLICY, Policy
from ers_mj.diagnosis.errors_told import errors_told
from ers_mj.diagnosis.mujoco_check import Rig, run_in_mujoco
from ers_mj.diagnosis.unexcited import is_unexcited
from ers_mj.effects import BY_NAME
from ers_mj.estimation.baseline import Start
from ers_mj.estimation.initial_state import with_starts
from ers_mj.estimation.intervals import half_widths
from ers_mj.estimation.objective import Fit, residuals
from ers_mj.selection.budget import SEARCH, Search
from ers_mj.selection.comparison import Candidate
from ers_mj.selection.confirmation import Confirmed
from ers_mj.selection.cross_validation import Score, pooled, recalibrated, scored
from ers_mj.selection.measure import FREE_RUN
from ers_mj.selection.posterior import probabilities
from ers_mj.selection.stepwise import Selection
from ers_mj.selection.unknown import Unknown, unknown
from ers_mj.selection.whiteness import left_by_sensor, left_elsewhere
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.model import DRIFTS, OBSERVER_RATE, STATES, Model


@dataclass(frozen=True)
class Case:
    """Everything that is known when the work is done, and what follows from it; ``suspects`` are the laws without a
    name that act here (see confounders.py)."""

    recordings: Sequence[Recording]
    holdout: list[Recording]
    datasheet: Datasheet | None
    start: Start
    selection: Selection
    confirmed: Confirmed
    sensors: Mapping[str, np.ndarray]
    suspects: tuple[Candidate, ...]
    seed: int
    rig: Rig
    multibody: tuple[float | None, float | None]
    policy: Policy = POLICY
    search: Search = SEARCH

    @property
    def model(self) -> Model:
        return self.selection.chosen.model

    @property
    def cut_short(self) -> bool:
        """Whether a budget of simulation ended the rounds or a refit."""
        effort = self.model.effort
        return self.selection.cut_short or effort is not None and effort.is_cut

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

    @cached_property
    def left_before(self) -> dict[str, float]:
        """What the refitted baseline leaves beyond the noise, by sensor."""
        return left_by_sensor(self.start.fit.model, self.start.traces)

    @property
    def inertia(self) -> float | None:
        return self.datasheet.parameters.get("J") if self.datasheet is not None else None

    @cached_property
    def scatter(self) -> float:
        """By what share the datasheet's letters are off, as far as what follows from them could be told."""
        told = {name: self.model.values[name] for owner, name in self.errors if owner == "base"}
        return self.datasheet.scatter(told) if self.datasheet is not None else 0.0

    @property
    def noise(self) -> float:
        traces = [fold.held_out for fold in self.confirmed.parts]
        return math.sqrt(float(np.mean([t.sigma**2 for t in traces])))

    @cached_property
    def fits(self) -> dict:
        """The errors before and after, as diagnosis.json has them."""
        c, traces = self.confirmed, list(enumerate(self.start.traces))

        def left_in_training(model: Model) -> float:
            return pooled([scored(model, t, k, measure=c.measure) for k, t in traces]).rmse

        ran = f"of what was held out the MuJoCo plant ran {self._run_in_mujoco if self.search.in_mujoco else 'nothing'}"
        train = left_in_training(self.start.fit.model), left_in_training(self.model)
        again = self._again[0].rmse, self._again[1].rmse
        return {
            "measure": c.measure.name,
            "window_s": c.measure.window_s,
            **errors_told(train, (pooled(c.before), pooled(c.after)), again, self.multibody),
            **self._free_run,
            "noise_floor_rad": self.noise,
            "heldout_from": c.sentence,
            "mujoco_heldout_from": ran,
            "selection_cost_before": self.start.fit.cost,
            "selection_cost_after": self.selection.chosen.cost,
        }

    @property
    def _free_run(self) -> dict[str, float]:
        """The held-out errors of one free run, to be set beside those of others, where windows are the measure."""
        c = self.confirmed
        if c.measure == FREE_RUN:
            return {}
        ends = ("before", c.base_models), ("after", c.models)
        return {
            f"heldout_free_run_rmse_{when}_rad": pooled([scored(m, f.held_out) for m, f in zip(some, c.parts)]).rmse
            for when, some in ends
        }

    @property
    def _run_in_mujoco(self) -> str:
        ran = run_in_mujoco(self.confirmed.parts)
        cut = ran[0].t.size < self.confirmed.parts[0].held_out.t.size
        return (
            f"the first {ran[0].t[-1] - ran[0].t[0]:.0f} s of {ran[0].name}"
            if cut
            else ", ".join(trace.name for trace in ran)
        )

    @cached_property
    def _again(self) -> tuple[Score, Score]:
        """The held-out scores before and after, recalibrated."""
        c = self.confirmed
        before, after = (
            pooled([recalibrated(m, fold.held_out, c.measure).score for m, fold in zip(models, c.parts)])
            for models in (c.base_models, c.models)
        )
        return before, after

    # -- what decisions/verdict.py reads ----------------------------------------------------------------------------

    @property
    def names(self) -> tuple[str, ...]:
        """The effects that may be named: none where the input never changes, which can tell no two of them apart."""
        return () if is_unexcited(self.start.traces) else self.model.names

    @property
    def recordings_differ(self) -> bool:
        """Whether each recording that is held out in turn has a state to itself."""
        return not self.holdout and bool(self.own_states)

    @property
    def own_states(self) -> list[str]:
        """What drifts from one training recording to the next."""
        return [name for name in self.model.states or {} if name in DRIFTS]

    @cached_property
    def explained(self) -> float:
        """Share of the squared held-out free-run error above the noise that the named effects take away.

        Where the rig has changed between the days (held-out recordings of their own, or such as differ), raw or
        recalibrated, whichever tells more. Where stick and slip fork in one recording its free run is lost with any
        model and swamps the rest: the mean over recordings tells more then.
        """
        c = self.confirmed
        noise = math.sqrt(float(np.mean([fold.held_out.sure_noise**2 for fold in c.parts])))
        ends = [(pooled(c.before), pooled(c.after)), *([self._again] if self.holdout or self.recordings_differ else [])]
        shares = [rules.share(before.sure**2, after.sure**2, noise**2) for before, after in ends]
        each = rules.explained_each(self._shown, self.left_before, self.left, self.policy)
        return max(*shares, each)

    @property
    def _shown(self) -> list[rules.Shown]:
        def misfit(s: Score) -> float:
            return float(np.mean(np.maximum(s.misfit, 1.0)))

        return [rules.Shown(b.sure, a.sure, noise, misfit(b), misfit(a)) for b, a, noise in self.confirmed.shown]

    @cached_property
    def left_elsewhere(self) -> float:
        return left_elsewhere(self.model, self.start.traces)

    @property
    def free_held(self) -> float:
        return self.fits["heldout_rmse_after_rad"] / self.noise

    @property
    def least_astray(self) -> float:
        c = self.confirmed
        return min(s.rmse / fold.held_out.sigma for s, fold in zip(c.before, c.parts))

    @cached_property
    def datasheet_explains(self) -> bool:
        known = self.datasheet.to_lumped() if self.datasheet is not None else {}
        if not {"a_2", "b"} <= known.keys():
            return False
        base = self.start.fit.model
        sheet = replace(base, values={**base.values, **{k: v for k, v in known.items() if k in base.values}})
        left = residuals(sheet, with_starts(sheet, self.start.traces), OBSERVER_RATE)
        return is_consistent(Blocks.of(self.start.traces).misfit(left), self.policy)

    # -- what stays unknown ------------------------------------------------------------------------------------------

    @property
    def answer(self) -> Model:
        """The model that is told: the baseline where nothing of it may be named."""
        return self.model if self.told_effects or not self.model.names else self.start.fit.model

    @cached_property
    def unknown(self) -> Unknown | None:
        """What nothing named accounts for, as tables beside the answer; None where nothing is left or no table pays."""
        answer, c = self.answer, self.confirmed
        plant = answer.plant()
        if not self.search.tabled or plant.coupled or plant.bends or not self.more_is_left:
            return None
        models = c.models if answer is self.model else c.base_models
        return unknown(answer, models, self.start.traces, c.parts, c.measure, self.selection.tau, self.policy)

    # -- what follows --------------------------------------------------------------------------------------------------

    @cached_property
    def told_effects(self) -> tuple[str, ...]:
        """The effects that are named."""
        return tuple(rules.told_effects(self, self.policy))

    @cached_property
    def verdict(self) -> str:
        """One of diagnosis.json's verdicts."""
        return rules.verdict(self, self.policy)

    @cached_property
    def more_is_missing(self) -> bool:
        """Whether the model leaves more than noise."""
        return rules.is_more_missing(self, self.policy)

    @cached_property
    def more_is_left(self) -> bool:
        """Whether a mismatch stays that nothing named accounts for."""
        return rules.is_more_left(self, self.policy)

    def found(self, name: str) -> tuple[list[Candidate], dict[str, float]]:
        """The effects that were compared when this one was found, itself first, and their probabilities."""
        for ranked in self.selection.rounds:
            named = [c for c in ranked if c.name in BY_NAME and c.gain > 0]
            if named and named[0].name == name:
                if named[0].beside is not None:  # it took another's place: as they were compared then
                    named = [replace(c, fit=c.beside) for c in named if c.beside is not None]
                return named, probabilities({c.name: c.fit for c in named})
        return [], {}

    def rivals(self) -> tuple[tuple[str, Fit], list[tuple[str, Fit, float]]]:
        """The answer and what the recordings do not exclude in its place, with probabilities: of the effect with the
        least certain name. Of a law without a name the effect that explained most before.
        """
        if self.suspects:
            return self._rivals_of_a_suspect()
        best: tuple[tuple[str, Fit], list[tuple[str, Fit, float]]]
        best = (" and ".join(self.model.names) or "baseline", self.selection.chosen), []
        for name in self.model.names or self._last_leader():
            ranked, weights = self.found(name)
            rivals = [(c.name, c.fit, weights[c.name]) for c in ranked[1:] if weights[c.name] > self.policy.tied]
            if sum(r[2] for r in rivals) > sum(r[2] for r in best[1]):
                best = (name, ranked[0].fit), rivals
        return best

    def _last_leader(self) -> list[str]:
        """What led the last round where nothing is named, though something is missing."""
        return [ranked[0].name for ranked in self.selection.rounds[-1:] if ranked and self.more_is_missing]

    def _rivals_of_a_suspect(self) -> tuple[tuple[str, Fit], list[tuple[str, Fit, float]]]:
        law, names = self.suspects[0], self.model.names
        first = [c for ranked in self.selection.rounds[:1] for c in ranked if c.name in BY_NAME and c.name not in names]
        return (law.name, law.fit), [
            (c.name, c.fit, probabilities({law.name: law.fit, c.name: c.fit})[c.name]) for c in first[:1]
        ]

    @cached_property
    def errors(self) -> dict[tuple[str, str], tuple[float, float]]:
        """95 % intervals of every fitted number, by (owner, name)."""
        model, out = self.model.of_records(range(len(self.start.traces))), {}
        layout = model.layout()
        for f, q, e in zip(layout, model.vector(layout), self.confirmed.widths):
            if (f.owner, f.name) in out:  # of a further recording
                continue
            ends = f.ends(q, e)
            if f.name == "b" and model.values["b"] < 0:
                ends = (-ends[1], -ends[0])
            out[(f.owner, f.name)] = ends
        return out

    def state_errors(self, model: Model) -> dict[tuple[str, int], tuple[float, float]]:
        """95 % intervals of the training recordings' states under a model, by (state, recording)."""
        if not model.states:
            return {}
        layout = model.layout()
        widths = half_widths(model, self.start.traces, (), self.selection.tau)
        return {
            (f.owner, f.index): f.ends(q, w)
            for f, q, w in zip(layout, model.vector(layout), widths)
            if f.owner in STATES
        }
