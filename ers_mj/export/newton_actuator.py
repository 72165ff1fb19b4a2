"""`newton_actuator.py`: the actuator in newton's own classes."""

from __future__ import annotations

import math
from importlib.resources import files
from string import Template

from ers_mj.export.base import Target, Written
from ers_mj.export.joint_numbers import JointNumbers, joint_numbers
from ers_mj.export.servo import Servo

GROWS = "newton's Delay grows from 0 to its length in the first calls after a reset, and is a whole number of steps"
SOLVERS = "friction, damping and spring act under SolverMuJoCo; Featherstone has no friction, XPBD neither"
EXPLICIT = (
    "the drive is explicit unless you ask newton for an implicit one: keep its damping times the timestep well below J"
)
STOPS = "stops are newton's own springs, joint_limit_ke and joint_limit_kd, and scale with nothing"
BRAKES = (
    "ENVELOPE alone: beyond the no-load speed ClampingDCMotor's line brakes, also when asked to drive; the limit of the"
    " servo itself is on its voltage, which add_to() has"
)


class Newton(Target):
    """A PD drive with a limit and a delay, the passive numbers on the joint."""

    name, file, tool = "newton", "newton_actuator.py", "newton 1.8"

    def write(self, servo: Servo) -> Written:
        from ers_mj import __version__

        n = joint_numbers(servo, wound=False)
        gain = math.copysign(n.torque, n.gear)
        limit = n.effort if n.kind == "position" else n.torque * n.limit
        clamping = f"[(ClampingMaxEffort, {{'max_effort': {limit!r}}})]" if math.isfinite(limit) else "[]"
        gains = f"        kp={n.gain!r},\n        kd={n.brake!r},"
        values = {
            "title": servo.name,
            "version": __version__,
            "command_lines": _commanded(n, servo),
            "classes": "ClampingMaxEffort, DrivePD" if math.isfinite(limit) else "DrivePD",
            "delay": repr(n.delay),
            "torque": "None  # it is told a position" if n.kind == "position" else f"{gain!r}  # [N m, or N]",
            "envelope": _enveloped(n),
            "armature": repr(n.armature),
            "damping": repr(n.damping),
            "friction": repr(n.friction),
            "solref": n.solref,
            "solimp": n.solimp,
            "edits": "\n".join(_edits(n)),
            "drive": "DrivePD",
            "clamping": clamping,
            "arguments": gains,
        }
        text = (files("ers_mj.export") / "newton_actuator.txt").read_text(encoding="utf-8")
        return Written(Template(text).substitute(values).encode(), _losses(n))


def _losses(n: JointNumbers) -> tuple[str, ...]:
    found = {
        SOLVERS: True,
        EXPLICIT: n.brake > 0,
        STOPS: math.isfinite(n.lower) or math.isfinite(n.upper),
        GROWS: n.delay > 0,
        BRAKES: n.envelope is not None,
    }
    return (*n.left_out, *(text for text, is_so in found.items() if is_so))


def _commanded(n: JointNumbers, servo: Servo) -> str:
    if n.kind == "position":
        return f"    control.joint_target_q[3] = r              # the command, a position [{servo.output_unit}]\n"
    return (
        f"    control.joint_act[3] = u * servo.TORQUE_PER_INPUT      # u [{servo.input_unit}]: the limit of u is the"
        " clamp\n"
    )


def _enveloped(n: JointNumbers) -> str:
    line = n.envelope
    if line is None:
        return "None  # of ClampingDCMotor: no limit of the command was found, or no back-EMF"
    names = {
        "saturation_effort": "saturation_effort",
        "velocity_limit": "velocity_limit",
        "effort_limit": "max_motor_effort",
    }
    return f"{ {names[key]: x for key, x in line.items()}!r}  # of ClampingDCMotor, for a PD loop of your own"


def _edits(n: JointNumbers) -> list[str]:
    """Lines that write spring and stops."""
    lines = []
    if n.stiffness > 0:
        lines += [f"    builder.joint_stiffness[dof] = {n.stiffness!r}", f"    builder.joint_rest_q[dof] = {n.rest!r}"]
    for name, end in (("lower", n.lower), ("upper", n.upper)):
        lines += [f"    builder.joint_limit_{name}[dof] = {end!r}"] if math.isfinite(end) else []
    if math.isfinite(n.lower) or math.isfinite(n.upper):
        J = n.armature
        lines += [
            f"    builder.joint_limit_ke[dof] = {J * n.stop!r}",
            f"    builder.joint_limit_kd[dof] = {J * n.stop_damping!r}",
        ]
    return lines
