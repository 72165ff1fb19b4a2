"""A gear that does not turn evenly: its ratio swings, or its torque does."""

import math

import numpy as np

from ers_mj.effects.base import RETURNS, Parameter, Transmission, law
from ers_mj.errors import InputError

ORDERS = range(
    1, 13
)  # periods within the travel from which a fit is begun: slower than cogging, of which poles make many a turn


class TransmissionRipple(Transmission):
    """r = 1 + ripple s, s = sin x + second sin(2 x + phase_2), x = 2 pi theta / period + phase: an eccentric gear, a
    bent screw, a strain wave. Or, whatever the load, theta'' += A s / J: teeth that grind.

    The motor's torque at the rudder is r times, its back-EMF r times the mean ratio's; the change of the reflected
    inertia, and with inductance the current's delay behind the changed back-EMF, are left out. A torque that waves with
    the angle is this one's where it is too slow for a motor's cogging (``Scales.cog``), which without a known gear it
    never is.
    """

    name = "transmission_ripple"
    sentence = "the gear ratio swings by an amplitude of {ripple} of itself every {period} of the rudder's angle"
    mjcf = "none: the torque is set step by step from angle, speed and current"
    apart = (
        "returns with the angle, slower than a motor's poles; its ratio form grows with the motor's torque and "
        "vanishes without current, which cogging does not"
    )
    parameters = (
        Parameter("ripple", "ratio", "amplitude over the mean ratio", positive=False, lower=-0.9, upper=0.9),
        Parameter("period", "position", "period, seen at the output"),
        Parameter("phase", "phase", "phase of the sine at angle zero", positive=False),
        Parameter(
            "A",
            "torque",
            "amplitude, seen at the output, of a torque instead of a ratio",
            positive=False,
            absent=np.inf,
        ),
        Parameter(
            "second",
            "ratio",
            "second harmonic over the first",
            positive=False,
            lower=-2.0,
            upper=2.0,
            absent=np.inf,
        ),
        Parameter("phase_2", "phase", "phase of the second harmonic against the first", positive=False, absent=np.inf),
    )
    needs, together = (("ripple", "A"),), (("second", "phase_2"),)
    sized, tries, fewest_turns = 1, 3, RETURNS
    wave = ((0, 3), 2)

    def starts(self, scales):
        periods = [(scales.high - scales.low) / order for order in ORDERS]
        periods += scales.finer_waves("torque", ORDERS[-1])
        return [
            *(np.array([0.05, period, 0.0, np.inf, np.inf, np.inf]) for period in periods),
            *(
                np.array([np.inf, period, 0.0, 0.2 * scales.acceleration, np.inf, np.inf])
                for period in periods
                if period > scales.cog
            ),
        ]

    def grown(self, name, p, scales):
        """From a plain sine: with a second harmonic, where a whole period is seen: less of five numbers stands for any
        smooth torque.
        """
        plain = name == self.name and not np.isfinite(p[4]) and p[1] <= scales.high - scales.low
        return [np.array([*p[:4], 0.1, phase]) for phase in (0.0, 0.5 * np.pi)] if plain else []

    def constants(self, p, c):
        second = p[4:] if np.isfinite(p[4]) else (0.0, 0.0)
        if not np.isfinite(p[3]):
            return np.array([p[0], 2 * np.pi / p[1], p[2], *second, c.a_emf, 1.0])
        if np.isfinite(p[0]) and p[0] != 0.0:
            raise InputError(f"{self.name}: ripple and A are both given, one of them was expected")
        return np.array([p[3], 2 * np.pi / p[1], p[2], *second, 0.0, 0.0])

    @law
    def torque(p, theta, w, j, t):
        x = p[1] * theta + p[2]
        swing = p[0] * (math.sin(x) + p[3] * math.sin(2.0 * x + p[4]))
        if p[6] == 0.0:
            return swing
        if j == 0.0:  # an open circuit
            return 0.0
        return swing * (j - (1.0 + swing) * p[5] * w)

    def describe(self, values):
        if values["A"] == "none":
            return super().describe(values)
        return (
            f"the gear does not turn evenly: a torque of amplitude {values['A']} at the rudder that returns every"
            f" {values['period']} of its angle"
        )
