"""What no effect explains, as a friction that depends on the place: a table."""

import numpy as np

from ers_mj.effects.base import Friction, Parameter, law

KNOTS = 9


class UnexplainedFriction(Friction):
    """F(theta) = F_c + dF(theta), dF by straight lines between dF_0 at ``low`` and dF_8 at ``low`` + 8 ``pitch``, level
    beyond: what turns with the motion.
    """

    name = "unexplained_friction"
    named, tabled = False, True
    sentence = "a friction that changes along the travel, of unknown origin"
    mjcf = "none: frictionloss is set step by step from the angle"
    apart = "a table, which says nothing of what makes it; position_dependent_friction has a shape"
    parameters = (
        Parameter("low", "position", "angle of the first entry", positive=False, fitted=False),
        Parameter("pitch", "position", "angle between two entries", fitted=False, absent=1.0),
        *(Parameter(f"dF_{k}", "torque", f"entry {k} of the table", positive=False) for k in range(KNOTS)),
    )

    def starts(self, scales):
        return []

    def blank(self, scales):
        return np.array([scales.low, (scales.high - scales.low) / (KNOTS - 1), *np.zeros(KNOTS)])

    @law
    def friction(p, level, theta, w, j, direction):
        x = min(max((theta - p[0]) / p[1], 0.0), 8.0)
        k = 0
        while k < 7 and x >= k + 1:
            k += 1
        return max(level + p[k + 2] + (x - k) * (p[k + 3] - p[k + 2]), 0.0)
