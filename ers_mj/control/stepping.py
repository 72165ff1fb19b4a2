"""A reduced plant one sample at a time, for a loop of one's own: command in, reading out, its state in one array.

    command -> the drive's static effects -> plant for one sample -> lag of the sensor -> its law -> reading

The reading is taken just before the command changes.
"""

from __future__ import annotations

from typing import Any

import control
import numpy as np

from ers_mj.effects import BY_NAME, Effect
from ers_mj.errors import InputError
from ers_mj.plants.reduced import ReducedModel
from ers_mj.plants.sampled_reduced import SampledReduced


class Stepper:
    """A reduced plant with its drive and its sensor.

    Args:
        plant: what runs.
        rate_hz: of the samples.
        theta, omega: where it starts; at rest at theta_0 by default.

    Raises:
        InputError: the rate is not above zero, or a dead time is beyond what a loop keeps.
    """

    def __init__(self, plant: ReducedModel, rate_hz: float, theta: float | None = None, omega: float = 0.0):
        if not 0 < rate_hz < np.inf:
            raise InputError(f"the sample rate is {rate_hz:g} Hz, more than zero was expected")
        most = 100_000  # samples of dead time, each of which is a number of the state
        late = sum(BY_NAME[name].dead_time(p) + BY_NAME[name].remembers(p)[1] for name, p in plant.effects)
        if late * rate_hz > most:
            raise InputError(
                f"a dead time of {late:g} s is {late * rate_hz:.3g} samples at {rate_hz:g} Hz, {most} at most were"
                " expected"
            )
        theta = plant.coefficients.theta_0 if theta is None else theta
        self.plant, self.rate_hz = plant, float(rate_hz)
        self._runs = SampledReduced(plant, rate_hz, (theta, omega))
        touching = [
            (BY_NAME[name], p) for name, p in plant.effects if type(BY_NAME[name]).measure is not Effect.measure
        ]
        self._late = [_Late(*effect.remembers(p), rate_hz, theta) for effect, p in touching if any(effect.remembers(p))]
        self._laws = [(effect, p) for effect, p in touching if not any(effect.remembers(p)) and not effect.holds]

    @property
    def theta(self) -> float:
        """The true output [output unit], which the sensor does not change."""
        return self._runs.theta

    @property
    def omega(self) -> float:
        """Its speed [output unit/s]."""
        return self._runs.omega

    @property
    def reading(self) -> float:
        """What the sensor shows now [output unit]."""
        y = np.array([self._late[-1].reading if self._late else self.theta])
        for effect, p in self._laws:
            y = effect.measure(p, np.zeros(1), y)
        return float(y[0])

    def step(self, u: float) -> float:
        """Hold the command u for one sample; the reading at its end [output unit]."""
        self._runs.hold(float(self.plant.terminal(np.array([u], float))[0]))
        y = self.theta
        for late in self._late:
            y = late.read(y)
        return self.reading

    @property
    def state(self) -> np.ndarray:
        """All that tells what comes (n,), in numbers without a unit of their own."""
        packed: np.ndarray = np.concatenate([self._runs.state, *(late.state for late in self._late)])
        return packed

    @state.setter
    def state(self, packed: np.ndarray) -> None:
        begin = self._runs.state.size
        self._runs.state = packed[:begin]
        for late in self._late:
            late.state, begin = packed[begin : begin + late.state.size], begin + late.state.size


class _Late:
    """T y' = x - y with x straight between samples, and behind it a dead time T_d [s]; settled at x."""

    def __init__(self, T: float, T_d: float, rate_hz: float, x: float):
        ratio = T * rate_hz
        decay = float(np.exp(-1.0 / ratio)) if ratio > 0 else 0.0
        self._weights = decay, ratio * (1.0 - decay) - decay, 1.0 - ratio * (1.0 - decay)
        whole, self._part = divmod(T_d * rate_hz, 1.0)
        self.state = np.full(int(whole) + 3, x)  # the input before, and the lag's output, oldest first

    @property
    def reading(self) -> float:
        return float((1.0 - self._part) * self.state[2] + self._part * self.state[1])

    def read(self, x: float) -> float:
        decay, before, now = self._weights
        lagged = decay * self.state[-1] + before * self.state[0] + now * x
        self.state = np.concatenate([[x], self.state[2:], [lagged]])
        return self.reading


def system(plant: ReducedModel, rate_hz: float, names: tuple[str, str]) -> control.NonlinearIOSystem:
    """The plant with all its effects as python-control's discrete system, input and output under these names.

    Its state is how far the plant is from rest at theta_0, so that python-control's initial state 0 is that rest. Every
    call works on a plant of its own state: one that is called in any order, or twice, gives the same.
    """
    stepper = Stepper(plant, rate_hz)
    rest = stepper.state.copy()

    def update(t: float, x: np.ndarray, u: np.ndarray, params: dict[str, Any]) -> np.ndarray:
        stepper.state = rest + x
        stepper.step(float(np.ravel(u)[0]))
        moved: np.ndarray = stepper.state - rest
        return moved

    def output(t: float, x: np.ndarray, u: np.ndarray, params: dict[str, Any]) -> np.ndarray:
        stepper.state = rest + x
        return np.array([stepper.reading])

    return control.NonlinearIOSystem(
        update, output, inputs=[names[0]], outputs=[names[1]], states=rest.size, dt=1.0 / rate_hz, name="servo"
    )
