"""Motor current that needs time to build up."""

import numpy as np

from ers_mj.effects.base import Drive, Parameter


class Inductance(Drive):
    """Eq. (1)'s L i' = u - R i - K_e w_m, where the datasheet has none, or more of it than the datasheet says.

    Iron saturates: the whole inductance is L / (1 + (i / i_2)^2), half of it at the current i_2, told as the torque
    that this one makes at the rudder, and LEAST_IRON of it at the least.
    """

    name = "inductance"
    sentence = "the motor current lags by an extra {tau_L}: winding inductance that no datasheet told"
    mjcf = "the inductance of the dcmotor; where it falls with the current it is set step by step"
    apart = (
        "delays torque only, by a first-order lag that the motion smooths; input_delay moves everything by one "
        "time, sensor_lag delays the reading and not the motion"
    )
    parameters = (
        # no sample tells a shorter one from none, and to simulate it takes as much longer as it is shorter
        Parameter("tau_L", "time", "electrical time constant beyond the baseline's", lower=2e-5),
        Parameter(
            "half",
            "torque",
            "torque at the rudder under whose current the inductance is half (infinite: it does not fall)",
            absent=np.inf,
        ),
    )
    needs = (("tau_L",),)
    absorbs = ("tau_e",)
    sized = 1
    tangible = False
    parts_damping = True

    def starts(self, scales):
        return [np.array([times * scales.sample_time, np.inf]) for times in (2.0, 5.0)]

    def grown(self, name, p, scales):
        """One that falls with the current, from one that does not."""
        return (
            [np.array([p[0], 1.5 * (scales.drive or scales.acceleration)])]
            if name == self.name and not np.isfinite(p[1])
            else []
        )

    def describe(self, values):
        falls = (
            ""
            if values["half"] == "none"
            else f"; it falls with the current, to half where that makes a torque of {values['half']}"
        )
        return super().describe(values) + falls

    def coefficients(self, p, c):
        return c._replace(tau_e=c.tau_e + p[0], fall=1.0 / p[1] if np.isfinite(p[1]) else 0.0)
