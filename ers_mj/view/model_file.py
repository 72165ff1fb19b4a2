"""A plant.xml, or any other MJCF file, in motion: file -> model -> motion -> Replay."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np

from ers_mj.data.prepared import Trace
from ers_mj.errors import InputError
from ers_mj.plants.mujoco.mjcf_folder import unlogged
from ers_mj.plants.mujoco.staging import staged
from ers_mj.view.replay import Replay
from ers_mj.view.within import parsed, refuse_outside

MOST_STEPS = 5e6  # a minute or two
UNSTABLE = tuple(getattr(mujoco.mjtWarning, f"mjWARN_BAD{what}").value for what in ("QPOS", "QVEL", "QACC", "CTRL"))


def read_plant(path: Path) -> mujoco.MjModel:
    """A plant.xml, or any other MJCF file, on its stage.

    Raises:
        InputError: no such file, no XML, no MJCF, or one that names files outside its folder.
    """
    if not path.is_file():
        raise InputError(
            f"{path}: there is no such file" if not path.exists() else f"{path}: is a folder, a plant.xml was expected"
        )
    root = parsed(path)
    if root.tag != "mujoco":
        raise InputError(f"{path}: its root element is <{root.tag[:40]}>, a MuJoCo model begins with <mujoco>")
    refuse_outside(path, root)
    try:
        with unlogged():
            return staged(mujoco.MjSpec.from_file(str(path)))
    except (ValueError, OSError, UnicodeError) as error:
        raise InputError(f"{path}: is not a model that MuJoCo reads ({' '.join(str(error).split())[:160]})") from None


def simulated_file(model: mujoco.MjModel, t: np.ndarray, u: np.ndarray, moments: np.ndarray) -> Replay:
    """A model of a file from its first keyframe under u (N,), on the actuator `motor` or else the first, at `moments`
    (F,).

    Raises:
        InputError: the model has no actuator, or the motion leaves all bounds.
    """
    return _stepped(model, at_home(model), t, u, moments)


def recorded_file(model: mujoco.MjModel, trace: Trace, moments: np.ndarray, output_unit: str = "rad") -> Replay:
    """A plant.xml under a recording's input, started as the recording starts, and what was measured, at `moments` (F,).

    Raises:
        InputError: the model is no plant of this package, or the motion leaves all bounds.
    """
    parts = ((mujoco.mjtObj.mjOBJ_BODY, "rudder"), (mujoco.mjtObj.mjOBJ_JOINT, "rocker"))
    if any(mujoco.mj_name2id(model, kind, name) < 0 for kind, name in parts):
        raise InputError("the model has no body rudder on a joint rocker, a recording cannot be shown beside it")
    film = _stepped(model, _started(model, *trace.start), trace.t, trace.u, moments)
    return replace(film, measured=trace.y[moments], output_unit=output_unit)


def _stepped(model: mujoco.MjModel, data: mujoco.MjData, t: np.ndarray, u: np.ndarray, moments: np.ndarray) -> Replay:
    if u.any() and model.nu == 0:
        raise InputError("the model has no actuator that an input could drive")
    _refuse_endless(t[moments[-1]] - t[0], model.opt.timestep)
    motor = max(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, "motor"), 0)
    shown, qpos, theta = set(moments.tolist()), [], []
    with unlogged():
        for k in range(int(moments[-1]) + 1):
            if k in shown:
                qpos.append(data.qpos.copy())
                theta.append(_output(model, data))
            data.ctrl[motor : motor + 1] = u[k]
            until = t[k + 1] - t[0] if k + 1 < t.size else -math.inf
            while data.time < until - 0.5 * model.opt.timestep:
                mujoco.mj_step(model, data)
                if any(data.warning[kind].number for kind in UNSTABLE):  # it begins anew at time 0, for ever
                    raise InputError(f"the simulation of the model is unstable at {t[k] - t[0]:.4g} s, check the file")
    if not np.isfinite(qpos).all():
        raise InputError("the simulation of the model leaves all bounds, check the file and the input")
    return Replay(model, t[moments] - t[0], np.array(qpos), np.array(theta))


def _refuse_endless(lasts: float, step: float) -> None:
    if not (step > 0.0 and lasts / step <= MOST_STEPS):
        raise InputError(
            f"the model's step of {step:g} s makes {lasts / step:.3g} of {lasts:.4g} s, at most {MOST_STEPS:.0e} were"
            " expected"
        )


def _started(model: mujoco.MjModel, theta: float, omega: float) -> mujoco.MjData:
    """At an output and its speed: the rocker, what linear joint equalities couple to it, and the preload's levers.

    A model with a rod, which such equalities do not describe, starts at home.
    """
    data = at_home(model)
    if mujoco.mjtEq.mjEQ_CONNECT in model.eq_type:
        return data
    known = {model.joint("rocker").id: (theta, omega)}
    for _ in range(model.neq):
        for one, other, poly in zip(model.eq_obj1id, model.eq_obj2id, model.eq_data, strict=True):
            if other in known and one >= 0:
                known[one] = (poly[0] + poly[1] * known[other][0], poly[1] * known[other][1])
            elif one in known and other >= 0 and poly[1]:
                known[other] = ((known[one][0] - poly[0]) / poly[1], known[one][1] / poly[1])
    for name, end, carried in (("lever_up", 0, max), ("lever_down", 1, min)):
        joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
        if joint >= 0:
            stop = float(model.jnt_range[joint, end])
            at = carried(theta, stop)
            known[joint] = (at, omega if at != stop else 0.0)
    for joint, (position, speed) in known.items():
        data.qpos[model.jnt_qposadr[joint]], data.qvel[model.jnt_dofadr[joint]] = position, speed
    mujoco.mj_forward(model, data)
    return data


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
