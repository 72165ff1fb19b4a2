"""A drive that limits its current."""

import numpy as np

from ers_mj.effects.base import Drive, Parameter, law


class CurrentLimit(Drive):
    """The motor's torque at the output, n K_t i, stays within +-tau_max. The limiter is faster than the winding."""

    name = "current_limit"
    sentence = "the drive limits its current: the motor gives no more than {tau_max} at the rudder"
    mjcf = "the forcerange of the motor (the saturation of a dcmotor)"
    parameters = (Parameter("tau_max", "torque", "largest motor torque n K_t i at the output", absent=np.inf),)
    follows_current = True

    def starts(self, scales):
        peak = scales.drive or 4.0 * scales.acceleration
        return [np.array([part * peak]) for part in (0.94, 0.86, 0.7, 0.5)]

    @law
    def torque(p, theta, w, j, t):
        return min(max(j, -p[0]), p[0]) - j

    def winding(self, p, c, t, motion, j):
        return np.clip(j, -p[0], p[0])

    def edit_spec(self, p, c, twin):
        if np.isfinite(p[0]):
            most = p[0] / twin.ampere
            twin.spec.actuator("motor").forcerange = [-most, most]
        return True
