"""An identified model as a MuJoCo plant: its free runs of recordings, and plant.xml."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ers_mj.data.prepared import Trace
from ers_mj.estimation.initial_state import fitted_start
from ers_mj.plants.mujoco.bodies import bodily
from ers_mj.plants.mujoco.plant import MechanicalPlant
from ers_mj.plants.reduced import lumped
from ers_mj.selection.cross_validation import Fold
from ers_mj.servo.model import Model

HELD_SECONDS, LEFT_OUT_SECONDS = (
    10.0,
    1.5,
)  # [s] of held-out recordings, and of those left out in turn, that are run in MuJoCo, which takes a thousand times as
# long as the reduced model


def run_in_mujoco(parts: Sequence[Fold]) -> list[Trace]:
    """The first of the recordings held out (HELD_SECONDS) or left out in turn (LEFT_OUT_SECONDS): as many as last so
    long together, or the first one's beginning."""
    traces, most = [fold.held_out for fold in parts], HELD_SECONDS if parts[0].training is None else LEFT_OUT_SECONDS
    ends = np.cumsum([trace.t[-1] - trace.t[0] for trace in traces])
    whole = int(np.searchsorted(ends, most, side="right"))
    first = traces[0]
    return traces[:whole] or [first.part(0, int(np.searchsorted(first.t, first.t[0] + most)), first.start)]


@dataclass(frozen=True)
class Rig:
    """What the shape of the MuJoCo plant follows from: the datasheet's parameters, and whether the output is an
    angle.
    """

    parameters: Mapping[str, float]
    is_angle: bool

    def plant(self, model: Model) -> MechanicalPlant:
        """The identified model as a MuJoCo plant: the rudder system where the datasheet tells its inertia, one lumped
        joint else.
        """
        shape = bodily(self.parameters, self.is_angle, model.values["b"])
        return MechanicalPlant(lumped(model.values), model.effects_of(), parameters=shape, is_angle=self.is_angle)

    def free_run(self, model: Model, trace: Trace) -> np.ndarray:
        """Output (N,) of the MuJoCo plant under a recording's input, from the initial state that the reduced model
        fits.
        """
        reduced, run = model.staged(trace, 0, 0.0, fitted_start(model, trace))
        return (
            self.plant(model)
            .simulate(trace.t, reduced.fed(trace.u), run["start"], enable=trace.enable, load=trace.load)
            .measured
        )

    def rmse(self, models: Sequence[Model], parts: Sequence[Fold], jobs: int) -> float | None:
        """Pooled free-run error [output unit] of the MuJoCo plants on what each model has not seen (see run_in_mujoco);
        None where one runs away.
        """
        traces = run_in_mujoco(parts)
        with ThreadPoolExecutor(jobs) as pool:
            outputs = list(pool.map(self.free_run, models, traces))
        errors = np.concatenate([(trace.y - y)[trace.valid] for y, trace in zip(outputs, traces)])
        return math.sqrt(float(np.mean(errors**2))) if np.all(np.isfinite(errors)) else None
