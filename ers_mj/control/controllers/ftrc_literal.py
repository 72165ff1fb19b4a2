"""The paper's finite-time law letter for letter."""

from __future__ import annotations

from ers_mj.control.controllers.base import Controller, State
from ers_mj.control.controllers.finite_time import FiniteTime, Gains


class FtrcLiteral(Controller):
    """Eq. (31): u = (1/b) {-a_1 x2 - a_2 x3 + k_3 sig(xi_3, 3q - 2)}. Nothing in it knows of friction, preload or the
    reference's acceleration.
    """

    name = "ftrc-literal"
    sentence = "finite-time law as printed in (31), without feed-forward"
    takes = "gains"

    def __init__(self, servo, rate_hz, u_max=24.0, *, gains: Gains = Gains(), **options):
        super().__init__(servo, rate_hz, u_max, **options)
        self._feedback = FiniteTime(gains)

    def law(self, s: State) -> float:
        return (-self.servo.a_1 * s.x2 - self.servo.a_2 * s.x3 + self._feedback(s.x1, s.x2, s.x3)) / self.servo.b
