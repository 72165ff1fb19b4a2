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
from ers_mj.diagnosis.mujoco_check import Rig, run_in_mujoco
from ers_mj.effects import BY_NAME
from ers_mj.estimation.baseline import Start
from ers_mj.estimation.fit import Fit, residuals, score
from ers_mj.estimation.initial_state import with_starts
from ers_mj.estimation.intervals import half_widths, slopes_of, unseen_widths
from ers_mj.selection.comparison import Candidate
from ers_mj.selection.confirmation import Confirmed
from ers_mj.selection.cross_validation import Score, pooled, recalibrated, scored
from ers_mj.selection.posterior import probabilities
from ers_mj.selection.stepwise import Selection
from ers_mj.selection.whiteness import left_by_sensor, left_elsewhere, more_is_missing
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.model import STATES, Model

CONSISTENT = 0.05  # cost per block up to which a model explains the data within its noise (an error of 0.3 sigma RMS)
TIED = 0.02  # weight from which a rival is told as an alternative
VISIBLE = 1.5  # noise levels of free-run error from which a recording shows a mismatch
FREE, FREE_HELD = (
    1.02,
    1.15,
)  # noise levels of free-run error up to which training and held-out recordings show nothing but noise
# times the noise by which the free run of every held-out recording misses: forks of stick and slip lose one or another
ASTRAY = 30.0
HALF = 0.5  # share of the squared held-out error that the named effects must explain
NEARLY_ALL = 0.98  # that another form of the right law explains
LEFT = (
    0.115  # of what is left in the output (see whiteness.py), 0.35 noise levels, from which it counts beside that share
)
# of the same in the recordings but the worst, 0.23 noise levels, from which a model without effects misses something:
# none of 65 nulls (4133 to 4135) leaves it
FAINT = 0.05
MUCH, NEARLY_GONE = (
    30.0,
    0.75,
    # held-out C that shows a mismatch beyond any doubt, and the share of it, or of what memory tells, that goes with what
    # acts
)
FAIR = 0.4  # share of the squared held-out error that is enough beside memory of which NEARLY_GONE goes
LOST = 6.0  # noise levels of free-run error after, from which stick and slip that fork are what a free run misses


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

    @cached_property
    def left_before(self) -> dict[str, float]:
        """What the refitted baseline leaves beyond the noise, by sensor."""
        return left_by_sensor(self.start.fit.model, self.start.traces)

    @property
    def inertia(self) -> float | None:
        return self.datasheet.parameters.get("J") if self.datasheet is not None else None

    @property
    def noise(self) -> float:
        traces = [fold.held_out for fold in self.confirmed.parts]
        return math.sqrt(float(np.mean([t.sigma**2 for t in traces])))

    @cached_property
    def fits(self) -> dict:
        """The errors before and after, as diagnosis.json has them."""
        c, base, model = self.confirmed, self.start.fit.model, self.model
        train = [pooled([scored(m, t, k) for k, t in enumerate(self.start.traces)]).rmse for m in (base, model)]
        return {
            "train_rmse_before_rad": train[0],
            "train_rmse_after_rad": train[1],
            "heldout_rmse_before_rad": pooled(c.before).rmse,
            "heldout_rmse_after_rad": pooled(c.after).rmse,
            "recalibrated_rmse_before_rad": self._again[0].rmse,
            "recalibrated_rmse_after_rad": self._again[1].rmse,
            "mujoco_heldout_rmse_before_rad": self.multibody[0],
            "mujoco_heldout_rmse_after_rad": self.multibody[1],
            "noise_floor_rad": self.noise,
            "heldout_from": c.sentence,
            "mujoco_heldout_from": f"of what was held out the MuJoCo plant ran {self._run_in_mujoco}",
            "selection_cost_before": self.start.fit.cost,
            "selection_cost_after": self.selection.chosen.cost,
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
        return tuple(
            pooled([recalibrated(m, fold.held_out)[0] for m, fold in zip(models, c.parts)])
            for models in (c.base_models, c.models)
        )

    @cached_property
    def explained(self) -> float:
        """Share of the squared held-out free-run error above the noise that the named effects take away.

        Where the rig has changed between the days (held-out recordings of their own), raw or recalibrated, whichever
        tells more. Where stick and slip fork in one recording its free run is lost with any model and swamps the rest:
        the mean over recordings tells more then.
        """
        shares, c = [], self.confirmed
        noise = math.sqrt(float(np.mean([fold.held_out.sure_noise**2 for fold in c.parts])))
        for ends in ((pooled(c.before), pooled(c.after)), *([self._again] if self.holdout else [])):
            shares.append(_share(*(score.sure**2 for score in ends), noise**2))
        return max(*shares, self._explained_each())

    def _explained_each(self) -> float:
        """The mean of that share over the held-out recordings, or halves of one, whose error without the effects is
        above the noise.

        One whose free run is lost with and without them tells nothing, as long as there are others: by ASTRAY, or,
        where the effects leave nothing beyond the noise (see whiteness.py), by LOST, since stick and slip must have
        forked then. Where there are no others the observer's held-out error tells their share. Where no error is above
        the noise, of which the estimate may be too large, and memory tells of a mismatch, memory tells the share.
        """
        forked = not more_is_missing(self.left, None)
        above = [(b, a, noise) for b, a, noise in self.confirmed.shown if b.sure > VISIBLE * noise]
        if not above and more_is_missing(self.left_before, None):
            kind = max(self.left_before, key=self.left_before.get)
            return _share(*(math.expm1(left[kind]) for left in (self.left_before, self.left)), 0.0)
        told = [ends for ends in above if min(ends[0].sure, ends[1].sure) < (LOST if forked else ASTRAY) * ends[2]]
        if told or not forked:
            shares = [_share(b.sure**2, a.sure**2, noise**2) for b, a, noise in told or above]
        else:
            shares = [_share(*(float(np.mean(np.maximum(s.misfit, 1.0))) for s in (b, a)), 1.0) for b, a, _ in above]
        return float(np.mean(shares)) if shares else 0.0

    def _goes_in_blocks(self) -> bool:
        """Whether nearly all of a large held-out C goes with the named effects: stick and slip that fork have lost the
        free runs then. Of what has no name a mimic takes away half (of 20 outsiders of 4157 to 4168 with one 0.55 at
        most, by what was fitted)."""
        before, after = (
            float(np.sum(score(pooled(scores).misfit, 1.0))) for scores in (self.confirmed.before, self.confirmed.after)
        )
        return before > MUCH and after < (1.0 - NEARLY_GONE) * before

    def _goes_from_memory(self) -> bool:
        """Whether nearly all that the output remembers of a mismatch goes with the named effects, and a FAIR share of
        the free-run error: one free run that stick and slip lose weighs as much as one that is met."""
        before, after = (max(left["output"], 0.0) for left in (self.left_before, self.left))
        return (
            self.explained >= FAIR and more_is_missing(self.left_before, None) and after < (1.0 - NEARLY_GONE) * before
        )

    @cached_property
    def more_is_missing(self) -> bool:
        """Whether the model leaves more than noise (see whiteness.py): of the output nothing where free runs leave
        none, whatever forks in the observer.
        """
        free = (
            self.fits["train_rmse_after_rad"] < FREE * self.noise
            and self.fits["heldout_rmse_after_rad"] < FREE_HELD * self.noise
        )
        left = {**self.left, "output": 0.0} if free else self.left
        if more_is_missing(left, self.left_before if self.model.names else None):
            return True
        return not (free or self.model.names) and left_elsewhere(self.model, self.start.traces) > FAINT

    @property
    def told_effects(self) -> tuple[str, ...]:
        """The effects that are named: those of the model, if they account for half of what the baseline leaves, in free
        run or, beyond doubt, in blocks or memory.
        """
        return self.model.names if self.explained >= HALF or self._goes_in_blocks() or self._goes_from_memory() else ()

    @cached_property
    def verdict(self) -> str:
        """One of diagnosis.json's verdicts."""
        if self.told_effects or self.sensors:
            return "missing_physics"
        if self.model.names or self.suspects or self.more_is_missing or self._astray():
            return "unexplained"
        return "consistent" if self._datasheet_explains() else "parameters_only"

    @property
    def more_is_left(self) -> bool:
        """Whether a mismatch stays that nothing named accounts for."""
        return (
            self.verdict == "unexplained"
            or bool(self.suspects)
            or self.told_effects != self.model.names
            or self.more_is_missing
            or self._is_a_part()
        )

    def _is_a_part(self) -> bool:
        """Whether memory and held-out error agree that the named effects are a part only, as the mimic of an unknown
        effect is.
        """
        return (
            bool(self.told_effects)
            and self.explained < NEARLY_ALL
            and self.left["output"] > LEFT
            and self.fits["heldout_rmse_after_rad"] < LOST * self.noise
        )

    def _astray(self) -> bool:
        """Whether no held-out recording is met by a free run, though the observer, which is set right on the way, sees
        nothing amiss.
        """
        return all(
            s.rmse > ASTRAY * fold.held_out.sigma for s, fold in zip(self.confirmed.before, self.confirmed.parts)
        )

    def _datasheet_explains(self) -> bool:
        known = self.datasheet.to_lumped() if self.datasheet is not None else {}
        if not {"a_2", "b"} <= known.keys():
            return False
        base = self.start.fit.model
        sheet = replace(base, values={**base.values, **{k: v for k, v in known.items() if k in base.values}})
        misfit = Blocks.of(self.start.traces).misfit(residuals(sheet, with_starts(sheet, self.start.traces), 5.0))
        return bool(np.all(np.isfinite(misfit))) and float(np.mean(score(misfit, 1.0))) < CONSISTENT

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
        least certain name. Of a law without a name the effect that explained most before."""
        if self.suspects:
            law, first = (
                self.suspects[0],
                [
                    c
                    for ranked in self.selection.rounds[:1]
                    for c in ranked
                    if c.name in BY_NAME and c.name not in self.model.names
                ],
            )
            return (law.name, law.fit), [
                (c.name, c.fit, probabilities({law.name: law.fit, c.name: c.fit})[c.name]) for c in first[:1]
            ]
        chosen = self.selection.chosen
        best = (" and ".join(self.model.names) or "baseline", chosen), []
        for name in self.model.names or [
            ranked[0].name for ranked in self.selection.rounds[-1:] if ranked and self.more_is_missing
        ]:
            ranked, weights = self.found(name)
            rivals = [(c.name, c.fit, weights[c.name]) for c in ranked[1:] if weights[c.name] > TIED]
            if sum(r[2] for r in rivals) > sum(r[2] for r in best[1]):
                best = (name, ranked[0].fit), rivals
        return best

    @cached_property
    def errors(self) -> dict[tuple[str, str], tuple[float, float]]:
        """95 % intervals of every fitted number, by (owner, name)."""
        model = replace(self.model, states=None)
        left_out = (
            self.confirmed.models
            if self.confirmed.parts[0].training is not None and len(self.confirmed.models) > 2
            else []
        )
        layout = model.layout()
        z, out = model.vector(layout), {}
        traces, tau = self.start.traces, self.selection.tau
        jacobian = slopes_of(model, traces)
        for f, q, e in zip(
            layout,
            z,
            np.hypot(half_widths(model, traces, left_out, tau, jacobian), unseen_widths(model, traces, tau, jacobian)),
        ):
            if (f.owner, f.name) in out:  # of a further recording
                continue
            ends = f.ends(q, e)
            if f.name == "b" and model.values["b"] < 0:
                ends = (-ends[1], -ends[0])
            out[(f.owner, f.name)] = ends
        return out

    def state_errors(self) -> dict[tuple[str, int], tuple[float, float]]:
        """95 % intervals of the training recordings' states, by (state, recording)."""
        if not self.model.states:
            return {}
        layout = self.model.layout()
        widths = half_widths(self.model, self.start.traces, (), self.selection.tau)
        return {
            (f.owner, f.index): f.ends(q, w)
            for f, q, w in zip(layout, self.model.vector(layout), widths)
            if f.owner in STATES
        }


def _share(before: float, after: float, noise: float) -> float:
    """Share of a squared error ``before`` that is gone ``after``, above the squared ``noise``."""
    return min(max(1.0 - (after - noise) / (before - noise), 0.0), 1.0) if before > noise else 0.0
