"""What no effect explains, as a friction that depends on speed and direction: a table."""

import numpy as np

from ers_mj.effects.base import Friction, Parameter, law

KNOTS = 5


class UnexplainedDrag(Friction):
    """F(w) = F_c + dF(w), dF by straight lines between five entries at (k / 4)^2 of the speed ``top``, level beyond,
    one set for either direction.
    """

    name = "unexplained_drag"
    named, tabled = False, True
    sentence = "a friction that changes with speed and direction, of unknown origin"
    mjcf = "none: frictionloss is set step by step from the speed"
    apart = "a table, which says nothing of what makes it; stribeck, drag and asymmetric friction have a shape"
    parameters = (
        Parameter("top", "speed", "speed of the last entry", fitted=False, absent=1.0),
        *(Parameter(f"up_{k}", "torque", f"entry {k} of the table of w > 0", positive=False) for k in range(KNOTS)),
        *(Parameter(f"down_{k}", "torque", f"entry {k} of the table of w < 0", positive=False) for k in range(KNOTS)),
    )

    def starts(self, scales):
        return []

    def blank(self, scales):
        return np.array([scales.speed, *np.zeros(2 * KNOTS)])

    @law
    def friction(p, level, theta, w, j, direction):
        v = min(16.0 * abs(w) / p[0], 16.0)
        k = 0
        while k < 3 and v >= (k + 1) * (k + 1):
            k += 1
        i = k + 1 if direction > 0.0 else k + 6
        return max(level + p[i] + (v - k * k) / (2.0 * k + 1.0) * (p[i + 1] - p[i]), 0.0)
