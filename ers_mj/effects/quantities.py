"""The records in which an effect speaks: the plant's coefficients, sizes in the recordings, its own numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import mujoco


class Coefficients(NamedTuple):
    """The lumped plant: Eq. (6) with inductance, asymmetric friction, stops and a second body as options.

    theta'' = -a_1 (theta - theta_0) - a_mech w + j - c_1 Sgn(theta - theta_0) - c_2 Sgn(w) + bias
    tau_e j' = b u - a_emf w - j          (j = b u - a_emf w where tau_e = 0)

    Units: output unit (rad, m, V ...) and s; b in output unit / s^2 per input unit. The second body takes the shares
    ``rho`` of the inertia, ``beta`` of the mechanical damping and ``phi`` of the friction to the motor's side of a
    spring-damper (``k_twist`` [1/s^2], ``d_twist`` [1/s], per total inertia) that is slack within +-``gap``, or,
    without a gap, gets stiffer the more it is twisted: k_twist (x + ``harden`` x^3).

    Where ``k_bristle`` [1/s^2] is not 0 (effect ``presliding``) a bristle carries the rudder's Coulomb friction; its
    damping is ``d_bristle`` [1/s] times exp(-(w / fade)^2), and it gives way as in Dahl (1968): its bend moves with (1
    - force over level)^``dahl`` of the rudder's speed. Of one body (rho = 0 beside two_body) the bristle's foot is the
    second one; beside a motor's side the rudder's bristle has the share 1 - phi of level, stiffness and damping.

    ``g_s`` and ``g_c`` say how gravity pulls at the rudder, -g_s sin theta - g_c cos theta: a law of its own makes that
    torque (``gravity_imbalance``), here it tells others what the gear carries.

    Where ``creep`` [1/s] is not 0 friction creeps below breakaway (effect ``presliding``): it grows with the speed at
    that rate, up to the level; segments of a motion are as short as it asks for.

    Where the inductance falls with the current tau_e is divided by 1 + (``fall`` j)^2, until LEAST_IRON of it is left.
    """

    a_1: float = 0.0
    a_mech_plus: float = 0.0
    a_mech_minus: float = 0.0
    a_emf: float = 0.0
    b: float = 1.0
    c_1: float = 0.0
    c_2_plus: float = 0.0
    c_2_minus: float = 0.0
    theta_0: float = 0.0
    tau_e: float = 0.0
    bias: float = 0.0
    lower: float = -np.inf
    upper: float = np.inf
    k_stop: float = 0.0
    d_stop: float = 0.0
    delay: float = 0.0
    two_body: float = 0.0
    rho: float = 0.5
    beta: float = 0.5
    phi: float = 0.0
    k_twist: float = 0.0
    d_twist: float = 0.0
    gap: float = 0.0
    k_bristle: float = 0.0
    d_bristle: float = 0.0
    fade: float = np.inf
    dahl: float = 1.0
    harden: float = 0.0
    fall: float = 0.0
    g_s: float = 0.0
    g_c: float = 0.0
    creep: float = 0.0

    @property
    def has_motor_side(self) -> bool:
        """Whether motor and rudder are two bodies."""
        return self.two_body > 0 and self.rho > 0

    @property
    def has_bristle(self) -> bool:
        """Whether friction bends a bristle first."""
        return self.k_bristle > 0


@dataclass(frozen=True)
class Scales:
    """Typical sizes in the recordings at hand; effects take their starts and bounds from them.

    ``position`` half the travel, ``low``/``high`` its ends, ``speed`` a high percentile of |w|, ``acceleration`` the
    friction level (or the drive's, where there is none), ``input`` the peak |u|, ``sample_time`` [s], ``noise`` and
    ``quantum`` in output units, ``is_angle`` true where the output is an angle in rad, ``duration`` that of the longest
    recording [s], ``recordings`` their number, ``cog`` the longest period at the output that a motor's cogging has
    behind a known gear, ``drive`` the largest drive acceleration of the refitted baseline, ``supply`` the median [V] of
    one that was seen to vary, ``hot`` the spans (recording, begin [s], length [s]) where the model at hand fails most,
    ``pushed`` the pushes (recording, begin [s], length [s], acceleration) that it asks for there, ``waves`` the (kind,
    period) of what it leaves along the travel: of a "torque", a "friction" or the "reading", ``rings`` the frequencies
    [Hz] that stand out of what it leaves over time, ``is_held`` whether a load holds the output with a torque of its
    own: a weight, or a spring that pulls harder than friction.
    """

    position: float
    low: float
    high: float
    speed: float
    acceleration: float
    input: float
    sample_time: float
    noise: float
    quantum: float
    is_angle: bool
    tau_e_datasheet: float | None = None
    cog: float = np.inf
    drive: float | None = None
    supply: float | None = None
    duration: float = 10.0
    recordings: int = 1
    hot: tuple[tuple[int, float, float], ...] = ()
    pushed: tuple[tuple[int, float, float, float], ...] = ()
    waves: tuple[tuple[str, float], ...] = ()
    rings: tuple[float, ...] = ()
    is_held: bool = False

    def finer_waves(self, kind: str, most: float) -> list[float]:
        """The periods of the waves of a kind of which more than ``most`` lie within the travel."""
        return [period for at, period in self.waves if at == kind and period * most < self.high - self.low]


@dataclass(frozen=True)
class Symptoms:
    """What recordings show of their sensor by themselves: the lengths [s] of the spans that it lost (n,), the
    ``seconds`` recorded, the step of each recording's converter (recordings,), 0 where there is none, the travel
    [output unit], and whether the output is an angle in rad.
    """

    dropouts: np.ndarray
    seconds: float
    quanta: np.ndarray
    travel: float
    is_angle: bool


@dataclass(frozen=True)
class Parameter:
    """One number of an effect.

    ``kind`` names its dimension: torque, damping, stiffness, drag, cubic (all carried per inertia), position, speed,
    input, time, frequency, phase, ratio, count, per_position, per_position_squared, supply. ``positive`` parameters are
    fitted in their logarithm; those not ``fitted`` keep the value they start with; those ``per_record`` are another
    number in every recording; those ``on_travel`` are places that the travel reaches, or nearly; those ``recorded`` act
    through what a recording measured, so that ``--effect`` has no such.
    """

    name: str
    kind: str
    meaning: str
    positive: bool = True
    lower: float = -np.inf
    upper: float = np.inf
    absent: float = 0.0
    fitted: bool = True
    per_record: bool = False
    on_travel: bool = False
    recorded: bool = False


@dataclass(frozen=True)
class Twin:
    """Where an effect writes its MJCF realisation.

    ``spec`` is the model so far; ``inertia`` the J [kg m^2, or 1 where lumped] that turns an acceleration into a
    torque; ``is_angle`` whether the output turns (hinges) or slides; ``ampere`` the drive acceleration of one unit of
    the motor's force. Named alike in every model: body ``rudder``, tendon ``rudder_angle`` (the absolute output),
    actuators ``motor`` (ctrl in input units) and ``load``.
    """

    spec: mujoco.MjSpec
    inertia: float
    is_angle: bool
    ampere: float


def coupled(
    c: Coefficients, f: float, zeta: float, rho: float, phi: float, gap: float = 0.0, harden: float = 0.0
) -> Coefficients:
    """Two bodies on a spring-damper of natural frequency f [Hz] (against the total inertia) and damping ratio zeta,
    slack within +-gap, or stiffer by harden [1/output unit^2].

    Where c has two bodies already, the springs, the dampers and the slacks are in series; the shares are the last ones
    named. Beside a slack nothing hardens.
    """
    k, d = (2 * np.pi * f) ** 2, 4 * np.pi * zeta * f
    if c.has_motor_side and c.k_twist > 0:
        k, d = k * c.k_twist / (k + c.k_twist), d * c.d_twist / (d + c.d_twist)
    slack = c.gap + gap
    return c._replace(
        two_body=1.0, gap=slack, rho=rho, beta=rho, phi=phi, k_twist=k, d_twist=d, harden=0.0 if slack > 0 else harden
    )
