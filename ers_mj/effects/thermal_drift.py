"""A motor that changes as it warms up."""

import math

import numpy as np

from ers_mj.effects.base import Drive, Parameter, law


class ThermalDrift(Drive):
    """R(t) = R (1 + rise (1 - exp(-t / T_w))): the winding's resistance creeps from its cold to its warm value in every recording.

    A negative rise is a drive that gains with time. Time counts from the zero of the recording's own clock.
    """

    name = "thermal_drift"
    sentence = "the motor's resistance drifts by {rise} of itself as it warms up within {T_w}"
    mjcf = "none: the torque is set step by step (the thermal of a dcmotor follows the current's heat, this one the clock)"
    parameters = (
        Parameter("rise", "ratio", "relative rise of the resistance once warm", positive=False, lower=-0.8, upper=10.0),
        Parameter("T_w", "time", "time constant of the warm-up", upper=1e4),
    )
    sized, tries = 1, 2

    def starts(self, scales):
        return [np.array([0.1, part * scales.duration]) for part in (0.3, 1.5, 0.06)]

    @law
    def torque(p, theta, w, j, t):
        drift = -p[0] * math.expm1(-t / p[1])
        return -j * drift / (1.0 + drift)

    def winding(self, p, c, t, motion, j):
        return j / (1.0 - p[0] * np.expm1(-t / p[1]))
