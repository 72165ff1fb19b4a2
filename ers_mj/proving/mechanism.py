"""The rudder system of mjcf/ as the generator uses it: bodies, linkage, spring, dry friction and play are MuJoCo's.

What MuJoCo has no element for is left to `recorder.py`, which sets two torques (on the rotor, on the rudder) and the
levels of dry friction at every step. All numbers come from a record of `laws.PLANT`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from ers_mj.plants.mujoco.mjcf_folder import read_mjcf
from ers_mj.proving.plant import TABLE_1

LINKAGES = ("constant", "rod")
ARM, ROD = 0.01417, 0.042  # [m] rocker arm and rod between its pins, as mjcf/ has them
LIGHT = 0.05  # of J left to the motor's bodies where a ratio of the generator's own moves the rest as armature
RIGID = [0.9999, 0.9999, 0.001, 0.5, 2.0]
PLAY = [0.99, 0.9999, 1e-5, 0.5, 2.0]


@dataclass(frozen=True)
class Mechanism:
    """A compiled model, and where in its arrays things stand.

    Attributes:
        model: MuJoCo's.
        laws: the record (1,) for the step-by-step laws, without what MuJoCo does itself.
        places: (rocker, gap or -1, rotor) in qpos and qvel, (motor, load) in ctrl, the tendon ``rudder_angle``.
    """

    model: mujoco.MjModel
    laws: np.ndarray
    places: np.ndarray
    start: dict[str, float]


def mechanism(plant: np.ndarray, linkage: str, h: float) -> Mechanism:
    """The rudder system with the numbers of `plant` (a record (1,)), stepped by h [s].

    Args:
        plant: effects included; the rod of linkage "rod" is MuJoCo's own, `plant` has no ratio of its own then.
    """
    p, laws = plant[0], plant.copy()
    two = bool(p["two"] > 0)
    spec = _load(f"rudder_{linkage}.xml", two)
    _solver(spec, h)
    _gear(spec, linkage, two)
    _inertia(spec, p)
    _spring(spec, p)
    motor = spec.actuator("motor")
    motor.set_to_motor()
    motor.gear[0] = 1.0
    _damping(spec, p, laws)
    _native(spec, p, laws, two, h)
    laws["k_s"] = 0.0
    laws["rod"] = float(linkage == "rod")
    model = spec.compile()
    joint = lambda name: int(model.jnt_qposadr[model.joint(name).id])
    places = [
        joint("rocker"),
        joint("gap") if two else -1,
        joint("rotor"),
        model.actuator("motor").id,
        model.actuator("load").id,
        model.tendon("rudder_angle").id,
    ]
    return Mechanism(model, laws, np.array(places), _pose(float(p["theta_0"]), linkage))


def _load(name: str, has_gap: bool) -> mujoco.MjSpec:
    """A model of mjcf/; lines that name the joint ``gap`` are left out where there is none."""
    texts = read_mjcf()
    if not has_gap:
        texts = {
            key: "\n".join(line for line in text.splitlines() if '"gap"' not in line) for key, text in texts.items()
        }
    return mujoco.MjSpec.from_string(texts[name], include={key: text.encode() for key, text in texts.items()})


def _solver(spec: mujoco.MjSpec, h: float) -> None:
    """Every rigid limit as stiff as the step allows: a time constant of 2 h."""
    spec.option.timestep = h
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    for part in [*spec.joints, *spec.tendons]:
        part.solref_limit = part.solref_friction = [2 * h, 1.0]
        part.solimp_limit = part.solimp_friction = RIGID
    for equality in spec.equalities:
        equality.solref, equality.solimp = [2 * h, 1.0], RIGID


def _gear(spec: mujoco.MjSpec, linkage: str, two: bool) -> None:
    n = TABLE_1["n"]
    spec.equality("thread").data[:2] = [0.0, ARM / n]
    if linkage == "constant":
        spec.equality("ratio").data[:2] = [0.0, 1.0 / n]
        if two:
            spec.delete(spec.equality("gap_closed"))


def _inertia(spec: mujoco.MjSpec, p: np.void) -> None:
    """J shared among rotor, nut, rocker and rudder; an appendage takes its own from the rudder's."""
    motor = p["J"] * (LIGHT if p["ratio_form"] > 0 else p["share_J"])
    nut = rocker = 3.2e-4 * motor  # hardly anything
    rudder = p["J"] * (1.0 - p["share_J"]) - p["app_J"]
    spec.body("nut").mass = nut / ARM**2
    parts = {"motor": (motor - nut - rocker) / TABLE_1["n"] ** 2, "rocker": rocker, "rudder": rudder}
    for body, size in parts.items():
        spec.body(body).inertia = [size] * 3


def _spring(spec: mujoco.MjSpec, p: np.void) -> None:
    """The spring as the tendon's stiffness; its preload is the recorder's, so the levers of mjcf/ go."""
    rest, tendon = float(p["theta_0"]), spec.tendon("rudder_angle")
    tendon.stiffness, tendon.springlength = [p["k_s"], 0.0, 0.0], [rest, rest]
    for way in ("up", "down"):
        spec.delete(spec.body(f"lever_{way}"))


def _damping(spec: mujoco.MjSpec, p: np.void, laws: np.ndarray) -> None:
    """Viscous friction, MuJoCo's own where it is the same both ways and the ratio is constant."""
    tendon, rocker = spec.tendon("rudder_angle"), spec.joint("rocker")
    native = p["asym_v"] == 0 and p["ratio_form"] == 0
    share = p["share_B"] if p["two"] > 0 else 0.0
    tendon.damping = [(1.0 - share) * p["B"] * native, 0.0, 0.0]
    rocker.damping = [share * p["B"] * native, 0.0, 0.0]
    if native:
        laws["B"] = 0.0


def _native(spec: mujoco.MjSpec, p: np.void, laws: np.ndarray, two: bool, h: float) -> None:
    """Play, shaft, stop and appendage where MuJoCo has them."""
    if two:
        gap = spec.joint("gap")
        gap.limited = bool(p["con_form"] == 3)
        if p["con_form"] == 3:
            gap.range, gap.solref_limit, gap.solimp_limit = [-p["gap"], p["gap"]], [2 * h, 2.0], PLAY
            laws["con_k"] = laws["con_c"] = 0.0
        elif p["con_form"] == 0 and p["gap"] == 0:
            gap.stiffness, gap.damping = [p["con_k"], 0.0, 0.0], [p["con_c"], 0.0, 0.0]
            laws["con_k"] = laws["con_c"] = 0.0
    if p["stop_k"] > 0 and p["stop_form"] == 2:
        tendon = spec.tendon("rudder_angle")
        tendon.limited, tendon.range = (
            True,
            [max(p["theta_0"] + p["stop_lo"], -1e6), min(p["theta_0"] + p["stop_hi"], 1e6)],
        )
        laws["stop_k"] = 0.0
    if p["app_J"] > 0:
        body = spec.body("rudder").add_body(
            name="appendage", explicitinertial=True, mass=0.01, inertia=[p["app_J"]] * 3, ipos=[0, 0, 0]
        )
        body.add_joint(
            name="appendage",
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=[0, -1, 0],
            stiffness=[p["app_k"], 0.0, 0.0],
            damping=[p["app_c"], 0.0, 0.0],
        )
        laws["app_J"] = 0.0


def _pose(theta: float, linkage: str) -> dict[str, float]:
    """Joint positions with the rudder at theta, the play centred."""
    n = TABLE_1["n"]
    if linkage == "constant":
        return {"rocker": theta, "rotor": n * theta, "nut": ARM * theta}
    rise = ARM * (1.0 - math.cos(theta))
    nut = ARM * math.sin(theta) + ROD - math.sqrt(ROD**2 - rise**2)
    return {"rocker": theta, "nut": nut, "rotor": nut * n / ARM, "rod": math.asin(rise / ROD)}
