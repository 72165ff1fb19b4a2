"""An impulse disturbance: a torque that comes once and goes again."""

import math

import numpy as np

from ers_mj.effects.base import Load, Parameter, law

EDGE = 0.005  # [s] over which the torque rises and falls
# how much stronger one that fades is begun, and how much shorter its time constant is than the length of one that ends
FADING = 1.5


class LoadDisturbance(Load):
    """theta'' += A / J from t_0 for ``width``, with edges of 5 ms, in one recording only. t counts on the recording's
    own clock. Or it fades from there on with a time constant, ``fade``.
    """

    name = "load_disturbance"
    sentence = "in one recording a load of {A} acts from {t_0} for {width}"
    mjcf = "none: the ctrl of the load actuator is set step by step from the clock"
    apart = "one impulse in one recording at one time; what returns with the angle or the clock is another effect"
    parameters = (
        Parameter("A", "torque", "torque of the impulse", positive=False, per_record=True),
        Parameter("t_0", "time", "when it begins", positive=False, per_record=True),
        Parameter("width", "time", "how long it lasts", lower=2 * EDGE, upper=10.0, absent=np.inf, per_record=True),
        Parameter("record", "count", "recording in which it acts, from 0", positive=False, fitted=False),
        Parameter(
            "fade",
            "time",
            "time constant with which it fades",
            lower=2 * EDGE,
            upper=10.0,
            absent=np.inf,
            per_record=True,
        ),
    )
    needs = (("A",), ("width", "fade"))
    tries = 3

    def starts(self, scales):
        """Those that the recordings ask for, and around each hot span pushes either way, up to four times what friction
        holds (a preload holds as much), begun somewhat before it or in it; long ones fade.
        """
        asked = [self._of(size, begin, length, record, False) for record, begin, length, size in scales.pushed]
        return asked + [
            self._of(
                size * scales.acceleration, begin + later, length, record, length > 0.1
            )  # shorter, it is begun as one that ends
            for record, begin, length in scales.hot
            for later in (-0.1, -0.05, 0.0, 0.05, 0.1, 0.15, 0.2)
            for size in (-4.0, -2.5, -1.0, -0.3, -0.1, -0.03, 0.03, 0.1, 0.3, 1.0, 2.5, 4.0)
        ]

    def grown(self, name, p, scales):
        """From one that ends one that fades, as strong over its time, and the other way round."""
        if name != self.name:
            return []
        fades = np.isfinite(p[4])
        return [self._of(p[0] / FADING if fades else p[0], p[1], p[4] * FADING if fades else p[2], p[3], not fades)]

    @staticmethod
    def _of(size, begin, length, record, fades):
        """A push that ends after a length, or one that fades and is as strong over its time."""
        return np.array(
            [FADING * size, begin, np.inf, record, length / FADING] if fades else [size, begin, length, record, np.inf]
        )

    def constants(self, p, c):
        return np.array([*p[:3], 1.0 / p[4] if np.isfinite(p[4]) else 0.0])

    @law
    def torque(p, theta, w, j, t):
        rise = min((t - p[1]) / EDGE, (p[1] + p[2] - t) / EDGE)
        if rise <= 0.0:
            return 0.0
        return p[0] * min(rise, 1.0) * math.exp(-p[3] * (t - p[1]))

    def describe(self, values):
        if values["fade"] == "none":
            return super().describe(values)
        ends = "" if values["width"] == "none" else f" until it ends after {values['width']}"
        return (
            f"in one recording a load of {values['A']} strikes at {values['t_0']} and fades with a time constant of"
            f" {values['fade']}{ends}"
        )
