"""Friction that gives like a spring before it slips."""

import math

import numpy as np

from ers_mj.effects.base import Friction, Parameter

RIGID_HZ = 2000.0  # natural frequency of the bristles (against J) above which friction is rigid: 1e-4 deg of displacement in Table 1


class Presliding(Friction):
    """Coulomb friction acts on a slider without inertia, tied to the rudder by a spring-damper: F = k z + d z' until |F| = F_c.

    k = F_c / x_s, and zeta = d / (2 sqrt(k J)). In slip the rudder feels F_c alone (and what other laws make of it), in stick it rings on
    the spring. Near rest this is LuGre's and Dahl's bristle with sigma_0 = F_c / x_s, without their creep. Beside a play or a shaft,
    whose second body takes its place in the plant, the effect is not there.
    """

    name = "presliding"
    sentence = "friction gives like a spring before it slips, by {x_s} at its full level"
    mjcf = "frictionloss on a light joint slider, which a tendon's spring-damper ties to the absolute angle"
    parameters = (
        Parameter("x_s", "position", "displacement at which it slips"),
        Parameter("zeta", "ratio", "damping ratio of the spring against the inertia", lower=0.05, upper=2.0, absent=0.2),
    )
    tries = 3

    def starts(self, scales):
        least, most = 2 * scales.noise, 0.02 * scales.position
        return [np.array([x_s, 0.2]) for x_s in (most, math.sqrt(least * most), least)]

    def coefficients(self, p, c):
        level = 0.5 * (c.c_2_plus + c.c_2_minus)
        if c.two_body > 0 or p[0] <= 0 or level <= 0 or level > (2 * np.pi * RIGID_HZ) ** 2 * p[0]:
            return c
        k = level / p[0]
        return c._replace(two_body=1.0, rho=0.0, beta=0.0, phi=1.0, k_twist=k, d_twist=2 * p[1] * math.sqrt(k), gap=0.0)
