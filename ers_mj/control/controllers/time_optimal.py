"""A modern rival: time-optimal far from the reference, linear near it, on an observer that knows stick and slip.

    measurement -> Kalman observer of (theta, w, d) with stick and slip -> wanted speed -> wanted acceleration ->
    inverse model -> voltage

The wanted speed of closing is Workman's proximate time-optimal profile: v(x2) = lambda x2 near the reference, sqrt(2
alpha A |x2|) - v_s far from it, joined with equal slope; A is what brakes with the voltage that the reference's own
needs leave, and with friction and damping. A reference that leaves none is followed in phase, its acceleration raised
and its position let go: the amplitude cannot be had. The disturbance d [rad/s^2] takes the integral's place. Causal: of
the reference it knows what every other law here knows. Its observer stands where the others have the filter of
``filter_s``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm, solve_discrete_are

from ers_mj.control.controllers.base import Aim, Controller, State


@dataclass(frozen=True)
class Tuning:
    """What the law takes for granted.

    Attributes:
        noise: of the measurement, for which the observer is tuned [rad].
        rattle: acceleration that the model does not tell, white [rad/s^2/sqrt(Hz)].
        drift: by which the disturbance wanders [rad/s^3/sqrt(Hz)].
        speed_gain, most_gain: k_w as a share of the sample rate, and the most whatever that is [1/s].
        closing: lambda as a share of k_w.
        trust: alpha, the share of the braking that the profile counts on.
        room: share of the full voltage that the braking counts on at least.
        slack: share of the full voltage by which a reference's needs exceed it when the position is let go.
        lazy: lambda from there on [1/s]: the phase can be kept, the amplitude cannot.
        boost: by how much theta_r'' is raised at most: by the share that its needs exceed the full voltage.
        memory: over which the peak of what the reference needs is forgotten [s].
        sure_slip: above which the estimated speed tells the friction's sign [rad/s].
    """

    noise: float = math.radians(0.01)
    rattle: float = 4.0
    drift: float = 100.0
    speed_gain: float = 0.4
    most_gain: float = 500.0
    closing: float = 0.5
    trust: float = 0.95
    room: float = 0.05
    slack: float = 0.05
    lazy: float = 10.0
    boost: float = 0.3
    memory: float = 0.3
    sure_slip: float = 0.5


class TimeOptimal(Controller):
    """a = theta_r'' + k_w (v(x2) + x3); u = (1/b) {a + a_1 (theta - theta_0) + a_2 w + c_1 Sgn(theta - theta_0) + c_2
    Sgn(w) - d}, at mid-sample.
    """

    name = "time-optimal"
    sentence = "proximate time-optimal servo on a Kalman observer with stick and slip (ours)"
    tuning = Tuning()

    def __init__(self, servo, rate_hz, u_max=24.0, **options):
        h, tuning = 1.0 / rate_hz, self.tuning
        self.k_w = min(tuning.speed_gain * rate_hz, tuning.most_gain)
        self.closing = tuning.closing * self.k_w
        self._forget = math.exp(-h / tuning.memory)
        whole = expm(h * np.array([[0.0, 1.0, 0.0], [-servo.a_1, -servo.a_2, 1.0], [0.0, 0.0, 0.0]]))
        (self._f11, self._f12, self._g1), (self._f21, self._f22, self._g2) = whole[:2].tolist()
        spread = np.diag([0.0, tuning.rattle**2 * h, tuning.drift**2 * h])
        seen = np.array([[1.0, 0.0, 0.0]])
        P = solve_discrete_are(whole.T, seen.T, spread, np.array([[tuning.noise**2]]))
        self._trust = (P @ seen.T / (P[0, 0] + tuning.noise**2)).ravel().tolist()
        super().__init__(servo, rate_hz, u_max, **options)

    def reset(self, theta: float) -> None:
        super().reset(theta)
        self._theta, self._speed, self._d, self._need = theta, 0.0, 0.0, 0.0
        self._alpha: float | None = None

    # -- the observer --

    def sense(self, y: float) -> tuple[float, float]:
        new = y - self._theta
        l1, l2, l3 = self._trust
        self._theta += l1 * new
        self._speed += l2 * new
        self._d += l3 * new
        return self._theta, self._speed

    def sent(self, u: float) -> None:
        """Predict the state at the next sample: linear flow, exact, under the friction and preload of the present
        mode.
        """
        servo, phi, w = self.servo, self._theta - self.servo.theta_0, self._speed
        push = servo.b * u + self._d
        side = math.tanh(phi / (0.2 * servo.side_band))
        net = push - servo.a_1 * phi - servo.c_1 * side
        w_free = w + self.h * net
        if abs(w_free) <= self.h * (servo.c_2 + servo.c_1 * (1.0 - abs(side))):
            self._theta += 0.5 * self.h * w
            self._speed = 0.0
            return
        force = net + servo.a_1 * phi - math.copysign(servo.c_2, w_free)
        self._theta = servo.theta_0 + self._f11 * phi + self._f12 * w + self._g1 * force
        self._speed = self._f21 * phi + self._f22 * w + self._g2 * force

    # -- the law --

    def law(self, s: State) -> float:
        servo, tuning = self.servo, self.tuning
        # at mid-sample, extrapolated
        alpha = s.aim.alpha if self._alpha is None else s.aim.alpha + 0.5 * (s.aim.alpha - self._alpha)
        self._alpha = s.aim.alpha
        spare, full = self._spare(s.aim), abs(servo.b) * self.u_max
        free = min(max(1.0 + spare / (tuning.slack * full), 0.0), 1.0)
        boost = 1.0 + min(max(-spare / full, 0.0), tuning.boost)
        aid = servo.c_2 + 0.5 * servo.a_2 * abs(s.omega)  # what friction and damping brake, at the mean speed
        closing = tuning.lazy + free * (self.closing - tuning.lazy)
        wanted = _profile(s.x2, closing, tuning.trust * max(spare + free * aid, tuning.room * full))
        a = boost * alpha + self.k_w * (wanted + s.x3)
        omega, theta = s.omega + 0.5 * self.h * a, s.theta + 0.5 * self.h * s.omega
        return (a + servo.spring(theta) + servo.a_2 * omega + servo.c_2 * self._slip(s, wanted) - self._d) / servo.b

    def _spare(self, aim: Aim) -> float:
        """Acceleration [rad/s^2] that the reference's own needs leave of the full voltage, their peak forgotten over
        the tuning's memory.
        """
        servo = self.servo
        slip = math.copysign(servo.c_2, aim.omega) if aim.omega else 0.0
        self._need = max(
            abs(aim.alpha + servo.spring(aim.theta) + servo.a_2 * aim.omega + slip), self._need * self._forget
        )
        return abs(servo.b) * self.u_max - self._need

    def _slip(self, s: State, wanted: float) -> float:
        """The friction's sign: of the speed where that is sure, else of the motion that is wanted."""
        if abs(s.omega) > self.tuning.sure_slip:
            return math.copysign(1.0, s.omega)
        return min(max((s.aim.omega + wanted) / (self.closing * self.servo.stick_band), -1.0), 1.0)


def _profile(x2: float, closing: float, A: float) -> float:
    """v(x2) [rad/s], of the rate near the reference [1/s] and the braking far from it [rad/s^2]."""
    if abs(x2) <= 0.5 * A / closing**2:
        return closing * x2
    return math.copysign(math.sqrt(2.0 * A * abs(x2)) - 0.5 * A / closing, x2)
