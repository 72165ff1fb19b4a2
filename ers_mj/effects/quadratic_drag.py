"""Drag that grows with the square of speed."""

import numpy as np

from ers_mj.effects.base import Friction, Parameter, law


class QuadraticDrag(Friction):
    """theta'' -= c w |w| / J: turbulent air or churned grease."""

    name = "quadratic_drag"
    sentence = "a drag of {c} times speed squared brakes fast motion"
    mjcf = "a quadratic term in the damping polynomial"
    parameters = (Parameter("c", "drag", "torque per speed squared"),)
    sized = 1

    def starts(self, scales):
        return [np.array([0.1 * scales.acceleration / scales.speed**2])]

    @law
    def torque(p, theta, w, j, t):
        return -p[0] * w * abs(w)

    def edit_spec(self, p, c, twin):
        tendon = twin.spec.tendon("rudder_angle")
        tendon.damping = [tendon.damping[0], twin.inertia * p[0], 0.0]
        return True
