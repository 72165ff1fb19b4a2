"""The rows of an answer: every letter with its interval or why it cannot be told, and the combinations that can."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ers_mj.identification.misfit import IN_PROPORTION, STEP, Search, central
from ers_mj.identification.precision import Precision
from ers_mj.identification.unknowns import LETTERS, unit_of_letter

PRINTED = ("a_1", "a_2", "b", "c_1", "c_2", "theta_0")


@dataclass(frozen=True)
class Row:
    """One line of the answer: a letter, a combination, or a letter of Eq. (6); None for what is not told."""

    name: str
    value: float | None
    unit: str
    ci95: tuple[float | None, float | None]
    datasheet: float | None
    identifiable: bool
    fixed: bool = False
    why: str = ""

    def as_document(self) -> dict:
        """As diagnosis.json has it, with what was fixed and why a number is not told."""
        return {
            "value": self.value,
            "unit": self.unit,
            "ci95": list(self.ci95),
            "datasheet": self.datasheet,
            "identifiable": self.identifiable,
            "fixed": self.fixed,
        } | ({"why": self.why} if self.why else {})


@dataclass(frozen=True, eq=False)
class Rows:
    """What makes the rows of an answer.

    Attributes:
        search: whose letters they are.
        letters: (k,) what was found of them.
        precision: how surely.
        ends: of a profile, by the letter of its coordinate: the coordinate's factors to the reference, None where it
            never crossed the level.
        sheet: what was known, by letter.
        y, u: units of output and input.
    """

    search: Search
    letters: np.ndarray
    precision: Precision
    ends: Mapping[str, tuple[float | None, ...]]
    sheet: Mapping[str, float]
    y: str
    u: str

    def all(self) -> list[Row]:
        """Eq. (6)'s letters, then Eq. (1)'s, then the combinations that stand for those which cannot be told."""
        unknowns = self.search.unknowns
        rows = [self._of_eq_6(name) for name in PRINTED]
        if unknowns.is_lumped:
            return rows + [self._of_eq_6(n) for n in ("tau_e", "emf_share", "ampere") if n in unknowns.names]
        there = (*unknowns.names, *unknowns.known)
        rows += [self._of_eq_1(name) for name in LETTERS if name != "theta_0" and name in there]
        return rows + self._combinations()

    def _of_eq_6(self, name: str) -> Row:
        unknowns = self.search.unknowns
        return self.row(name, lambda v: unknowns.values(v)[name], self._unit(name))

    def _of_eq_1(self, name: str) -> Row:
        unknowns = self.search.unknowns
        if name not in unknowns.names:
            value = unknowns.known[name]
            ci95 = (value, value) if name in unknowns.fixed else (None, None)
            return Row(name, value, self._unit(name), ci95, self.sheet.get(name), True, True, "held")
        k = unknowns.names.index(name)
        own = name if self.search.structure.told(np.eye(len(self.letters))[k]) else None
        return self.row(name, lambda v: v[k], self._unit(name), own=own)

    def _unit(self, name: str) -> str:
        return unit_of_letter(name, self.y, self.u)

    def _combinations(self) -> list[Row]:
        """Products of powers of several letters, each under the letter that stands for it."""
        structure, names, out = self.search.structure, self.search.unknowns.names, []
        for k in structure.kept:
            powers, name = structure.exponents(k), structure.combination(k)
            if powers is not None and name is not None and np.count_nonzero(powers) > 1:
                product = lambda v, powers=powers: float(np.prod(v[powers != 0] ** powers[powers != 0]))
                unit = unit_of_powers(names, powers, self.y, self.u)
                known = [self.sheet.get(letter) for letter in names]
                out.append(self.row(name, product, unit, _product(known, powers), names[k]))
        return out

    def row(
        self,
        name: str,
        function: Callable[[np.ndarray], float],
        unit: str,
        known: float | None = None,
        own: str | None = None,
    ) -> Row:
        """One line: the value of a function of the letters (k,), its interval, or null where the null space or the
        noise moves it. ``known`` is what the datasheet says where that goes by another name, ``own`` the letter whose
        profile is that of this line.
        """
        known = self.sheet.get(name) if known is None else known
        search, letters = self.search, self.letters
        value, by_letter = float(function(letters)), _gradient(search, letters, function)
        if value == 0.0 and not np.any(by_letter):
            return Row(name, 0.0, unit, (None, None), known, True, True, "absent")
        untold = lambda why: Row(name, None, unit, (None, None), known, False, why=why)
        if not search.structure.told(by_letter / (abs(value) or 1.0)):
            return untold("these recordings tell it in combination with others only")
        by_coordinate, size = _by_coordinate(search, letters, by_letter), self.precision.fisher.shape[0]
        half = self.precision.half_width(np.concatenate([by_coordinate, np.zeros(size - by_coordinate.size)]))
        relative = half / abs(value) if name != "theta_0" else half / search.scale
        if not relative < 1.0:
            return untold(f"too weak in these recordings: its 95 % half-width would be {relative:.0%} of it")
        return Row(name, value, unit, self._ends(name, value, half, own), known, True)

    def _ends(self, name: str, value: float, half: float, own: str | None) -> tuple[float, float]:
        """The interval: a profile's ends where it has been followed."""
        low, high = value - half, value + half
        letter = name.partition("/")[0]
        if own is None or own not in self.ends or letter not in self.search.names:
            return low, high
        k = self.search.names.index(letter)
        scale = value / factor_of(letter, self.search.coordinates(self.letters)[k])
        least, most = self.ends[own]
        return low if least is None else least * scale, high if most is None else most * scale


def _product(known: Sequence[float | None], powers: np.ndarray) -> float | None:
    """A product of powers of known letters, None where one of them is not."""
    used = [(p, q) for p, q in zip(known, powers) if q]
    return float(np.prod([p**q for p, q in used])) if all(p for p, _ in used) else None


def factor_of(name: str, z: float) -> float:
    """The factor to the reference that a letter's coordinate means."""
    return z if name in IN_PROPORTION else math.exp(z)


def _gradient(search: Search, letters: np.ndarray, function: Callable[[np.ndarray], float]) -> np.ndarray:
    """Slopes (k,) of a function of the letters by their logarithms (theta_0: by half travels)."""
    angle = np.array([name == "theta_0" for name in search.unknowns.names])
    return central(
        lambda z: np.array([function(np.where(angle, letters + search.scale * z, letters * np.exp(z)))]),
        np.zeros(letters.size),
        STEP,
    )[0]


def _by_coordinate(search: Search, letters: np.ndarray, by_letter: np.ndarray) -> np.ndarray:
    """The same by the search's coordinates (r,)."""
    here = search.coordinates(letters)
    return np.array(
        [
            by_letter[k] / here[i] if name in IN_PROPORTION else by_letter[k]
            for i, (k, name) in enumerate(zip(search.structure.kept, search.names))
        ]
    )


def unit_of_powers(names: Sequence[str], powers: np.ndarray, y: str, u: str) -> str:
    """The unit of a product of powers, as the letters' units stand."""
    above = [unit_of_letter(n, y, u) for n, q in zip(names, powers) if q > 0]
    below = [unit_of_letter(n, y, u) for n, q in zip(names, powers) if q < 0 for _ in range(round(-q))]
    return "/".join([" ".join(above), *(f"({unit})" if " " in unit else unit for unit in below)])
