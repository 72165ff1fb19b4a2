"""Friction that grows with the transmitted torque."""

import numpy as np

from ers_mj.effects.base import Friction, Parameter, law


class LoadDependentFriction(Friction):
    """F = F_c + mu |n K_t i|: a screw or gear that rubs harder the more it carries."""

    name = "load_dependent_friction"
    sentence = "friction grows by {mu} of the torque that the gear transmits"
    mjcf = "none: frictionloss is set step by step from the current"
    parameters = (Parameter("mu", "ratio", "share of the drive torque lost to friction", upper=0.9),)
    follows_current = True
    sized = 1

    def starts(self, scales):
        return [np.array([0.05])]

    @law
    def friction(p, level, theta, w, j, direction):
        return level + p[0] * abs(j)
