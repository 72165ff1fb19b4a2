"""The MuJoCo plant one sample at a time, its state carried: what a control loop needs."""

from __future__ import annotations

import math

from ers_mj.plants.mujoco.plant import MechanicalPlant
from ers_mj.plants.mujoco.stepping import unlogged


class SampledMuJoCo:
    """A MuJoCo plant under a voltage that is given sample by sample, with the interface of
    :class:`ers_mj.plants.sampled_reduced.SampledReduced`.
    """

    def __init__(self, plant: MechanicalPlant, rate_hz: float, start: tuple[float, float]):
        self._stepper = plant._stepper()
        self._stepper.reset(plant._start(start))
        delay, self._h = plant._lowered.delay, 1.0 / rate_hz
        skip = int(delay * rate_hz + 1e-9)
        self._late = delay - skip * self._h
        self._sent = [0.0] * (skip + 2)
        self._observed = self._stepper._observe()

    @property
    def theta(self) -> float:
        """The rudder's angle [rad]."""
        return float(self._observed[0])

    @property
    def omega(self) -> float:
        """The rudder's speed [rad/s]."""
        return float(self._observed[1])

    def drive(self, v: float) -> float:
        """Drive acceleration n K_t i / J [rad/s^2] with v [V] at the terminals."""
        return float(self._stepper.drive_under(v))

    @unlogged()
    def hold(self, v: float) -> None:
        """Hold v [V] at the terminals until the next sample."""
        self._sent = [*self._sent[1:], v]
        self._stepper.hold(self._inputs(), self._h)
        self._observed = self._stepper._observe()

    def _inputs(self) -> list[tuple[float, int]]:
        """(voltage, steps) over the sample; the step in which a delayed switch falls takes the mean."""
        h, steps = self._stepper._divide(self._h)
        before, now = self._sent[:2]
        whole = math.floor(self._late / h + 1e-9)
        rest = self._late / h - whole
        if rest < 1e-9:
            return [(before, whole), (now, steps - whole)]
        return [(before, whole), (rest * before + (1.0 - rest) * now, 1), (now, steps - whole - 1)]
