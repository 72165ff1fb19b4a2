"""Friction that is higher, or lower, at one place of the travel."""

import math

import numpy as np

from ers_mj.effects.base import Friction, Parameter, law


class PositionDependentFriction(Friction):
    """F(theta) = F_c + dF exp(-((theta - place) / width)^2 / 2): a dent in the screw, or a place worn smooth (dF < 0)."""

    name = "position_dependent_friction"
    sentence = "friction changes by {dF} around {place}, within ±{width}"
    mjcf = "none: frictionloss is set step by step from the angle"
    parameters = (
        Parameter("dF", "torque", "friction at the place minus friction elsewhere", positive=False),
        Parameter("place", "position", "where on the travel", positive=False),
        Parameter("width", "position", "half-width of the place, one standard deviation"),
    )
    sized, tries = 1, 3

    def starts(self, scales):
        travel = scales.high - scales.low
        return [np.array([0.2 * scales.acceleration, scales.low + at * travel, width * travel])
                for width in (0.08, 0.25) for at in (0.51, 0.27, 0.74, 0.03, 0.96)]

    @law
    def friction(p, level, theta, w, j, direction):
        return max(level + p[0] * math.exp(-0.5 * ((theta - p[1]) / p[2]) ** 2), 0.0)
