"""A sensor, or its wire, that loses samples."""

import numpy as np

from ers_mj.effects.base import Parameter, Sensor


class SensorDropout(Sensor):
    """The last reading is held for ``duration``, ``rate`` times a second at random. Found in the data itself, not by a
    fit.
    """

    name = "sensor_dropout"
    sentence = "the sensor drops out at random, at {rate}, for {duration} on average"
    mjcf = "none: readings are held after the simulation"
    apart = "the same reading held while the motion goes on; seen in the data itself, before any fit"
    tangible, after_noise, holds = False, True, True
    parameters = (
        Parameter("rate", "frequency", "dropouts in a second"),
        Parameter("duration", "time", "mean length of a dropout"),
    )

    def starts(self, scales):
        return []

    def symptom(self, seen, policy):
        if seen.dropouts.size < policy.fewest_dropouts:
            return None
        return np.array([seen.dropouts.size / seen.seconds, np.mean(seen.dropouts)])

    def measure(self, p, t, y):
        """The instants and lengths are the same at every call."""
        random = np.random.default_rng(0)
        begins = t[0] + np.cumsum(random.exponential(1.0 / p[0], max(1, int(4 * p[0] * (t[-1] - t[0])) + 20)))
        held = np.arange(t.size)
        for begin, length in zip(begins, random.exponential(p[1], begins.size)):
            first, last = np.searchsorted(t, (begin, begin + length))
            held[first:last] = max(first - 1, 0)
        return y[held]
