"""`lookup.csv`: curves for the tables of a block diagram (Simulink and its kin), and the constants around them.

    J theta'' = force - back_emf w - damping(w) - friction(w) + load(theta),  read: sensor(theta)
    force: drive(u), or proportional (u - theta) - derivative w within +-limit; u late by the delay

Friction is dry: at rest it holds what is below its level at w = 0+-.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ers_mj.effects import BY_NAME, Effect
from ers_mj.export.base import Target, Written
from ers_mj.export.portable import Portable, bare
from ers_mj.export.servo import Servo
from ers_mj.plants.mujoco.looped import firmware_alone

SPEEDS = np.concatenate([[0.0], np.geomspace(1e-4, 1.0, 120)])  # of a table, as shares of its largest
FASTEST, WIDEST = 30.0, math.pi  # [rad/s] and [rad] to either side of tables; as many output units where it is no angle
PLACES = 801
SOFT = "friction is a table over speed: at rest your solver must let it hold, not chatter (a block with zero crossings)"
REACH = (
    "tables end at +-{speed:g} {y}/s and {place:.3g} {y} to either side of the start: a block's own rule holds beyond"
)


class Lookup(Target):
    """Rows `table,x,x_unit,y,y_unit`: each table a curve, each constant a row."""

    name, file, tool = "lookup", "lookup.csv", "lookup tables (Simulink)"

    def write(self, servo: Servo) -> Written:
        curves = Curves(servo)
        rows = [f"{table},{x!r},{x_unit},{y!r},{y_unit}" for table, x, x_unit, y, y_unit in curves.rows()]
        return Written("\n".join(["table,x,x_unit,y,y_unit", *rows, ""]).encode(), curves.losses)


@dataclass(frozen=True)
class Curves:
    """A servo as curves, all per inertia but where they are written."""

    servo: Servo

    @property
    def kept(self) -> list[tuple[Effect, np.ndarray]]:
        """Effects whose laws are curves: a torque over place or over speed, a friction over speed."""
        constants = self.servo.portable.constants
        acting = [(BY_NAME[name.removeprefix("law_")], p) for name, p in constants.items()]
        return [(effect, p) for effect, p in acting if _is_curve(effect, p, self.servo.rest)]

    @property
    def lost(self) -> list[str]:
        """Names of the other effects that act by laws."""
        kept = {effect.name for effect, _ in self.kept}
        acting = [name.removeprefix("law_") for name in self.servo.portable.constants]
        return [name for name in acting if name not in kept]

    @property
    def carried(self) -> Portable:
        """The model without what no curve carries."""
        q = {
            "I": 0.0, "lag": 0.0, "band": 0.0, "lost": 0.0, "idle": 0.0, "least": 0.0, "most": math.inf,
            "dead_time": 0.0, "R": math.inf,
        }  # fmt: skip
        one = {"parted": 0.0, "rho": 0.0, "beta": 0.0, "phi": 0.0, "gap": 0.0, "k_bristle": 0.0, "at_motor": 0.0}
        off = {
            **q,
            **one,
            "creep": math.inf,
            "fall": 0.0,
            "log_at_motor": 0.0,
            "buried": 1.0,
            "lower": -math.inf,
            "upper": math.inf,
        }
        return bare(
            self.servo.portable, off, self.servo.portable.drive, [e for e, _ in self.kept], self.servo.portable.sensor
        )

    # -- curves --------------------------------------------------------------------------------------------------------

    def friction(self, w: np.ndarray) -> np.ndarray:
        """Dry friction (N,) against the motion at speeds (N,), 0 at rest."""
        c = self.servo.lowered
        level = np.where(w > 0, c.c_2_plus, c.c_2_minus)
        for effect, p in self.kept:
            if effect.friction:
                level = np.array([effect.friction(p, x, self.servo.rest, v, 0.0, np.sign(v)) for x, v in zip(level, w)])
        return np.maximum(level, 0.0) * np.sign(w)

    def damping(self, w: np.ndarray) -> np.ndarray:
        """Mechanical damping (N,) against the motion."""
        c, own = self.servo.lowered, self._torque(lambda f, p, v: f(p, self.servo.rest, v, 0.0, 0.0), w)
        still = self._torque(lambda f, p, v: f(p, self.servo.rest, 0.0, 0.0, 0.0), w)
        return np.where(w > 0, c.a_mech_plus, c.a_mech_minus) * w - (own - still)

    def load(self, theta: np.ndarray) -> np.ndarray:
        """What pushes (N,) at rest at places (N,)."""
        c = self.servo.lowered
        spring = c.bias + c.a_1 * (c.theta_0 - theta) - c.c_1 * np.sign(theta - c.theta_0)
        return spring + self._torque(lambda f, p, place: f(p, place, 0.0, 0.0, 0.0), theta)

    def _torque(self, at: Callable, x: np.ndarray) -> np.ndarray:
        laws = [(effect.torque, p) for effect, p in self.kept if effect.torque]
        return np.array([sum(at(law, p, v) for law, p in laws) for v in x], float)

    # -- the file ------------------------------------------------------------------------------------------------------

    def rows(self) -> Iterator[tuple[str, float, str, float, str]]:
        """(table, x, its unit, y, its unit) of every point and constant."""
        servo, y, p = self.servo, self.servo.output_unit, self.servo.portable
        J, force = servo.inertia or 1.0, self._force
        for name, value, unit in self.constants():
            yield name, 0.0, "-", float(value), unit
        speeds = FASTEST * np.concatenate([-SPEEDS[:0:-1], SPEEDS])
        for name, curve in (("friction", self.friction), ("damping", self.damping)):
            yield from ((name, float(v), f"{y}/s", float(J * f), force) for v, f in zip(speeds, curve(speeds)))
        for x, f in zip(places := self._places(), self.load(places)):
            yield "load", float(x), y, float(J * f), force
        if not servo.loop:
            reach = 1.0 if p.drive.is_identity else None
            at = np.array([-reach, reach]) * 100.0 if reach else p.drive.at
            to = at if reach else p.drive.to
            yield from (
                ("drive", float(u), servo.input_unit, float(J * servo.lowered.b * v), force) for u, v in zip(at, to)
            )
        if not p.sensor.is_identity:
            yield from (("sensor", float(a), y, float(b), y) for a, b in zip(p.sensor.at, p.sensor.to))

    def constants(self) -> list[tuple[str, float, str]]:
        """(name, value, unit) of what is no curve."""
        servo, c, q, n = self.servo, self.servo.lowered, self.servo.loop, self.servo.portable.numbers
        J, force, y = servo.inertia or 1.0, self._force, servo.output_unit
        found = [
            ("inertia", J, "kg m^2" if servo.is_angle else "kg"),
            ("back_emf", J * c.a_emf, f"{force} s/{y}"),
            ("time_constant", c.tau_e, "s"),
            ("delay", q.tau if q else c.delay, "s"),
            ("start", servo.rest, y),
            ("sensor_time_constant", n["T_sensor"], "s"),
            ("sensor_delay", n["late_sensor"], "s"),
        ]
        if q:
            found += [("proportional", J * q.K, f"{force}/{y}"), ("derivative", J * q.D, f"{force} s/{y}")]
            found += [("limit", J * q.L, force)] if math.isfinite(q.L) else []
        return found

    @property
    def _force(self) -> str:
        return "N m" if self.servo.is_angle else "N"

    def _places(self) -> np.ndarray:
        """Places of the load's table; where the spring's preload jumps, one to either side."""
        around, c = self.servo.rest, self.servo.lowered
        places = around + np.linspace(-WIDEST, WIDEST, PLACES)
        jump = [c.theta_0 - 1e-9, c.theta_0 + 1e-9] if c.c_1 > 0 else []
        return np.unique([*places, *jump])

    @property
    def losses(self) -> tuple[str, ...]:
        """What no curve carries."""
        c, q, servo = self.servo.lowered, self.servo.loop, self.servo
        found = {
            "the inertia is not known: J = 1 is written, every force is per inertia": servo.inertia is None,
            "a second body behind a play or a shaft": c.has_motor_side,
            "friction that bends before it slips": c.has_bristle,
            "friction that creeps below its level": math.isfinite(servo.portable.numbers["creep"]),
            "an inductance that falls with the current": c.fall > 0 and c.tau_e > 0,
            "stops at the ends of the travel": math.isfinite(c.lower) or math.isfinite(c.upper),
            "a dead time within the firmware's loop": q is not None and q.dead_time > 0,
        }
        firmware = firmware_alone(q) if q else ()
        laws = [f"{name.replace('_', ' ')}: more than a curve over place or speed" for name in self.lost]
        y, drawn = servo.output_unit, (SOFT, REACH)
        told = [text.format(speed=FASTEST, place=WIDEST, y=y) for text in drawn]
        lost = [text for text, is_so in found.items() if is_so]
        return (*lost, *firmware, *laws, *servo.portable.left_out, *told)


def _is_curve(effect: Effect, p: np.ndarray, rest: float) -> bool:
    """Whether a law is a torque over place or over speed, or a friction over speed, and nothing more."""
    if effect.memory or effect.inertia:
        return False
    random = np.random.default_rng(0)
    tried = [
        (rest + random.uniform(-1, 1), random.uniform(-5, 5), random.uniform(-99, 99), random.uniform(0, 9))
        for _ in range(24)
    ]
    if effect.friction:
        alone = [
            abs(effect.friction(p, 50.0, x, w, j, np.sign(w)) - effect.friction(p, 50.0, rest, w, 0.0, np.sign(w)))
            for x, w, j, _ in tried
        ]
        return max(alone) < 1e-9
    law = effect.torque
    assert law is not None
    apart = [
        abs(law(p, x, w, j, t) - law(p, x, 0.0, 0.0, 0.0) - law(p, rest, w, 0.0, 0.0) + law(p, rest, 0.0, 0.0, 0.0))
        for x, w, j, t in tried
    ]
    return max(apart) < 1e-9
