"""A drive that gives no more than its supply."""

import numpy as np

from ers_mj.effects.base import Drive, Parameter


class VoltageSaturation(Drive):
    """The terminals see the command clipped at +-u_max."""

    name = "voltage_saturation"
    sentence = "the drive gives no more than {u_max}, whatever is commanded"
    mjcf = "the ctrlrange of the motor"
    parameters = (Parameter("u_max", "input", "largest input that reaches the motor", absent=np.inf),)

    tries = 2

    def starts(self, scales):
        return [np.array([part * scales.input]) for part in (0.95, 0.8)]

    def command(self, p, u):
        return np.clip(u, -p[0], p[0])

    def edit_spec(self, p, c, twin):
        if np.isfinite(p[0]):
            twin.spec.actuator("motor").ctrlrange = [-p[0], p[0]]
        return True
