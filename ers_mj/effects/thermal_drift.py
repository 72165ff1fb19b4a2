"""A motor that changes as it warms up."""

import math

import numpy as np

from ers_mj.effects.base import Drive, Parameter, law, recursive

SHORTEST = 0.5  # [s] warm-up: windings of small motors take seconds
COLDEST = -0.9  # of the resistance, by which it may fall at most


class ThermalDrift(Drive):
    """R(t) = R (1 + rise q), T_w q' = (j / j_stall)^2 - q: the winding's heat, one node that is cold where a recording
    begins.

    j_stall is the drive acceleration under the largest input at a standstill, so that ``rise`` is what the resistance
    gains in the long run there. A negative rise is a drive that gains as it warms.
    """

    name = "thermal_drift"
    sentence = (
        "the motor's resistance drifts by {rise} of itself as it warms up within {T_w} (at a standstill under {u})"
    )
    mjcf = (
        "none: the torque is set step by step (the thermal of a dcmotor knows heat in watts, which no recording of an"
        " angle tells)"
    )
    apart = "changes over seconds of load and recovers; supply_sag follows the current at once"
    parameters = (
        Parameter(
            "rise",
            "ratio",
            "relative rise of the resistance, once warm at a standstill under the largest input",
            positive=False,
            lower=-3.0,
            upper=30.0,
        ),
        Parameter("T_w", "time", "time constant of the warm-up", lower=SHORTEST, upper=1e4),
        Parameter("u", "input", "largest input, 24 where it is not told", fitted=False, absent=24.0),
    )
    needs = (("rise",),)
    sized, tries = 1, 2
    parts_damping = True

    def starts(self, scales):
        return [np.array([0.4, max(part * scales.duration, SHORTEST), scales.input]) for part in (0.3, 1.5, 0.06)]

    def constants(self, p, c):
        return np.array([p[0], p[1], abs(c.b) * p[2], 0.0, 0.0])

    @law
    def memory(p, theta, w, j, h):
        heat = (j / p[2]) ** 2
        return heat + (p[4] - heat) * math.exp(-h / p[1])

    @law
    def torque(p, theta, w, j, t):
        drift = max(p[0] * p[4], COLDEST)
        return -j * drift / (1.0 + drift)

    def winding(self, p, c, t, motion, j):
        heat, decay = (motion[:-1, 2] / (c.b * p[2])) ** 2, np.exp(-np.diff(t) / p[1])
        warmth = recursive(np.append(1.0, decay), np.append(0.0, heat * (1.0 - decay)))
        return j / (1.0 + np.maximum(p[0] * warmth, COLDEST))
