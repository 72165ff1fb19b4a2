"""Stepping a MuJoCo plant from sample to sample, alone or many at once."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import mujoco
import mujoco.batch
import numpy as np
from mujoco.rollout import Rollout

from ers_mj.effects.base import LEAST_IRON
from ers_mj.effects.quantities import Coefficients
from ers_mj.plants.kernel.state import RUNAWAY
from ers_mj.plants.mujoco.mjcf_folder import unlogged

MOTOR_GROUP = 1  # actuator group that an open circuit disables
TIME_CONSTANT = 0  # where MuJoCo keeps a motor's electrical time constant in its actuator's dynprm
# steps over which a law keeps its value; one beside a bristle, whose level is stiff, and where the inductance falls
LAW_STEPS = 4
LOST = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)
FULL = mujoco.mjtState.mjSTATE_FULLPHYSICS
LUGRE_DAMPING = 6  # where MuJoCo keeps a bristle's sigma_1 in an actuator's dynprm

Late = Callable[[np.ndarray], np.ndarray]  # mean input between given instants [s] (k + 1,) -> (k,)


@dataclass(frozen=True)
class Law:
    """A law that the stepping evaluates: an effect's torque, friction, inertia or memory (see effects/base.py) and its
    constants p; its torque and memory are the motor's where that is a body of its own and the law ``at_motor``."""

    name: str
    p: np.ndarray
    torque: Callable | None
    friction: Callable | None
    inertia: Callable | None = None
    memory: Callable | None = None
    at_motor: bool = False


@dataclass(frozen=True)
class Observer:
    """Corrections on the way, as event_integrator.simulate makes them: at one sample in ``every`` the output is moved
    by gain (y - theta).

    ``moved(theta, by)`` gives {joint: change of its position} of such a move; y is (N,), NaN where there is none.
    """

    y: np.ndarray
    gain: float
    every: int
    moved: Callable[[float, float], Mapping[str, float]]


@dataclass
class Stepper:
    """One run of one plant, on a copy of its model.

    ``inertia``, ``ratio`` and ``motor_joint`` are the skeleton's; ``activation`` turns the motor's activation into a
    drive acceleration.
    """

    model: mujoco.MjModel
    c: Coefficients
    laws: Sequence[Law]
    timestep: float
    inertia: float
    ratio: float
    motor_joint: str
    activation: float
    data: mujoco.MjData = field(init=False)

    def __post_init__(self):
        self.model = copy.copy(self.model)
        self.data = mujoco.MjData(self.model)
        self.motor, self.load = (self.model.actuator(name).id for name in ("motor", "load"))
        self.tendon = self.model.tendon("rudder_angle").id
        self.rocker, self.rotor = (self._address(name) for name in ("rocker", self.motor_joint))
        self.gap = self._address("gap") if self.c.has_motor_side else None
        self.current = int(self.model.actuator_actadr[self.motor])
        self.bristle = self.model.actuator("bristle").id if self.c.has_bristle else None
        self.falls = self.current >= 0 and self.c.fall > 0
        self._sort_laws()
        self.turning = self.model.joint("rocker").dofadr[0]
        self.armature = float(self.model.dof_armature[self.turning])

    def _sort_laws(self) -> None:
        """What the laws compute, by kind, each with constants of its own."""
        laws = [(law, law.p.tolist(), law.at_motor and self.c.has_motor_side) for law in self.laws]
        self.torques = [(_plain(law.torque), p, own) for law, p, own in laws if law.torque]
        self.frictions = [(_plain(law.friction), p) for law, p, _ in laws if law.friction]
        self.inertias = [(_plain(law.inertia), p) for law, p, _ in laws if law.inertia and not self.c.has_motor_side]
        self.memories = [(_plain(law.memory), p, own) for law, p, own in laws if law.memory]

    def _address(self, joint: str) -> int:
        return int(self.model.jnt_qposadr[self.model.joint(joint).id])

    def reset(self, start: Mapping[str, tuple[float, float]]) -> None:
        """Put every joint at its (position, velocity), and the drive at its acceleration."""
        mujoco.mj_resetData(self.model, self.data)
        for k in range(self.model.njnt):
            self.data.qpos[k], self.data.qvel[k] = start.get(self.model.joint(k).name, (0.0, 0.0))
        self.drive = start["drive"][0]
        if self.current >= 0:
            self.data.act[self.current] = self.drive / self.activation
        if self.bristle is not None:
            self.data.act[self.model.actuator_actadr[self.bristle]] = start["bristle"][0]

    @unlogged()
    def run(
        self, t: np.ndarray, u: np.ndarray, late: Late | None, enable=None, load=None, observer: Observer | None = None
    ) -> np.ndarray:
        """Rows (N, 5) at the sample times t (N,): theta, omega, theta_m, motor speed / n, drive acceleration; under u
        (N,), or what of it ``late`` gives.
        """
        if late is None and load is None and self._goes_alone(t, enable):
            rows = self._rolled(t, u, observer)
            if rows is not None:
                return rows
        model, data, rows = self.model, self.data, np.full((t.size, 5), np.nan)
        data.time = t[0]
        for k in range(t.size):
            rows[k] = self._observe()
            if k == t.size - 1 or not abs(rows[k, 0]) < RUNAWAY:
                break
            self._correct(observer, k, rows[k, 0])
            h, steps = self._divide(t[k + 1] - t[k])
            model.opt.timestep = h
            self._connect(enable is None or bool(enable[k]))
            known = 0.0 if load is None else load[k]
            inputs = [(u[k], steps)] if late is None else [(v, 1) for v in late(t[k] + h * np.arange(steps + 1))]
            for v, count in inputs:
                self._advance(v, known, count)
        return rows

    def _correct(self, observer: Observer | None, k: int, theta: float) -> None:
        """Move the output towards what was measured, where the observer does at this sample."""
        if observer is not None and k % observer.every == 0 and np.isfinite(observer.y[k]):
            for name, change in observer.moved(theta, observer.gain * (observer.y[k] - theta)).items():
                self.data.qpos[self._address(name)] += change

    def _goes_alone(self, t: np.ndarray, enable) -> bool:
        """Whether MuJoCo needs nobody between the samples: it carries the plant whole, and all samples are as long."""
        if self.laws or self.falls or t.size < 2 or not (enable is None or np.all(enable)):
            return False
        return bool(np.ptp(np.diff(t)) < 1e-9 * (t[1] - t[0]))

    def _rolled(self, t: np.ndarray, u: np.ndarray, observer: Observer | None) -> np.ndarray | None:
        """As ``run`` of a plant that goes alone: MuJoCo steps by itself from one correction to the next. None, and the
        state as before, where it runs away: MuJoCo then repeats itself without saying since when.
        """
        model, data = self.model, self.data
        model.opt.timestep, steps = self._divide(t[1] - t[0])
        self._connect(True)
        data.time = t[0]
        every, size = t.size if observer is None else observer.every, model.nq + model.nv + model.na
        states, control = np.empty((t.size, size)), np.zeros((1, (t.size - 1) * steps, model.nu))
        control[0, :, self.motor] = np.repeat(u[:-1], steps)
        states[0] = np.concatenate([data.qpos, data.qvel, data.act])
        begun = np.empty((1, mujoco.mj_stateSize(model, FULL)))
        mujoco.mj_getState(model, data, first := np.empty(begun.size), FULL)
        with Rollout(nthread=0) as pool:
            for k in range(0, t.size - 1, every):
                self._correct(observer, k, self._observe()[0])
                mujoco.mj_getState(model, data, begun[0], FULL)
                span = control[:, k * steps : (k + every) * steps]
                after, warm = np.empty((1, span.shape[1], begun.size)), data.qacc_warmstart[None].copy()
                pool.rollout(
                    [model],
                    [data],
                    begun,
                    span,
                    skip_checks=True,
                    nstep=span.shape[1],
                    initial_warmstart=warm,
                    state=after,
                )
                states[k + 1 : k + 1 + every] = after[0, steps - 1 :: steps, 1 : 1 + size]
        rows = _rows(self, states, u)
        if any(data.warning[bad].number for bad in LOST) or not np.all(np.abs(rows[:, 0]) < RUNAWAY):
            mujoco.mj_resetData(model, data)
            mujoco.mj_setState(model, data, first, FULL)
            return None
        return rows

    def hold(self, inputs: Sequence[tuple[float, int]], sample: float) -> None:
        """Go on over one sample [s] under (voltage, steps) one after the other, the circuit closed."""
        self.model.opt.timestep, _ = self._divide(sample)
        self._connect(True)
        for v, steps in inputs:
            if steps:
                self._advance(v, 0.0, steps)

    def drive_under(self, v: float) -> float:
        """Drive acceleration at the present state with v [V] at the terminals."""
        self._connect(True)
        return self._drive(v)

    def _divide(self, sample: float) -> tuple[float, int]:
        """(step [s], steps) of a sample: the longest step that is no longer than the timestep and divides it."""
        steps = max(1, math.ceil(sample / self.timestep - 1e-6))
        h = sample / steps
        return (self.timestep if abs(h - self.timestep) < 1e-9 * h else h), steps

    def _connect(self, closed: bool) -> None:
        """Close or open the motor's circuit; an open one carries no current."""
        self.closed = closed
        self.model.opt.disableactuator = 0 if closed else 1 << MOTOR_GROUP
        if not closed:
            self.drive = 0.0
            if self.current >= 0:
                self.data.act[self.current] = 0.0

    def _advance(self, v: float, load: float, steps: int) -> None:
        data = self.data
        data.ctrl[self.motor], data.ctrl[self.load] = v, self.inertia * load
        if self.laws or self.falls:
            most = LAW_STEPS if self.bristle is None and not self.falls else 1
            for done in range(0, steps, most):
                count = min(most, steps - done)
                self._apply_laws(v, load, count * self.model.opt.timestep)
                mujoco.mj_step(self.model, data, count)
        else:
            mujoco.mj_step(self.model, data, steps)
        self.drive = self._drive(v)

    def _drive(self, v: float) -> float:
        """Drive acceleration under the input v."""
        if not self.closed:
            return 0.0
        if self.current >= 0:
            return self.activation * self.data.act[self.current]
        return self.c.b * v - self.c.a_emf * self.data.qvel[self.rotor] / self.ratio

    def _observe(self) -> tuple[float, float, float, float, float]:
        q, v = self.data.qpos, self.data.qvel
        theta, omega = q[self.rocker], v[self.rocker]
        if self.gap is not None:
            return theta + q[self.gap], omega + v[self.gap], theta, v[self.rotor] / self.ratio, self.drive
        return theta, omega, theta, v[self.rotor] / self.ratio, self.drive

    def _apply_laws(self, v: float, load: float, h: float) -> None:
        """Set load torque, motor torque, frictionloss, armature and inductance from the laws at the present state, for
        the next h [s].
        """
        theta, w, theta_m, w_m, _ = self._observe()
        j, t, c = self._drive(v), self.data.time, self.c
        if self.falls:
            self.model.actuator_dynprm[self.motor, TIME_CONSTANT] = c.tau_e * max(
                1.0 / (1.0 + (c.fall * j) ** 2), LEAST_IRON
            )
        for memory, p, own in self.memories:
            p[-1] = memory(p, theta_m if own else theta, w_m if own else w, j, h)
        force = load + sum(torque(p, theta, w, j, t) for torque, p, own in self.torques if not own)
        if c.has_motor_side:
            self.data.qfrc_applied[self.turning] = self.inertia * sum(
                torque(p, theta_m, w_m, j, t) for torque, p, own in self.torques if own
            )
        for inertia, p in self.inertias:
            relative, half_slope = inertia(p, theta)
            self.model.dof_armature[self.turning] = self.armature + self.inertia * (relative - 1.0)
            force -= half_slope * w * w
        if self.frictions:
            force += self._apply_frictions(theta, w, w_m, j)
        self.data.ctrl[self.load] = self.inertia * force

    def _apply_frictions(self, theta: float, w: float, w_m: float, j: float) -> float:
        """Set frictionloss or the bristle from the laws; the force that an asymmetric friction leaves beside it."""
        c = self.c
        share = 1.0 - c.phi if c.has_motor_side else 1.0
        up, down = self._levels(theta, w, j)
        if c.has_motor_side:
            self.model.dof_frictionloss[self.turning] = 0.5 * c.phi * self.inertia * sum(self._levels(theta, w_m, j))
        if self.bristle is None:
            self.model.tendon_frictionloss[self.tendon] = 0.5 * share * self.inertia * (up + down)
            return -(0.5 * share * (up - down - c.c_2_plus + c.c_2_minus))
        self.model.actuator_biasprm[self.bristle, 3:5] = share * self.inertia * self._yielding(up if w > 0 else down, w)
        self.model.actuator_dynprm[self.bristle, LUGRE_DAMPING] = (
            share * self.inertia * c.d_bristle * math.exp(-((w / c.fade) ** 2))
        )
        return 0.0

    def _levels(self, theta: float, w: float, j: float) -> tuple[float, float]:
        """The friction levels up and down, per inertia, after every law."""
        up, down = self.c.c_2_plus, self.c.c_2_minus
        for friction, p in self.frictions:
            up, down = friction(p, up, theta, w, j, 1.0), friction(p, down, theta, w, j, -1.0)
        return up, down

    def _yielding(self, level: float, w: float) -> float:
        """The level at which MuJoCo's bristle, of exponent 1, bends as fast as one of another exponent under this
        ``level`` (both per inertia).
        """
        share = (
            math.copysign(1.0, w) * self.c.k_bristle * self.data.act[self.model.actuator_actadr[self.bristle]] / level
        )
        if self.c.dahl == 1.0:
            return level
        if abs(share) < 1e-9:
            return level / self.c.dahl
        return level * share / (1.0 - math.copysign(abs(1.0 - share) ** self.c.dahl, 1.0 - share))


def _plain(law: Callable) -> Callable:
    """A law as Python has it: called from Python it is as fast as compiled (0.2 to 3.7 us beside 0.4 to 1.8), and
    nothing is compiled (0.1 to 0.4 s).
    """
    return getattr(law, "py_func", law)


def delayed(t: np.ndarray, u: np.ndarray, delay: float, before: float) -> Late:
    """Mean of u(t - delay) between given instants, ``before`` in front of the first sample: the impulse of a switch
    inside a step is exact.
    """
    at = np.concatenate([[t[0] - delay - 1.0], t])
    area = np.concatenate([[0.0], np.cumsum(np.concatenate([[before], u[:-1]]) * np.diff(at))])
    return lambda ends: np.diff(np.interp(ends - delay, at, area)) / np.diff(ends)


@unlogged()
def step_many(steppers: Sequence[Stepper], t: np.ndarray, u: np.ndarray, jobs: int = 0) -> np.ndarray:
    """Rows (M, N, 5) as Stepper.run's, of plants without laws or delay and of one layout, on ``jobs`` cores (0: all); u
    is (M, N).
    """
    first = steppers[0]
    batch = mujoco.batch.Batch(first.model, len(steppers), jobs)
    h, steps = first._divide(t[1] - t[0])
    for stepper in steppers:
        stepper.model.opt.timestep = h
    batch.set_models([stepper.model for stepper in steppers])
    q, v, ctrl = batch.bind("qpos"), batch.bind("qvel"), batch.bind("ctrl")
    act = batch.bind("act") if first.model.na else None
    states = np.empty((t.size, len(steppers), q.shape[1] + v.shape[1] + (0 if act is None else 1)))
    for i, stepper in enumerate(steppers):
        q[i], v[i], ctrl[i] = stepper.data.qpos, stepper.data.qvel, 0.0
        if act is not None:
            act[i] = stepper.data.act
    for k in range(t.size):
        states[k] = np.concatenate([q, v] if act is None else [q, v, act], axis=1)
        if k < t.size - 1:
            ctrl[:, first.motor] = u[:, k]
            batch.step(nstep=steps)
    return np.array([_rows(stepper, states[:, i], u[i]) for i, stepper in enumerate(steppers)])


def _rows(stepper: Stepper, states: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Rows (N, 5) from the states (N, qpos + qvel + act) of one plant."""
    nq = stepper.model.nq
    theta_m, omega_m = states[:, stepper.rocker], states[:, nq + stepper.rocker]
    twist, spread = (0.0, 0.0) if stepper.gap is None else (states[:, stepper.gap], states[:, nq + stepper.gap])
    speed = states[:, nq + stepper.rotor] / stepper.ratio
    if stepper.current >= 0:
        drive = stepper.activation * states[:, nq + stepper.model.nv + stepper.current]
    else:
        drive = np.concatenate([[stepper.drive], stepper.c.b * u[:-1] - stepper.c.a_emf * speed[1:]])
    return np.column_stack([theta_m + twist, omega_m + spread, theta_m, speed, drive])
