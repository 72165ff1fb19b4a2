"""A modern rival: time-optimal far from the reference, linear near it, on an observer that knows stick and slip.

    measurement -> Kalman observer of (theta, w, d) with stick and slip -> wanted speed -> wanted acceleration -> inverse model -> voltage

The wanted speed of closing follows Workman's proximate time-optimal servo: v(x2) = lambda x2 near the reference, sqrt(2 alpha A |x2|) - v_s far
from it, joined with equal slope; A is what the drive can brake at the full voltage with the help of friction, spring and preload. The
disturbance d [rad/s^2] takes the integral's place. Causal: of the reference it knows what every other law here knows.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import expm, solve_discrete_are

from ers_mj.controllers.base import SIDE_BAND, STICK_BAND, Controller, State

NOISE = math.radians(0.01)  # [rad] of the measurement, for which the observer is tuned
RATTLE = 300.0  # [rad/s^2/sqrt(Hz)] acceleration that the model does not tell, white
DRIFT = 300.0  # [rad/s^3/sqrt(Hz)] by which the disturbance wanders
SPEED_GAIN, CLOSING = 0.45, 0.45  # speed loop [1/s] as a share of the sample rate; closing rate lambda as a share of it
MOST_GAIN = 500.0  # [1/s] of the speed loop, whatever the sample rate
TRUST = 0.85  # alpha: share of the braking that the profile counts on
SURE_SLIP = 0.5  # [rad/s] above which the estimated speed tells the friction's sign


class TimeOptimal(Controller):
    """a = theta_r'' + k_w (v(x2) + x3); u = (1/b) {a + a_1 (theta - theta_0) + a_2 w + c_1 Sgn(theta - theta_0) + c_2 Sgn(w) - d}, at mid-sample."""

    name = "time-optimal"
    sentence = "proximate time-optimal servo on a Kalman observer with stick and slip (ours)"

    def __init__(self, servo, rate_hz, u_max=24.0, **options):
        h = 1.0 / rate_hz
        self.k_w = min(SPEED_GAIN * rate_hz, MOST_GAIN)
        self.closing = CLOSING * self.k_w
        whole = expm(h * np.array([[0.0, 1.0, 0.0], [-servo.a_1, -servo.a_2, 1.0], [0.0, 0.0, 0.0]]))
        (self._f11, self._f12, self._g1), (self._f21, self._f22, self._g2) = whole[:2].tolist()
        spread = np.diag([0.0, RATTLE**2 * h, DRIFT**2 * h])
        seen = np.array([[1.0, 0.0, 0.0]])
        P = solve_discrete_are(whole.T, seen.T, spread, np.array([[NOISE**2]]))
        self._trust = (P @ seen.T / (P[0, 0] + NOISE**2)).ravel().tolist()
        super().__init__(servo, rate_hz, u_max, **options)

    def reset(self, theta: float) -> None:
        super().reset(theta)
        self._theta, self._speed, self._d, self._alpha = theta, 0.0, 0.0, None

    # -- the observer --

    def sense(self, y: float) -> tuple[float, float]:
        new = y - self._theta
        l1, l2, l3 = self._trust
        self._theta += l1 * new
        self._speed += l2 * new
        self._d += l3 * new
        return self._theta, self._speed

    def sent(self, u: float) -> None:
        """Predict the state at the next sample: linear flow, exact, under the friction and preload of the present mode."""
        servo, phi, w = self.servo, self._theta - self.servo.theta_0, self._speed
        push = servo.b * u + self._d
        side = math.tanh(phi / (0.2 * SIDE_BAND))
        net = push - servo.a_1 * phi - servo.c_1 * side
        w_free = w + self.h * net
        slip = math.copysign(1.0, w_free)
        brake = servo.c_2 + (servo.c_1 * (1.0 - abs(side)) if phi * slip <= 0 or abs(side) < 1 else 0.0)
        if abs(w_free) <= self.h * brake:
            self._theta += 0.5 * self.h * w
            self._speed = 0.0
            return
        force = net + servo.a_1 * phi - servo.c_2 * slip
        self._theta = servo.theta_0 + self._f11 * phi + self._f12 * w + self._g1 * force
        self._speed = self._f21 * phi + self._f22 * w + self._g2 * force

    # -- the law --

    def law(self, s: State) -> float:
        servo = self.servo
        alpha = s.aim.alpha if self._alpha is None else s.aim.alpha + 0.5 * (s.aim.alpha - self._alpha)  # at mid-sample, extrapolated
        self._alpha = s.aim.alpha
        wanted = self._profile(s)
        a = alpha + self.k_w * (wanted + s.x3)
        omega = s.omega + 0.5 * self.h * a
        theta = s.theta + 0.5 * self.h * s.omega
        return (a + servo.spring(theta) + servo.a_2 * omega + servo.c_2 * self._slip(s, wanted) - self._d) / servo.b

    def _slip(self, s: State, wanted: float) -> float:
        """The friction's sign: of the speed where that is sure, else of the motion that is wanted."""
        if abs(s.omega) > SURE_SLIP:
            return math.copysign(1.0, s.omega)
        return min(max((s.aim.omega + wanted) / (self.closing * STICK_BAND), -1.0), 1.0)

    def _profile(self, s: State) -> float:
        """v(x2) [rad/s]."""
        servo, way = self.servo, math.copysign(1.0, s.x2)
        phi = s.theta - servo.theta_0
        A = abs(servo.b) * self.u_max + servo.c_2 + way * (servo.a_1 * phi + servo.c_1 * math.copysign(1.0, phi) + s.aim.alpha - self._d)
        A = TRUST * max(A, 0.2 * abs(servo.b) * self.u_max)
        reach = 0.5 * A / self.closing**2
        if abs(s.x2) <= reach:
            return self.closing * s.x2
        return way * (math.sqrt(2.0 * A * abs(s.x2)) - 0.5 * A / self.closing)
