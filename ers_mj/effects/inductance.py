"""Motor current that needs time to build up."""

import numpy as np

from ers_mj.effects.base import Drive, Parameter


class Inductance(Drive):
    """Eq. (1)'s L i' = u - R i - K_e w_m, where the datasheet has none, or more of it than the datasheet says."""

    name = "inductance"
    sentence = "the motor current lags by an extra {tau_L}, more winding inductance than the datasheet has"
    mjcf = "the inductance of the dcmotor"
    parameters = (Parameter("tau_L", "time", "electrical time constant beyond the baseline's"),)
    absorbs = ("tau_e",)
    sized = 1

    def starts(self, scales):
        return [np.array([times * scales.sample_time]) for times in (2.0, 5.0)]

    def coefficients(self, p, c):
        return c._replace(tau_e=c.tau_e + p[0])
