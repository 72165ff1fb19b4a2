"""What no effect explains, as a torque that depends on the place: a table."""

import numpy as np

from ers_mj.effects.base import Load, Parameter, law

KNOTS = 9


class UnexplainedTorque(Load):
    """theta'' += T(theta) / J, T by straight lines between T_0 at ``low`` and T_8 at ``low`` + 8 ``pitch``, level
    beyond: what keeps its sign when the motion turns.
    """

    name = "unexplained_torque"
    named, tabled = False, True
    sentence = "a torque that changes along the travel, of unknown origin"
    mjcf = "none: the torque is set step by step from the angle"
    apart = "a table, which says nothing of what makes it; cogging and a cubic moment have a shape"
    parameters = (
        Parameter("low", "position", "angle of the first entry", positive=False, fitted=False),
        Parameter("pitch", "position", "angle between two entries", fitted=False, absent=1.0),
        *(Parameter(f"T_{k}", "torque", f"entry {k} of the table", positive=False) for k in range(KNOTS)),
    )

    def starts(self, scales):
        return []

    def blank(self, scales):
        return np.array([scales.low, (scales.high - scales.low) / (KNOTS - 1), *np.zeros(KNOTS)])

    @law
    def torque(p, theta, w, j, t):
        x = min(max((theta - p[0]) / p[1], 0.0), 8.0)
        k = 0
        while k < 7 and x >= k + 1:
            k += 1
        return p[k + 2] + (x - k) * (p[k + 3] - p[k + 2])
