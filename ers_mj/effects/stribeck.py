"""Friction that is higher at rest than in motion."""

import math

import numpy as np

from ers_mj.effects.base import Friction, Parameter, law

HEAVY = 1.5  # tail from which one heavier than an exponential's is begun


class Stribeck(Friction):
    """F(w) = F_c + dF_s exp(-x), x = (|w|/v_s)^delta: Stribeck's drop from static to Coulomb friction. Or one with a
    heavier tail, dF_s (1 + x / tail)^-tail.
    """

    name = "stribeck"
    sentence = "friction at rest is {dF_s} higher than in motion and drops off around {v_s}"
    mjcf = "none: the law's exponent is free and it has no bristles as LuGre has; frictionloss is set step by step"
    apart = (
        "a jump when motion begins and at reversals; presliding bends before it slips, drive_dead_zone depends on the"
        " command"
    )
    parameters = (
        Parameter("dF_s", "torque", "static minus Coulomb friction"),
        Parameter("v_s", "speed", "Stribeck velocity"),
        Parameter("delta", "ratio", "exponent", lower=0.4, upper=4.0, absent=1.0),
        Parameter(
            "tail",
            "ratio",
            "power with which its tail falls, where that is no exponential",
            lower=0.3,
            upper=30.0,
            absent=np.inf,
        ),
    )
    sized, tries = 1, 3

    def starts(self, scales):
        return [np.array([0.2 * scales.acceleration, part * scales.speed, 1.4, np.inf]) for part in (0.03, 0.15, 0.5)]

    def grown(self, name, p, scales):
        """From an exponential: with a heavy tail, and half of it left at the same speed."""
        if name != self.name or np.isfinite(p[3]):
            return []
        half = p[1] * math.log(2.0) ** (1.0 / p[2])
        return [np.array([p[0], half / math.sqrt(HEAVY * (2.0 ** (1.0 / HEAVY) - 1.0)), 2.0, HEAVY])]

    def constants(self, p, c):
        return np.array([*p[:3], 1.0 / p[3] if np.isfinite(p[3]) else 0.0])

    @law
    def friction(p, level, theta, w, j, direction):
        x = (abs(w) / p[1]) ** p[2]
        if p[3] == 0.0:
            return level + p[0] * math.exp(-x)
        return level + p[0] * (1.0 + p[3] * x) ** (-1.0 / p[3])
