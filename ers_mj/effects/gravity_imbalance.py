"""A rudder whose centre of mass lies off its axis."""

import math

import numpy as np

from ers_mj.effects.base import Load, Parameter, law


class GravityImbalance(Load):
    """theta'' -= (g_s sin theta + g_c cos theta) / J = m g l sin(theta + phase) / J. Needs an angle in rad."""

    name = "gravity_imbalance"
    sentence = "gravity pulls at an off-centre mass: {g_s} sin(angle) + {g_c} cos(angle)"
    parameters = (
        Parameter("g_s", "torque", "m g l cos(phase)", positive=False),
        Parameter("g_c", "torque", "m g l sin(phase)", positive=False),
    )

    def starts(self, scales):
        size = 0.2 * scales.acceleration
        return [np.array([a * size, b * size]) for a, b in ((1, 0.3), (-1, 0.3))] if scales.is_angle else []

    @law
    def torque(p, theta, w, j, t):
        return -p[0] * math.sin(theta) - p[1] * math.cos(theta)
