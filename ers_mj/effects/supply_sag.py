"""A supply that gives way under load."""

import numpy as np

from ers_mj.effects.base import Drive, Parameter, law


class SupplySag(Drive):
    """A source of resistance R_s behind a bridge of duty d = u / V_0: the motor sees d (V_0 - R_s d i), so that its current is that of a
    winding R (1 + (u / u_half)^2), u_half = V_0 sqrt(R / R_s). The command is recovered as u = (j + a_emf w) / b.
    """

    name = "supply_sag"
    sentence = "the supply sags under load: at a command of {u_half} the motor would get half its current"
    mjcf = "none: the torque is set step by step from speed and current"
    parameters = (Parameter("u_half", "input", "command at which the motor gets half its current", absent=np.inf),)

    def starts(self, scales):
        return [np.array([part * scales.input]) for part in (2.0, 1.0, 4.0)]

    def constants(self, p, c):
        return np.array([1.0 / (c.b * p[0]) ** 2, c.a_emf])

    @law
    def torque(p, theta, w, j, t):
        sag = p[0] * (j + p[1] * w) ** 2
        return -j * sag / (1.0 + sag)

    def winding(self, p, c, t, motion, j):
        return j / (1.0 + ((motion[:, 2] + c.a_emf * motion[:, 1]) / (c.b * p[0])) ** 2)
