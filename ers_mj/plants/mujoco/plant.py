"""The plant in MuJoCo: the reduced model's coefficients and effects as bodies, joints and actuators; voltages in,
motion out.

The model is written from what the effects leave in ``Coefficients``, times the inertia: one source for both plants. An
effect whose law has no MJCF element is evaluated at every step of a Python loop, about three times slower.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np

from ers_mj.effects import BY_NAME
from ers_mj.effects.quantities import Coefficients, Twin
from ers_mj.errors import InputError
from ers_mj.plants.bare_gap import rigid_play
from ers_mj.plants.mujoco.bodies import Skeleton, lumped_skeleton, rudder_skeleton
from ers_mj.plants.mujoco.forces import motor_gain, write_coefficients
from ers_mj.plants.mujoco.stepping import Late, Law, Observer, Stepper, delayed, step_many
from ers_mj.plants.reduced import Motion, ReducedModel

TIMESTEP = 5e-5  # [s] RMS error on Table 1 at most 0.01 deg; twice the step, twice the error
BRISTLE_STEPS = 4  # steps for one where friction bends a bristle: MuJoCo steps its force explicitly
MAX_DELAY_SAMPLES = 4096  # history of a delayed actuator in plant.xml


@dataclass(frozen=True)
class MechanicalPlant:
    """A MuJoCo plant with the interface of :class:`ers_mj.plants.reduced.ReducedModel`.

    Attributes:
        coefficients: Eq. (6)'s record; tau_e > 0 switches the inductance on.
        effects: (name, parameters (k,)), torques per inertia, as the reduced model takes them.
        parameters: a datasheet's, of which J [kg m^2], n and K_t [N m/A] make the three-dimensional rudder system; None
            for one lumped joint of inertia 1 in output units.
        linkage: "constant" or "rod", of the rudder system.
        gap: half-width of a rigid play [output unit] (see plants/bare_gap.py); the effect ``backlash`` brings its own
            split and an elastic contact.
        is_angle: whether the output of a lumped plant turns (rad) or slides (m, V).
        timestep: h [s], at most; a sample is divided into whole steps.

    Raises:
        InputError: options that contradict each other or that no plant can have.
    """

    coefficients: Coefficients
    effects: Sequence[tuple[str, np.ndarray]] = ()
    parameters: Mapping[str, float] | None = None
    linkage: str = "constant"
    gap: float = 0.0
    is_angle: bool = True
    timestep: float = TIMESTEP
    _lowered: Coefficients = field(init=False, repr=False, compare=False)
    _skeleton: Skeleton = field(init=False, repr=False, compare=False)
    _laws: tuple[Law, ...] = field(init=False, repr=False, compare=False)
    model: mujoco.MjModel = field(init=False, repr=False, compare=False)

    def __post_init__(self):
        self._refuse_contradictions()
        object.__setattr__(self, "_lowered", self._lower())
        skeleton, laws = self._build()
        object.__setattr__(self, "_skeleton", skeleton)
        object.__setattr__(self, "_laws", laws)
        object.__setattr__(self, "model", skeleton.spec.compile())

    def __reduce__(self) -> tuple:
        """Travel to another process as its settings; the model is built again there."""
        parameters = None if self.parameters is None else dict(self.parameters)
        return type(self), (
            self.coefficients,
            tuple(self.effects),
            parameters,
            self.linkage,
            self.gap,
            self.is_angle,
            self.timestep,
        )

    def simulate(self, t, u, start=None, *, enable=None, load=None, y=None, gain=0.0, every=1) -> Motion:
        """Free run from ``start`` (at rest at theta_0 by default) under u (N,), held between samples; the observer form
        where ``gain`` > 0.

        Args:
            t: sample times (N,) [s], strictly increasing; they need not be uniform.
            u: input (N,), before the drive's effects.
            start: (theta, omega[, drive acceleration[, twist, its speed]]), the play centred where no twist is given.
            enable: (N,) bool, false an open circuit.
            load: (N,) a known acceleration of the rudder.
            y, gain, every: what was measured (N,) and how the observer follows it (see stepping.Observer).

        Returns:
            Motion, theta taken just before u[k] acts; NaN from where the motion leaves all bounds.
        """
        t, u = np.ascontiguousarray(t, float), self.terminal(u)
        stepper = self._stepper()
        stepper.reset(self._start(start))
        rows = stepper.run(
            t, u, self._late(t, u, start), enable, load, Observer(y, gain, every, self._moved) if gain > 0 else None
        )
        return self._motion(t, rows)

    def _late(self, t: np.ndarray, u: np.ndarray, start: Sequence[float] | None) -> Late | None:
        """How the command arrives after a dead time; what came before is the reduced model's."""
        if self._lowered.delay <= 0:
            return None
        twin = ReducedModel(self.coefficients, self.effects)
        begun = (self.coefficients.theta_0, 0.0) if start is None else start
        return delayed(t, u, self._lowered.delay, twin.before(t[0], u[0], begun))

    def ratio(self, theta: float) -> float:
        """The motor's speed over the rudder's at the angle theta, the play closed."""
        return self._skeleton.pose(theta)[self._skeleton.motor_joint][1]

    def terminal(self, u: np.ndarray) -> np.ndarray:
        """The input (N,) that is left of the command u (N,) after the drive's static effects."""
        for name, values in self.effects:
            u = BY_NAME[name].command(values, u)
        return np.ascontiguousarray(u, float)

    @property
    def stepped(self) -> tuple[str, ...]:
        """What the MJCF does not carry and the stepping applies."""
        falls = self._lowered.fall > 0 and self._lowered.tau_e > 0
        return (*(law.name for law in self._laws), *(("inductance",) if falls else ()))

    def spec(self) -> mujoco.MjSpec:
        """The model for a plain viewer: with the command's delay, and a keyframe ``home`` at rest at theta_0."""
        skeleton, _ = self._build()
        spec, delay = skeleton.spec, self._lowered.delay
        if delay > 0:
            motor = spec.actuator("motor")
            motor.delay, motor.nsample = delay, min(int(np.ceil(delay / self._step)) + 1, MAX_DELAY_SAMPLES)
        spec.compile()
        stepper = self._stepper()
        stepper.reset(self._start(None))
        spec.add_key(name="home", qpos=stepper.data.qpos.copy())
        return spec

    def xml(self) -> str:
        """plant.xml: the model as self-contained text, its first lines naming what it cannot carry."""
        spec = self.spec()
        spec.compile()
        absent = sorted({*self.stepped, *(name for name, _ in self.effects if BY_NAME[name].mjcf.startswith("none"))})
        note = f"effects that MJCF does not carry here: {', '.join(absent) or 'none'}"
        return f"<!-- ers-mj plant; load the keyframe home to start at rest. {note} -->\n{spec.to_xml()}"

    def positions(self, theta: float, theta_m: float) -> np.ndarray:
        """Joint positions (nq,) of the model with the output at theta and the drive before the play at theta_m."""
        start = self.parted_start(theta, theta_m, 0.0)
        return np.array([start.get(self.model.joint(k).name, (0.0, 0.0))[0] for k in range(self.model.njnt)])

    def parted_start(self, theta: float, theta_m: float, omega: float) -> dict[str, tuple[float, float]]:
        """{joint: (position, velocity)} with the output at theta, the drive before the play at theta_m, and one speed
        of both.
        """
        return self._start((theta, omega, 0.0, theta_m - theta, 0.0))

    # -- building --

    def _refuse_contradictions(self) -> None:
        if self.gap < 0:
            raise InputError(f"the gap is {self.gap:g}, zero or more was expected")
        if self.gap > 0 and (plays := [name for name, _ in self.effects if BY_NAME[name].is_play]):
            raise InputError(f"the play is given twice, as gap and as the effect {plays[0]}, once was expected")
        if not self.timestep > 0:
            raise InputError(f"the timestep is {self.timestep:g} s, more than zero was expected")
        if self.parameters is None and self.linkage != "constant":
            raise InputError("a rod linkage needs a datasheet with J, n and K_t")

    def _lower(self) -> Coefficients:
        c = self.coefficients
        if self.gap > 0:
            c = rigid_play(c, self.gap)
        for name, values in self.effects:
            c = BY_NAME[name].coefficients(values, c)
        return c

    @property
    def _step(self) -> float:
        return self.timestep / BRISTLE_STEPS if self._lowered.has_bristle else self.timestep

    def _build(self) -> tuple[Skeleton, tuple[Law, ...]]:
        c = self._lowered
        skeleton = (
            lumped_skeleton(c, self.is_angle)
            if self.parameters is None
            else rudder_skeleton(c, self.parameters, self.linkage)
        )
        write_coefficients(skeleton, c, self._step)
        twin = Twin(
            skeleton.spec, skeleton.inertia, skeleton.is_angle, skeleton.ratio * skeleton.K_t / skeleton.inertia
        )
        laws = []
        for name, values in self.effects:
            effect, constants = BY_NAME[name], BY_NAME[name].constants(values, c)
            if not effect.edit_spec(constants, c, twin):
                laws.append(
                    Law(name, constants, effect.torque, effect.friction, effect.inertia, effect.memory, effect.at_motor)
                )
        if c.a_mech_plus != c.a_mech_minus:
            laws.append(_viscous_asymmetry(c))
        if c.has_bristle and (c.c_2_plus != c.c_2_minus or np.isfinite(c.fade) or c.dahl != 1.0):
            laws.append(
                Law(
                    "a bristle's asymmetry, fading damping or exponent",
                    np.zeros(0),
                    None,
                    lambda p, level, theta, w, j, direction: level,
                )
            )
        return skeleton, tuple(laws)

    # -- running --

    def _stepper(self) -> Stepper:
        c, J = self._lowered, self._skeleton.inertia
        return Stepper(
            self.model,
            c,
            self._laws,
            self._step,
            inertia=J,
            ratio=self._skeleton.ratio,
            motor_joint=self._skeleton.motor_joint,
            activation=self._activation(),
        )

    def _activation(self) -> float:
        """Drive acceleration for one unit of the motor's activation."""
        s = self._skeleton
        return float(np.copysign(motor_gain(s, self._lowered) * s.ratio * s.K_t / s.inertia, self._lowered.b))

    def _start(self, start) -> dict[str, tuple[float, float]]:
        """{joint: (position, velocity)} and, under "drive" and "bristle", (acceleration or deflection, 0) for (theta,
        omega[, drive[, twist, its speed]]).
        """
        c = self._lowered
        given = (c.theta_0, 0.0) if start is None else tuple(start)
        theta, omega, drive, twist, over = (*given, 0.0, 0.0, 0.0)[:5]
        pose = self._skeleton.pose(theta + twist)
        joints = {name: (q, dq * (omega + over)) for name, (q, dq) in pose.items()} | {"gap": (-twist, -over)}
        joints["lever_up"] = (
            max(theta, c.theta_0),
            omega if theta > c.theta_0 else max(omega, 0.0) * (theta == c.theta_0),
        )
        joints["lever_down"] = (
            min(theta, c.theta_0),
            omega if theta < c.theta_0 else min(omega, 0.0) * (theta == c.theta_0),
        )
        slip = 0.5 * (c.c_2_plus + c.c_2_minus) / c.k_bristle if c.has_bristle else 0.0
        bent = float(np.clip(omega / np.sqrt(c.k_bristle), -slip, slip)) if c.has_bristle else 0.0
        return joints | {"drive": (drive, 0.0), "bristle": (bent, 0.0)}

    def _moved(self, theta: float, by: float) -> dict[str, float]:
        """{joint: change of its position} where the output moves from theta by so much."""
        before, after = self._positions(theta), self._positions(theta + by)
        return {name: q - before[name] for name, q in after.items() if q != before[name]}

    def _positions(self, theta: float) -> dict[str, float]:
        """{joint: position} at theta."""
        home, pose = self._lowered.theta_0, self._skeleton.pose(theta)
        places = {name: q for name, (q, _) in pose.items()}
        places |= {"lever_up": max(theta, home), "lever_down": min(theta, home)}
        joints = {self.model.joint(k).name for k in range(self.model.njnt)}
        return {name: q for name, q in places.items() if name in joints}

    def _motion(self, t: np.ndarray, rows: np.ndarray) -> Motion:
        """Rows (N, 5) of theta, omega, theta_m, motor speed over n, drive -> Motion."""
        theta, omega, theta_m, _, drive = rows.T.copy()
        measured = theta
        for name, values in self.effects:
            measured = BY_NAME[name].measure(values, t, measured)
        return Motion(t, theta, omega, drive, theta_m, measured)


def _viscous_asymmetry(c: Coefficients) -> Law:
    """Half the difference of viscous friction between the directions: a force even in the speed, which no damping
    gives.
    """
    half = 0.5 * (c.a_mech_plus - c.a_mech_minus) * (1.0 - c.beta if c.has_motor_side else 1.0)
    return Law("asymmetric viscous friction", np.array([half]), lambda p, theta, w, j, t: -p[0] * abs(w), None)


def simulate_many(
    plants: Sequence[MechanicalPlant], t: np.ndarray, u: np.ndarray, jobs: int = 0, start=None
) -> list[Motion]:
    """Free runs of many plants (or one plant under many inputs), from rest at theta_0 or all from one ``start``, on
    many cores.

    Args:
        plants: (M,), or one for all inputs.
        t: (N,) [s], uniform.
        u: (M, N), or (N,) for all plants.
        jobs: cores to use, 0 for all; they do not change the result.
        start: (theta, omega[, drive acceleration]), as of MechanicalPlant.simulate.

    Raises:
        InputError: the counts do not match, or t is not uniform.
    """
    t, u = np.ascontiguousarray(t, float), np.atleast_2d(np.asarray(u, float))
    count = max(len(plants), len(u))
    if len(plants) not in (1, count) or len(u) not in (1, count):
        raise InputError(
            f"{len(plants)} plants and {len(u)} inputs were given, equal numbers or one of either were expected"
        )
    if t.size > 2 and np.ptp(np.diff(t)) > 1e-6 * (t[1] - t[0]):
        raise InputError("many plants at once need a uniform time, simulate them one by one")
    plants = list(plants) * (count // len(plants))
    u = np.repeat(u, count // len(u), axis=0)
    motions: list[Motion | None] = [None] * count
    for group in _alike(plants):
        steppers = [plants[k]._stepper() for k in group]
        for stepper, k in zip(steppers, group, strict=True):
            stepper.reset(plants[k]._start(start))
        terminal = np.array([plants[k].terminal(u[k]) for k in group])
        for k, rows in zip(group, step_many(steppers, t, terminal, jobs), strict=True):
            motions[k] = plants[k]._motion(t, rows)
    for k, plant in enumerate(plants):
        if motions[k] is None:
            motions[k] = plant.simulate(t, u[k], start)
    return motions


def _alike(plants: Sequence[MechanicalPlant]) -> list[list[int]]:
    """Indices of the plants that can be stepped together: native ones, of one layout and one delay."""
    groups: dict[tuple, list[int]] = {}
    for k, plant in enumerate(plants):
        m = plant.model
        if not plant.stepped and plant._lowered.delay == 0:
            groups.setdefault((m.nq, m.nv, m.nu, m.na, m.nbody, m.ntendon, m.neq, plant.timestep), []).append(k)
    return list(groups.values())
