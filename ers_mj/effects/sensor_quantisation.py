"""A sensor that counts in coarse steps."""

import numpy as np

from ers_mj.effects.base import Parameter, Sensor


class SensorQuantisation(Sensor):
    """The output is rounded to the nearest multiple of ``step``. Found in the data itself, not by a fit."""

    name = "sensor_quantisation"
    sentence = "the sensor counts in steps of {step}"
    mjcf = "none: the reading is rounded after the simulation"
    apart = "readings lie on a grid; seen in the data itself, before any fit"
    tangible, after_noise = False, True
    parameters = (Parameter("step", "position", "one count of the sensor"),)

    def starts(self, scales):
        return []

    def symptom(self, seen, policy):
        """A converter is one where it is coarse for the travel, or coarser than those of rudders' angles are and not
        fine for the travel.
        """
        ordinary = max(policy.ordinary_step, policy.fine_step * seen.travel)
        is_unusual = seen.is_angle and np.median(seen.quanta) > ordinary
        is_coarse = np.max(seen.quanta) > policy.coarse_step * seen.travel
        return np.array([np.max(seen.quanta)]) if is_coarse or is_unusual else None

    def measure(self, p, t, y):
        return np.round(y / p[0]) * p[0]
