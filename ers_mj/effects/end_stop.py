"""Stops that end the travel."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ers_mj.effects.base import Load, Parameter


class EndStop(Load):
    """Stiff spring-dampers beyond ``lower`` and ``upper``; their natural frequency is f_stop (against J)."""

    name = "end_stop"
    sentence = "the travel ends at a stop"
    mjcf = "the range of the absolute angle, its limit a spring-damper (negative solref) that does not pull"
    apart = "stiff, at the end of the travel only; a cubic moment grows from the rest angle on"
    parameters = (
        Parameter("lower", "position", "lower stop", positive=False, absent=-np.inf, on_travel=True),
        Parameter("upper", "position", "upper stop", positive=False, absent=np.inf, on_travel=True),
        Parameter("f_stop", "frequency", "natural frequency of the contact", lower=10.0, upper=400.0, absent=100.0),
        Parameter("zeta", "ratio", "damping ratio of the contact", lower=0.02, upper=2.0, absent=0.3),
    )
    needs = (("lower", "upper"),)
    by_lightness: ClassVar[Mapping[str, float]] = {"f_stop": 0.5, "zeta": 0.5}
    tries, tangible = 3, False

    def starts(self, scales):
        inset = 0.0005 * (scales.high - scales.low)  # from further within what was reached a fit runs outwards
        low, high = scales.low + inset, scales.high - inset
        frequency = min(100.0, 0.2 / scales.sample_time)
        ends = ((low, np.inf), (-np.inf, high), (low, high))
        return [np.array([lower, upper, frequency, 0.3]) for lower, upper in ends]

    def sizes(self, p):
        return []  # a place is none

    def scaffold(self, scales, sprung):
        return self.starts(scales)[-1]

    def describe(self, values):
        ends = [f"the {end} one at {values[end]}" for end in ("lower", "upper") if values[end] != "none"]
        return f"the travel ends at a stop, {' and '.join(ends)}" if ends else self.sentence

    def coefficients(self, p, c):
        contact = 2 * np.pi * p[2]
        return c._replace(lower=p[0], upper=p[1], k_stop=contact**2, d_stop=2 * p[3] * contact)
