"""Friction that grows with the transmitted torque."""

import math

import numpy as np

from ers_mj.effects.base import Friction, Parameter, law


class LoadDependentFriction(Friction):
    """F = F_c + mu |T|: a screw or gear that rubs harder the more it carries. Or mu |T| x / (1 + x), x = |T| / half:
    teeth that rub little until they are pressed.

    T = (1 - side) n K_t i - side T_load is what the gear carries: the motor's torque, back-EMF and all, or what the
    load holds against it (spring, preload, gravity), each by the other side's share of the inertia; n K_t i where the
    side is absent (infinite). At low speed mu may be larger by mu_s exp(-(w / w_s)^2), as Stribeck's is.
    """

    name = "load_dependent_friction"
    sentence = "friction grows by {mu} of the torque that the gear transmits"
    mjcf = "none: frictionloss is set step by step from the current and the load"
    apart = (
        "grows with the motor's torque; position_dependent_friction changes with the place, stribeck with speed alone"
    )
    parameters = (
        Parameter("mu", "ratio", "share of the transmitted torque lost to friction", upper=1.8),
        Parameter("half", "torque", "torque at the rudder under which the share is half of that", absent=np.inf),
        Parameter(
            "side",
            "ratio",
            "weight of the load's torque beside the motor's (infinite: the motor's alone)",
            positive=False,
            lower=0.0,
            upper=1.0,
            absent=np.inf,
        ),
        Parameter("mu_s", "ratio", "how much larger the share is at rest", upper=0.9, absent=np.inf),
        Parameter("w_s", "speed", "speed at which 1/e of that is left", absent=np.inf),
    )
    follows_current = True
    parts_damping = True
    sized, tries, needs, together = 1, 2, (("mu",),), (("mu_s", "w_s"),)

    def starts(self, scales):
        """By the motor's torque, and by both sides' where the load has a torque of its own."""
        motor, both = np.array([0.05, *4 * [np.inf]]), np.array([0.1, np.inf, 0.5, np.inf, np.inf])
        return [motor, both] if scales.is_held else [motor]

    def grown(self, name, p, scales):
        """From one share of the motor's torque: of what both sides make of it; half of the share under as much as
        friction holds at rest. From one of both sides: a larger share at rest.
        """
        if name != self.name or np.isfinite(p[1]) or np.isfinite(p[3]):
            return []
        if np.isfinite(p[2]):
            return [np.array([p[0], np.inf, p[2], 0.5 * p[0], 0.1 * scales.speed])]
        return [
            np.array([1.5 * p[0], np.inf, 0.5, np.inf, np.inf]),
            np.array([1.3 * p[0], 0.3 * scales.acceleration, *3 * [np.inf]]),
        ]

    def constants(self, p, c):
        half, side, more = (x if np.isfinite(x) else 0.0 for x in p[1:4])
        slow = 1.0 / p[4] ** 2 if np.isfinite(p[4]) else 0.0
        return np.array(
            [p[0], half, side, more, slow, c.bias + c.a_1 * c.theta_0, c.a_1, c.c_1, c.theta_0, c.g_s, c.g_c]
        )

    @law
    def friction(p, level, theta, w, j, direction):
        push = abs(j)
        if p[2] > 0.0:
            held = p[5] - p[6] * theta - p[9] * math.sin(theta) - p[10] * math.cos(theta)
            if p[7] > 0.0:
                held -= math.copysign(p[7], theta - p[8])
            push = abs((1.0 - p[2]) * j - p[2] * held)
        if push <= 0.0:
            return level
        share = p[0] * push / (push + p[1])
        if p[3] > 0.0:
            share += p[3] * math.exp(-p[4] * w * w)
        return level + share * push

    def describe(self, values):
        carried = "" if values["side"] == "none" else ", of which the load's side makes {side}".format(**values)
        under = "" if values["half"] == "none" else f", and by half of that under {values['half']}"
        slow = "" if values["mu_s"] == "none" else f", by {values['mu_s']} more at rest (below {values['w_s']})"
        return super().describe(values) + carried + under + slow
