"""A knock: a torque that comes once and goes again."""

import numpy as np

from ers_mj.effects.base import Load, Parameter, law

EDGE = 0.005  # [s] over which the torque rises and falls


class LoadDisturbance(Load):
    """theta'' += A / J from t_0 for ``width``, with edges of 5 ms, in one recording only. t counts on the recording's own clock."""

    name = "load_disturbance"
    sentence = "in one recording a load of {A} acts from {t_0} for {width}"
    mjcf = "none: the ctrl of the load actuator is set step by step from the clock"
    parameters = (
        Parameter("A", "torque", "torque of the knock", positive=False, per_record=True),
        Parameter("t_0", "time", "when it begins", positive=False, per_record=True),
        Parameter("width", "time", "how long it lasts", lower=2 * EDGE, upper=10.0, absent=0.1, per_record=True),
        Parameter("record", "count", "recording in which it acts, from 0", positive=False, fitted=False),
    )
    needs = (("A",),)
    tries = 3

    def starts(self, scales):
        """Around each hot span: pushes either way, up to four times what friction holds (a preload holds as much), begun somewhat before it or in it."""
        return [np.array([size * scales.acceleration, begin + later, length, record]) for record, begin, length in scales.hot
                for later in (-0.1, -0.05, 0.0, 0.05, 0.1, 0.15, 0.2) for size in (-4.0, -2.5, -1.0, -0.3, -0.1, -0.03, 0.03, 0.1, 0.3, 1.0, 2.5, 4.0)]

    def constants(self, p, c):
        return p[:3]

    @law
    def torque(p, theta, w, j, t):
        rise = min((t - p[1]) / EDGE, (p[1] + p[2] - t) / EDGE)
        return p[0] * min(max(rise, 0.0), 1.0)
