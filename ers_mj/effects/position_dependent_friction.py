"""Friction that is higher, or lower, at one place of the travel."""

import math

import numpy as np

from ers_mj.effects.base import Friction, Parameter, law
from ers_mj.errors import InputError

ORDERS = (1, 1.5, 2, 3, 4, 6, 8)  # periods within the travel from which a fit is begun


class PositionDependentFriction(Friction):
    """F(theta) = F_c + dF exp(-((theta - place) / width)^2 / 2), a pitted place of a screw or one worn smooth (dF < 0);
    or F_c + dF sin(2 pi theta / period + phase), a screw that binds once a turn.

    Terms that are absent are infinite.
    """

    name = "position_dependent_friction"
    sentence = "friction changes along the travel by {dF} (around {place}, within ±{width}; every {period})"
    mjcf = "none: frictionloss is set step by step from the angle"
    apart = (
        "returns at the same place in both directions and reverses with the motion; cogging and a cubic moment "
        "keep their sign"
    )
    parameters = (
        Parameter(
            "dF", "torque", "friction at the place minus friction elsewhere, or amplitude of the wave", positive=False
        ),
        Parameter("place", "position", "where on the travel", positive=False, absent=np.inf),
        Parameter("width", "position", "half-width of the place, one standard deviation", absent=np.inf),
        Parameter("period", "position", "period of the wave", absent=np.inf),
        Parameter("phase", "phase", "phase of the wave at angle zero", positive=False, absent=np.inf),
    )
    needs, together = (("dF",), ("place", "period")), (("place", "width"), ("period", "phase"))
    sized, tries = 1, 3
    wave = ((0,), 4)

    def starts(self, scales):
        travel, size = scales.high - scales.low, 0.2 * scales.acceleration
        places = [
            np.array([size, scales.low + at * travel, width * travel, np.inf, np.inf])
            for width in (0.08, 0.25)
            for at in (0.51, 0.27, 0.74, 0.03, 0.96)
        ]
        periods = [*(travel / order for order in ORDERS), *scales.finer_waves("friction", ORDERS[-1])]
        return places + [np.array([size, np.inf, np.inf, period, 0.0]) for period in periods]

    def constants(self, p, c):
        if np.isfinite(p[1]) and np.isfinite(p[3]):
            raise InputError(f"{self.name}: place and period are both given, one of them was expected")
        if np.isfinite(p[3]):
            return np.array([p[0], p[4], 2 * np.pi / p[3], 1.0])
        return np.array([p[0], p[1], p[2], 0.0]) if np.isfinite(p[1]) else np.array([0.0, 0.0, 1.0, 0.0])

    @law
    def friction(p, level, theta, w, j, direction):
        if p[3] > 0:
            return max(level + p[0] * math.sin(p[2] * theta + p[1]), 0.0)
        return max(level + p[0] * math.exp(-0.5 * ((theta - p[1]) / p[2]) ** 2), 0.0)

    def describe(self, values):
        if values["period"] == "none":
            return f"friction changes by {values['dF']} around {values['place']}, within ±{values['width']}"
        return f"friction swings by an amplitude of {values['dF']} every {values['period']} of the travel"
