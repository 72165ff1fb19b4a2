"""Friction that is higher at rest than in motion."""

import math

import numpy as np

from ers_mj.effects.base import Friction, Parameter, law


class Stribeck(Friction):
    """F(w) = F_c + dF_s exp(-(|w|/v_s)^delta): Stribeck's drop from static to Coulomb friction."""

    name = "stribeck"
    sentence = "friction at rest is {dF_s} higher than in motion and drops off around {v_s}"
    mjcf = "none: the law's exponent is free and it has no bristles as LuGre has; frictionloss is set step by step"
    parameters = (
        Parameter("dF_s", "torque", "static minus Coulomb friction"),
        Parameter("v_s", "speed", "Stribeck velocity"),
        Parameter("delta", "ratio", "exponent", lower=0.4, upper=4.0, absent=1.0),
    )
    sized, tries = 1, 3

    def starts(self, scales):
        return [np.array([0.2 * scales.acceleration, part * scales.speed, 1.4]) for part in (0.03, 0.15, 0.5)]

    @law
    def friction(p, level, theta, w, j, direction):
        return level + p[0] * math.exp(-(abs(w) / p[1]) ** p[2])
