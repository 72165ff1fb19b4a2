"""A motion for the eye: what a plant's joints do frame by frame, and what was measured beside it.

datasheet + options -> MechanicalPlant -> motion -> Replay
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from ers_mj.data.prepared import Trace
from ers_mj.errors import InputError
from ers_mj.plants.mujoco.bodies import bodily
from ers_mj.plants.mujoco.looped import LoopedPlant
from ers_mj.plants.mujoco.plant import MechanicalPlant
from ers_mj.plants.mujoco.staging import staged
from ers_mj.plants.reduced import lumped
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.simulation import inertia_of, kernel_effects


@dataclass(frozen=True, eq=False)
class Replay:
    """A model on its stage and F moments of it.

    Attributes:
        model: what is shown.
        t: (F,) [s], from 0.
        qpos: (F, nq) its joints.
        theta: (F,) the simulated output [output unit], NaN in a model that has none.
        measured: (F,) the measured output, NaN where missing; None where nothing was measured.
        output_unit: "rad", "m" or "V".
    """

    model: mujoco.MjModel
    t: np.ndarray
    qpos: np.ndarray
    theta: np.ndarray
    measured: np.ndarray | None = None
    output_unit: str = "rad"

    def only(self, k: int) -> Replay:
        """One moment of it."""
        one = slice(k, k + 1)
        return replace(
            self,
            t=self.t[one],
            qpos=self.qpos[one],
            theta=self.theta[one],
            measured=None if self.measured is None else self.measured[one],
        )

    def still(self) -> Replay:
        """The moment that says most: the largest difference from what was measured, the last without a measurement."""
        if self.measured is None or not np.isfinite(self.measured - self.theta).any():
            return self.only(self.t.size - 1)
        return self.only(int(np.nanargmax(np.abs(self.measured - self.theta))))


def plant_of(
    datasheet: Datasheet, linkage: str = "constant", gap: float = 0.0, output_unit: str = "rad"
) -> MechanicalPlant:
    """The MuJoCo plant of a datasheet or a model with its effects: the rudder system or one lumped joint.

    Args:
        linkage: "constant" or "rod".
        gap: half-width of a play [output unit].

    Raises:
        InputError: the datasheet lacks b, or the options contradict it.
    """
    values = datasheet.to_lumped() | {"tau_e": 0.0} | dict(datasheet.baseline)
    if "b" not in values:
        raise InputError(
            f"{datasheet.name or 'the datasheet'}: cannot be shown, it needs b, or J, K_t and R from which b follows"
        )
    effects, is_angle = kernel_effects(datasheet.effects, inertia_of(datasheet)), output_unit == "rad"
    shape = bodily(datasheet.parameters, is_angle, values["b"])
    return MechanicalPlant(lumped(values), effects, shape, linkage, gap, is_angle)


def posed(
    plant: MechanicalPlant | LoopedPlant,
    t: np.ndarray,
    theta: np.ndarray,
    measured: np.ndarray | None = None,
    theta_m: np.ndarray | None = None,
    output_unit: str = "rad",
) -> Replay:
    """The plant put at outputs theta (F,), its drive at theta_m (F,), theta where that is not given."""
    drive = theta if theta_m is None else theta_m
    shown = theta if measured is None else np.concatenate([theta, measured])
    model = staged(plant.spec(), max(float(np.nanmax(np.abs(shown))), 1e-6))
    qpos = np.array([plant.positions(x, m) for x, m in zip(theta, drive, strict=True)])
    return Replay(model, t - t[0], qpos, theta, measured, output_unit)


def simulated(plant: MechanicalPlant, t: np.ndarray, u: np.ndarray, moments: np.ndarray) -> Replay:
    """The plant from rest under u (N,) at t (N,) [s], shown at the samples `moments` (F,)."""
    motion = plant.simulate(t, u)
    refuse_runaway(t, motion.theta)
    return posed(
        plant, t[moments], motion.theta[moments], None, motion.theta_m[moments], "rad" if plant.is_angle else "m"
    )


def recorded(plant: MechanicalPlant, trace: Trace, moments: np.ndarray, output_unit: str = "rad") -> Replay:
    """The plant under a recording's input, started as the recording starts, and what was measured, at `moments`
    (F,).
    """
    cut = slice(0, int(moments[-1]) + 1)
    enable, load = (None if x is None else x[cut] for x in (trace.enable, trace.load))
    motion = plant.simulate(trace.t[cut], trace.u[cut], trace.start, enable=enable, load=load)
    refuse_runaway(trace.t, motion.theta)
    return posed(plant, trace.t[moments], motion.theta[moments], trace.y[moments], motion.theta_m[moments], output_unit)


def moments_of(t: np.ndarray, fps: float, duration: float) -> np.ndarray:
    """The samples (F,) of t (N,) [s] nearest after every frame of `duration` [s] at `fps`, each once."""
    frames = t[0] + np.arange(max(1, round(min(duration, t[-1] - t[0]) * fps) + 1)) / fps
    return np.unique(np.minimum(np.searchsorted(t, frames - 1e-9), t.size - 1))


def refuse_runaway(t: np.ndarray, theta: np.ndarray) -> None:
    """Raise InputError where a simulation theta (N,) did not stay finite."""
    if not np.isfinite(theta).all():
        raise InputError(
            f"the simulation leaves all bounds at {t[int(np.argmax(~np.isfinite(theta)))]:.4g} s, "
            "check the model and its input"
        )
