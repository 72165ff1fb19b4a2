"""A gear whose ratio swings as it turns."""

import math

import numpy as np

from ers_mj.effects.base import Parameter, Transmission, law

ORDERS = range(1, 13)  # periods within the travel from which a fit is begun: slower than cogging, of which poles make many a turn


class TransmissionRipple(Transmission):
    """r = 1 + ripple sin(2 pi theta / period + phase): an eccentric gear or a bent screw.

    The motor's torque at the rudder is r times, its back-EMF r times the mean ratio's; the change of the reflected inertia, and with
    inductance the current's delay behind the changed back-EMF, are left out.
    """

    name = "transmission_ripple"
    sentence = "the gear ratio swings by an amplitude of {ripple} of itself every {period} of the rudder's angle"
    mjcf = "none: the torque is set step by step from angle, speed and current"
    parameters = (
        Parameter("ripple", "ratio", "amplitude over the mean ratio", positive=False, lower=-0.9, upper=0.9),
        Parameter("period", "position", "period, seen at the output"),
        Parameter("phase", "phase", "phase of the sine at angle zero", positive=False),
    )
    sized, tries = 1, 3
    wave = (0, 2)

    def starts(self, scales):
        travel = scales.high - scales.low
        return [np.array([0.05, travel / order, 0.0]) for order in ORDERS]

    def constants(self, p, c):
        return np.array([p[0], 2 * np.pi / p[1], p[2], c.a_emf])

    @law
    def torque(p, theta, w, j, t):
        if j == 0.0:  # an open circuit
            return 0.0
        swing = p[0] * math.sin(p[1] * theta + p[2])
        return swing * (j - (1.0 + swing) * p[3] * w)
