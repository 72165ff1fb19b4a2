"""The bodies and joints of a MuJoCo plant, before any of Eq. (6)'s numbers acts on them.

Two roads to one set of names: the rudder system in three dimensions from the folder mjcf/, for a servo with a
datasheet, and one joint in output units (J = 1), for a plant of which only Eq. (6)'s coefficients are known. In both
the joint ``rocker`` is the output of the drive, ``gap`` the play behind it, and the tendon ``rudder_angle`` their sum,
the absolute output.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from ers_mj.effects.quantities import Coefficients
from ers_mj.errors import InputError
from ers_mj.plants.bare_gap import MOTOR_SHARE
from ers_mj.plants.mujoco.mjcf_folder import read_mjcf

LINKAGES = ("constant", "rod")
BODILY = ("J", "n", "K_t")  # what a datasheet must give for the rudder system in three dimensions
LEVER_SHARE = 1e-6 / 0.0031  # of J in either lever of the preload
ARM = 0.01417  # [m] rocker arm, n times the lead of 4 mm over 2 pi
ROD = 0.042  # [m] length of the rod between its pins

Pose = Callable[[float], dict[str, tuple[float, float]]]


@dataclass(frozen=True)
class Skeleton:
    """A model without forces.

    Attributes:
        spec: the model, to be written on.
        inertia: J of the whole plant at the output [kg m^2, or 1 where lumped].
        ratio: turns of the motor's joint for one of the output.
        K_t: torque constant [N m/A], 1 where lumped.
        motor_joint: the joint that the motor drives.
        is_angle: whether the output turns or slides.
        pose: output -> {joint: (position, d position / d output)}, on the linkage with the play centred.
        local: inertia of rocker and of rudder alone, without what is coupled by equalities.
    """

    spec: mujoco.MjSpec
    inertia: float
    ratio: float
    K_t: float
    motor_joint: str
    is_angle: bool
    pose: Pose
    local: tuple[float, float]


# -- three dimensions --------------------------------------------------------------------------------------


def bodily(parameters: Mapping[str, float], is_angle: bool, b: float) -> Mapping[str, float] | None:
    """The datasheet's parameters where they make the rudder system, None where the plant is one lumped joint.

    Args:
        parameters: of the datasheet, SI.
        is_angle: whether the output turns.
        b: Eq. (6)'s gain; a negative one turns the output against the motor, which the linkages cannot.
    """
    return parameters if is_angle and b > 0 and all(parameters.get(name, 0.0) > 0 for name in BODILY) else None


def rudder_skeleton(c: Coefficients, parameters: Mapping[str, float], linkage: str) -> Skeleton:
    """The rudder system of mjcf/ with the inertia J, the ratio n and the torque constant K_t of a datasheet.

    The share c.rho of J (MOTOR_SHARE with one body) sits on the motor's side. The rod, where there is one, comes on
    top.

    Raises:
        InputError: a parameter is missing or the linkage unknown.
    """
    if linkage not in LINKAGES:
        raise InputError(f"the linkage is {linkage!r}, constant or rod was expected")
    missing = [key for key in BODILY if not parameters.get(key, 0.0) > 0]
    if missing:
        raise InputError(f"the three-dimensional plant needs {' and '.join(missing)} above zero in the datasheet")
    J, n = parameters["J"], parameters["n"]
    spec = _load(f"rudder_{linkage}.xml", c.has_motor_side)
    spec.equality("thread").data[:2] = [0.0, ARM / n]
    if linkage == "constant":
        spec.equality("ratio").data[:2] = [0.0, 1.0 / n]
        if c.has_motor_side:
            spec.delete(spec.equality("gap_closed"))
    local = _share_inertia(spec, J, n, c.rho if c.has_motor_side else MOTOR_SHARE)
    pose = _constant_pose(n) if linkage == "constant" else _rod_pose(n)
    return Skeleton(spec, J, n, parameters["K_t"], "rotor", True, pose, local)


def _load(name: str, has_play: bool) -> mujoco.MjSpec:
    """A model of the folder; without play the lines that name the joint ``gap`` are left out."""
    texts = read_mjcf()
    if not has_play:
        texts = {
            key: "\n".join(line for line in text.splitlines() if '"gap"' not in line) for key, text in texts.items()
        }
    return mujoco.MjSpec.from_string(texts[name], include={key: text.encode() for key, text in texts.items()})


def _share_inertia(spec: mujoco.MjSpec, J: float, n: float, rho: float) -> tuple[float, float]:
    """Make the parts sum to J at the rudder, rho of it before the play; returns the inertia of (rocker, rudder)."""
    nut, rocker = 3.2e-4 * rho * J, 3.2e-4 * rho * J
    rotor = (rho * J - nut - rocker) / n**2
    lever = LEVER_SHARE * J
    rudder = (1.0 - rho) * J - lever
    spec.body("nut").mass = nut / ARM**2
    for body, inertia in {
        "motor": rotor,
        "rocker": rocker,
        "rudder": rudder,
        "lever_up": lever,
        "lever_down": lever,
    }.items():
        spec.body(body).inertia = [inertia] * 3
    return rocker, rudder


def _constant_pose(n: float) -> Pose:
    return lambda theta: {"rocker": (theta, 1.0), "rotor": (n * theta, n), "nut": (ARM * theta, ARM)}


def _rod_pose(n: float) -> Pose:
    """The nut's way along the screw for a rocker angle: the rod is level at angle zero."""

    def pose(theta):
        rise, slope = ARM * (1.0 - math.cos(theta)), ARM * math.sin(theta)
        level = math.sqrt(ROD**2 - rise**2)
        nut, rate = slope + ROD - level, ARM * math.cos(theta) + rise * slope / level
        return {
            "rocker": (theta, 1.0),
            "nut": (nut, rate),
            "rotor": (nut * n / ARM, rate * n / ARM),
            "rod": (math.asin(rise / ROD), slope / level),
        }

    return pose


# -- one joint ---------------------------------------------------------------------------------------------


def lumped_skeleton(c: Coefficients, is_angle: bool) -> Skeleton:
    """One joint of inertia 1 in output units, split in two by a joint ``gap`` where c has a second body."""
    spec = mujoco.MjSpec()
    spec.modelname = "lumped servo"
    spec.compiler.degree = False
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.gravity = [0.0, 0.0, 0.0]
    spec.option.tolerance = 1e-12
    spec.option.enableflags |= mujoco.mjtEnableBit.mjENBL_DIAGEXACT
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    rho = c.rho if c.has_motor_side else MOTOR_SHARE
    rocker = _lumped_body(spec.worldbody, "rocker", rho, is_angle, "rocker")
    rudder = _lumped_body(rocker, "rudder", 1.0 - rho - LEVER_SHARE, is_angle, "gap" if c.has_motor_side else "")
    rudder.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.3, 0.1, 0.01], pos=[0.2, 0, 0], mass=0, contype=0, conaffinity=0
    )
    for name in ("lever_up", "lever_down"):
        _lumped_body(spec.worldbody, name, LEVER_SHARE, is_angle, name)
    _lumped_tendons(spec, ["rocker", "gap"] if c.has_motor_side else ["rocker"])
    _lumped_actuators(spec)
    return Skeleton(
        spec, 1.0, 1.0, 1.0, "rocker", is_angle, lambda theta: {"rocker": (theta, 1.0)}, (rho, 1 - rho - LEVER_SHARE)
    )


def _lumped_body(parent: mujoco.MjsBody, name: str, inertia: float, is_angle: bool, joint: str) -> mujoco.MjsBody:
    body = parent.add_body(name=name, explicitinertial=True, mass=inertia, ipos=[0, 0, 0], inertia=[inertia] * 3)
    if joint:
        kind = mujoco.mjtJoint.mjJNT_HINGE if is_angle else mujoco.mjtJoint.mjJNT_SLIDE
        body.add_joint(name=joint, type=kind, axis=[0, -1, 0] if is_angle else [1, 0, 0])
    return body


def _lumped_tendons(spec: mujoco.MjSpec, output: list[str]) -> None:
    angle = spec.add_tendon(name="rudder_angle")
    for joint in output:
        angle.wrap_joint(joint, 1.0)
    for way, reach in (("up", [0.0, 1e6]), ("down", [-1e6, 0.0])):
        push = spec.add_tendon(name=f"push_{way}", limited=True, range=reach)
        push.wrap_joint(f"lever_{way}", 1.0)
        for joint in output:
            push.wrap_joint(joint, -1.0)


def _lumped_actuators(spec: mujoco.MjSpec) -> None:
    joint, tendon = mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_TENDON
    spec.add_actuator(name="motor", trntype=joint, target="rocker", group=1)
    spec.add_actuator(name="load", trntype=tendon, target="rudder_angle")
    for way in ("up", "down"):
        lever = spec.add_actuator(name=f"preload_{way}", trntype=joint, target=f"lever_{way}", gainprm=np.zeros(10))
        lever.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    for name, kind in (("theta", mujoco.mjtSensor.mjSENS_TENDONPOS), ("omega", mujoco.mjtSensor.mjSENS_TENDONVEL)):
        spec.add_sensor(name=name, type=kind, objtype=mujoco.mjtObj.mjOBJ_TENDON, objname="rudder_angle")
