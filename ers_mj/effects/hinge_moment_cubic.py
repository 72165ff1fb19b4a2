"""A return moment that grows with the cube of the angle."""

import numpy as np

from ers_mj.effects.base import Load, Parameter, law


class HingeMomentCubic(Load):
    """theta'' -= k_3 theta^3 / J: a hardening (or softening, k_3 < 0) aerodynamic hinge moment about angle zero."""

    name = "hinge_moment_cubic"
    sentence = "a hinge moment of {k_3} times angle cubed acts on the rudder"
    parameters = (Parameter("k_3", "cubic", "torque per angle cubed", positive=False),)

    def starts(self, scales):
        reach = max(abs(scales.low), abs(scales.high))
        return [np.array([sign * 0.2 * scales.acceleration / reach**3]) for sign in (1, -1)]

    @law
    def torque(p, theta, w, j, t):
        return -p[0] * theta * theta * theta
