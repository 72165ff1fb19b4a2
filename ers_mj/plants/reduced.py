"""The reduced model, Eq. (1)/(5)/(6), with any effects of the library switched on: voltages in, motion out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ers_mj.effects import BY_NAME, EFFECTS
from ers_mj.effects.base import Effect
from ers_mj.effects.quantities import Coefficients
from ers_mj.plants.effort import Effort
from ers_mj.plants.kernel import event_integrator, fixed_steps
from ers_mj.plants.kernel.before import resting_input, resting_twist
from ers_mj.plants.kernel.laws import Acting, acting, laid_out
from ers_mj.plants.kernel.state import N_CONSTANTS
from ers_mj.plants.kernel.tangents import NUDGE, prepare, tangent

EVENT = 1.1  # [us] that an event takes
# [us] that a simulated second takes: of the plain plant, with laws, of two bodies or on a bristle, of both; of a
# tangent; and how much more where the inductance falls with the current
PLAIN, LAW, TWO_BODIES, FIXED_STEPS, TANGENT, FALLING = 150, 400, 800, 2000, 60, 1500


def lumped(values: Mapping[str, float]) -> Coefficients:
    """Kernel coefficients of Eq. (6)'s letters: a_1 a_2 b c_1 c_2 theta_0, with tau_e [s] and emf_share optional.

    a_2 splits into the back-EMF's part a_2 * emf_share (which acts through the current) and the mechanical rest.
    """
    share = values.get("emf_share", 0.0)
    a_2 = values.get("a_2", 0.0)
    c_2 = values.get("c_2", 0.0)
    return Coefficients(
        a_1=values.get("a_1", 0.0),
        a_mech_plus=a_2 * (1 - share),
        a_mech_minus=a_2 * (1 - share),
        a_emf=a_2 * share,
        b=values["b"],
        c_1=values.get("c_1", 0.0),
        c_2_plus=c_2,
        c_2_minus=c_2,
        theta_0=values.get("theta_0", 0.0),
        tau_e=values.get("tau_e", 0.0),
    )


def lowered(c: Coefficients, effects: Sequence[tuple[str, np.ndarray]]) -> tuple[np.ndarray, Acting, np.ndarray]:
    """What laws.laid_out takes of a plant with these effects: coefficients, the laws that are on, their constants."""
    given = {}
    for name, values in effects:
        c = BY_NAME[name].coefficients(values, c)
    for name, values in effects:
        effect = BY_NAME[name]
        if (effect.torque or effect.friction or effect.inertia or effect.memory) and effect.is_lawful(values):
            given[name] = effect.constants(values, c)
    on = acting(tuple(given), c.has_motor_side)
    p = np.zeros((len(on.rows), N_CONSTANTS))
    for row, constants in zip(on.rows, p, strict=True):
        constants[: len(given[EFFECTS[row].name])] = given[EFFECTS[row].name]
    return np.array(c, float), on, p


@dataclass(frozen=True)
class Motion:
    """A simulated motion, each (N,): time [s], angle, speed, drive acceleration n K_t i / J, motor-side angle."""

    t: np.ndarray
    theta: np.ndarray
    omega: np.ndarray
    drive: np.ndarray
    theta_m: np.ndarray
    measured: np.ndarray


@dataclass(frozen=True)
class Held:
    """What acts on a run beside its input: whether the circuit is closed (N,), a known acceleration of the rudder (N,),
    and what an observer of this ``gain`` follows (N,) at one sample in ``every`` (see event_integrator.simulate).
    """

    enable: np.ndarray | None = None
    load: np.ndarray | None = None
    y: np.ndarray | None = None
    gain: float = 0.0
    every: int = 1

    def beside(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(enable, load, y) as the kernel takes them, each (N,)."""
        enable = np.ones(t.size, np.bool_) if self.enable is None else self.enable
        return enable, np.zeros(t.size) if self.load is None else self.load, t if self.y is None else self.y


def _step(c: np.ndarray, c_2: np.ndarray) -> np.ndarray:
    """c_2 - c, and 0 where both are the same infinity."""
    return np.subtract(c_2, c, out=np.zeros_like(c), where=c != c_2)


def _whole(delay: float, h: float) -> int:
    """Samples of length h that a delay swallows."""
    return int(delay / h + 1e-9)


def _touches_sensor(name: str) -> bool:
    return type(BY_NAME[name]).measure is not Effect.measure


@dataclass(frozen=True)
class ReducedModel:
    """Eq. (6)'s coefficients and the effects on top of them.

    ``effects`` is a sequence of (name, parameters (k,)); torques are carried per inertia (see effects/base.py).
    ``supply`` is what a recording measured of it [V] (N,), or None; ``effort`` counts what is simulated with it.
    """

    coefficients: Coefficients
    effects: Sequence[tuple[str, np.ndarray]] = ()
    supply: np.ndarray | None = field(default=None, repr=False, compare=False)
    effort: Effort | None = field(default=None, repr=False, compare=False)
    _lowered: tuple = field(init=False, repr=False, compare=False)

    def __post_init__(self):
        object.__setattr__(self, "_lowered", lowered(self.coefficients, self.effects))

    def __reduce__(self):  # what is laid out holds addresses, which no other process has
        return ReducedModel, (self.coefficients, self.effects, self.supply, self.effort)

    @cached_property
    def _with_effects(self) -> Coefficients:
        """The coefficients that the effects leave."""
        return Coefficients(*self._lowered[0])

    @property
    def coupled(self) -> bool:
        """Whether there is a second body, be it the foot of a bristle."""
        return self._with_effects.two_body > 0

    @cached_property
    def bends(self) -> bool:
        """Whether friction bends a bristle first."""
        return self._with_effects.has_bristle

    @cached_property
    def has_motor_side(self) -> bool:
        """Whether a play or a shaft parts motor and rudder."""
        return self._with_effects.has_motor_side

    @cached_property
    def _laid_out(self) -> np.ndarray:
        """What the kernels take of the plant, a copy each since they change it."""
        return laid_out(*self._lowered)

    @cached_property
    def _keeps_command(self) -> bool:
        """Whether no effect makes another input of the command."""
        kinds = [type(BY_NAME[name]) for name, _ in self.effects]
        return all(kind.command is Effect.command and kind.fed is Effect.fed for kind in kinds)

    def fed(self, u: np.ndarray) -> np.ndarray:
        """What a drive makes of the command u (N,) whose supply varies as it was measured."""
        for name, values in self.effects if self.supply is not None else ():
            u = BY_NAME[name].fed(values, u, self.supply)
        return u

    def terminal(self, u: np.ndarray) -> np.ndarray:
        """The input (N,) that is left of the command u (N,) after the drive's static effects."""
        u = self.fed(u)
        for name, values in self.effects:
            u = BY_NAME[name].command(values, u)
        return np.ascontiguousarray(u, float)

    def _run(self, t: np.ndarray, u: np.ndarray, start, held: Held, refine: int) -> tuple[np.ndarray, int]:
        """The motion (N, 4), and what its events take beyond what a run of this plant usually does [us]."""
        out = np.empty((t.size, 4))
        enable, load, y = held.beside(t)
        refine *= 2 if any(BY_NAME[name].follows_current for name, _ in self.effects) else 1
        x0 = np.zeros(5)
        x0[: len(start)] = start
        by_steps = self.bends and self.has_motor_side
        run = fixed_steps.simulate if by_steps else event_integrator.simulate
        plant = self._laid_out.copy()
        events = run(t, self._late(t, u, x0), enable, load, y, held.gain, held.every, plant, refine, x0, out)
        beyond = 0 if by_steps else max(0, int(EVENT * events - self._price * (t[-1] - t[0])))
        self._count(t, self._price, beyond)
        return out, beyond

    def theta(self, t, u, start, *, enable=None, load=None, y=None, gain=0.0, every=1) -> np.ndarray:
        """What the sensor reads (N,) at the sample times t (N,) [s]; the observer form where ``gain`` > 0 (see
        event_integrator.simulate).

        ``start`` is (theta, omega[, drive acceleration[, twist, its speed]]), both bodies alike where no twist of the
        motor's side is given; ``load`` (N,) an acceleration; ``enable`` (N,) bool. An
        observer beside a sensor effect that is not ``instant`` goes more than one way: what the sensor adds on one is
        taken off the measurement on the next.
        """
        return self.outputs(t, u, start, enable=enable, load=load, y=y, gain=gain, every=every)[0]

    def outputs(
        self, t, u, start, *, enable=None, load=None, y=None, gain=0.0, every=1
    ) -> tuple[np.ndarray, np.ndarray]:
        """As ``theta``, with the motion (N, 4) beside it: theta, omega, drive acceleration and motor side's angle."""
        return self.priced(t, u, start, enable=enable, load=load, y=y, gain=gain, every=every)[:2]

    def priced(
        self, t, u, start, *, enable=None, load=None, y=None, gain=0.0, every=1
    ) -> tuple[np.ndarray, np.ndarray, int]:
        """As ``outputs``, and what the events took beyond the usual [us]."""
        followed = self.behind(y) if gain > 0 and self._is_instant else y
        motion, beyond = self._run(t, u, start, Held(enable, load, followed, gain, every), 1)
        read = self.read(t, motion[:, 0])
        for _ in range(self._ways - 1 if gain > 0 else 0):
            followed = y - (read - motion[:, 0])
            motion, more = self._run(t, u, start, Held(enable, load, followed, gain, every), 1)
            read, beyond = self.read(t, motion[:, 0]), beyond + more
        return read, motion, beyond

    def current(self, t: np.ndarray, motion: np.ndarray) -> np.ndarray:
        """n K_t i / J (N,) of the winding's current along a motion (N, 4): what effects take from the drive
        acceleration is not in it.
        """
        j = motion[:, 2]
        for name, values in self.effects:
            j = BY_NAME[name].winding(values, self.coefficients, t, motion, j)
        return j

    @property
    def draws_drive(self) -> bool:
        """Whether the winding's current is the drive acceleration itself."""
        return all(type(BY_NAME[name]).winding is Effect.winding for name, _ in self.effects)

    @cached_property
    def _touches_reading(self) -> bool:
        return any(_touches_sensor(name) for name, _ in self.effects)

    @cached_property
    def _is_instant(self) -> bool:
        """Whether the reading tells the output at the same time."""
        return all(BY_NAME[name].instant for name, _ in self.effects if _touches_sensor(name))

    @cached_property
    def _ways(self) -> int:
        """How often an observer goes along a recording: behind a lag a second way still sticks and slips by what the
        first one, that followed a late reading, has shifted.
        """
        if self._is_instant:
            return 1
        return 3 if any(any(BY_NAME[name].remembers(values)) for name, values in self.effects) else 2

    @property
    def is_told_by_motion(self) -> bool:
        """Whether the angle read, the speed and the drive at a moment tell all that comes: not what a delay, a sensor,
        a law or a second body remembers.
        """
        return (
            not self.coupled
            and self._with_effects.delay <= 0
            and not any(_touches_sensor(name) or BY_NAME[name].memory for name, _ in self.effects)
        )

    @property
    def has_tangents(self) -> bool:
        """Whether ``tangents`` can tell how the output changes: of one body, on a bristle or not, that meets no stop,
        creeps nowhere, read by a sensor of a smooth law.
        """
        c = self._with_effects
        return (
            not self.has_motor_side
            and c.creep == 0.0
            and c.lower == -np.inf
            and c.upper == np.inf
            and all(BY_NAME[name].tangible for name, _ in self.effects if _touches_sensor(name))
        )

    def tangents(self, t, u, path, others, scale, **held) -> list[np.ndarray]:
        """First-order changes (N, 4) of theta, omega, drive acceleration and reading along a ``path`` (see
        ``outputs``), towards each of the ``others``, with what was ``held`` beside the input (see Held).

        Each is multiplied by ``scale``: 1 over the step that made the other model, or 1 for all of a small effect. An
        observer's last way (see ``theta``) is taken to follow what the other sensor adds, not what the change of the
        motion makes of it.
        """
        c, on, p = self._lowered
        held = Held(**held)
        enable, load, y = held.beside(t)
        theta, arriving = path[:, 0], self._arriving(t, u, path[0])
        read, followed, instant, out = self.read(t, theta), self.behind(y), self._is_instant, []
        maps, slopes, still = np.empty((6, 5, 17)), np.zeros((t.size, 3)), np.zeros(t.size)
        nothing = acting((), False)
        prepare(t, load, path, self._laid_out.copy(), maps, slopes)
        self._count(t, TANGENT * len(others))
        for other in others:
            c_2, on_2, p_2 = other._lowered
            dc, differ = laid_out(_step(c, c_2) * scale, nothing, p[:0]), on != on_2 or bool((p != p_2).any())
            change, added, dy = np.empty((t.size, 4)), still, still
            if self._touches_reading or other._touches_reading:
                added = (other.read(t, theta) - read) * scale
                dy = (other.behind(y) - followed) * scale if instant else -added
            du, here = self._moved_input(t, u, path[0], arriving, other, scale), followed if instant else y
            motion = (t, arriving, du, enable, load, here, dy, path, maps, slopes, held.gain, held.every)
            tangent(*motion, self._laid_out.copy(), other._laid_out.copy(), dc, differ, scale, change)
            change[:, 3] = self._read_change(t, theta, read, change[:, 0])
            if added is not still:
                change[:, 3] += added
            out.append(change)
        return out

    @property
    def told(self) -> tuple:
        """All that tells a motion of this plant from others under one input and one supply, to compare by."""
        c, _, _ = self._lowered
        return (c.tobytes(), *((name, values.tobytes()) for name, values in self.effects))

    @property
    def _price(self) -> int:
        """[us] that a simulated second takes."""
        if self.bends and self.has_motor_side:
            return FIXED_STEPS
        price = TWO_BODIES if self.coupled else LAW if self._lowered[1].pushes else PLAIN
        c = self._with_effects
        return price + (FALLING if c.fall > 0 and c.tau_e > 0 else 0)

    def count_outputs(self, t: np.ndarray, followed: bool, beyond: int) -> None:
        """Count what ``priced`` along t (N,) would have simulated, as an observer where ``followed``."""
        self._count(t, self._price, beyond)
        for _ in range(self._ways - 1 if followed else 0):
            self._count(t, self._price)

    def _count(self, t: np.ndarray, per_second: int, beyond: int = 0) -> None:
        if self.effort is not None:
            self.effort.add(t, per_second, beyond)

    def _moved_input(
        self, t: np.ndarray, u: np.ndarray, start: np.ndarray, arriving: np.ndarray, other: ReducedModel, scale: float
    ) -> np.ndarray:
        """Change (N,) towards another plant, times the scale, of the input that arrives at the motor."""
        if self._keeps_command and other._keeps_command and self._with_effects.delay == other._with_effects.delay:
            return np.zeros(t.size)
        return (other._arriving(t, u, start) - arriving) * scale

    def before(self, t: float, u: float, start: Sequence[float]) -> float:
        """The input at the terminals before a first sample at t [s] with u there: u itself, but where the plant is at
        rest (``start`` is theta, omega) what holds it so.
        """
        return u if start[1] != 0.0 else resting_input(t, u, start[0], self._laid_out.copy())

    def resting_twist(self, t: float, theta: float) -> float:
        """How far the motor's side is ahead of a load that rests at theta at t [s]."""
        return resting_twist(t, theta, self._laid_out.copy()) if self.has_motor_side else 0.0

    def _late(self, t: np.ndarray, u: np.ndarray, start: np.ndarray) -> np.ndarray:
        """The input (N + 1,) that a dead time lets through by whole samples, from the sample before the first on."""
        u = self.terminal(u)
        delay = self._with_effects.delay
        before = self.before(t[0], u[0], start) if delay > 0 else u[0]
        return np.concatenate([np.full(1 + _whole(delay, t[1] - t[0]), before), u])[: t.size + 1]

    def _arriving(self, t: np.ndarray, u: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Mean (N,) over each uniform sample of the input that arrives at the motor: after a dead time the impulse of a
        switch within a sample is exact.
        """
        delay, h, late = self._with_effects.delay, t[1] - t[0], self._late(t, u, start)
        return late[1:] - (delay / h - _whole(delay, h)) * np.diff(late)

    def _read_change(self, t: np.ndarray, theta: np.ndarray, read: np.ndarray, change: np.ndarray) -> np.ndarray:
        """First-order change (N,) of the reading that a change (N,) of the output makes."""
        most = float(np.max(np.abs(change))) if self._touches_reading else 0.0
        if not 0.0 < most < np.inf:
            return change
        small = NUDGE * float(np.ptp(theta)) / most
        return (self.read(t, theta + small * change) - read) / small

    def read(self, t: np.ndarray, theta: np.ndarray) -> np.ndarray:
        """What the sensor reads (N,) of the true output theta (N,); theta itself where no effect touches the sensor."""
        for name, values in self.effects:
            theta = BY_NAME[name].measure(values, t, theta)
        return theta

    def behind(self, reading):
        """The output, a number or (N,), at which the sensor at rest shows this reading."""
        for name, values in reversed(self.effects):
            reading = BY_NAME[name].behind(values, reading)
        return reading

    def simulate(self, t, u, start=None, *, enable=None, load=None, refine=1) -> Motion:
        """Free run from ``start`` (at rest at theta_0 by default) under u (N,), held between samples."""
        t, start = np.ascontiguousarray(t, float), (self.coefficients.theta_0, 0.0) if start is None else start
        out, _ = self._run(t, u, start, Held(enable, load), refine)
        return Motion(t, out[:, 0], out[:, 1], out[:, 2], out[:, 3], self.read(t, out[:, 0]))
