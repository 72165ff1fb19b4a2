"""Damping that is not the same along the travel."""

import math

import numpy as np

from ers_mj.effects.base import Friction, Parameter, law
from ers_mj.errors import InputError

ORDERS = (1, 1.5, 2, 3, 4, 6, 8)  # periods within the travel from which a fit is begun


class UnevenDamping(Friction):
    """theta'' -= w (d_1 x + d_2 x^2) / J, x = theta / reach: grease that is thicker at one end; or w A sin(2 pi theta /
    period + phase) / J: a speed that is fed back unevenly.

    Terms that are absent are infinite.
    """

    name = "uneven_damping"
    named = False
    sentence = "damping that changes along the travel"
    mjcf = "none: the torque is set step by step from angle and speed"
    apart = "grows with speed and depends on the place; position_dependent_friction does not grow with speed"
    parameters = (
        Parameter(
            "d_1",
            "damping",
            "damping that rises in proportion to the angle, at the reach",
            positive=False,
            absent=np.inf,
        ),
        Parameter("d_2", "damping", "damping that rises with its square, there", positive=False, absent=np.inf),
        Parameter("reach", "position", "angle at which they are told, 1 where it is not", fitted=False, absent=1.0),
        Parameter("A", "damping", "amplitude of the wave", positive=False, absent=np.inf),
        Parameter("period", "position", "period of the wave", absent=np.inf),
        Parameter("phase", "phase", "phase of the wave at angle zero", positive=False, absent=np.inf),
    )
    needs, together = (("d_1", "d_2", "A"),), (("A", "period", "phase"),)
    sized, tries = 2, 2
    wave = ((3,), 5)

    def starts(self, scales):
        size, travel, none = 0.1 * scales.acceleration / scales.speed, scales.high - scales.low, np.inf
        slopes = [
            np.array([size * d_1, size * d_2, scales.position, none, none, none])
            for d_1, d_2 in ((0, 1), (1, 0), (1, 1), (1, -1))
        ]
        return slopes + [np.array([none, none, 1.0, size, travel / order, 0.0]) for order in ORDERS]

    def constants(self, p, c):
        if np.isfinite(p[4]):
            if np.isfinite(p[:2]).any():
                raise InputError(f"{self.name}: d_1 or d_2 and A are both given, one of them was expected")
            return np.array([0.0, 0.0, p[3], 2 * np.pi / p[4], p[5]])
        d_1, d_2 = (d if np.isfinite(d) else 0.0 for d in p[:2])
        return np.array([d_1 / p[2], d_2 / p[2] ** 2, 0.0, 0.0, 0.0])

    @law
    def torque(p, theta, w, j, t):
        if p[2] != 0.0:
            return -w * p[2] * math.sin(p[3] * theta + p[4])
        return -w * theta * (p[0] + p[1] * theta)
