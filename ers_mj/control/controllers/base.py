"""What every controller is: reference with its derivatives and one measurement in, one voltage out, sample by sample.

A member of this folder declares ``name``, ``sentence`` and ``law``. The base brings what all of them need alike: the
filtered difference that makes a speed of the measured angle, the integral, the saturation, and an integral that stands
still while the saturation would only deepen. The letters are Eq. (7)'s: x1 = int x2 dt, x2 = theta_r - theta, x3 =
theta_r' - w.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple

from ers_mj.errors import InputError
from ers_mj.servo.datasheet import TABLE_1, Datasheet

FILTER_S = 5e-4  # [s] time constant of the speed's filter where none is given
LETTERS = ("a_1", "a_2", "b", "c_1", "c_2", "theta_0")


class Aim(NamedTuple):
    """The reference at one instant: angle [rad], speed [rad/s], acceleration [rad/s^2]."""

    theta: float
    omega: float = 0.0
    alpha: float = 0.0


class State(NamedTuple):
    """What a law sees at one instant: the reference, the angle and speed as sensed, and Eq. (7)'s errors."""

    aim: Aim
    theta: float
    omega: float
    x1: float
    x2: float
    x3: float


@dataclass(frozen=True)
class Servo:
    """Eq. (6) as a controller knows it: a_1 [1/s^2], a_2 [1/s], b [rad/s^2/V], c_1, c_2 [rad/s^2], theta_0 [rad].

    Attributes:
        slip: speed [rad/s] above which its sign is taken for the sign of the friction.
        stick_band: x2 [rad] over which the friction's compensation grows while the rudder sticks.
        side_band: angle [rad] from theta_0 over which the preload changes its sign.
    """

    slip: ClassVar[float] = 0.05
    stick_band: ClassVar[float] = math.radians(0.02)
    side_band: ClassVar[float] = math.radians(0.05)

    a_1: float = 0.0
    a_2: float = 0.0
    b: float = 1.0
    c_1: float = 0.0
    c_2: float = 0.0
    theta_0: float = 0.0

    @classmethod
    def of(cls, datasheet: Datasheet) -> Servo:
        """What a datasheet or a `model.toml` tells; what it does not tell is zero.

        Raises:
            InputError: b does not follow from it.
        """
        lumped = datasheet.to_lumped()
        if "b" not in lumped:
            raise InputError(
                f"{datasheet.name or 'the datasheet'}: no controller follows from it, it needs b, or J, K_t and R from"
                " which b follows"
            )
        return cls(**{letter: lumped[letter] for letter in LETTERS if letter in lumped})

    def spring(self, theta: float) -> float:
        """Spring and preload a_1 (theta - theta_0) + c_1 Sgn(theta - theta_0) [rad/s^2], the sign smooth."""
        phi = theta - self.theta_0
        return self.a_1 * phi + self.c_1 * math.tanh(phi / self.side_band)

    def friction(self, omega: float, x2: float) -> float:
        """c_2 Sgn(w) [rad/s^2], stick-aware: where the rudder rests, in proportion to the error that it should
        leave.
        """
        if abs(omega) > self.slip:
            return math.copysign(self.c_2, omega)
        return self.c_2 * min(max(x2 / self.stick_band, -1.0), 1.0)

    def feed_forward(self, s: State) -> float:
        """theta_r'' + a_1 (theta - theta_0) + a_2 w + c_1 Sgn(theta - theta_0) + c_2 Sgn(w) [rad/s^2]: the torque of
        the wanted motion.
        """
        return s.aim.alpha + self.spring(s.theta) + self.a_2 * s.omega + self.friction(s.omega, s.x2)

    @cached_property
    def printed_gain(self) -> float:
        """By how much the paper's gains in V/deg, meant for Table 1's servo, are multiplied: the same acceleration for
        the same error, in V/rad.
        """
        return math.degrees(1.0) * Servo.of(Datasheet(parameters=TABLE_1)).b / self.b


class Controller:
    """Abstract base: one control law at one sample rate.

    Args:
        servo: the plant as the law knows it.
        rate_hz: of the samples.
        u_max: voltage that the drive gives at most [V].
        filter_s: time constant of the speed's filter [s].
    """

    name: ClassVar[str] = ""
    sentence: ClassVar[str] = ""
    takes: ClassVar[str] = ""  # the keyword of its gains: "gains" of the finite-time laws, "pid", none

    def __init__(self, servo: Servo, rate_hz: float, u_max: float = 24.0, filter_s: float = FILTER_S):
        self.servo, self.h, self.u_max = servo, 1.0 / rate_hz, u_max
        self._new = 1.0 - math.exp(-self.h / filter_s) if filter_s > 0 else 1.0
        self.reset(servo.theta_0)

    @classmethod
    def told_gains(cls, servo: Servo) -> dict[str, float]:
        """Gains that no option sets, by name, as they are for a servo."""
        return {}

    def reset(self, theta: float) -> None:
        """Begin anew, at rest at theta."""
        self._x1, self._before, self._omega = 0.0, theta, 0.0

    def voltage(self, aim: Aim, y: float, t: float) -> float:
        """The voltage [V] to hold until the next sample, of the reference and the measured angle y [rad] at time t
        [s].
        """
        wanted, x1, x2 = self._wanted(aim, y)
        u = min(max(wanted, -self.u_max), self.u_max)
        if (wanted - u) * x2 * self.servo.b <= 0:
            self._x1 = x1
        self.sent(u)
        return u

    def unlimited(self, aim: Aim, y: float, t: float) -> float:
        """As ``voltage`` of a drive without limit, the law itself as it is."""
        wanted, self._x1, _ = self._wanted(aim, y)
        self.sent(wanted)
        return wanted

    def _wanted(self, aim: Aim, y: float) -> tuple[float, float, float]:
        """What the law wants [V], the integral x1 with this sample in it, and x2."""
        theta, omega = self.sense(y)
        x2, x3 = aim.theta - theta, aim.omega - omega
        x1 = self._x1 + self.h * x2
        return self.law(State(aim, theta, omega, x1, x2, x3)), x1, x2

    def sense(self, y: float) -> tuple[float, float]:
        """Angle and speed from the measured angle: y itself and its filtered difference. A law with an observer brings
        its own.
        """
        self._omega += self._new * ((y - self._before) / self.h - self._omega)
        self._before = y
        return y, self._omega

    def sent(self, u: float) -> None:
        """Told the voltage that goes out; an observer listens."""

    def law(self, s: State) -> float:
        """The voltage that the law wants [V], before saturation."""
        raise NotImplementedError
