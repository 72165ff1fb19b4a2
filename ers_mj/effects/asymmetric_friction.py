"""Friction that differs between the two directions of motion."""

import math

import numpy as np

from ers_mj.effects.base import Friction, Parameter, law


class AsymmetricFriction(Friction):
    """Coulomb F_c +- dF and viscous B +- dB for motion up and down (worn screws; EMPS). Where rest and v_a are given,
    the Coulomb part differs otherwise where the rudder begins to move: +- dF (1 + (rest - 1) exp(-(w / v_a)^2)).
    """

    name = "asymmetric_friction"
    sentence = "friction differs with direction: Coulomb by {dF} and viscous by {dB} either way of their mean"
    mjcf = (
        "the mean as frictionloss and damping, half the Coulomb difference as a constant torque "
        "(exact); a viscous difference, or one that grows with speed, step by step"
    )
    apart = (
        "acts only while it moves and turns with the direction; a bias_torque also shifts where the rudder rests, "
        "which shows only under a spring or a hanging load"
    )
    parameters = (
        Parameter("dF", "torque", "half the difference of Coulomb friction, up minus down", positive=False),
        Parameter("dB", "damping", "half the difference of viscous friction, up minus down", positive=False),
        Parameter(
            "rest", "ratio", "share of dF where motion begins", positive=False, lower=0.01, upper=1.0, absent=np.inf
        ),
        Parameter("v_a", "speed", "speed at which it has become dF", absent=np.inf),
    )
    sized, needs, together = 2, (("dF", "dB"),), (("rest", "v_a"),)

    def starts(self, scales):
        return [
            np.array([0.1 * scales.acceleration * a, 0.05 * scales.acceleration / scales.speed * b, np.inf, np.inf])
            for a, b in ((1, 1), (1, -1))
        ]

    def scaffold(self, scales, sprung):
        return None if sprung else self.starts(scales)[0]

    def grown(self, name, p, scales):
        """From one difference: with half of it where motion begins, at shares of the largest speed."""
        return (
            [np.array([*p[:2], 0.5, share * scales.speed]) for share in (0.05, 0.2)]
            if name == self.name and not np.isfinite(p[2])
            else []
        )

    def coefficients(self, p, c):
        return c._replace(
            c_2_plus=max(c.c_2_plus + p[0], 0.0),
            c_2_minus=max(c.c_2_minus - p[0], 0.0),
            a_mech_plus=c.a_mech_plus + p[1],
            a_mech_minus=c.a_mech_minus - p[1],
        )

    def constants(self, p, c):
        return np.array([p[0] * (p[2] - 1.0), p[3]]) if self.is_lawful(p) else np.zeros(2)

    def is_lawful(self, p):
        return bool(np.isfinite(p[2]))

    @law
    def friction(p, level, theta, w, j, direction):
        return max(level + direction * p[0] * math.exp(-((w / p[1]) ** 2)), 0.0)

    def edit_spec(self, p, c, twin):
        return p[1] == 0.0

    def describe(self, values):
        growing = (
            ""
            if values["rest"] == "none"
            else f"; Coulomb by {values['rest']} of that where motion begins, growing until {values['v_a']}"
        )
        return super().describe(values) + growing
