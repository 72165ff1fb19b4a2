"""A firmware's own position loop over frequency: its margins, whether it cycles, and recordings beside it.

model.toml -> the plant from drive and load to both bodies -> friction described -> loop -> margins;  let go -> cycle;
reference to log beside a recording's response
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import control
import numpy as np

from ers_mj.control.firmware import NAME, refuse_other_than_angle
from ers_mj.control.frequency.cycle import balanced, lasting, residual
from ers_mj.control.frequency.describing import coulomb, highest_hz, rubbing, saturation
from ers_mj.control.frequency.linear import coefficients, matrices, transitions
from ers_mj.control.frequency.loop import LOWEST_HZ, Loop, judged
from ers_mj.control.frequency.study import SCOPE, Compared, Cycles, Study, refuse_rate
from ers_mj.control.trial import Conditions
from ers_mj.data.frequency_response import frequency_response, gap
from ers_mj.data.prepared import smooth_speed
from ers_mj.data.recording import Recording
from ers_mj.errors import InputError
from ers_mj.plants.loop_numbers import LoopNumbers
from ers_mj.plants.mujoco.plant import MechanicalPlant
from ers_mj.plants.reduced import ReducedModel
from ers_mj.position_loop.saved import loop_of, looped_plant, motion_of
from ers_mj.servo.datasheet import Datasheet

Plant = ReducedModel | MechanicalPlant


def study_firmware(
    datasheet: Datasheet,
    plants: Sequence[str],
    conditions: Conditions,
    recordings: Sequence[Recording] = (),
    *,
    progress: Callable[[str, float], None] = lambda text, fraction: None,
) -> Study:
    """The loop of a model with a [loop] around each plant, about ``conditions.start`` at ``conditions.amplitude``.

    Raises:
        InputError: the model's output is no angle, the rate or a recording cannot be used.
    """
    refuse_other_than_angle(datasheet)
    refuse_rate(conditions.rate_hz)
    responses = [_response(recording) for recording in recordings]
    loops = {name: FirmwareLoop.of(datasheet, name) for name in plants}
    judgements, seen, tails = [], {}, {}
    for k, (name, loop) in enumerate(loops.items()):
        progress(f"the firmware's loop on the {name} plant", k / len(loops))
        judgements.append(loop.judged(conditions))
        seen[name], tails[name] = _let_go(datasheet, name, conditions)
    cycles = Cycles(NAME, tuple(next(iter(loops.values())).cycles(conditions)), seen, tails)
    compared = [_compared(*pair, loops) for pair in zip(recordings, responses, strict=True)]
    return Study((), tuple(judgements), (cycles,), tuple(compared))


@dataclass(frozen=True, eq=False)
class FirmwareLoop:
    """The firmware's numbers around one plant of this name, which takes an acceleration of its motor."""

    name: str
    plant: Plant
    q: LoopNumbers

    @classmethod
    def of(cls, datasheet: Datasheet, name: str) -> FirmwareLoop:
        """The loop of a model.toml around the plant "reduced" or "mujoco"."""
        c, effects, q = loop_of(datasheet)
        return cls(name, looped_plant(datasheet).plant if name == "mujoco" else ReducedModel(c, effects), q)

    def feedback(self, f_hz: np.ndarray) -> np.ndarray:
        """Drive over the error that its sensor sees (F,) [1/s^2], the speed's damping in it."""
        s = 2j * math.pi * f_hz
        return self.ahead(f_hz) + self.q.D * s / (1.0 + self.q.lag * s) * np.exp(-s * self.q.dead_time)

    def ahead(self, f_hz: np.ndarray) -> np.ndarray:
        """Drive over the reference that the loop has (F,) [1/s^2]: without the damping."""
        s = 2j * math.pi * f_hz
        return (self.q.K + self.q.I / s) * np.exp(-s * self.q.dead_time)

    def bodies(self, f_hz: np.ndarray, theta: float, N: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Angles of the load and of the motor's side over the drive, each (F,) [s^2], about ``theta`` [rad] while both
        slip, friction N (F,) [1/s^2] beside the inertias, shared as the plant shares it.
        """
        G, c = _responses(self.plant, f_hz, theta), coefficients(self.plant)
        on_motor = c.phi if c.has_motor_side else 0.0
        rubs = np.zeros_like(G)
        rubs[:, 0, 1], rubs[:, 1, 0] = on_motor * N, (1.0 - on_motor) * N  # to (motor, load) of (load, motor's side)
        closed = np.linalg.solve(np.eye(2) + G @ rubs, G[:, :, :1])
        return closed[:, 0, 0], closed[:, 1, 0]

    def friction(self, amplitude: float, f_hz: np.ndarray) -> np.ndarray:
        """N (F,) of the friction under a sine of this amplitude [rad]; it creeps where the firmware's does."""
        c = coefficients(self.plant)
        level, s = 0.5 * (c.c_2_plus + c.c_2_minus), 2j * math.pi * f_hz
        if not math.isfinite(self.q.creep):
            return np.broadcast_to(coulomb(level, amplitude), f_hz.shape)
        fast = np.abs(s) * amplitude
        return s * self.q.creep * np.array([saturation(level / self.q.creep, float(w)) for w in fast])

    def judged(self, conditions: Conditions) -> Loop:
        """Its margins with the friction of the conditions' amplitude; stable as the linear loop of a slipping servo."""
        f_hz = np.geomspace(LOWEST_HZ, highest_hz(1.0 / conditions.rate_hz), 600)
        load, motor = self.bodies(f_hz, conditions.start, self.friction(conditions.amplitude, f_hz))
        found = judged(NAME, self.name, f_hz, motor if self.q.at_motor > 0.0 else load, self.feedback(f_hz))
        reduced = ReducedModel(self.plant.coefficients, self.plant.effects)
        poles = closed_loop(reduced, self.q, conditions.start).poles()
        return replace(found, stable=bool(poles.real.max() < 0.0))

    def cycles(self, conditions: Conditions):
        """The limit cycles that the describing functions predict, the firmware's limit among them."""
        c, h, at_motor = coefficients(self.plant), 1.0 / conditions.rate_hz, self.q.at_motor > 0.0

        def left(f: float, e: float) -> complex:
            asks = complex(self.feedback(np.array([f]))[0])
            limited = asks * saturation(self.q.L, abs(asks) * e)
            return residual(c, h, conditions.start, limited, f, e, at_motor)

        return balanced(left, min(500.0, highest_hz(h)))

    def response(self, f_hz: np.ndarray, theta: float, N: np.ndarray, h: float) -> np.ndarray:
        """The log over a reference that is held for h [s] from sample to sample (F,), latency and all."""
        load, motor = self.bodies(f_hz, theta, N)
        seen, log = motor if self.q.at_motor > 0.0 else load, motor if self.q.log_at_motor > 0.0 else load
        late = np.sinc(f_hz * h) * np.exp(-2j * math.pi * f_hz * (self.q.tau + 0.5 * h))
        return log * self.ahead(f_hz) * late / (1.0 + seen * self.feedback(f_hz))


def _responses(plant: Plant, f_hz: np.ndarray, theta: float) -> np.ndarray:
    """Angles of (load, motor's side) over accelerations of (motor, load), (F, 2, 2) [s^2], while the plant slips."""
    s = 2j * math.pi * f_hz
    if isinstance(plant, ReducedModel):
        A, B, C = matrices(plant, theta, 1.0)
        shown = np.vstack([C, np.eye(1, A.shape[0], 2) if plant.has_motor_side else C])
        at = s
    else:
        A, B, shown, step = transitions(plant, 1.0 / plant.timestep, theta, 1.0)
        at = np.exp(s * step)
    return shown @ np.linalg.solve(
        at[:, None, None] * np.eye(A.shape[0]) - A, np.broadcast_to(B, (f_hz.size, *B.shape))
    )


def closed_loop(plant: ReducedModel, q: LoopNumbers, theta: float, order: int = 4) -> control.StateSpace:
    """The slipping servo with its loop about ``theta`` [rad], from reference to log, in continuous time, dead
    times as Pade's approximations of this order; the limits and the dead band are left out.
    """
    A, B, C = matrices(plant, theta, 1.0)
    seen, log = (2 * int(side > 0 and plant.has_motor_side) for side in (q.at_motor, q.log_at_motor))
    A, B = _late_input(A, B[:, :1], q.dead_time, order)
    back = np.zeros((1, A.shape[0]))
    back[0, seen], back[0, seen + 1] = q.K, 0.0 if q.lag > 0 else q.D
    shown = np.eye(1, A.shape[0], log)
    A, into, drive = A - B @ back, q.K * B, B
    if q.I > 0:
        A = np.block([[A, q.I * drive], [-np.eye(1, A.shape[0], seen), np.zeros((1, 1))]])
        into, drive = np.vstack([into, [[1.0]]]), np.vstack([drive, [[0.0]]])
    if q.lag > 0:
        A = np.block([[A, -q.D * drive], [np.eye(1, A.shape[0], seen + 1) / q.lag, np.full((1, 1), -1.0 / q.lag)]])
        into = np.vstack([into, [[0.0]]])
    shown = np.hstack([shown, np.zeros((1, A.shape[0] - shown.shape[1]))])
    system = control.ss(A, into, shown, 0)
    return system * control.ss(control.tf(*control.pade(q.tau, order))) if q.tau > 0 else system


def _late_input(A: np.ndarray, B: np.ndarray, late: float, order: int) -> tuple[np.ndarray, np.ndarray]:
    """x' = A x + B u of an input that comes ``late`` [s]; the states of the plant stay first."""
    if late <= 0.0:
        return A, B
    d = control.ss(control.tf(*control.pade(late, order)))
    below = np.zeros((d.nstates, A.shape[0]))
    return np.block([[A, B @ d.C], [below, d.A]]), np.vstack([B @ d.D, d.B])


def _let_go(datasheet: Datasheet, plant: str, conditions: Conditions):
    """The cycle that the loop keeps after being let go beside its reference, or None, and its end (N,) [rad]."""
    h = 1.0 / conditions.rate_hz
    t = h * np.arange(round(SCOPE.watched / h))
    reference = np.full(t.size, conditions.start)
    theta = motion_of(datasheet, t, reference, plant, (conditions.start + SCOPE.kick, 0.0), conditions.start)[:, 0]
    return lasting(theta - conditions.start, h), theta[-round(0.1 / h) :] - conditions.start


# -- recordings --------------------------------------------------------------------------------------------------------


def _response(recording: Recording):
    if recording.input_kind != "position" or recording.output_unit != "rad":
        raise InputError(
            f"{recording.name}: its input is a {recording.input_kind} and its output in {recording.output_unit}, a"
            " position command and an angle were expected beside a model with a [loop]"
        )
    return frequency_response(recording)


def _compared(recording: Recording, response, loops: dict[str, FirmwareLoop]) -> Compared:
    """A recording beside the loop on each plant, slipping and with the friction that its motion meets (taken as
    normal).
    """
    y, f_hz = recording.y[recording.valid], response.f_hz
    speed, centre, h = float(smooth_speed(recording).std()), float(y.mean()), 1.0 / recording.rate_hz
    models = {}
    for name, loop in loops.items():
        c = coefficients(loop.plant)
        models[f"{name}, slipping"] = loop.response(f_hz, centre, np.zeros(f_hz.size), h)
        if c.c_2_plus > 0:
            level = min(0.5 * (c.c_2_plus + c.c_2_minus), loop.q.creep * speed)
            models[f"{name}, friction described"] = loop.response(f_hz, centre, rubbing(level, speed, f_hz), h)
    return Compared(response, models, {name: gap(response, model) for name, model in models.items()})
