"""A controller and a plant in a loop, sample by sample.

    reference, measurement -> controller -> saturation -> plant for one sample -> sensor -> measurement

The measurement is taken just before the voltage changes, and the voltage that follows from it acts from the same
instant on; a dead time is an effect (``input_delay``) of the plant.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ers_mj.control.controllers import Aim, Controller
from ers_mj.control.references import Reference
from ers_mj.effects import BY_NAME, Effect

LOST = 4.0 * math.pi  # [rad] from the start beyond which a loop is given up as unstable


class Sampled(Protocol):
    """A plant one sample at a time."""

    @property
    def theta(self) -> float:
        """The rudder's angle [rad]."""

    @property
    def omega(self) -> float:
        """Its speed [rad/s]."""

    def drive(self, v: float) -> float:
        """Drive acceleration [rad/s^2] with v [V] at the terminals."""

    def hold(self, v: float) -> None:
        """Hold v [V] until the next sample."""


@dataclass(frozen=True, eq=False)
class Run:
    """What a loop did, each (N,): the rudder's angle [rad] and speed [rad/s], what was measured of it [rad], the
    voltage [V] (NaN of a firmware's own loop, which does not tell it), and the drive's acceleration [rad/s^2] at the
    beginning and at the end of each sample. NaN from where the loop was given up."""

    reference: Reference
    theta: np.ndarray
    omega: np.ndarray
    measured: np.ndarray
    u: np.ndarray
    drive: np.ndarray
    drive_after: np.ndarray

    @property
    def lost(self) -> bool:
        """Whether the loop ran away."""
        return not np.isfinite(self.theta).all()

    @property
    def has_volts(self) -> bool:
        """Whether its voltage is known."""
        return bool(np.isfinite(self.u).any())


class Sensor:
    """What is read of the angle: the sensor's effects, white noise, then converter and wire.

    Args:
        effects: (name, parameters (k,)) of the plant; those that touch no sensor do nothing here.
        t: the sample times (N,) [s].
        noise: standard deviation (rad).
        seed: of the noise.
    """

    def __init__(self, effects: Sequence[tuple[str, np.ndarray]], t: np.ndarray, noise: float = 0.0, seed: int = 0):
        touching = [(BY_NAME[name], p) for name, p in effects if BY_NAME[name].subsystem == "sensor"]
        self._lags = [(effect, p) for effect, p in touching if any(effect.remembers(p))]
        self._before = [(effect, p) for effect, p in touching if not (effect.after_noise or any(effect.remembers(p)))]
        self._after = [(effect, p) for effect, p in touching if effect.after_noise and not effect.holds]
        self._wires = [(effect, p) for effect, p in touching if effect.holds]
        self._noise = noise * np.random.default_rng(seed).standard_normal(t.size)
        self._t, self._k = t, 0
        self._truth, self._read = np.empty(t.size), np.empty(t.size)
        held = np.arange(t.size, dtype=float)
        for effect, p in self._wires:
            held = effect.measure(p, t, held)
        self._held = held.astype(int)  # the sample whose reading arrives

    def read(self, theta: float) -> float:
        """The reading [rad] of the angle at the next sample."""
        k, y = self._k, theta
        self._truth[k] = theta
        for effect, p in self._lags:
            y = self._lagged(effect, p, k)
        at = self._t[k : k + 1]
        for effect, p in self._before:
            y = float(effect.measure(p, at, np.array([y]))[0])
        y += self._noise[k]
        for effect, p in self._after:
            y = float(effect.measure(p, at, np.array([y]))[0])
        self._read[k] = y
        self._k += 1
        return float(self._read[self._held[k]])

    def _lagged(self, effect: Effect, p: np.ndarray, k: int) -> float:
        h, memory = float(self._t[1] - self._t[0]), 12.0  # time constants of the lag that its window holds
        constant, dead = effect.remembers(p)
        late = memory * constant + dead
        begin = max(0, k - 2 - int(late / h))
        if k == 0:
            return float(self._truth[0])
        return float(effect.measure(p, self._t[begin : k + 1], self._truth[begin : k + 1])[-1])


def close(controller: Controller, plant: Sampled, sensor: Sensor, reference: Reference, terminal=None) -> Run:
    """Run the loop over a reference.

    Args:
        controller: reset to where the plant rests by its maker.
        plant: at its start.
        sensor: at its first sample.
        reference: N samples.
        terminal: the voltage (1,) that is left of a command (1,) after the drive's static effects; None for all of it.
    """
    n, start = reference.t.size, plant.theta
    theta, omega, measured, u, drive, after = np.full((6, n), np.nan)
    aims = np.column_stack([reference.theta, reference.omega, reference.alpha]).tolist()
    for k, t in enumerate(reference.t.tolist()):
        theta[k], omega[k] = plant.theta, plant.omega
        if not abs(theta[k] - start) < LOST:
            theta[k] = np.nan
            break
        measured[k] = sensor.read(theta[k])
        u[k] = controller.voltage(Aim(*aims[k]), measured[k], t)
        v = u[k] if terminal is None else float(terminal(u[k : k + 1])[0])
        drive[k] = plant.drive(v)
        plant.hold(v)
        after[k] = plant.drive(v)
    return Run(reference, theta, omega, measured, u, drive, after)
