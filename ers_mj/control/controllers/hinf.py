"""The paper's H-infinity controller."""

from __future__ import annotations

import math

from ers_mj.control.controllers.base import Controller, State

P, D, SPEED = 14.0, 0.6, 0.5  # [V/deg], [V s/deg], [V s/deg] for Table 1's servo
ALPHA = 0.15  # [V s^2/rad], twelve times 1/b of Table 1


class HInf(Controller):
    """Eq. (39) with the signs that stabilise: u = 0.15 theta_r'' + 0.5 w + 14 x2 + 0.6 x3, feedback in degrees.

    It has neither integral nor friction compensation: what holds the rudder is paid in error. Its acceleration term is
    taken in radians, the smaller reading, and is still twelve times what the plant needs. The paper gives the law
    alone, not the synthesis behind it.
    """

    name = "hinf"
    sentence = "H-infinity law of (39)"

    def law(self, s: State) -> float:
        gain = self.servo.printed_gain
        return gain * (P * s.x2 + D * s.x3 + SPEED * s.omega + ALPHA * s.aim.alpha / math.degrees(1.0))
