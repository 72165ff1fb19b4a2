"""A sensor that counts in coarse steps."""

import numpy as np

from ers_mj.effects.base import Parameter, Sensor

WHOLE = 1e-3  # bits from a whole number, within which the step of an encoder is read from rounded numbers


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
        fine for the travel. An encoder that divides a turn by a power of two is ordinary from so many bits on.
        """
        ordinary = max(policy.ordinary_step, policy.fine_step * seen.travel)
        step = float(np.median(seen.quanta))
        bits = np.log2(2.0 * np.pi / step) if step > 0.0 else 0.0
        is_encoder = bits > policy.ordinary_bits - WHOLE and abs(bits - np.round(bits)) < WHOLE
        is_unusual = seen.is_angle and step > ordinary and not is_encoder
        is_coarse = np.max(seen.quanta) > policy.coarse_step * seen.travel
        return np.array([np.max(seen.quanta)]) if is_coarse or is_unusual else None

    def measure(self, p, t, y):
        return np.round(y / p[0]) * p[0]
