"""What a servo is asked to follow: the paper's cases, and a user's own from a file.

Each is a function of time from 0 and gives angle, speed and acceleration; where the angle jumps both derivatives are
those beside the jump, as no drive could follow more.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ers_mj.control.controllers import Servo
from ers_mj.data.formats import load
from ers_mj.data.tables import listed, numbers
from ers_mj.errors import InputError

ANGLES = {"theta_ref_rad": 1.0, "theta_ref_deg": math.radians(1.0)}


@dataclass(frozen=True)
class Bounds:
    """Of a reference: samples, sample rate [Hz] and angle [rad]."""

    fewest: int = 100
    most: int = 2_000_000
    rate_hz: float = 1e6
    angle: float = 1000.0


BOUNDS = Bounds()


@dataclass(frozen=True, eq=False)
class Reference:
    """A reference, each (N,): time [s], angle [rad], speed [rad/s], acceleration [rad/s^2]; ``jumps`` are the samples
    at which the angle jumps.
    """

    name: str
    t: np.ndarray
    theta: np.ndarray
    omega: np.ndarray
    alpha: np.ndarray
    jumps: tuple[int, ...] = ()

    @property
    def rate_hz(self) -> float:
        """Of its samples."""
        return (self.t.size - 1) / float(self.t[-1] - self.t[0])


def _still(t: np.ndarray) -> np.ndarray:
    return np.zeros(t.size)


def step(t):
    """1 from the first sample on."""
    return np.ones(t.size), _still(t), _still(t)


def square(t, hz=1.0):
    """+1 and -1 in turn, half a second each (the paper's Case 1)."""
    return 1.0 - 2.0 * (np.floor(2.0 * hz * t + 1e-9) % 2), _still(t), _still(t)


def ramp(t, hz=0.5):
    """A triangle that begins at 0 and rises: constant speed, reversed at +1 and -1 (Case 2)."""
    turns = hz * t
    falling = np.floor(2.0 * turns + 0.5 + 1e-9) % 2
    return 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * turns)), 4.0 * hz * (1.0 - 2.0 * falling), _still(t)


def chirp(t, from_hz=1.0, to_hz=20.0, duration=5.0):
    """A sine from 1 to 20 Hz, linear in time (Case 3)."""
    sweep = 2.0 * np.pi * (to_hz - from_hz) / duration
    phase = 2.0 * np.pi * from_hz * t + 0.5 * sweep * t**2
    rate = 2.0 * np.pi * from_hz + sweep * t
    return np.sin(phase), rate * np.cos(phase), sweep * np.cos(phase) - rate**2 * np.sin(phase)


CASES: Mapping[str, tuple[Callable, float]] = {
    "step": (step, 2.0),
    "square": (square, 2.0),
    "ramp": (ramp, 2.0),
    "chirp": (chirp, 5.0),
}  # shape of amplitude 1, and duration [s]


def named(name: str, amplitude: float, start: float, rate_hz: float) -> Reference:
    """One of the cases, of this amplitude [rad] about this start [rad].

    Raises:
        InputError: the rate does not make a usable number of samples of it.
    """
    shape, duration = CASES[name]
    n = round(duration * rate_hz)
    if not BOUNDS.fewest <= n <= BOUNDS.most:
        raise InputError(
            f"{duration:g} s at {rate_hz:g} Hz are {n} samples, {BOUNDS.fewest} to {BOUNDS.most} were expected"
        )
    t = np.arange(n) / rate_hz
    theta, omega, alpha = (amplitude * x for x in shape(t))
    jumps = (0, *np.flatnonzero(np.diff(theta)) + 1) if name in ("step", "square") else ()
    return Reference(name, t, start + theta, omega, alpha, tuple(int(k) for k in jumps))


def read_reference(path: str | os.PathLike, servo: Servo, u_max: float) -> Reference:
    """A reference of a file with the columns t_s and theta_ref_rad or theta_ref_deg, sampled as the loop shall run.

    Speed and acceleration are backward differences, so that nothing of the future is in them; a difference that no
    motion of this servo could make is a jump and has none.

    Raises:
        InputError: the file is no such thing.
    """
    file = Path(path)
    table = load(file, file.name)[0].table
    names = [name for name in ANGLES if name in table.column_names]
    if "t_s" not in table.column_names or len(names) != 1:
        raise InputError(
            f"{file.name}: a reference has the column t_s and one of {listed(ANGLES)}, the columns are"
            f" {listed(table.column_names)}"
        )
    t, theta = numbers(table["t_s"], "t_s", file.name), numbers(table[names[0]], names[0], file.name) * ANGLES[names[0]]
    _refuse_holes(t, theta, file.name)
    t, h = t - t[0], float(t[-1] - t[0]) / (t.size - 1)
    fastest = servo_speed(servo, u_max)
    omega = np.diff(theta, prepend=theta[0]) / h
    jump = np.abs(omega) > fastest
    omega[jump] = 0.0
    alpha = np.diff(omega, prepend=omega[0]) / h
    alpha[np.abs(alpha) > abs(servo.b) * u_max] = 0.0
    alpha[jump | np.roll(jump, 1)] = 0.0
    alpha[:2] = 0.0  # the first speed is not known before the second sample
    return Reference(file.stem, t, theta, omega, alpha, tuple(int(k) for k in np.flatnonzero(jump)))


def servo_speed(servo: Servo, u_max: float) -> float:
    """The speed [rad/s] that the servo would reach at full voltage, or in a second where nothing brakes it."""
    return abs(servo.b) * u_max / max(servo.a_2, 1.0)


def _refuse_holes(t: np.ndarray, theta: np.ndarray, name: str) -> None:
    if not BOUNDS.fewest <= t.size <= BOUNDS.most:
        raise InputError(f"{name}: has {t.size} samples, {BOUNDS.fewest} to {BOUNDS.most} were expected")
    for label, x in (("t_s", t), ("the reference", theta)):
        if not np.isfinite(x).all():
            raise InputError(
                f"{name}: {label} is missing or infinite in data row {1 + int(np.argmax(~np.isfinite(x)))}, a reference"
                " has no holes"
            )
    h = np.diff(t)
    if h.min() <= 0 or np.ptp(h) > 0.01 * h.mean():
        raise InputError(f"{name}: its times are not evenly spaced, a loop runs at one sample rate")
    if h.mean() < 1.0 / BOUNDS.rate_hz:
        raise InputError(
            f"{name}: its samples are {h.mean():.3g} s apart, {1.0 / BOUNDS.rate_hz:g} s or more was expected"
        )
    if np.abs(theta).max() > BOUNDS.angle:
        raise InputError(
            f"{name}: its reference reaches {np.abs(theta).max():.3g} rad, {BOUNDS.angle:g} rad at most was expected"
        )
