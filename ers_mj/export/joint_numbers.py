"""A servo as the numbers of one joint and one actuator, for tools that configure both in Python."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ers_mj.export.mujoco_joint import PER_INERTIA, WEIGHTS, OwnJoint
from ers_mj.export.servo import Servo
from ers_mj.plants.mujoco.joint import FAR


@dataclass(frozen=True)
class JointNumbers:
    """Numbers of one joint, SI.

    Attributes:
        kind: "position", "dcmotor" (a voltage behind a resistance) or "motor".
        armature, damping, friction: passive; of a dcmotor the back-EMF is not in the damping.
        stiffness, rest, lower, upper, stop, stop_damping: spring and stops, infinite ends where there are none.
        gain, brake, effort: of a position loop at the joint.
        gear, limit, constant, resistance, inductance: of a motor; its limit in input units.
        emf: what the back-EMF damps at the joint.
        delay: [s] of the command.
        softness: (creep [1/s], heavy) of friction below breakaway, or None: it holds.
        commanded: what the command is, a sentence.
        left_out: what these numbers do not carry.
    """

    kind: str
    armature: float
    damping: float
    friction: float
    stiffness: float
    rest: float
    lower: float
    upper: float
    stop: float
    stop_damping: float
    gain: float
    brake: float
    effort: float
    gear: float
    limit: float
    constant: float
    resistance: float
    inductance: float
    emf: float
    delay: float
    softness: tuple[float, float] | None
    commanded: str
    left_out: tuple[str, ...]

    @property
    def envelope(self) -> dict[str, float] | None:
        """The torque-speed line of a drive whose limit was found, as torques at the joint; None where the data do not
        show one.
        """
        stall = self.torque * self.limit
        if self.kind == "position" or not math.isfinite(stall) or self.emf <= 0:
            return None
        return {"saturation_effort": stall, "velocity_limit": stall / self.emf, "effort_limit": stall}

    @property
    def torque(self) -> float:
        """At the joint, of one unit of the input at rest."""
        return abs(self.gear) * (self.constant / self.resistance if self.kind == "dcmotor" else 1.0)

    @property
    def solref(self) -> str:
        """solref_friction as text of Python, where ``timestep`` is known."""
        if self.softness is None:
            return "[2.0 * timestep, 1.0]"
        share = self._impedance
        return f"[max({2.0 * share / (share * self.softness[0] * (1.0 - share))!r}, 2.0 * timestep), 1.0]"

    @property
    def solimp(self) -> str:
        """solimp_friction as text of Python."""
        d = 0.9999 if self.softness is None else self._impedance
        return f"[{d!r}, {d!r}, 0.001]"

    @property
    def _impedance(self) -> float:
        assert self.softness is not None
        return min(max(1.0 - 1.0 / self.softness[1], 0.01), 0.9999)

    @property
    def edits(self) -> list[str]:
        """Lines of Python that write spring and stops onto the joint ``own`` of an MjSpec."""
        lines = []
        if self.stiffness > 0:
            lines += [f'    _first(own, "stiffness", {self.stiffness!r})', f"    own.springref = {self.rest!r}"]
        if math.isfinite(self.lower) or math.isfinite(self.upper):
            ends = max(self.lower, -FAR), min(self.upper, FAR)
            lines += [f"    own.limited, own.range[:] = True, {[*ends]!r}"]
            lines += [f"    own.solref_limit[:] = {[-self.stop, -self.stop_damping]!r}"]
            lines += ["    own.solimp_limit[:3] = [1e-4, 1e-4, 0.001]"]
        return lines


def joint_numbers(servo: Servo, wound: bool = True) -> JointNumbers:
    """The numbers of a servo; the delay is the whole one, in seconds, the actuator a dcmotor only where ``wound``."""
    made, c, n = OwnJoint(servo, wound=wound), servo.lowered, servo.portable.numbers
    lines, J = made.lines, made.inertia
    joint, actuator = lines.joint, lines.actuator

    def of(table, name: str, absent: float = 0.0) -> float:
        return float(table.get(name, absent))

    limit = actuator["ctrlrange"][1] if "ctrlrange" in actuator else math.inf  # type: ignore[index]
    effort = actuator["forcerange"][1] if "forcerange" in actuator else math.inf  # type: ignore[index]
    constant = actuator["motorconst"][0] if "motorconst" in actuator else 0.0  # type: ignore[index]
    unit = "kg m^2" if servo.is_angle else "kg"
    lost = [*([PER_INERTIA.format(unit=unit)] if servo.inertia is None else []), *lines.left_out]
    lost += [WEIGHTS] if math.hypot(c.g_s, c.g_c) > 0 else []
    return JointNumbers(
        kind=lines.kind,
        armature=J,
        damping=of(joint, "damping"),
        friction=of(joint, "frictionloss"),
        stiffness=of(joint, "stiffness"),
        rest=of(joint, "springref"),
        lower=c.lower,
        upper=c.upper,
        stop=c.k_stop,
        stop_damping=max(c.d_stop, 1e-12),
        gain=of(actuator, "kp"),
        brake=of(actuator, "kv"),
        effort=float(effort),
        gear=of(actuator, "gear", 1.0),
        limit=float(limit),
        constant=float(constant),
        resistance=of(actuator, "resistance", 1.0),
        inductance=float(actuator["inductance"][0]) if "inductance" in actuator else 0.0,  # type: ignore[index]
        emf=J * c.a_emf,
        delay=n["delay"],
        softness=(n["creep"], n["heavy"]) if math.isfinite(n["creep"]) else None,
        commanded=_commanded(lines.kind, servo),
        left_out=tuple(lost),
    )


def _commanded(kind: str, servo: Servo) -> str:
    if kind == "position":
        return f"Its command is a position [{servo.output_unit}]."
    return f"Its command is the input [{servo.input_unit}], as an effort target."
