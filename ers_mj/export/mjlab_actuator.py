"""`mjlab_actuator.py`: the actuator in mjlab's own classes."""

from __future__ import annotations

import math
from importlib.resources import files
from string import Template

from ers_mj.export.base import Target, Written
from ers_mj.export.joint_numbers import JointNumbers, joint_numbers
from ers_mj.export.servo import Servo

UNLIMITED = 1e6  # [input unit] where a class demands a limit and the servo has none
WHOLE_STEPS = (
    "a delay is rounded to whole physics steps, and mjlab answers with the newest command while its history is short"
)
KEEPS = "armature, friction and damping are written over your XML's; a `None` in their place would keep those"
BRAKES = (
    "torque_actuator() alone: beyond the no-load speed its four-quadrant line brakes, also when asked to drive; the"
    " servo itself is a voltage behind a resistance, which actuator() is"
)
ITS_MUJOCO = "mjlab 1.6 runs MuJoCo 3.11: joint.xml's delay and nsample, new in 4.0, are refused there"


class Mjlab(Target):
    """A native actuator where MuJoCo has it, and the torque-speed line of a DC motor beside it."""

    name, file, tool = "mjlab", "mjlab_actuator.py", "mjlab 1.6"

    def write(self, servo: Servo) -> Written:
        from ers_mj import __version__

        n = joint_numbers(servo)
        cfg, arguments, classes = _configured(n)
        envelope = n.envelope
        values = {
            "title": servo.name,
            "version": __version__,
            "command": n.commanded,
            "classes": ", ".join(sorted({*classes, *(["DcMotorActuatorCfg"] if envelope else [])})),
            "delay": repr(n.delay),
            "envelope": repr(envelope) if envelope else "None  # no limit of the command was found, or no back-EMF",
            "cfg": cfg,
            "arguments": "\n".join(f"        {name}={x}," for name, x in arguments.items()),
            "enveloped": ENVELOPED if envelope else "",
            "solref": n.solref,
            "solimp": n.solimp,
            "edits": "\n".join(n.edits),
        }
        text = (files("ers_mj.export") / "mjlab_actuator.txt").read_text(encoding="utf-8")
        lost = [*n.left_out, KEEPS, ITS_MUJOCO]
        lost += [WHOLE_STEPS] if n.delay else []
        lost += [BRAKES] if envelope else []
        return Written(Template(text).substitute(values).encode(), tuple(lost))


ENVELOPED = '''

def torque_actuator(stiffness, damping, joint="servo", timestep=0.005):
    """The torque-speed line alone, under a PD loop of your own: torques are cut, no voltage is there."""
    lag = round(DELAY / timestep)
    return DcMotorActuatorCfg(
        target_names_expr=(joint,),
        stiffness=stiffness,
        damping=damping,
        delay_min_lag=lag,
        delay_max_lag=lag,
        **ENVELOPE,
    )
'''


def _configured(n: JointNumbers) -> tuple[str, dict[str, str], tuple[str, ...]]:
    """(class, its arguments as text, all classes that they name)."""
    passive = {"armature": repr(n.armature), "frictionloss": repr(n.friction), "viscous_damping": repr(n.damping)}
    if n.kind == "position":
        limit = repr(n.effort) if math.isfinite(n.effort) else "None"
        own = {"stiffness": repr(n.gain), "damping": repr(n.brake), "effort_limit": limit}
        return "BuiltinPositionActuatorCfg", {**own, **passive}, ("BuiltinPositionActuatorCfg",)
    if n.kind == "dcmotor":
        own = {
            "motor_params": f"DcMotorPhysicalParams(kt={n.constant!r}, ke={n.constant!r}, resistance={n.resistance!r})",
            "mode": "DcMotorInputMode.VOLTAGE",
            "gear": repr(n.gear),
            "inductance": repr(n.inductance),
            "voltage_limit": repr(n.limit) if math.isfinite(n.limit) else "0.0",
        }
        classes = ("BuiltinDcMotorActuatorCfg", "DcMotorInputMode", "DcMotorPhysicalParams")
        return "BuiltinDcMotorActuatorCfg", {**own, **passive}, classes
    most = n.limit if math.isfinite(n.limit) else UNLIMITED
    own = {"effort_limit": repr(most), "gear": repr(n.gear)}
    return "BuiltinMotorActuatorCfg", {**own, **passive}, ("BuiltinMotorActuatorCfg",)
