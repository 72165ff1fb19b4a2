"""A supply that gives way under load."""

import math

import numpy as np

from ers_mj.effects.base import Drive, Parameter, law, recursive


class SupplySag(Drive):
    """A source of resistance R_s behind a bridge of duty d = u / V_0, which draws d times the motor's current: the
    motor sees d (V_0 - R_s d i), so that its current is that of a winding R (1 + (R_s / R) d^2), with bridge (u /
    u_most)^2 for that share. A source that carries the whole current of the motor makes it R (1 + (R_s / R) |d|), with
    whole |u / u_most|. Where the supply was measured, the motor sees u (1 + measured (v / V_m - 1)) of a supply v: all
    of its changes (1), or none where u is already what the terminals saw. Behind a capacitor the voltage follows what
    is drawn with the time constant T_c. The command is recovered as u = (j + a_emf w) / b.
    """

    name = "supply_sag"
    sentence = (
        "the supply sags under load: as if the motor's resistance were higher by {share} of itself at a command of"
        " {u_most}"
    )
    mjcf = "none: the torque is set step by step from speed and current"
    apart = "loss grows with current and with the command; thermal_drift needs seconds, a current_limit has an edge"
    parameters = (
        Parameter(
            "bridge",
            "ratio",
            "source resistance over the motor's at the largest input, of a bridge that draws its duty's share of the"
            " current",
            absent=np.inf,
        ),
        Parameter("whole", "ratio", "the same of a source that carries the whole current of the motor", absent=np.inf),
        Parameter(
            "measured",
            "ratio",
            "share of the measured supply's changes that the motor sees",
            upper=2.0,
            absent=np.inf,
            recorded=True,
        ),
        Parameter("T_c", "time", "time constant of the supply's capacitor", lower=0.005, upper=10.0, absent=np.inf),
        Parameter("u_most", "input", "largest input, 24 where it is not told", fitted=False, absent=24.0),
        Parameter("V_m", "supply", "median of the measured supply, 24 where it is not told", fitted=False, absent=24.0),
    )
    needs = (("bridge", "whole", "measured"),)
    sized, tries = 3, 4
    parts_damping = True

    def starts(self, scales):
        drawn = [
            np.array([*shares, np.inf, T_c, scales.input, 24.0])
            for T_c in (np.inf, 0.1)
            for shares in ((0.2, np.inf), (np.inf, 0.2))
        ]
        return (
            drawn + [np.array([np.inf, np.inf, 0.5, np.inf, scales.input, scales.supply])] if scales.supply else drawn
        )

    def grown(self, name, p, scales):
        """Behind a capacitor, from a source without one."""
        if name != self.name or np.isfinite(p[3]) or np.isfinite(p[2]):
            return []
        return [np.array([*p[:3], 0.02, *p[4:]])]

    def fed(self, p, u, supply):
        return u * (1.0 + p[2] * (supply / p[5] - 1.0)) if np.isfinite(p[2]) else u

    def constants(self, p, c):
        bridge, whole = (share if np.isfinite(share) else 0.0 for share in p[:2])
        most = abs(c.b) * p[4]
        return np.array([bridge / most**2, whole / most, c.a_emf, p[3] if np.isfinite(p[3]) else 0.0, 0.0])

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
        return j - asked * recursive(
            np.append(1.0, decay - (1.0 - decay) * back[:-1]), np.append(0.0, (1.0 - decay) * most[:-1])
        )

    def supply_left(self, p, c, t, motion, j):
        return self.winding(p, c, t, motion, j) / np.where(j == 0.0, 1.0, j)

    def describe(self, values):
        if values["measured"] != "none":
            return (
                f"the supply varies and the drive does not make up for it: the motor sees {values['measured']} of each"
                " of its measured changes"
            )
        share = values["whole"] if values["bridge"] == "none" else values["bridge"]
        return self.sentence.format(share=share, u_most=values["u_most"]) + (
            f", {values['T_c']} after it is drawn" if values["T_c"] != "none" else ""
        )
