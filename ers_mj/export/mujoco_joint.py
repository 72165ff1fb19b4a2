"""`joint.xml`: a model of one joint and its actuator, whose lines go into a robot of one's own."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property

import numpy as np

from ers_mj.export.base import Target, Written
from ers_mj.export.portable import Portable, bare, clipping
from ers_mj.export.servo import Servo
from ers_mj.export.trying import apart, excitation, response
from ers_mj.plants.mujoco.joint import JointLines, clip_of, joint_lines, pushed
from ers_mj.plants.mujoco.looped import firmware_alone

TIMESTEP = 5e-4  # [s] of the file
NEGLIGIBLE = 1e-6  # of the joint's inertia that its body has itself, so that the armature is J
PER_INERTIA = "the inertia is not known: J = 1 {unit} is written, multiply every force by yours"
INTEGRATED = (
    "another integrator or timestep is another model: with Euler, an actuator's kv brakes more than the same joint"
    " damping, from a timestep of a tenth of J / damping on"
)
INVERSE = (
    "stops, and friction below breakaway, are as stiff as written against J alone: in a robot they scale with its"
    " inertia at the joint (dof_invweight0)"
)
PLAIN = (
    "a slide along an axis of a body whose centre of mass is its origin: MuJoCo then takes dof_invweight0 from the mass"
    " without the armature, and friction and stops give way; the file moves the centre by a millimetre"
)
WEIGHTS = "the bodies of your robot bring their own weight: give them the masses and centres that they have"
LATE = "the delay is written half a timestep less than a whole number of steps: MuJoCo's clock would add one at times"
RESET = "a controller that resets by writing qpos and qvel leaves old commands in the delay: use mj_resetData"


class MujocoJoint(Target):
    """Armature, damping, friction, spring, stops and one actuator of the plainest kind that carries it."""

    name, file, tool = "mujoco", "joint.xml", "MuJoCo 4"

    def write(self, servo: Servo) -> Written:
        made = OwnJoint(servo)
        return Written(made.xml.encode(), made.losses)


class OwnJoint:
    """A servo as the lines of one joint.

    Args:
        servo: what is to be written.
        timestep: h [s] of the model.
        wound: whether the actuator may be a dcmotor, which has the winding's time constant.
    """

    def __init__(self, servo: Servo, timestep: float = TIMESTEP, wound: bool = True):
        self.servo, self.timestep, self.wound = servo, timestep, wound
        self.inertia = servo.inertia or 1.0

    @cached_property
    def lines(self) -> JointLines:
        """Attributes of joint and actuator, with what they do not carry."""
        c, p = self.servo.lowered, self.servo.portable.numbers
        soft = (p["creep"], p["heavy"]) if math.isfinite(p["creep"]) else None
        lines = joint_lines(
            self.servo.plant,
            self.inertia,
            joint="servo",
            bodies=NEGLIGIBLE * self.inertia,
            timestep=self.timestep,
            actuator="dcmotor" if c.tau_e > 0 and self.wound else "motor",
            is_angle=self.servo.is_angle,
            soft=soft,
        )
        return lines if self.servo.loop is None else self._looped(lines)

    def _looped(self, lines: JointLines) -> JointLines:
        """A position actuator in the place of the motor: its gains at the joint, gear 1."""
        q, J = self.servo.loop, self.inertia
        assert q is not None
        actuator: dict[str, object] = {"name": "servo_servo", "joint": "servo", "kp": J * q.K, "kv": J * q.D}
        if math.isfinite(q.L):
            actuator["forcerange"] = (-J * q.L, J * q.L)
        if q.tau > 0:
            late = q.tau - 0.5 * self.timestep if self._is_whole(q.tau) else q.tau
            actuator |= {"delay": late, "nsample": math.ceil(late / self.timestep) + 1}
        within = ("a dead time within the firmware's loop",) if q.dead_time > 0 else ()
        lost = (*lines.left_out, *firmware_alone(q), *within)
        return replace(lines, actuator=actuator, kind="position", left_out=lost)

    def _is_whole(self, seconds: float) -> bool:
        steps = seconds / self.timestep
        return abs(steps - round(steps)) < 1e-6 * max(steps, 1.0)

    @property
    def carried(self) -> Portable:
        """The model without what these lines do not carry."""
        c, clip = self.servo.lowered, clip_of(self.servo.plant)
        level, damping = 0.5 * (c.c_2_plus + c.c_2_minus), 0.5 * (c.a_mech_plus + c.a_mech_minus)
        off = {
            "c_1": 0.0, "fall": 0.0, "k_bristle": 0.0, "parted": 0.0, "rho": 0.0, "beta": 0.0, "phi": 0.0, "gap": 0.0,
            "c_2_plus": level, "c_2_minus": level, "a_mech_plus": damping, "a_mech_minus": damping,
            "bias": pushed(c) if c.a_1 > 0 else 0.0, "tau_e": c.tau_e if self.lines.kind == "dcmotor" else 0.0,
            "I": 0.0, "lag": 0.0, "R": math.inf, "band": 0.0, "lost": 0.0, "idle": 0.0, "least": 0.0, "most": math.inf,
            "dead_time": 0.0,
            "at_motor": 0.0, "log_at_motor": 0.0, "buried": 1.0,
        }  # fmt: skip
        return bare(self.servo.portable, off, None if clip is None else clipping(clip))

    @property
    def xml(self) -> str:
        """The file: a model that loads as it is."""
        lines, hinge = self.lines.xml, ' axis="0 1 0"'
        joint = next(line for line in lines.splitlines() if line.startswith("<joint")).replace("/>", f"{hinge}/>")
        actuator = next(line for line in lines.splitlines() if line.startswith("<actuator"))
        centre = "0 0 0" if self.servo.is_angle else "0.001 0 0"  # see PLAIN
        size, name = repr(NEGLIGIBLE * self.inertia), self.servo.name.replace("--", "- -")
        told = [sentence.replace("--", "- -") for sentence in self.lines.left_out] or ["nothing"]
        lost = "\n".join(f"     {sentence}" for sentence in told)
        return f"""<!-- {name} as a joint and its actuator, written by ers-mj.
     Copy the two marked lines; they do not carry:
{lost} -->
<mujoco model="servo">
  <compiler angle="radian" autolimits="true"/>
  <option timestep="{self.timestep!r}" integrator="implicitfast" gravity="0 0 0"/>
  <worldbody>
    <body name="output">
      <inertial pos="{centre}" mass="{size}" diaginertia="{size} {size} {size}"/>
      <!-- the joint -->
      {joint}
    </body>
  </worldbody>
  <!-- its actuator: ctrl is {self.servo.signals[0]} -->
  {actuator}
</mujoco>
"""

    def follow(self, t: np.ndarray, u: np.ndarray) -> np.ndarray:
        """The joint's position (N,) in MuJoCo under the input u (N,), from rest."""
        import mujoco

        model = mujoco.MjModel.from_xml_string(self.xml)
        data, out = mujoco.MjData(model), np.empty(t.size)
        data.qpos[0] = self.servo.rest
        steps = max(1, round((t[1] - t[0]) / model.opt.timestep))
        for k in range(t.size):
            out[k], data.ctrl[0] = data.qpos[0], u[k]
            mujoco.mj_step(model, data, steps)
        return out

    @property
    def losses(self) -> tuple[str, ...]:
        """What the lines do not carry, what they do otherwise, and by how much the joint was off when it was run."""
        c, lines = self.servo.lowered, self.lines
        unit = "kg m^2" if self.servo.is_angle else "kg"
        found = {
            PER_INERTIA.format(unit=unit): self.servo.inertia is None,
            PLAIN: not self.servo.is_angle,
            WEIGHTS: math.hypot(c.g_s, c.g_c) > 0,
            LATE: "delay" in lines.actuator,
            RESET: "delay" in lines.actuator,
            INVERSE: "range" in lines.joint or c.c_2_plus + c.c_2_minus > 0,
            INTEGRATED: True,
        }
        return (*lines.left_out, *(text for text, is_so in found.items() if is_so), self.measured)

    @cached_property
    def measured(self) -> str:
        """The sentence of a run in MuJoCo against the model with what is not carried switched off."""
        t, u = excitation(self.servo)
        off = apart(self.follow(t, u), response(self.servo, self.carried, t, u))
        rest = "the model with that switched off" if self.lines.left_out else "the model"
        return (
            f"measured: at a timestep of {1e3 * self.timestep:g} ms MuJoCo {_version()} is {100.0 * off:.2g} % of the"
            f" RMS from {rest}, soft friction and stops included"
        )


def _version() -> str:
    import mujoco

    return str(mujoco.__version__)
