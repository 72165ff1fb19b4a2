"""Friction that changes as the rudder moves."""

import math

import numpy as np

from ers_mj.effects.base import Friction, Parameter, law


class RunningIn(Friction):
    """F = F_c (1 + change (1 - exp(-s / distance))), s the path since the recording began: grease that is worked in, or
    out.
    """

    name = "running_in"
    named = False
    sentence = "friction that changes with the path travelled"
    mjcf = "none: frictionloss is set step by step from the path"
    apart = "changes with the path travelled; thermal_drift changes with the current's heat"
    parameters = (
        Parameter(
            "change",
            "ratio",
            "change of the Coulomb friction in the long run, over what it was",
            positive=False,
            lower=-0.95,
            upper=5.0,
        ),
        Parameter("distance", "position", "path within which it happens"),
    )
    needs = (("change",),)
    sized, tries = 1, 2

    def starts(self, scales):
        return [np.array([0.1, turns * (scales.high - scales.low)]) for turns in (1.0, 3.0, 10.0)]

    def constants(self, p, c):
        return np.array([p[0], p[1], 0.0, 0.0, 0.0])

    @law
    def memory(p, theta, w, j, h):
        return p[4] + abs(w) * h

    @law
    def friction(p, level, theta, w, j, direction):
        return level * (1.0 + p[0] * (1.0 - math.exp(-p[4] / p[1])))
