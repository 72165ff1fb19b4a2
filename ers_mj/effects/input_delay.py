"""A command that arrives late."""

import numpy as np

from ers_mj.effects.base import Drive, Parameter


class InputDelay(Drive):
    """The terminals see u(t - T_d); a fraction of a sample is switched inside the sample."""

    name = "input_delay"
    sentence = "the command reaches the motor {T_d} late"
    mjcf = "the delay of the motor actuator"
    apart = (
        "moves the whole response by one time; inductance rounds it, and a sensor's lag also shifts when sticking "
        "is seen"
    )
    parameters = (Parameter("T_d", "time", "dead time of the command"),)
    sized = 1
    tangible = False
    in_loop = ("tau_s", "dead_time_s")
    loop_sentence = "the servo answers its command {value} late"

    def starts(self, scales):
        return [np.array([2 * scales.sample_time])]

    def dead_time(self, p):
        return float(p[0])

    def coefficients(self, p, c):
        return c._replace(delay=c.delay + p[0])
