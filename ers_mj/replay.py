"""A motion for the eye: what a plant's joints do frame by frame, and what was measured beside it.

    datasheet + options -> MechanicalPlant -> motion -> Replay        plant.xml -> motion -> Replay
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

from ers_mj.datasheet import Datasheet
from ers_mj.errors import InputError
from ers_mj.plants.mechanical import MechanicalPlant
from ers_mj.plants.reduced import lumped
from ers_mj.plants.staging import staged
from ers_mj.plants.stepping import unlogged
from ers_mj.recording import Recording
from ers_mj.simulation import inertia_of, kernel_effects

THREE_DIMENSIONAL = ("J", "n", "K_t")  # a datasheet that gives these is shown as the rudder system
START = 0.05  # [s] from which a recording's first speed is taken


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


def only(replay: Replay, k: int) -> Replay:
    """One moment of a replay."""
    measured = None if replay.measured is None else replay.measured[k : k + 1]
    return replace(replay, t=replay.t[k : k + 1], qpos=replay.qpos[k : k + 1], theta=replay.theta[k : k + 1], measured=measured)


def plant_of(datasheet: Datasheet, linkage: str = "constant", gap: float = 0.0, output_unit: str = "rad") -> MechanicalPlant:
    """The MuJoCo plant of a datasheet or a model with its effects: the rudder system where it gives J, n and K_t and turns.

    Args:
        linkage: "constant" or "rod".
        gap: half-width of a play [output unit].

    Raises:
        InputError: the datasheet lacks b, or the options contradict it.
    """
    values = datasheet.to_lumped() | {"tau_e": 0.0} | dict(datasheet.baseline)
    if "b" not in values:
        raise InputError(f"{datasheet.name or 'the datasheet'}: cannot be shown, it needs b, or J, K_t and R from which b follows")
    effects = kernel_effects(datasheet.effects, inertia_of(datasheet))
    is_rudder = output_unit == "rad" and all(datasheet.parameters.get(key, 0.0) > 0 for key in THREE_DIMENSIONAL)
    return MechanicalPlant(lumped(values), effects, datasheet.parameters if is_rudder else None, linkage, gap, output_unit == "rad")


# -- a plant ---------------------------------------------------------------------------------------------------


def posed(plant: MechanicalPlant, t: np.ndarray, theta: np.ndarray, measured: np.ndarray | None = None,
          theta_m: np.ndarray | None = None, output_unit: str = "rad") -> Replay:
    """The plant put at outputs theta (F,), its drive at theta_m (F,), theta where that is not given."""
    drive = theta if theta_m is None else theta_m
    shown = theta if measured is None else np.concatenate([theta, measured])
    model = staged(plant.spec(), max(float(np.nanmax(np.abs(shown))), 1e-6))
    qpos = np.array([plant.positions(x, m) for x, m in zip(theta, drive, strict=True)])
    return Replay(model, t - t[0], qpos, theta, measured, output_unit)


def simulated(plant: MechanicalPlant, t: np.ndarray, u: np.ndarray, moments: np.ndarray) -> Replay:
    """The plant from rest under u (N,) at t (N,) [s], shown at the samples `moments` (F,)."""
    motion = plant.simulate(t, u)
    _refuse_runaway(t, motion.theta)
    return posed(plant, t[moments], motion.theta[moments], None, motion.theta_m[moments], "rad" if plant.is_angle else "m")


def recorded(plant: MechanicalPlant, recording: Recording, moments: np.ndarray) -> Replay:
    """The plant under a recording's input, started as the recording starts, and what was measured, at `moments` (F,)."""
    last = int(moments[-1]) + 1
    t, u, y = recording.t[:last], recording.u[:last], recording.y[:last]
    load = None if recording.load is None else recording.load[:last] / (plant.parameters or {"J": 1.0})["J"]
    enable = None if recording.enable is None else recording.enable[:last]
    motion = plant.simulate(t, u, first_state(t, y), enable=enable, load=load)
    _refuse_runaway(t, motion.theta)
    return posed(plant, t[moments], motion.theta[moments], y[moments], motion.theta_m[moments], recording.output_unit)


def first_state(t: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Output and speed at the first sample, a line through the first 50 ms or 10 samples of y (N,) at t (N,) [s]."""
    head = slice(0, max(10, int(np.searchsorted(t, t[0] + START))))
    known = np.isfinite(y[head])
    if known.sum() < 2:
        raise InputError("the recording has no output in its first samples, a replay cannot start there")
    slope, level = np.polyfit(t[head][known] - t[0], y[head][known], 1)
    return float(level), float(slope)


def moments_of(t: np.ndarray, fps: float, duration: float) -> np.ndarray:
    """The samples (F,) of t (N,) [s] nearest after every frame of `duration` [s] at `fps`, each once."""
    frames = t[0] + np.arange(max(1, round(min(duration, t[-1] - t[0]) * fps) + 1)) / fps
    return np.unique(np.minimum(np.searchsorted(t, frames - 1e-9), t.size - 1))


def _refuse_runaway(t: np.ndarray, theta: np.ndarray) -> None:
    if not np.isfinite(theta).all():
        raise InputError(f"the simulation leaves all bounds at {t[int(np.argmax(~np.isfinite(theta)))]:.4g} s, "
                         "check the model and its input")


# -- a model from a file -----------------------------------------------------------------------------------------


def read_plant(path: Path) -> mujoco.MjModel:
    """A plant.xml, or any other MJCF file, on its stage.

    Raises:
        InputError: no such file, no XML, no MJCF.
    """
    if not path.is_file():
        raise InputError(f"{path}: there is no such file" if not path.exists() else f"{path}: is a folder, a plant.xml was expected")
    try:
        root = ElementTree.parse(path).getroot().tag
    except (ElementTree.ParseError, OSError, UnicodeError, LookupError, ValueError) as error:
        raise InputError(f"{path}: is not XML ({str(error)[:120]})") from None
    if root != "mujoco":
        raise InputError(f"{path}: its root element is <{root[:40]}>, a MuJoCo model begins with <mujoco>")
    try:
        with unlogged():
            return staged(mujoco.MjSpec.from_file(str(path)))
    except (ValueError, OSError, UnicodeError) as error:
        raise InputError(f"{path}: is not a model that MuJoCo reads ({' '.join(str(error).split())[:160]})") from None


def file_simulated(model: mujoco.MjModel, t: np.ndarray, u: np.ndarray, moments: np.ndarray,
                   measured: np.ndarray | None = None, output_unit: str = "rad") -> Replay:
    """A model of a file from its first keyframe under u (N,), on the actuator `motor` or else the first, at `moments` (F,).

    Raises:
        InputError: the model has no actuator, or the motion leaves all bounds.
    """
    if u.any() and model.nu == 0:
        raise InputError("the model has no actuator that an input could drive")
    motor = max(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, "motor"), 0)
    data, shown, qpos, theta = at_home(model), set(moments.tolist()), [], []
    with unlogged():
        for k in range(int(moments[-1]) + 1):
            if k in shown:
                qpos.append(data.qpos.copy())
                theta.append(_output(model, data))
            data.ctrl[motor : motor + 1] = u[k]
            until = t[k + 1] - t[0] if k + 1 < t.size else -math.inf
            while data.time < until - 0.5 * model.opt.timestep:
                mujoco.mj_step(model, data)
    if not np.isfinite(qpos).all():
        raise InputError("the simulation of the model leaves all bounds, check the file and the input")
    beside = None if measured is None else measured[moments]
    return Replay(model, t[moments] - t[0], np.array(qpos), np.array(theta), beside, output_unit)


def has_rudder(model: mujoco.MjModel) -> bool:
    """Whether a model of a file has what a measured output is shown by."""
    parts = ((mujoco.mjtObj.mjOBJ_BODY, "rudder"), (mujoco.mjtObj.mjOBJ_JOINT, "rocker"))
    return all(mujoco.mj_name2id(model, kind, name) >= 0 for kind, name in parts)


def at_home(model: mujoco.MjModel) -> mujoco.MjData:
    """Data at the model's first keyframe, or its reference pose where it has none."""
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    return data


def _output(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    tendon = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TENDON, "rudder_angle")
    return float(data.ten_length[tendon]) if tendon >= 0 else math.nan
