"""The paper's finite-time robust controller, the law that its proof needs."""

from __future__ import annotations

from ers_mj.control.controllers.base import Controller, State
from ers_mj.control.controllers.finite_time import FiniteTime, Gains


class Ftrc(Controller):
    """u = (1/b) {theta_r'' + a_1 (theta_r - theta_0 - x2) + a_2 (theta_r' - x3) + c_1 Sgn(theta - theta_0) + c_2 Sgn(w)
    + k_3 sig(xi_3, 3q - 2)}.

    (31) as printed leaves out the first five terms, without which (32) does not follow. The friction's sign is
    stick-aware. The paper's adaptive law, which it names and does not give, is not in it.
    """

    name = "ftrc"
    sentence = "finite-time law of the proof (30), with its whole feed-forward"
    takes = "gains"

    def __init__(self, servo, rate_hz, u_max=24.0, *, gains: Gains = Gains(), **options):
        super().__init__(servo, rate_hz, u_max, **options)
        self._feedback = FiniteTime(gains)

    def law(self, s: State) -> float:
        return (self.servo.feed_forward(s) + self._feedback(s.x1, s.x2, s.x3)) / self.servo.b
