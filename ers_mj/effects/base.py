"""What every missing-physics effect declares.

An effect is one file in this folder, found by itself; one that may act behind a firmware's loop as well is listed in
`position_loop/terms.py`. Where it acts is its base class, in the order the signal travels:
:class:`Drive` -> :class:`Transmission` -> :class:`Load` / :class:`Friction` -> :class:`Sensor`.

Laws work on the lumped model of Eq. (6): every torque is divided by the inertia J, so that a *torque* parameter
is carried as an acceleration [output unit / s^2] and only turned into N m for the reader, where J is known.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ers_mj.decisions.thresholds import Policy
from ers_mj.effects.quantities import Coefficients, Parameter, Scales, Symptoms, Twin

FORGOTTEN = 1e-20  # share of what was before that counts as nothing
LEAST_IRON = 0.25  # share of an inductance that no current saturates
RETURNS = (
    2.0  # periods of a torque that returns with the angle which the travel must hold: less is a spring or a weight
)


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
    apart: ClassVar[str] = ""  # what tells it from its neighbours, for the catalogue of docs/effects.md
    named: ClassVar[bool] = (
        # whether an answer names it; a law that is not is a suspect, tried in the place of what is (see confounders.py)
        True
    )
    tabled: ClassVar[bool] = False  # a table of what stays unknown (see selection/unknown.py): no candidate, no suspect
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
        True  # whether tangents of a motion tell what its own numbers do to it (see plants/kernel/tangents.py)
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
    parts_damping: ClassVar[bool] = False  # it tells the back-EMF's share of the damping from the mechanical one
    at_motor: ClassVar[bool] = (
        # its torque and memory are the motor's, at whose angle and speed they are taken where a play or a shaft parts
        # it from the rudder
        False
    )
    is_play: ClassVar[bool] = False  # a slack between motor and rudder, which a plant has once
    holds_place: ClassVar[bool] = False  # it may stand in a baseline where others have a spring (see ``columns``)
    after_noise: ClassVar[bool] = False  # a sensor's converter or wire: it acts on what is read, noise and all
    holds: ClassVar[bool] = False  # a wire that brings an earlier reading again
    # letters of a position loop (position_loop/model.py) that it is told by, where a firmware closes one
    in_loop: ClassVar[tuple[str, ...]] = ()
    only_in_loop: ClassVar[bool] = False  # whether it is none without one
    loop_sentence: ClassVar[str] = ""  # what is said of it there, with the {value} of the first of these letters
    is_weight: ClassVar[bool] = False  # its torques grow with a load's moment m l
    by_lightness: ClassVar[Mapping[str, float]] = {}  # numbers told against the inertia: the power of one over it
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

    def sizes(self, p: np.ndarray) -> list[int]:
        """Which of its numbers p (k,) tell how large it is: those to which it is proportional, or of which there must
        be one, else its first.
        """
        finite, needed = [int(k) for k in np.flatnonzero(np.isfinite(p))], self.needs[0] if self.needs else ()
        return [k for k in finite if k < self.sized or self.parameters[k].name in needed] or finite[:1]

    def narrower(self, p: np.ndarray) -> list[np.ndarray]:
        """Its numbers p (k,) without those that may be absent, one by one, or together where they say something only
        together; what ``needs`` one of them keeps it.
        """
        names = [x.name for x in self.parameters]
        alone = [(name,) for name in names if not any(name in group for group in self.together)]
        groups = [[names.index(name) for name in group] for group in (*self.together, *alone)]
        return [self._less(p, at) for at in groups if np.all(np.isfinite(p[at])) and self._may_lack(p, at)]

    def _less(self, p: np.ndarray, at: Sequence[int]) -> np.ndarray:
        less = p.copy()
        less[at] = self.absent()[at]
        return less

    def _may_lack(self, p: np.ndarray, at: Sequence[int]) -> bool:
        """Whether there is a form of p (k,) without these fitted numbers."""
        lacked, left = [self.parameters[k] for k in at], np.isfinite(self._less(p, at))
        names = {x.name for x, is_left in zip(self.parameters, left, strict=True) if is_left}
        return all(math.isinf(x.absent) and x.fitted and not x.per_record for x in lacked) and all(
            names.intersection(one) for one in self.needs or (names,)
        )

    def absent(self) -> np.ndarray:
        """Parameter values (k,) at which the effect vanishes, so that models nest."""
        return np.array([p.absent for p in self.parameters])

    def beside(self, given: Collection[str]) -> np.ndarray:
        """Parameter values (k,) that a file which names only the ``given`` ones means."""
        return self.absent()

    def starts(self, scales: Scales) -> list[np.ndarray]:
        """Parameter vectors (k,) of a visible size from which a fit is begun; empty where the effect cannot apply."""
        raise NotImplementedError

    def blank(self, scales: Scales) -> np.ndarray:
        """The entries (k,) of a table over these recordings that changes nothing, if it is ``tabled``."""
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

    def columns(self, y: np.ndarray) -> np.ndarray:
        """Torques (N, k) along the output y (N,) that one of each of its numbers makes, if it ``holds_place``."""
        raise NotImplementedError

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
        """What the compiled law receives as its ``p`` (at most 11 numbers)."""
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
    by_lightness: ClassVar[Mapping[str, float]] = {"f_shaft": 0.5, "f_contact": 0.5, "zeta": 0.5, "rho": 1.0}


class Load(Effect):
    """A torque on the rudder."""

    subsystem = "load"


class Friction(Effect):
    """The level of dry or viscous friction at the rudder (subsystem: load)."""

    subsystem = "load"


class Sensor(Effect):
    """Between the rudder and the number in the file."""

    subsystem = "sensor"


def recursive(decay: np.ndarray, driven: np.ndarray) -> np.ndarray:
    """z (N,) of z[k] = decay[k] z[k - 1] + driven[k], from z[0] = driven[0], by doubling: of what lies 1, 2, 4 ...
    samples back, until nothing of it is left.
    """
    z, kept, back = driven.copy(), np.append(0.0, decay[1:]), 1
    while back < z.size and kept.any():
        z[back:] += kept[back:] * z[:-back]
        kept[back:] *= kept[:-back]
        kept[np.abs(kept) < FORGOTTEN] = 0.0
        back *= 2
    return z


def law(function: Callable) -> staticmethod:
    """Compile one effect's law for the integrator."""
    from numba import njit

    return staticmethod(njit(inline="never", nogil=True)(function))
