"""A sensor that follows late."""

import numpy as np

from ers_mj.effects.base import Parameter, Sensor, recursive


class SensorLag(Sensor):
    """T y' = theta - y, settled at the start: a filter in the sensor or its electronics. Theta is taken as straight between samples."""

    name = "sensor_lag"
    sentence = "the sensor lags behind the output by a time constant of {T}"
    mjcf = "none: the reading is filtered after the simulation"
    parameters = (Parameter("T", "time", "time constant of the sensor"),)
    sized = 1

    def starts(self, scales):
        return [np.array([2 * scales.sample_time])]

    def measure(self, p, t, y):
        ratio = p[0] / float(np.median(np.diff(t)))
        if ratio < 1e-3:
            return y
        decay = np.exp(-1.0 / ratio)
        now, before = 1.0 - ratio * (1.0 - decay), ratio * (1.0 - decay) - decay
        driven = now * (y - y[0])
        driven[1:] += before * (y[:-1] - y[0])
        return recursive(np.full(y.size, decay), driven) + y[0]
