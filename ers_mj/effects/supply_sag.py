"""A supply that gives way under load."""

import math

import numpy as np

from ers_mj.effects.base import Drive, Parameter, law, recursive


class SupplySag(Drive):
    """A source of resistance R_s behind a bridge of duty d = u / V_0, which draws d times the motor's current: the motor sees d (V_0 - R_s d i), so
    that its current is that of a winding R (1 + (R_s / R) d^2), with bridge (u / u_most)^2 for that share. A source that carries the whole current
    of the motor makes it R (1 + (R_s / R) |d|), with whole |u / u_most|. Behind a capacitor the voltage follows what is drawn with the time constant
    T_c. The command is recovered as u = (j + a_emf w) / b.
    """

    name = "supply_sag"
    sentence = "the supply sags under load: as if the motor's resistance were higher by {share} of itself at a command of {u_most}"
    mjcf = "none: the torque is set step by step from speed and current"
    parameters = (
        Parameter("bridge", "ratio", "source resistance over the motor's at the largest input, of a bridge that draws its duty's share of the current", absent=np.inf),
        Parameter("whole", "ratio", "the same of a source that carries the whole current of the motor", absent=np.inf),
        Parameter("T_c", "time", "time constant of the supply's capacitor", lower=0.005, upper=10.0, absent=np.inf),
        Parameter("u_most", "input", "largest input, 24 where it is not told", fitted=False, absent=24.0),
    )
    sized, tries = 2, 4

    def starts(self, scales):
        return [np.array([*shares, T_c, scales.input]) for T_c in (np.inf, 0.1) for shares in ((0.2, np.inf), (np.inf, 0.2))]

    def constants(self, p, c):
        bridge, whole = (share if np.isfinite(share) else 0.0 for share in p[:2])
        most = abs(c.b) * p[3]
        return np.array([bridge / most**2, whole / most, c.a_emf, p[2] if np.isfinite(p[2]) else 0.0, 0.0])

    @law
    def memory(p, theta, w, j, h):
        """The share of the supply's voltage that is missing."""
        if p[3] == 0.0:
            return 0.0
        asked = j + p[2] * w
        got = j - asked * p[4]
        missing = p[0] * max(asked * got, 0.0) + p[1] * abs(got)
        return missing + (p[4] - missing) * math.exp(-h / p[3])

    @law
    def torque(p, theta, w, j, t):
        asked = j + p[2] * w
        if p[3] > 0.0:
            return -asked * p[4]
        sag = p[0] * asked * asked + p[1] * abs(asked)
        return -j * sag / (1.0 + sag)

    def winding(self, p, c, t, motion, j):
        bridge, whole, a_emf, T_c, _ = self.constants(p, c)
        asked, drawn = motion[:, 2] + a_emf * motion[:, 1], motion[:, 2]
        if T_c == 0.0:
            return j / (1.0 + bridge * asked**2 + whole * np.abs(asked))
        way, decay = np.sign(drawn * asked), np.exp(-np.diff(t) / T_c)  # a sag turns no current round
        most = bridge * np.maximum(drawn * asked, 0.0) + whole * np.abs(drawn)
        back = bridge * np.where(way > 0, asked**2, 0.0) + whole * way * np.abs(asked)
        return j - asked * recursive(np.append(1.0, decay - (1.0 - decay) * back[:-1]), np.append(0.0, (1.0 - decay) * most[:-1]))

    def describe(self, values):
        share = values["whole"] if values["bridge"] == "none" else values["bridge"]
        return self.sentence.format(share=share, u_most=values["u_most"]) + (f", {values['T_c']} after it is drawn" if values["T_c"] != "none" else "")
