"""The fair rival of the finite-time law: the paper's PID with the same feed-forward."""

from __future__ import annotations

from ers_mj.controllers.base import Controller, State
from ers_mj.controllers.pid import D, I, P


class PidFf(Controller):
    """Eq. (38)'s PID beside the feed-forward of ``ftrc``: theta_r'', spring, preload, damping and friction."""

    name = "pid-ff"
    sentence = "PID of (38) with the feed-forward of ftrc"

    def law(self, s: State) -> float:
        return self.servo.printed_gain * (P * s.x2 + I * s.x1 + D * s.x3) + self.servo.feed_forward(s) / self.servo.b
