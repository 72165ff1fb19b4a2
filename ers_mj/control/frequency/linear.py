"""Plants as linear systems, while they slip: the reduced model from its coefficients, the MuJoCo plant from MuJoCo's
own derivatives.

    plant, point -> x' = A x + B (voltage, load), theta = C x -> the same from sample to sample, held, with the
    command's delay

Where a plant slips, its Coulomb friction and its preload are constant and drop out; a play is closed. Laws of effects
enter with their slopes at the point.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import control
import mujoco
import numpy as np
from scipy.linalg import expm

from ers_mj.effects import BY_NAME
from ers_mj.effects.base import Effect
from ers_mj.effects.quantities import Coefficients
from ers_mj.errors import InputError
from ers_mj.plants.mujoco.mjcf_folder import unlogged
from ers_mj.plants.mujoco.plant import MechanicalPlant
from ers_mj.plants.reduced import ReducedModel

Move = Callable[[float], tuple[np.ndarray, np.ndarray]]  # time [s] -> (transition, effect of held inputs)


@dataclass(frozen=True, eq=False)
class LinearPlant:
    """A plant about one point.

    Attributes:
        name: "reduced" or "mujoco".
        held: voltage, held from sample to sample, to angle; discrete, the command's delay in it.
        load: acceleration on the rudder to angle, as the plant itself moves.
        theta, omega: the point [rad], [rad/s].
        left_out: effects of the plant that are in neither.
    """

    name: str
    held: control.StateSpace
    load: control.StateSpace
    theta: float
    omega: float
    left_out: tuple[str, ...]

    def response(self, f_hz: np.ndarray) -> np.ndarray:
        """Angle over voltage (F,) [rad/V]."""
        return at(self.held, f_hz)

    def load_response(self, f_hz: np.ndarray) -> np.ndarray:
        """Angle over the rudder's acceleration (F,) [s^2]."""
        return at(self.load, f_hz)


def at(system: control.StateSpace, f_hz: np.ndarray) -> np.ndarray:
    """Response (F,) of a continuous or a discrete system at frequencies [Hz]."""
    s = 2j * np.pi * np.asarray(f_hz)
    return np.asarray(system(np.exp(s * system.dt) if system.dt else s)).reshape(-1)


def linearised(plant: ReducedModel | MechanicalPlant, rate_hz: float, theta: float, omega: float = 1.0) -> LinearPlant:
    """A plant about the angle theta [rad] while it slips at omega [rad/s], for a loop of this sample rate."""
    c = coefficients(plant)
    if isinstance(plant, ReducedModel):
        A, B, C = matrices(plant, theta, omega)
        load = control.ss(A, B[:, 1:], C, 0)
        move, name = _flow(A, B[:, :1]), "reduced"
    else:
        A, B, shown, step = transitions(plant, rate_hz, theta, omega)
        C = shown[:1]
        load = control.ss(A, B[:, 1:], C, 0, step)
        move, name = _steps(A, B[:, :1], step), "mujoco"
    held = _held(move, C, 1.0 / rate_hz, c.delay)
    for effect, values in plant.effects:
        if any(lag := BY_NAME[effect].remembers(values)):
            held, load = held * _late(*lag, held.dt), load * _late(*lag, load.dt)
    return LinearPlant(name, held, load, theta, omega, left_out(plant))


def continuous(plant: ReducedModel, theta: float, omega: float, order: int) -> control.StateSpace:
    """Voltage to angle of a reduced plant about the angle theta [rad] while it slips at omega [rad/s], in continuous
    time; dead times as Pade's approximations of this order, behind one another: command, plant, sensor.
    """
    A, B, C = matrices(plant, theta, omega)
    system, delay = control.ss(A, B[:, :1], C, 0), coefficients(plant).delay
    if delay > 0:
        system = system * control.ss(control.tf(*control.pade(delay, order)))
    for effect, values in plant.effects:
        if any(lag := BY_NAME[effect].remembers(values)):
            system = _late(*lag, 0, order) * system
    return system


def coefficients(plant: ReducedModel | MechanicalPlant) -> Coefficients:
    """The letters of a plant's equation, with its effects in them."""
    return Coefficients(*plant._lowered[0]) if isinstance(plant, ReducedModel) else plant._lowered


def left_out(plant: ReducedModel | MechanicalPlant) -> tuple[str, ...]:
    """Effects that change the command or the reading in ways that are not linear; in MuJoCo also laws that the stepping
    applies.
    """
    shaped = [
        name
        for name, values in plant.effects
        if type(BY_NAME[name]).command is not Effect.command
        or (type(BY_NAME[name]).measure is not Effect.measure and not any(BY_NAME[name].remembers(values)))
    ]
    return tuple(dict.fromkeys([*shaped, *(plant.stepped if isinstance(plant, MechanicalPlant) else ())]))


# -- the reduced model -------------------------------------------------------------------------------------------------


def matrices(model: ReducedModel, theta: float, omega: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A (n, n), B (n, 2) of voltage [V] and load [rad/s^2], C (1, n) of the states theta, w[, theta_m, w_m][, j],
    without the delay.

        (1 - rho) w' = -a_1 theta - (1 - beta) a_mech w + k (theta_m - theta) + d (w_m - w) + f(theta, w, j) + load
        rho w_m' = -beta a_mech w_m + j - k (theta_m - theta) - d (w_m - w),   tau_e j' = b u - a_emf w_m - j

    With one body w_m = w and both lines are one; without tau_e j = b u - a_emf w_m.
    """
    c = coefficients(model)
    f_theta, f_w, f_j = _slopes(model, c, theta, omega)
    two, n = c.has_motor_side, 4 if c.has_motor_side else 2
    A, B = np.zeros((n + 1, n + 1)), np.zeros((n + 1, 2))
    A[0, 1] = 1.0
    if two:
        k, d, rest = c.k_twist, c.d_twist, 1.0 - c.rho
        A[1] = np.array([f_theta - c.a_1 - k, f_w - (1.0 - c.beta) * c.a_mech_plus - d, k, d, f_j]) / rest
        A[2, 3] = 1.0
        A[3] = np.array([k, d, -k, -d - c.beta * c.a_mech_plus, 1.0]) / c.rho
        B[1, 1] = 1.0 / rest
    else:
        A[1] = f_theta - c.a_1, f_w - c.a_mech_plus, 1.0 + f_j
        B[1, 1] = 1.0
    fast = np.zeros(n + 1)  # the drive's line: tau_e j' = fast . x + b u
    fast[n - 1], fast[n] = -c.a_emf, -1.0
    if c.tau_e > 0:
        A[n], B[n, 0] = fast / c.tau_e, c.b / c.tau_e
        return A, B, np.eye(1, n + 1)
    through = A[:n, n:]
    return A[:n, :n] + through @ fast[None, :n], B[:n] + through @ np.array([[c.b, 0.0]]), np.eye(1, n)


def _slopes(model: ReducedModel, c: Coefficients, theta: float, omega: float) -> tuple[float, float, float]:
    """Slopes over theta, w and j of what the effects' laws add to the rudder's acceleration, in motion upwards at a
    drive that holds the speed.
    """
    laws = [
        (effect, effect.constants(values, c))
        for effect, values in ((BY_NAME[name], values) for name, values in model.effects)
        if effect.is_lawful(values)
    ]
    j = c.a_1 * (theta - c.theta_0) + c.a_mech_plus * omega + c.c_1 * np.sign(theta - c.theta_0) + c.c_2_plus

    def force(theta: float, w: float, j: float) -> float:
        total, level = 0.0, c.c_2_plus
        for effect, p in laws:
            total += effect.torque(p, theta, w, j, 0.0) if effect.torque else 0.0
            level = effect.friction(p, level, theta, w, j, 1.0) if effect.friction else level
        return total - level

    point = np.array([theta, omega, j])
    steps = 1e-5 * np.maximum(np.abs(point), 1.0)
    return tuple((force(*(point + e)) - force(*(point - e))) / (2.0 * e.sum()) for e in np.diag(steps))


# -- the MuJoCo plant --------------------------------------------------------------------------------------------------


@unlogged()
def transitions(
    plant: MechanicalPlant, rate_hz: float, theta: float, omega: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """A (n, n), B (n, 2) of voltage [V] and load [rad/s^2], C (2, n) of the rudder and of the motor's side, from one
    step of MuJoCo to the next, and that step [s].

    By `mjd_transitionFD`, after a motion under the voltage that holds the speed, so that contacts and couplings carry
    their loads. Of its differences the first that the rigid contacts bear, which give little under their loads: a
    growth beyond 1.01 in one step has opened one.

    Raises:
        InputError: no difference is small enough for the contacts at this point.
    """
    stepper, c, J, settle_s = plant._stepper(), plant._lowered, plant._skeleton.inertia, 0.1
    model, data = stepper.model, stepper.data
    v = (
        c.a_1 * (theta - c.theta_0)
        + (c.a_mech_plus + c.a_emf) * omega
        + c.c_1 * np.sign(theta - c.theta_0)
        + c.c_2_plus
    ) / c.b
    stepper.reset(_pushing(plant, theta - settle_s * omega, omega))
    stepper.hold([(v, stepper._divide(settle_s)[1])], settle_s)
    model.opt.timestep, _ = stepper._divide(1.0 / rate_hz)
    n = 2 * model.nv + model.na
    A, B = np.zeros((n, n)), np.zeros((n, model.nu))
    for epsilon in (1e-7, 1e-8, 3e-9, 1e-9):
        mujoco.mjd_transitionFD(model, data, epsilon, 1, A, B, None, None)
        if np.isfinite(A).all() and np.abs(np.linalg.eigvals(A)).max() < 1.01:
            break
    else:
        raise InputError(
            f"MuJoCo's derivatives at {theta:.4g} rad and {omega:.3g} rad/s are those of no motion: its contacts carry"
            " too little load there"
        )
    C = np.zeros((2, n))
    C[:, stepper.rocker] = 1.0
    if stepper.gap is not None:
        C[0, stepper.gap] = 1.0
    return A, B[:, [stepper.motor, stepper.load]] * [1.0, J], C, model.opt.timestep


def _pushing(plant: MechanicalPlant, theta: float, omega: float) -> dict[str, tuple[float, float]]:
    """Where the joints start, {name: (position, velocity)}: the drive at the upper end of the play, so that it pushes
    upwards.
    """
    ahead = plant._lowered.gap if plant._lowered.has_motor_side else 0.0
    pose = plant._skeleton.pose(theta + ahead)
    return (
        plant._start((theta, omega))
        | {name: (q, dq * omega) for name, (q, dq) in pose.items()}
        | {"gap": (-ahead, 0.0)}
    )


# -- from sample to sample ---------------------------------------------------------------------------------------------


def _flow(A: np.ndarray, B: np.ndarray) -> Move:
    n = A.shape[0]
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n:] = A, B

    def move(duration: float) -> tuple[np.ndarray, np.ndarray]:
        E = expm(whole * duration)
        return E[:n, :n], E[:n, n:]

    return move


def _steps(A: np.ndarray, B: np.ndarray, step: float) -> Move:
    n = A.shape[0]
    whole = np.eye(n + 1)
    whole[:n, :n], whole[:n, n:] = A, B

    def move(duration: float) -> tuple[np.ndarray, np.ndarray]:
        E = np.linalg.matrix_power(whole, round(duration / step))
        return E[:n, :n], E[:n, n:]

    return move


def _held(move: Move, C: np.ndarray, h: float, delay: float) -> control.StateSpace:
    """From sample to sample, the input held and late: x+ = F x + G_late u[k - d - 1] + G_now u[k - d]."""
    d = int(delay / h + 1e-9)
    (F1, G1), (F2, G2) = move(delay - d * h), move(h - (delay - d * h))
    n, line = F1.shape[0], d + 1
    A, B = np.zeros((n + line, n + line)), np.zeros((n + line, 1))
    A[:n, :n], A[:n, n + line - 1 :] = F2 @ F1, F2 @ G1
    if d:
        A[:n, n + d - 1 : n + d] += G2
        A[n + 1 :, n : n + d] = np.eye(d)
    else:
        B[:n] = G2
    B[n] = 1.0
    return control.ss(A, B, np.hstack([C, np.zeros((1, line))]), 0, h)


def _late(T: float, T_d: float, dt: float, order: int = 4) -> control.StateSpace:
    """What a late sensor makes of the angle: its lag T, and behind it its dead time T_d where it has one."""
    if not T_d:
        return _lag(T, dt)
    if not dt:
        return _lag(T, dt) * control.ss(control.tf(*control.pade(T_d, order)))
    whole, part = divmod(T_d / dt, 1.0)
    return _lag(T, dt) * control.ss(control.tf([1.0 - part, part], [1.0, *[0.0] * (int(whole) + 1)], dt))


def _lag(T: float, dt: float) -> control.StateSpace:
    """T y' = x - y, the input straight between samples where dt > 0."""
    if not dt:
        return control.ss(-1.0 / T, 1.0 / T, 1.0, 0.0)
    ratio = T / dt
    decay = np.exp(-1.0 / ratio)
    now, before = 1.0 - ratio * (1.0 - decay), ratio * (1.0 - decay) - decay
    return control.ss(decay, before + decay * now, 1.0, now, dt)


def named(
    system: control.StateSpace, plant: ReducedModel, signals: tuple[str, str], output_unit: str
) -> control.StateSpace:
    """A system with the names of its input and output, and of its states where they are the plant's alone."""
    into, out = signals
    states = [out, f"speed_{output_unit}_s"]
    states += ["motor_side", "motor_side_speed"] if plant.has_motor_side else []
    states += [f"drive_{output_unit}_s2"] if plant.coefficients.tau_e > 0 else []
    own = {"states": states} if len(states) == system.nstates else {}  # dead times and sensors add their own
    return control.ss(
        system.A, system.B, system.C, system.D, system.dt, inputs=[into], outputs=[out], name="servo", **own
    )
