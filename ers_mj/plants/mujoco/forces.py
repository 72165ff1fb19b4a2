"""Eq. (6)'s coefficients written into a skeleton: every force of a MuJoCo plant, from the record that the reduced model
uses.

With J the inertia and h the timestep, on the absolute output theta:

    spring J a_1 (theta - theta_0), damping J a_mech, frictionloss J c_2, levers J c_1, motor n K_t i = J j
 Rigid limits have a time constant of 2 h, the stiffest that MuJoCo integrates. A limit with a negative solref is a
physical spring-damper K, D if its impedance is the smallest one and both are scaled by the inverse inertia A that it
acts on.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from ers_mj.effects.quantities import Coefficients
from ers_mj.errors import InputError
from ers_mj.plants.mujoco.bodies import Skeleton

RIGID = [0.9999, 0.9999, 0.001, 0.5, 2.0]
PLAY = [0.99, 0.9999, 1e-5, 0.5, 2.0]
OVERDAMPED = 2.0  # damping ratio of the play's rigid ends: a limit that does not pull still bounces at critical damping
ELASTIC = [1e-4, 1e-4, 0.001, 0.5, 2.0]  # mjMINIMP: the limit's force does not depend on the other forces
RESOLVED = (
    0.8  # decay rate [1/s] of a contact times h, above which a rigid limit is nearer to it than its own spring-damper
)
NO_TORQUE = 1e-9  # [N m/A] the constant of a motor that only rubs
FAR = 1e6  # [output unit] an end that is not there


def write_coefficients(skeleton: Skeleton, c: Coefficients, timestep: float) -> None:
    """Write all of c onto the skeleton's spec.

    Raises:
        InputError: b is zero or beyond all sizes, or the back-EMF or the timestep negative.
    """
    if not 0.0 < skeleton.inertia * c.b * c.b < math.inf:
        raise InputError(f"b is {c.b:g}: a drive whose input does nothing, or moves all there is, cannot be simulated")
    if c.a_emf < 0 or c.tau_e < 0:
        raise InputError(f"a_emf is {c.a_emf:g} and tau_e {c.tau_e:g}, both zero or more were expected")
    _write_solver(skeleton.spec, timestep)
    _write_motor(skeleton, c)
    _write_friction(skeleton, c)
    _write_spring(skeleton, c)
    _write_stops(skeleton, c)
    if c.has_motor_side:
        _write_play(skeleton, c)


def motor_gain(skeleton: Skeleton, c: Coefficients) -> float:
    """Force of the motor's actuator [A] for one unit of its activation; 1 ampere is n K_t / J of drive acceleration."""
    torque = skeleton.ratio * skeleton.K_t
    return c.a_emf / abs(c.b) / torque if c.a_emf > 0 else skeleton.inertia * abs(c.b) / torque


def _write_solver(spec: mujoco.MjSpec, h: float) -> None:
    spec.option.timestep = h
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET | mujoco.mjtDisableBit.mjDSBL_ISLAND
    for part in [*spec.joints, *spec.tendons]:
        part.solref_limit = part.solref_friction = [2 * h, 1.0]
        part.solimp_limit = part.solimp_friction = RIGID
    for equality in spec.equalities:
        equality.solref, equality.solimp = [2 * h, 1.0], RIGID


def _write_motor(skeleton: Skeleton, c: Coefficients) -> None:
    """The motor: ctrl the input, force the current [A].

    One constant K stands for K_t and K_e in MuJoCo. With the gear K_t, the constant K_e/K_t and the impedance (R, L)
    times K_e/K_t both keep their values: torque K_t i, back-EMF K_e w_m. From Eq. (6): n K_e = a_emf/b, R = n K_t/(J
    b).
    """
    motor = skeleton.spec.actuator("motor")
    motor.gear[0] = math.copysign(skeleton.K_t, c.b)
    gain = motor_gain(skeleton, c)
    if c.a_emf > 0:
        resistance = c.a_emf / (skeleton.inertia * c.b * c.b)
        motor.set_to_dcmotor(motorconst=[gain, gain], resistance=resistance, inductance=[c.tau_e * resistance, 0.0])
        return
    motor.gaintype, motor.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_NONE
    motor.gainprm = [gain, *[0.0] * 9]
    if c.tau_e > 0:
        motor.dyntype = mujoco.mjtDyn.mjDYN_FILTEREXACT
        motor.dynprm = [c.tau_e, *[0.0] * 9]


def _write_friction(skeleton: Skeleton, c: Coefficients) -> None:
    """Dry and viscous friction, shared by rocker and rudder; the asymmetry of the dry one is a constant torque, on a
    bristle a law.
    """
    J, tendon, rocker = skeleton.inertia, skeleton.spec.tendon("rudder_angle"), skeleton.spec.joint("rocker")
    beta, phi = (c.beta, c.phi) if c.has_motor_side else (0.0, 0.0)
    damping, level = 0.5 * J * (c.a_mech_plus + c.a_mech_minus), 0.5 * J * (c.c_2_plus + c.c_2_minus)
    tendon.damping, rocker.damping = [(1 - beta) * damping, 0.0, 0.0], [beta * damping, 0.0, 0.0]
    push = J * (c.bias - 0.5 * (1 - phi) * (c.c_2_plus - c.c_2_minus))
    tendon.frictionloss, rocker.frictionloss = (1 - phi) * level, phi * level
    if c.has_bristle:
        _write_bristle(skeleton, c, 1 - phi, level)
        tendon.frictionloss, push = 0.0, J * c.bias
    if push:
        skeleton.spec.add_actuator(
            name="bias",
            trntype=mujoco.mjtTrn.mjTRN_TENDON,
            target="rudder_angle",
            gainprm=np.zeros(10),
            biastype=mujoco.mjtBias.mjBIAS_AFFINE,
            biasprm=[push, *[0.0] * 9],
        )


def _write_bristle(skeleton: Skeleton, c: Coefficients, share: float, level: float) -> None:
    """LuGre friction, which MuJoCo has as a part of a motor: one without torque, its activation the bristle's
    deflection.
    """
    bristle = skeleton.spec.add_actuator(name="bristle", trntype=mujoco.mjtTrn.mjTRN_TENDON, target="rudder_angle")
    bristle.set_to_dcmotor(
        motorconst=[NO_TORQUE, NO_TORQUE],
        resistance=1.0,
        lugre=[
            share * skeleton.inertia * c.k_bristle,
            share * skeleton.inertia * c.d_bristle,
            share * level,
            share * level,
            1.0,
        ],
    )


def _write_spring(skeleton: Skeleton, c: Coefficients) -> None:
    """The spring about theta_0, and its preload: two levers, or none."""
    spec, J = skeleton.spec, skeleton.inertia
    rest = c.theta_0 if c.theta_0 != -1.0 else np.nextafter(-1.0, 0.0)  # -1 means "automatic" to MuJoCo
    spec.tendon("rudder_angle").stiffness = [J * c.a_1, 0.0, 0.0]
    spec.tendon("rudder_angle").springlength = [rest, rest]
    for way, sign in (("up", -1.0), ("down", 1.0)):
        if c.c_1 > 0:
            ends = [c.theta_0, FAR] if way == "up" else [-FAR, c.theta_0]
            spec.joint(f"lever_{way}").limited, spec.joint(f"lever_{way}").range = True, ends
            spec.actuator(f"preload_{way}").biasprm[0] = sign * J * c.c_1
        else:
            spec.delete(spec.body(f"lever_{way}"))


def _write_stops(skeleton: Skeleton, c: Coefficients) -> None:
    if np.isinf(c.lower) and np.isinf(c.upper):
        return
    tendon, (rocker, rudder) = skeleton.spec.tendon("rudder_angle"), skeleton.local
    tendon.limited, tendon.range = True, [max(c.lower, -FAR), min(c.upper, FAR)]
    mobility = 1.0 / rudder if c.has_motor_side else 1.0 / (rocker + rudder)
    tendon.solref_limit, tendon.solimp_limit = _elastic(skeleton, mobility, c.k_stop, c.d_stop), ELASTIC


def _write_play(skeleton: Skeleton, c: Coefficients) -> None:
    """The play: elastic where c gives its contact a stiffness and the timestep resolves its damping, else rigid; a
    shaft if it has no width.
    """
    joint, (rocker, rudder) = skeleton.spec.joint("gap"), skeleton.local
    if c.gap <= 0:
        joint.limited = False
        stiffness = skeleton.inertia * c.k_twist
        joint.stiffness, joint.damping = (
            [stiffness, 0.0, stiffness * c.harden],
            [skeleton.inertia * c.d_twist, 0.0, 0.0],
        )
        return
    joint.limited, joint.range, joint.solimp_limit = True, [-c.gap, c.gap], PLAY
    joint.solref_limit = [2 * skeleton.spec.option.timestep, OVERDAMPED]
    if c.k_twist > 0 and c.d_twist / (c.rho * (1.0 - c.rho)) * skeleton.spec.option.timestep < RESOLVED:
        joint.solref_limit, joint.solimp_limit = (
            _elastic(skeleton, 1 / rocker + 1 / rudder, c.k_twist, c.d_twist),
            ELASTIC,
        )


def _elastic(skeleton: Skeleton, mobility: float, stiffness: float, damping: float) -> list[float]:
    """solref of a spring-damper given per total inertia, on a limit whose inverse inertia is ``mobility``."""
    scale = skeleton.inertia * mobility
    return [-stiffness * scale, -max(damping * scale, 1e-12)]
