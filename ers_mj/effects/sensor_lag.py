"""A sensor that follows late."""

import numpy as np

from ers_mj.effects.base import Parameter, Sensor, recursive

HARDLY = 0.05  # of the dead time, up to which a time constant beside it is none


class SensorLag(Sensor):
    """T y' = theta(t - T_d) - y, settled at the start: a filter in the sensor or its electronics, and a bus that brings
    its reading late.

    Theta is taken as straight between samples.
    """

    name = "sensor_lag"
    sentence = "the sensor lags behind the output by a time constant of {T}"
    mjcf = "none: the reading is filtered after the simulation"
    apart = (
        "the reading creeps on after the rudder has stuck; input_delay and inductance make the motion late, and it"
        " ends at once"
    )
    parameters = (
        Parameter("T", "time", "time constant of the sensor"),
        Parameter("T_d", "time", "dead time of its reading", absent=np.inf),
    )
    sized, needs = 1, (("T", "T_d"),)

    def starts(self, scales):
        return [np.array([2 * scales.sample_time, np.inf])]

    def grown(self, name, p, scales):
        """From a plain lag: with a dead time for a part of it."""
        return (
            [np.array([(1.0 - part) * p[0], part * p[0]]) for part in (0.5, 0.95)]
            if name == self.name and not np.isfinite(p[1])
            else []
        )

    def really(self, p, friction):
        """A dead time beside which there is hardly a lag makes the motion late and nothing else."""
        return "input_delay" if np.isfinite(p[1]) and p[0] < HARDLY * p[1] else self.name

    def remembers(self, p):
        return p[0], p[1] if np.isfinite(p[1]) else 0.0

    def measure(self, p, t, y):
        if np.isfinite(p[1]):
            y = np.interp(t - p[1], t, y)
        ratio = p[0] / float(np.median(np.diff(t)))
        if ratio < 1e-3:
            return y
        decay = np.exp(-1.0 / ratio)
        now, before = 1.0 - ratio * (1.0 - decay), ratio * (1.0 - decay) - decay
        driven = now * (y - y[0])
        driven[1:] += before * (y[:-1] - y[0])
        return recursive(np.full(y.size, decay), driven) + y[0]
