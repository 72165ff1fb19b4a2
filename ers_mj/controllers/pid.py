"""The paper's PID."""

from __future__ import annotations

from ers_mj.controllers.base import Controller, State

P, I, D = 5.0, 1.2, 0.1  # [V/deg], [V/(deg s)], [V s/deg] for Table 1's servo; in V/rad the rudder would never break away


class Pid(Controller):
    """Eq. (38) with the signs that stabilise: u = 5 x2 + 1.2 x1 + 0.1 x3 + tau_fa + tau_spa, errors in degrees.

    As printed, with minus signs and x2 = theta_r - theta, it feeds back positively. tau_fa and tau_spa are friction, spring and preload in volts.
    """

    name = "pid"
    sentence = "PID of (38), with friction and spring compensated"

    def law(self, s: State) -> float:
        compensation = self.servo.spring(s.theta) + self.servo.friction(s.omega, s.x2)
        return self.servo.printed_gain * (P * s.x2 + I * s.x1 + D * s.x3) + compensation / self.servo.b
