"""A linkage whose ratio changes along the travel."""

import numpy as np

from ers_mj.effects.base import Parameter, Transmission, law

LEAST = 0.05  # of the ratio at theta_0: a linkage near its dead centre


class VariableRatio(Transmission):
    """r = 1 + slope x + bend x^2, x = theta - theta_0: a rod on a rocker arm.

    The motor's torque at the rudder is r times, its back-EMF r times that at theta_0, and its share rho of the inertia
    r^2 times; with inductance the current's delay behind the changed back-EMF is left out.
    """

    name = "variable_ratio"
    sentence = (
        "the gear ratio changes along the travel: by {slope} times the angle from rest and {bend} times its square"
    )
    mjcf = "none: torque and inertia are set step by step; a rod on a rocker arm is the rudder system's own linkage"
    apart = (
        "scales torque, back-EMF and reflected inertia together along the travel; a bent sensor changes only what "
        "is read"
    )
    parameters = (
        Parameter("slope", "per_position", "relative change of the ratio per angle", positive=False),
        Parameter("bend", "per_position_squared", "relative change of the ratio per angle squared", positive=False),
        Parameter("rho", "ratio", "motor side's share of the inertia at theta_0", lower=0.1, upper=0.9, absent=0.5),
    )
    needs = (("slope", "bend"),)
    sized, tries, at_motor = 2, 2, True

    def starts(self, scales):
        """Mostly slope, mostly bend, and both."""
        reach = scales.position
        return [
            np.array([0.1 * slope / reach, 0.1 * bend / reach**2, 0.5])
            for slope, bend in ((1.0, 0.05), (0.05, 1.0), (1.0, 1.0), (1.0, -1.0))
        ]

    def constants(self, p, c):
        return np.array([p[0], p[1], c.theta_0, c.a_emf, p[2]])

    @law
    def torque(p, theta, w, j, t):
        if j == 0.0:  # an open circuit
            return 0.0
        x = theta - p[2]
        change = max(p[0] * x + p[1] * x * x, LEAST - 1.0)
        return change * (j - (1.0 + change) * p[3] * w)

    @law
    def inertia(p, theta):
        x = theta - p[2]
        ratio = max(1.0 + p[0] * x + p[1] * x * x, LEAST)
        return 1.0 + p[4] * (ratio * ratio - 1.0), p[4] * ratio * (p[0] + 2.0 * p[1] * x)

    def winding(self, p, c, t, motion, j):
        x = motion[:, 0] - c.theta_0
        return j - np.maximum(p[0] * x + p[1] * x * x, LEAST - 1.0) * c.a_emf * motion[:, 1]
