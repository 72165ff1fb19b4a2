"""The fair rival of the finite-time law: the paper's PID with the same feed-forward."""

from __future__ import annotations

from ers_mj.control.controllers.base import State
from ers_mj.control.controllers.pid import Pid


class PidFf(Pid):
    """Eq. (38)'s PID beside the feed-forward of ``ftrc``: theta_r'', spring, preload, damping and friction."""

    name = "pid-ff"
    sentence = "PID of (38) with the feed-forward of ftrc"

    def law(self, s: State) -> float:
        return self.feedback(s) + self.servo.feed_forward(s) / self.servo.b
