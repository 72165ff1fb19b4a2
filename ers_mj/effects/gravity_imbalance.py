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
    sized, tries = 2, 3

    def starts(self, scales):
        """At the middle of the travel: a torque, a stiffness, and both either way."""
        if not scales.is_angle:
            return []
        size, middle = 0.2 * scales.acceleration, 0.5 * (scales.low + scales.high)
        turns = middle + np.pi / 2 * np.array([0.0, 1.0, 0.5, -0.5])
        return [size * np.array([np.cos(turn), -np.sin(turn)]) for turn in turns]

    @law
    def torque(p, theta, w, j, t):
        return -p[0] * math.sin(theta) - p[1] * math.cos(theta)
