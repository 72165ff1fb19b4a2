"""What is known of a servo with a position loop when the work is done, and what follows from it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ers_mj.data.recording import Recording
from ers_mj.decisions import verdict as rules
from ers_mj.decisions.thresholds import POLICY, Policy
from ers_mj.diagnosis.errors_told import errors_told
from ers_mj.effects.gravity_imbalance import GravityImbalance
from ers_mj.plants.mujoco.looped import LoopedPlant
from ers_mj.plants.mujoco.plant import MechanicalPlant
from ers_mj.position_loop import beside
from ers_mj.position_loop.compared import Selection
from ers_mj.position_loop.confirmation import Confirmed, recalibrated
from ers_mj.position_loop.fit import Fit
from ers_mj.position_loop.intervals import Intervals
from ers_mj.position_loop.model import LoopModel
from ers_mj.position_loop.runs import Run
from ers_mj.position_loop.selection import Selector
from ers_mj.servo.datasheet import Datasheet

LAGS = 3  # samples over which what a model leaves is remembered
HELD_SECONDS = 6.0  # [s] of held-out recordings that the MuJoCo plant runs


@dataclass(frozen=True)
class LoopCase:
    """Recordings, runs, what was selected and confirmed, the intervals, and what was known of the servo before."""

    recordings: Sequence[Recording]
    holdout: Sequence[Recording]
    selector: Selector
    selection: Selection
    confirmed: Confirmed
    intervals: Intervals
    datasheet: Datasheet | None = None
    seed: int = 0
    policy: Policy = POLICY

    @property
    def runs(self) -> tuple[Run, ...]:
        return self.selector.runs

    @property
    def chosen(self) -> Fit:
        return self.selection.chosen

    @property
    def model(self) -> LoopModel:
        return self.chosen.model

    @property
    def base(self) -> LoopModel:
        return self.confirmed.base.model

    @property
    def output_unit(self) -> str:
        return self.recordings[0].output_unit

    @property
    def held(self) -> list[Run]:
        return [run for fold in self.confirmed.folds for run in fold.held]

    @property
    def noise(self) -> float:
        """The noise floor: that of the sensors, or what the answer leaves where that is less."""
        sensor = math.sqrt(float(np.mean([run.sigma**2 for run in self.held])))
        return min(sensor, self.train[1])

    @cached_property
    def train(self) -> tuple[float, float]:
        """Error of the free runs on what was fitted, before and after [output unit]."""
        errors = [
            np.concatenate([(run.y - model.predicted(run))[run.scored] for run in self.runs])
            for model in (self.base, self.model)
        ]
        before, after = (math.sqrt(float(np.mean(e**2))) for e in errors)
        return before, after

    # -- what decisions/verdict.py reads -------------------------------------------------------------------------------

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(x.name for x in self.selection.named)

    @property
    def sensors(self) -> tuple[str, ...]:
        return ()

    @property
    def suspects(self) -> tuple[str, ...]:
        return ()

    @property
    def recordings_differ(self) -> bool:
        return False

    @property
    def explained(self) -> float:
        c, noise = self.confirmed, self.noise
        return rules.share(c.before.rmse**2, c.after.rmse**2, noise**2)

    @cached_property
    def left_before(self) -> dict[str, float]:
        """What is left without the law that most is left without: what the loop itself does has no other form."""
        laws = {name for name in self.model.names if name != GravityImbalance.name}
        without = [left.fit.model for left in self.selection.left if left.name in laws]
        return {"output": max(map(self._remembered, without), default=0.0)}

    @cached_property
    def left(self) -> dict[str, float]:
        return {"output": self._remembered(self.model)}

    @property
    def left_elsewhere(self) -> float:
        return self.left["output"]

    @property
    def free_held(self) -> float:
        return self.confirmed.after.rmse / self.noise

    @property
    def least_astray(self) -> float:
        return self.confirmed.before.rmse / self.noise

    @property
    def datasheet_explains(self) -> bool:
        return False

    def _remembered(self, model: LoopModel) -> float:
        """ln(1 + power), in the noise's, of what a model leaves from sample to sample, a converter's own apart."""
        told = []
        for run in self.runs:
            e = np.where(run.scored, run.y - model.predicted(run), np.nan)
            pairs = [e[lag:] * e[:-lag] for lag in range(1, LAGS + 1)]
            kept = max(float(np.nanmean(np.concatenate(pairs))) - run.quantum**2 / 12.0, 0.0)
            told.append(math.log1p(kept / run.sigma**2))
        return float(np.mean(told))

    # -- what follows --------------------------------------------------------------------------------------------------

    @cached_property
    def told_effects(self) -> tuple[str, ...]:
        return tuple(rules.told_effects(self, self.policy))

    @cached_property
    def verdict(self) -> str:
        """One of diagnosis.json's verdicts."""
        return rules.verdict(self, self.policy)

    @cached_property
    def more_is_left(self) -> bool:
        """Whether a mismatch stays that nothing named accounts for."""
        return rules.is_more_left(self, self.policy)

    @cached_property
    def fits(self) -> dict:
        """The errors before and after, as diagnosis.json has them."""
        c = self.confirmed
        before, after = (recalibrated(models, c.folds, self.policy) for models in (c.before_models, c.models))
        multibody = self._in_mujoco(c.before_models), self._in_mujoco(c.models)
        return {
            "measure": "free_run",
            **errors_told(self.train, (c.before, c.after), (before, after), multibody),
            "noise_floor_rad": self.noise,
            "heldout_from": c.sentence,
            **self._beside,
            "mujoco_heldout_from": f"of what was held out the MuJoCo plant ran the first {HELD_SECONDS:.0f} s",
        }

    @property
    def _beside(self) -> dict:
        """Errors before and after of the drive signal that was recorded beside, in its own unit."""
        out = {}
        for word, model in (("before", self.base), ("after", self.model)):
            left = beside.errors(model, self.runs, [model.motion(run) for run in self.runs])
            if left:
                out[f"second_train_rmse_{word}"] = math.sqrt(float(np.mean(np.concatenate([e for _, e in left]) ** 2)))
        return out | ({"second": self.recordings[0].second_name} if out else {})

    def plant(self, model: LoopModel | None = None, run: Run | None = None) -> LoopedPlant:
        """The servo in MuJoCo: one joint of inertia 1 behind its loop."""
        model, run = model or self.model, run or self.runs[0]
        return LoopedPlant(
            MechanicalPlant(*model.plant_of(run), is_angle=self.output_unit == "rad", timestep=2.5e-4),
            model.of(run)[0],
        )

    def _in_mujoco(self, models: Sequence[LoopModel]) -> float | None:
        """Error of the MuJoCo plant on the beginning of what was held out; None where it runs away."""
        squares, left = [], HELD_SECONDS
        for model, fold in zip(models, self.confirmed.folds, strict=True):
            for run in fold.held:
                n = int(np.searchsorted(run.t, left))
                if n < 10:
                    break
                left -= float(run.t[n - 1])
                y = self.plant(model, run).simulate(run.t[:n], run.r[:n], run.start, run.before)
                squares.append(((run.y[:n] - y) ** 2)[np.isfinite(run.y[:n]) & run.enable[:n]])
        error = math.sqrt(float(np.mean(np.concatenate(squares))))
        return error if math.isfinite(error) else None
