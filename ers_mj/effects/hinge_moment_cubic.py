"""A return moment that grows with the cube of the angle."""

import math

import numpy as np

from ers_mj.effects.base import Load, Parameter, law


class HingeMomentCubic(Load):
    """theta'' -= k_3 x^3 exp(-(x / x_p)^2 / 2) / J, x = theta - theta_0: a hardening (or, k_3 < 0, softening) moment
    about the rest angle. It grows more slowly beyond x_p, where the flow parts from the rudder; not where x_p is absent
    (infinite).
    """

    name = "hinge_moment_cubic"
    sentence = "a hinge moment of {k_3} times angle cubed acts on the rudder"
    mjcf = (
        "a cubic term in the stiffness polynomial; with x_p none: the ctrl of the load actuator is set step by step"
        " from the angle"
    )
    apart = (
        "bends the spring's line on both sides of the rest angle; gravity's bend follows from its size, an "
        "end_stop's is sudden"
    )
    parameters = (
        Parameter("k_3", "cubic", "torque per angle cubed", positive=False),
        Parameter("x_p", "position", "angle from the rest angle around which it grows more slowly", absent=np.inf),
    )
    sized, needs = 1, (("k_3",),)

    def starts(self, scales):
        return [np.array([0.2 * scales.acceleration / scales.position**3, np.inf])]

    def grown(self, name, p, scales):
        """From a plain cubic: one that grows more slowly two half travels out."""
        return [np.array([p[0], 2.0 * scales.position])] if name == self.name and not np.isfinite(p[1]) else []

    def constants(self, p, c):
        return np.array([p[0], c.theta_0, 0.5 / p[1] ** 2])

    @law
    def torque(p, theta, w, j, t):
        x = theta - p[1]
        return -p[0] * x**3 * math.exp(-p[2] * x * x)

    def edit_spec(self, p, c, twin):
        if p[2] > 0.0:
            return False
        tendon = twin.spec.tendon("rudder_angle")
        tendon.stiffness = [tendon.stiffness[0], 0.0, twin.inertia * p[0]]
        return True

    def describe(self, values):
        return super().describe(values) + (
            "" if values["x_p"] == "none" else f", growing more slowly beyond {values['x_p']}"
        )
