"""What every missing-physics effect declares.

An effect is one file in this folder. Where it acts is its base class, in the order the signal travels:
:class:`Drive` -> :class:`Transmission` -> :class:`Load` / :class:`Friction` -> :class:`Sensor`.

Laws work on the lumped model of Eq. (6): every torque is divided by the inertia J, so that a *torque* parameter
is carried as an acceleration [output unit / s^2] and only turned into N m for the reader, where J is known.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np
from scipy.linalg.blas import dtbsv

from ers_mj.decisions.policy import Policy

if TYPE_CHECKING:
    import mujoco

LEAST_IRON = 0.25  # share of an inductance that no current saturates
# periods of a torque that returns with the angle which the travel must hold, overshoots set aside: less is a spring, a
# weight or a cubic
RETURNS = 0.95


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
    one that was seen to vary, ``hot`` the spans (recording, begin [s], length [s]) where the model at hand fails most.
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


@dataclass(frozen=True)
class Effect:
    """Abstract base: a piece of physics that the reduced model of Eq. (6) leaves out.

    ``torque(p, theta, w, j, t)``, ``friction(p, level, theta, w, j, direction)`` and ``inertia(p, theta)``, which gives
    the inertia over that of the plain plant and half its slope by theta, are compiled laws (or None); an inertia acts
    beside a torque or a friction, of one body. ``memory(p, theta, w, j, h)`` is what the fifth constant becomes within
    a sample of length h, and begins at 0; ``coefficients``, ``command`` and ``measure`` act outside the integrator. All
    are the identity unless overridden. ``mjcf`` says in a sentence how a MuJoCo model shows the effect; ``edit_spec``
    does it. What acts through ``coefficients`` needs no more: the model is written from them. A law without a twin is
    applied step by step.
    """

    name: ClassVar[str] = ""
    sentence: ClassVar[str] = ""
    subsystem: ClassVar[str] = ""
    mjcf: ClassVar[str] = ""
    named: ClassVar[bool] = (
        # whether an answer names it; a law that is not is a suspect, tried in the place of what is (see confounders.py)
        True
    )
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    absorbs: ClassVar[tuple[str, ...]] = ()  # baseline parameters that the effect makes redundant: held while it is on
    redundant: ClassVar[int] = (
        0  # of its numbers, how many only stand in for the baseline's own, so that they explain nothing more
    )
    curves: ClassVar[str] = (
        # the effect of which it is a form that changes along the travel by what its size tells: either may be better
        ""
    )
    wave: ClassVar[tuple[tuple[int, ...], int] | None] = (
        None  # amplitudes (of which a start has one) and phase: the screening finds both from two quarter periods
    )
    fewest_turns: ClassVar[float] = (
        0.8  # periods of a wave over position within the travel: a longer one is no wave but a slope
    )
    tries: ClassVar[int] = 1  # starts, the best of the screening first, from which the effect is refitted
    tangible: ClassVar[bool] = (
        True  # whether tangents of a motion tell what its own numbers do to it (see plants/tangents.py)
    )
    dear: ClassVar[bool] = (
        False  # a simulation takes many times as long as others: refitted only where it promises most
    )
    step: ClassVar[float] = (
        1e-4  # of transformed parameters, over which differences of its simulation tell a slope: more where it bounces
    )
    needs: ClassVar[
        tuple[tuple[str, ...], ...]
    ] = ()  # of each of these one number at least, or it does nothing; () where any one will do
    together: ClassVar[tuple[tuple[str, ...], ...]] = ()  # numbers that say something only together
    sized: ClassVar[int] = 0  # leading parameters to which the effect is proportional: a start may be scaled in them
    follows_current: ClassVar[bool] = (
        False  # its law changes as fast as the current, or within a small angle: half the segment length
    )
    at_motor: ClassVar[bool] = (
        # its torque and memory are the motor's, at whose angle and speed they are taken where a play or a shaft parts
        # it from the rudder
        False
    )
    is_play: ClassVar[bool] = False  # a slack between motor and rudder, which a plant has once
    after_noise: ClassVar[bool] = False  # a sensor's converter or wire: it acts on what is read, noise and all
    holds: ClassVar[bool] = False  # a wire that brings an earlier reading again
    instant: ClassVar[bool] = False  # a sensor whose reading tells the output at the same time (see behind)
    torque: ClassVar[Callable | None] = None
    friction: ClassVar[Callable | None] = None
    inertia: ClassVar[Callable | None] = None
    memory: ClassVar[Callable | None] = None

    @property
    def local(self) -> bool:
        """Whether some of it is another number in every recording, so that no other recording can tell it."""
        return any(p.per_record for p in self.parameters)

    @property
    def once(self) -> bool:
        """Whether it acts in one recording only."""
        return any(p.name == "record" for p in self.parameters)

    @property
    def local_columns(self) -> list[int]:
        """Which of its parameters are ``per_record``."""
        return [k for k, p in enumerate(self.parameters) if p.per_record]

    @property
    def signed(self) -> bool:
        """Whether the effect may act either way along a start."""
        return self.sized > 0 and not any(p.positive for p in self.parameters[: self.sized])

    def absent(self) -> np.ndarray:
        """Parameter values (k,) at which the effect vanishes, so that models nest."""
        return np.array([p.absent for p in self.parameters])

    def starts(self, scales: Scales) -> list[np.ndarray]:
        """Parameter vectors (k,) of a visible size from which a fit is begun; empty where the effect cannot apply."""
        raise NotImplementedError

    def symptom(self, seen: Symptoms, policy: Policy) -> np.ndarray | None:
        """The effect's numbers (k,) where it shows in the data itself; None where it does not, or no fit is needed to
        tell.
        """
        return None

    def scaffold(self, scales: Scales, sprung: bool) -> np.ndarray | None:
        """Values (k,) of the effect under which a search without a datasheet is tried as well, without springs or with
        them (``sprung``), since it disturbs that search most; None where it does not.
        """
        return None

    def grown(self, name: str, p: np.ndarray, scales: Scales) -> list[np.ndarray]:
        """Parameter vectors (k,) near those p at which the effect ``name`` acts alike: where that one is a limit of
        this one.
        """
        return []

    def seen(self, p: np.ndarray, friction: float) -> bool:
        """Whether these numbers, beside a Coulomb friction c_2, are clearly not those of an effect that is a limit of
        this one (see grown).
        """
        return False

    def shows(self, p: np.ndarray, scales: Scales) -> bool:
        """Whether recordings of these scales can show the effect at these numbers at all."""
        return True

    def really(self, p: np.ndarray, friction: float) -> str:
        """Name of the effect of which these numbers, beside a Coulomb friction c_2, are a form: its own but where it is
        hardly there.
        """
        return self.name

    def coefficients(self, p: np.ndarray, c: Coefficients) -> Coefficients:
        """The plant's coefficients with the effect in place."""
        return c

    def constants(self, p: np.ndarray, c: Coefficients) -> np.ndarray:
        """What the compiled law receives as its ``p`` (at most 7 numbers)."""
        return p

    def is_lawful(self, p: np.ndarray) -> bool:
        """Whether its compiled law adds anything at these numbers to what its ``coefficients`` say."""
        return True

    def command(self, p: np.ndarray, u: np.ndarray) -> np.ndarray:
        """What the motor's terminals see (N,) of the command u (N,)."""
        return u

    def fed(self, p: np.ndarray, u: np.ndarray, supply: np.ndarray) -> np.ndarray:
        """What the drive makes of the command u (N,) from a measured supply [V] (N,)."""
        return u

    def dead_time(self, p: np.ndarray) -> float:
        """By how much the command reaches the motor late [s]."""
        return 0.0

    def remembers(self, p: np.ndarray) -> tuple[float, float]:
        """(time constant, dead time) [s] of a reading that hangs on more than the output at the same time."""
        return 0.0, 0.0

    def supply_left(
        self, p: np.ndarray, c: Coefficients, t: np.ndarray, motion: np.ndarray, j: np.ndarray
    ) -> np.ndarray | float:
        """Share (N,) of the supply that is left along a motion (N, 4) of drive acceleration j (N,)."""
        return 1.0

    def measure(self, p: np.ndarray, t: np.ndarray, y: np.ndarray) -> np.ndarray:
        """What the sensor reads (N,) at times t (N,) of the true output y (N,)."""
        return y

    def is_within(self, p: np.ndarray, y: np.ndarray, step: float) -> bool:
        """Whether a sensor's error along the readings y (N,) is less than a ``step`` [output unit]."""
        return False

    def behind(self, p: np.ndarray, y):
        """The output, a number or (N,), at which a sensor at rest reads y."""
        return y

    def winding(self, p: np.ndarray, c: Coefficients, t: np.ndarray, motion: np.ndarray, j: np.ndarray) -> np.ndarray:
        """n K_t i / J (N,) of the winding's current where the law takes it from the drive acceleration j (N,) of a
        motion (N, 4).
        """
        return j

    def edit_spec(self, p: np.ndarray, c: Coefficients, twin: Twin) -> bool:
        """Write the effect's elements into the MJCF; False where the stepping has to apply its law instead.

        ``p`` is what the law receives (``constants``), ``c`` the coefficients with every effect in place.
        """
        return not (self.torque or self.friction or self.inertia)

    def describe(self, values: dict[str, str]) -> str:
        """The sentence with its numbers; ``values`` holds name -> formatted value with unit."""
        return self.sentence.format(**values)


class Drive(Effect):
    """Between the command and the motor's torque."""

    subsystem, at_motor = "drive", True


class Transmission(Effect):
    """Between the motor and the rudder."""

    subsystem = "transmission"


class Load(Effect):
    """A torque on the rudder."""

    subsystem = "load"


class Friction(Effect):
    """The level of dry or viscous friction at the rudder (subsystem: load)."""

    subsystem = "load"


class Sensor(Effect):
    """Between the rudder and the number in the file."""

    subsystem = "sensor"


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


def recursive(decay: np.ndarray, driven: np.ndarray) -> np.ndarray:
    """z (N,) of z[k] = decay[k] z[k - 1] + driven[k], from z[0] = driven[0]: a triangular system of two diagonals."""
    band = np.vstack([np.ones(driven.size), np.append(-decay[1:], 0.0)])
    return dtbsv(1, band, driven, lower=1)


def law(function: Callable) -> staticmethod:
    """Compile one effect's law for the integrator."""
    from numba import njit

    return staticmethod(njit(inline="never", nogil=True)(function))
