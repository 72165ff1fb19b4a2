"""A motor whose torque is not in proportion to its current."""

import numpy as np

from ers_mj.effects.base import Drive, Parameter, law


class TorqueSaturation(Drive):
    """j / (1 + fall (j / j_peak)^2) in place of the drive acceleration j: iron that saturates. j_peak is that of a
    standstill under the input u.
    """

    name = "torque_saturation"
    named = False
    sentence = "a torque that is not in proportion to the current"
    mjcf = "none: the torque is set step by step from the current"
    apart = "bends the torque over the current smoothly; a limit has an edge, a sag depends on the command too"
    parameters = (
        Parameter("fall", "ratio", "loss at the peak over what is left there", positive=False, lower=-0.9, upper=20.0),
        Parameter("u", "input", "largest input, 24 where it is not told", fitted=False, absent=24.0),
    )
    needs = (("fall",),)
    sized = 1

    def starts(self, scales):
        return [np.array([0.1, scales.input])]

    def constants(self, p, c):
        return np.array([p[0], abs(c.b) * p[1], 0.0, 0.0, 0.0])

    @law
    def torque(p, theta, w, j, t):
        loss = max(p[0] * (j / p[1]) ** 2, -0.5)
        return -j * loss / (1.0 + loss)
