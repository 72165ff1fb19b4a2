"""A drive that limits its current."""

import numpy as np

from ers_mj.effects.base import Drive, Parameter, law


class CurrentLimit(Drive):
    """The motor's torque at the output, n K_t i, stays within +-tau_max, or exceeds it by the share ``beyond`` of what
    it would without a limit: a drive that takes voltage back in proportion to the excess (foldback). The limiter is
    faster than the winding.
    """

    name = "current_limit"
    sentence = "the drive limits its current: the motor gives no more than {tau_max} at the rudder"
    mjcf = "the forcerange of the motor (the saturation of a dcmotor); beyond it, set step by step by the load actuator"
    apart = (
        "clips torque, so it bites at starts and reversals where the back-EMF is small; a voltage limit bites on "
        "the command alone"
    )
    parameters = (
        Parameter("tau_max", "torque", "largest motor torque n K_t i at the output", absent=np.inf),
        Parameter(
            "beyond",
            "ratio",
            "share of the excess that still flows (infinite: none)",
            lower=0.002,
            upper=0.9,
            absent=np.inf,
        ),
    )
    needs, follows_current = (("tau_max",),), True
    in_loop = ("most",)
    loop_sentence = "the servo limits its current: its motor gives {value} at most"
    parts_damping = True

    def starts(self, scales):
        peak = scales.drive or 4.0 * scales.acceleration
        return [np.array([part * peak, np.inf]) for part in (0.94, 0.86, 0.7, 0.5)]

    def grown(self, name, p, scales):
        """A drive that takes voltage back, a tenth of the excess still flowing, from one that clamps."""
        return [np.array([p[0], 0.1])] if name == self.name and not np.isfinite(p[1]) else []

    def constants(self, p, c):
        return np.array([p[0], p[1] if np.isfinite(p[1]) else 0.0])

    @law
    def torque(p, theta, w, j, t):
        return (1.0 - p[1]) * (min(max(j, -p[0]), p[0]) - j)

    def winding(self, p, c, t, motion, j):
        limited = np.clip(j, -p[0], p[0])
        return limited if not np.isfinite(p[1]) else limited + p[1] * (j - limited)

    def edit_spec(self, p, c, twin):
        if p[1] > 0.0:
            return False
        if np.isfinite(p[0]):
            most = p[0] / twin.ampere
            twin.spec.actuator("motor").forcerange = [-most, most]
        return True
