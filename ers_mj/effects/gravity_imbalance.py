"""A rudder whose centre of mass lies off its axis."""

import math

import numpy as np

from ers_mj.effects.base import Load, Parameter, law

G = 9.81  # [m/s^2]


class GravityImbalance(Load):
    """theta'' -= (g_s sin theta + g_c cos theta) / J = m g l sin(theta + phase) / J. Needs an angle in rad."""

    name = "gravity_imbalance"
    sentence = "gravity pulls at an off-centre mass: {g_s} sin(angle) + {g_c} cos(angle)"
    mjcf = "an off-axis point mass under gravity, every other part weightless; its inertia is taken from the rudder"
    apart = (
        "follows sine and cosine of the angle; over a narrow travel it is a bias_torque and a spring, and is told "
        "as such"
    )
    parameters = (
        Parameter("g_s", "torque", "m g l cos(phase)", positive=False),
        Parameter("g_c", "torque", "m g l sin(phase)", positive=False),
    )
    sized, tries, holds_place = 2, 3, True
    is_weight = True
    redundant, curves = (
        1,
        "bias_torque",
    )  # its slope is the spring's; how it bends follows from its size at the middle of the travel

    def starts(self, scales):
        """At the middle of the travel: a torque, a stiffness, and both either way."""
        if not scales.is_angle:
            return []
        size, middle = 0.2 * scales.acceleration, 0.5 * (scales.low + scales.high)
        turns = middle + np.pi / 2 * np.array([0.0, 1.0, 0.5, -0.5])
        return [size * np.array([np.cos(turn), -np.sin(turn)]) for turn in turns]

    def columns(self, y):
        return -np.column_stack([np.sin(y), np.cos(y)])

    def coefficients(self, p, c):
        return c._replace(g_s=c.g_s + p[0], g_c=c.g_c + p[1])

    @law
    def torque(p, theta, w, j, t):
        return -p[0] * math.sin(theta) - p[1] * math.cos(theta)

    def edit_spec(self, p, c, twin):
        size = math.hypot(p[0], p[1])
        if not twin.is_angle or size == 0:
            return size == 0
        rudder = twin.spec.body("rudder")
        inertia = 0.01 * rudder.inertia[1]  # of the point mass; any small share gives the same torque
        arm = inertia * G / (twin.inertia * size)
        for body in twin.spec.bodies[1:]:
            body.gravcomp = 1.0
        twin.spec.option.gravity = [0.0, 0.0, -G]
        rudder.inertia = rudder.inertia - inertia
        rudder.add_body(
            name="imbalance",
            pos=[arm * p[1] / size, 0.0, -arm * p[0] / size],
            explicitinertial=True,
            mass=inertia / arm**2,
            ipos=[0.0, 0.0, 0.0],
            inertia=[1e-9 * inertia] * 3,
        )
        return True
