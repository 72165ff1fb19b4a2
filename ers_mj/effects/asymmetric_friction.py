"""Friction that differs between the two directions of motion."""

import numpy as np

from ers_mj.effects.base import Friction, Parameter


class AsymmetricFriction(Friction):
    """Coulomb F_c +- dF and viscous B +- dB for motion up and down (worn screws; EMPS)."""

    name = "asymmetric_friction"
    sentence = "friction differs with direction: Coulomb by {dF} and viscous by {dB} either way of their mean"
    mjcf = ("the mean as frictionloss and damping, half the Coulomb difference as a constant torque "
            "(exact); a viscous difference step by step")
    parameters = (
        Parameter("dF", "torque", "half the difference of Coulomb friction, up minus down", positive=False),
        Parameter("dB", "damping", "half the difference of viscous friction, up minus down", positive=False),
    )
    sized = 2

    def starts(self, scales):
        return [np.array([0.1 * scales.acceleration * a, 0.05 * scales.acceleration / scales.speed * b])
                for a, b in ((1, 1), (1, -1))]

    def coefficients(self, p, c):
        return c._replace(c_2_plus=max(c.c_2_plus + p[0], 0.0), c_2_minus=max(c.c_2_minus - p[0], 0.0),
                          a_mech_plus=c.a_mech_plus + p[1], a_mech_minus=c.a_mech_minus - p[1])
