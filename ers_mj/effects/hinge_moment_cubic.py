"""A return moment that grows with the cube of the angle."""

import numpy as np

from ers_mj.effects.base import Load, Parameter, law


class HingeMomentCubic(Load):
    """theta'' -= k_3 (theta - theta_0)^3 / J: a hardening (or, k_3 < 0, softening) moment about the rest angle."""

    name = "hinge_moment_cubic"
    sentence = "a hinge moment of {k_3} times angle cubed acts on the rudder"
    mjcf = "a cubic term in the stiffness polynomial"
    parameters = (Parameter("k_3", "cubic", "torque per angle cubed", positive=False),)
    sized = 1

    def starts(self, scales):
        return [np.array([0.2 * scales.acceleration / scales.position**3])]

    def constants(self, p, c):
        return np.array([p[0], c.theta_0])

    @law
    def torque(p, theta, w, j, t):
        return -p[0] * (theta - p[1]) ** 3

    def edit_spec(self, p, c, twin):
        tendon = twin.spec.tendon("rudder_angle")
        tendon.stiffness = [tendon.stiffness[0], 0.0, twin.inertia * p[0]]
        return True
