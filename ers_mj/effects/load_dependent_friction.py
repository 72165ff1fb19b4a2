"""Friction that grows with the transmitted torque."""

import numpy as np

from ers_mj.effects.base import Friction, Parameter, law


class LoadDependentFriction(Friction):
    """F = F_c + mu |n K_t i|: a screw or gear that rubs harder the more it carries. Or mu |n K_t i| x / (1 + x), x = |n
    K_t i| / half: teeth that rub little until they are pressed.
    """

    name = "load_dependent_friction"
    sentence = "friction grows by {mu} of the torque that the gear transmits"
    mjcf = "none: frictionloss is set step by step from the current"
    apart = (
        "grows with the motor's torque; position_dependent_friction changes with the place, stribeck with speed alone"
    )
    parameters = (
        Parameter("mu", "ratio", "share of the drive torque lost to friction", upper=0.9),
        Parameter("half", "torque", "torque at the rudder under which the share is half of that", absent=np.inf),
    )
    follows_current = True
    sized, needs = 1, (("mu",),)

    def starts(self, scales):
        return [np.array([0.05, np.inf])]

    def grown(self, name, p, scales):
        """From one share: half of it under as much as friction holds at rest."""
        return (
            [np.array([1.3 * p[0], 0.3 * scales.acceleration])] if name == self.name and not np.isfinite(p[1]) else []
        )

    def constants(self, p, c):
        return np.array([p[0], p[1] if np.isfinite(p[1]) else 0.0])

    @law
    def friction(p, level, theta, w, j, direction):
        push = abs(j)
        return level + p[0] * push * push / (push + p[1]) if push > 0.0 else level

    def describe(self, values):
        return super().describe(values) + (
            "" if values["half"] == "none" else f", and by half of that under {values['half']}"
        )
