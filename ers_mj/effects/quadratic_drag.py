"""Drag that grows with the square of speed."""

import numpy as np

from ers_mj.effects.base import Friction, Parameter, law

GROWN = 2.2  # exponent from which another one than the square is looked for


class QuadraticDrag(Friction):
    """theta'' -= c w |w|^(n - 1) / J, w in output units/s: turbulent air or churned grease. n is 2 where it is absent
    (infinite).
    """

    name = "quadratic_drag"
    sentence = "a drag of {c} times speed squared brakes fast motion"
    mjcf = (
        "a quadratic term in the damping polynomial; with n none: the ctrl of the load actuator is set step by step"
        " from the speed"
    )
    apart = "shows at high speed only; inductance and a sagging supply brake by current, which rises at low speed too"
    parameters = (
        Parameter("c", "drag", "torque per speed squared, at 1 output unit/s"),
        Parameter("n", "ratio", "exponent of the speed, where it is not 2", lower=1.2, upper=4.0, absent=np.inf),
    )
    sized, needs = 1, (("c",),)

    def starts(self, scales):
        return [np.array([0.1 * scales.acceleration / scales.speed**2, np.inf])]

    def grown(self, name, p, scales):
        """From a square: with an exponent of its own, as strong at high speed."""
        return (
            [np.array([p[0] * scales.speed ** (2.0 - GROWN), GROWN])]
            if name == self.name and not np.isfinite(p[1])
            else []
        )

    def constants(self, p, c):
        return np.array([p[0], p[1] - 2.0 if np.isfinite(p[1]) else 0.0])

    @law
    def torque(p, theta, w, j, t):
        if p[1] == 0.0:
            return -p[0] * w * abs(w)
        return -p[0] * w * abs(w) ** (1.0 + p[1])

    def edit_spec(self, p, c, twin):
        if p[1] != 0.0:
            return False
        tendon = twin.spec.tendon("rudder_angle")
        tendon.damping = [tendon.damping[0], twin.inertia * p[0], 0.0]
        return True

    def describe(self, values):
        return (
            super().describe(values)
            if values["n"] == "none"
            else f"a drag of {values['c']} times speed to the power {values['n']} brakes fast motion"
        )
