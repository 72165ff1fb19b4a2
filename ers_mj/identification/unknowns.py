"""What an identification searches: Eq. (1)'s letters where a datasheet gives them all, else Eq. (6)'s, each within
bounds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.columns import per
from ers_mj.data.prepared import Trace
from ers_mj.errors import InputError
from ers_mj.estimation.search import opening
from ers_mj.servo.datasheet import LUMPED, SHEET_UNITS, Datasheet, refuse_impossible
from ers_mj.servo.model import BASE, Model
from ers_mj.servo.simulation import EffectSettings, inertia_of, kernel_effects

LETTERS = ("L", "R", "k_s", "T_LH", "F_c", "J", "B", "K_t", "K_e", "theta_0")  # Eq. (1), in the paper's order
NEEDED = ("J", "B", "K_t", "K_e", "R")  # without them Eq. (1) cannot run
FACTORS = (0.2, 3.0)  # of what is known beforehand, between which a positive one is searched
REST = {"a_1": 0.0, "a_2": 0.0, "c_1": 0.0, "c_2": 0.0, "theta_0": 0.0, "tau_e": 0.0, "emf_share": 0.0}


def unit_of_letter(name: str, y: str, u: str) -> str:
    """The unit of a letter of Eq. (1) or (6) for outputs in y and inputs in u."""
    lumped = {
        "a_1": "1/s^2",
        "a_2": "1/s",
        "b": f"{y}/s^2/{per(u)}",
        "c_1": f"{y}/s^2",
        "c_2": f"{y}/s^2",
        "theta_0": y,
        "tau_e": "s",
        "emf_share": "-",
        "ampere": f"{y}/s^2/A",
    }
    return SHEET_UNITS.get(name) or lumped[name]


@dataclass(frozen=True)
class Unknowns:
    """The letters that are searched.

    Attributes:
        names: (k,) letters, of Eq. (1) or, where ``is_lumped``, of Eq. (6).
        reference: (k,) what is known beforehand, where a search begins.
        lower, upper: (k,) bounds.
        known: the letters that are held, n among them.
        fixed: which of these the user fixed.
        is_lumped: whose letters they are.
        guessed: which letters nothing but the recordings told beforehand, so that no bounds of theirs are known.
        factors: those of the bounds that were made of the reference.
        absent: letters that were left out since the recordings ask for none of them.
        effects: (name, {key: value}) [SI] of the datasheet, which act and stay as they are.
        inertia: J [kg m^2] by which their torques are divided where J is not among the letters.
    """

    names: tuple[str, ...]
    reference: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    known: Mapping[str, float]
    fixed: tuple[str, ...]
    is_lumped: bool
    guessed: tuple[str, ...] = ()
    factors: tuple[float, float] = FACTORS
    absent: tuple[str, ...] = ()
    effects: EffectSettings = ()
    inertia: float = 1.0

    @property
    def winding(self) -> str:
        """The letter that makes the current lag."""
        return "tau_e" if self.is_lumped else "L"

    def without(self, name: str, letters: np.ndarray) -> Unknowns:
        """The same without a letter, the reference at the others of these letters (k,)."""
        kept = np.array([other != name for other in self.names])
        return replace(
            self,
            names=tuple(other for other in self.names if other != name),
            reference=letters[kept],
            lower=self.lower[kept],
            upper=self.upper[kept],
            absent=(*self.absent, name),
        )

    def around(self, letters: np.ndarray) -> Unknowns:
        """The same with the bounds of guessed letters moved as far as these letters (k,) allow."""
        guessed = np.array([name in self.guessed for name in self.names])
        ends = np.sort(np.outer(self.factors, letters), axis=0)
        return replace(
            self,
            lower=np.where(guessed, np.minimum(self.lower, ends[0]), self.lower),
            upper=np.where(guessed, np.maximum(self.upper, ends[1]), self.upper),
        )

    def drawn(self, random: np.random.Generator) -> np.ndarray:
        """Letters (k,) drawn from the bounds, evenly by their logarithm where they are positive."""
        positive = self.lower > 0
        low, high = (np.log(np.where(positive, x, 1.0)) for x in (self.lower, self.upper))
        share = random.random(self.lower.size)
        return np.where(positive, np.exp(low + share * (high - low)), self.lower + share * (self.upper - self.lower))

    def everything(self, letters: np.ndarray) -> dict[str, float]:
        """All letters by name, of the searched ones (k,) and those held."""
        return {**self.known, **dict(zip(self.names, letters.tolist()))}

    def values(self, letters: np.ndarray) -> dict[str, float]:
        """Eq. (6)'s letters as Model takes them."""
        every = self.everything(letters)
        lumped = every if self.is_lumped else Datasheet(parameters=every).to_lumped()
        return {**REST, "ampere": lumped["b"], **{name: x for name, x in lumped.items() if name in BASE}}

    def model(self, letters: np.ndarray) -> Model:
        """The model that the searched letters (k,) make."""
        return Model(self.values(letters), (), self.acting(letters), frozen=tuple(name for name, _ in self.effects))

    def acting(self, letters: np.ndarray) -> tuple[tuple[str, np.ndarray], ...]:
        """The datasheet's effects (name, parameters (k,)), their torques per inertia."""
        return kernel_effects(self.effects, float(self.everything(letters).get("J", self.inertia)))


def unknowns_of(
    traces: Sequence[Trace],
    datasheet: Datasheet | None,
    fixed: Mapping[str, float],
    bounds: Mapping[str, tuple[float, float]],
    factors: tuple[float, float] = FACTORS,
    is_angle: bool = True,
) -> Unknowns:
    """What to search in these recordings.

    Args:
        traces: the recordings.
        datasheet: what is known, or None: Eq. (6) is then first fitted from scratch.
        fixed: letters to hold, by name.
        bounds: (lower, upper) by name; a letter that no datasheet gives begins in their middle.
        factors: bounds of the others, as factors to what is known.

    Raises:
        InputError: a name that cannot be searched here, or bounds without what is fixed or known.
    """
    _refuse_unknown({**fixed, **bounds})
    for name, x in fixed.items():
        refuse_impossible(name, x, "--fix")
    both = fixed.keys() & bounds.keys()
    if both:
        raise InputError(f"{sorted(both)[0]} is fixed and has bounds, one of both was expected")
    is_lumped, known = _known(traces, datasheet, fixed, bounds, is_angle)
    _refuse_others((*fixed, *bounds), is_lumped, datasheet)
    ends = _searched(traces, known, is_lumped, fixed, bounds, factors)
    if not ends:
        raise InputError("every letter is fixed, there is nothing to identify")
    own = () if datasheet is not None else tuple(name for name in ends if name not in bounds and name != "theta_0")
    lower, upper = np.array([*ends.values()], float).T.copy()
    reference = np.clip([known[name] for name in ends], lower, upper)
    held = {name: x for name, x in known.items() if name not in ends}
    effects, inertia = ((), 1.0) if datasheet is None else (tuple(datasheet.effects), inertia_of(datasheet))
    told = tuple(ends), reference, lower, upper, held, tuple(fixed), is_lumped, own, (factors[0], factors[1])
    return Unknowns(*told, effects=effects, inertia=inertia)


def _searched(
    traces: Sequence[Trace],
    known: Mapping[str, float],
    is_lumped: bool,
    fixed: Mapping[str, float],
    bounds: Mapping[str, tuple[float, float]],
    factors: tuple[float, float],
) -> dict[str, tuple[float, float]]:
    """The letters that are searched, in their order, and the ends between which."""
    y = np.concatenate([t.y[t.valid] for t in traces])
    ends: dict[str, tuple[float, float]] = {}
    for name in (n for n in (BASE if is_lumped else LETTERS) if n in known and n not in fixed):
        if name in bounds:
            ends[name] = _given(name, bounds[name], traces, known)
        elif name == "theta_0":
            if _has_spring(known, is_lumped):
                ends[name] = float(y.min()), float(y.max())
        elif known[name] != 0.0 and _matters(name, traces, known, is_lumped):
            low, high = sorted((factors[0] * known[name], factors[1] * known[name]))
            ends[name] = low, high
    return ends


def _known(
    traces: Sequence[Trace],
    datasheet: Datasheet | None,
    fixed: Mapping[str, float],
    bounds: Mapping[str, tuple[float, float]],
    is_angle: bool,
) -> tuple[bool, dict[str, float]]:
    """(whether these are Eq. (6)'s letters, all of them as they are known beforehand)."""
    sheet = dict(datasheet.parameters) if datasheet is not None else {}
    middle = {name: _middle(name, ends) for name, ends in bounds.items()}
    known = {"n": 1.0, **middle, **sheet, **fixed}
    if all(name in known for name in NEEDED) and not (datasheet is not None and datasheet.lumped and not sheet):
        return False, {name: x for name, x in known.items() if name in (*LETTERS, "n")}
    return True, {**_lumped(traces, datasheet, is_angle), **fixed}


def _given(
    name: str, ends: tuple[float, float], traces: Sequence[Trace], known: Mapping[str, float]
) -> tuple[float, float]:
    """The bounds that were asked for; a winding no quicker than a share of the sample time: such a one moves no sample,
    and takes a simulation that many times as long.
    """
    if name not in ("L", "tau_e"):
        return ends
    least = 0.03 * min(t.sample_time for t in traces) * (known["R"] if name == "L" else 1.0)
    return max(ends[0], least), max(ends[1], 2.0 * least)


def _has_spring(known: Mapping[str, float], is_lumped: bool) -> bool:
    """Whether anything brings the rudder home."""
    return any(known.get(name, 0.0) for name in (("a_1", "c_1") if is_lumped else ("k_s", "T_LH")))


def _refuse_others(names: Sequence[str], is_lumped: bool, datasheet: Datasheet | None) -> None:
    """Raise InputError where one of these is no letter that is searched."""
    allowed = LUMPED if is_lumped else LETTERS
    sheet = datasheet.parameters if datasheet is not None else {}
    for name in names:
        if name not in allowed:
            why = (
                f"without {', '.join(x for x in NEEDED if x not in sheet)} of a datasheet"
                if is_lumped
                else "where a datasheet gives those of Eq. (1)"
            )
            raise InputError(f"{name} cannot be fixed or bounded {why}: these are identified, {', '.join(allowed)}")


def _matters(name: str, traces: Sequence[Trace], known: Mapping[str, float], is_lumped: bool) -> bool:
    """Whether a letter of Eq. (6) can show at all: share and ampere only where a current does, or a time constant."""
    seen = any(c.kind == "current" for t in traces for c in t.channels)
    if not is_lumped or name not in ("ampere", "emf_share"):
        return True
    return seen or name == "emf_share" and known.get("tau_e", 0.0) > 0


def _refuse_unknown(given: Mapping) -> None:
    for name in given:
        if name not in (*LETTERS, *LUMPED, "n"):
            raise InputError(
                f"there is no parameter {name[:40]!r}; there are {', '.join(dict.fromkeys((*LETTERS, 'n', *LUMPED)))}"
            )


def _middle(name: str, ends: tuple[float, float]) -> float:
    lower, upper = ends
    if not lower < upper or lower < 0 and name not in ("theta_0", "b"):
        raise InputError(
            f"the bounds of {name} are {lower:g} and {upper:g}, a lower one of at least zero and an upper one above it"
            " were expected"
        )
    return math.sqrt(lower * upper) if lower > 0 else 0.5 * (lower + upper)


def _lumped(traces: Sequence[Trace], datasheet: Datasheet | None, is_angle: bool) -> dict[str, float]:
    """Eq. (6)'s letters as known, or as a first search finds them."""
    known = datasheet.to_lumped() if datasheet is not None else {}
    if not {"a_2", "b"} <= known.keys():
        known = opening(traces, is_angle)
    return {**REST, "ampere": known["b"], **known}
