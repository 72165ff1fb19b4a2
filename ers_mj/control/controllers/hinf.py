"""The paper's H-infinity controller."""

from __future__ import annotations

import math

from ers_mj.control.controllers.base import Controller, State


class HInf(Controller):
    """Eq. (39) with the signs that stabilise: u = 0.15 theta_r'' + 0.5 w + 14 x2 + 0.6 x3, feedback in degrees.

    It has neither integral nor friction compensation: what holds the rudder is paid in error. Its acceleration term is
    taken in radians, the smaller reading, and is still twelve times what the plant needs. The paper gives the law
    alone, not the synthesis behind it.

    Attributes:
        error, rate, speed: gains on x2 [V/deg], on x3 and on w [V s/deg], for Table 1's servo.
        alpha: gain on theta_r'' [V s^2/rad].
    """

    name = "hinf"
    sentence = "H-infinity law of (39)"
    error, rate, speed, alpha = 14.0, 0.6, 0.5, 0.15

    @classmethod
    def told_gains(cls, servo) -> dict[str, float]:
        told = {"error": cls.error, "rate": cls.rate, "speed": cls.speed, "alpha": cls.alpha}
        return told | {"all times": servo.printed_gain / math.degrees(1.0)}

    def law(self, s: State) -> float:
        feedback = self.error * s.x2 + self.rate * s.x3
        return self.servo.printed_gain * (
            feedback + self.speed * s.omega + self.alpha * s.aim.alpha / math.degrees(1.0)
        )
