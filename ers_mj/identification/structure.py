"""What the data can tell at all: the rank of the sensitivities, and the combinations that are left where it falls
short.

Sensitivities are simulated slopes by the logarithm of each letter, so that an exponent is a number: where a null
vector v of them has whole entries, prod p_i^{v_i s} changes nothing, and with one letter (the pivot) of each null
vector held, every other one stands for the combination p_i / prod pivot_j^{v_ji}.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

WHOLE = 0.02  # from a whole number, within which an exponent is one
HELD_FIRST = (
    "J",
    "R",
    "B",
    "K_t",
    "K_e",
    "L",
    "k_s",
    "T_LH",
    "F_c",
    "ampere",
    "emf_share",
    "tau_e",
)  # pivots, as a reader expects them


@dataclass(frozen=True)
class Structure:
    """Letters (k,), the null space in reduced rows (d, k), 1 at each row's pivot and 0 at the others', and the singular
    values (k,).
    """

    names: tuple[str, ...]
    null: np.ndarray
    pivots: tuple[int, ...]
    singular: np.ndarray

    @property
    def rank(self) -> int:
        """How many combinations the data can tell."""
        return len(self.names) - len(self.pivots)

    @property
    def kept(self) -> list[int]:
        """The letters that are no pivots."""
        return [k for k in range(len(self.names)) if k not in self.pivots]

    def told(self, gradient: np.ndarray) -> bool:
        """Whether something with this gradient (k,) by the letters' logarithms stays the same along the null space."""
        return not len(self.null) or float(np.abs(self.null @ gradient).max()) < WHOLE * max(
            float(np.abs(gradient).max()), 1e-300
        )

    def exponents(self, k: int) -> np.ndarray | None:
        """(k,) of the combination that letter k stands for; None where it is no product of powers."""
        out = np.zeros(len(self.names))
        out[k] = 1.0
        for row, pivot in zip(self.null, self.pivots):
            power = round(row[k])
            if abs(row[k] - power) > WHOLE or (power and self.names[pivot] == "theta_0"):
                return None
            out[pivot] -= power
        return out

    def combination(self, k: int) -> str | None:
        """Its name, as in "K_t/(J R)"; the letter's own where it stands for itself."""
        powers = self.exponents(k)
        if powers is None:
            return None
        above, below = (
            [_power(self.names[i], abs(powers[i])) for i in [k, *self.pivots] if way * powers[i] > 0] for way in (1, -1)
        )
        return " ".join(above) + (f"/{below[0]}" if len(below) == 1 else f"/({' '.join(below)})" if below else "")

    def trades(self) -> list[str]:
        """A sentence for each null vector without a whole exponent: what makes up for what."""
        out = []
        for row, pivot in zip(self.null, self.pivots):
            others = [k for k in self.kept if row[k] != 0.0]
            if others and all(abs(row[k] - round(row[k])) > WHOLE for k in others):
                out.append(
                    f"one per cent of {self.names[pivot]} is made up for by"
                    f" {' and '.join(f'{row[k]:+.2g} % of {self.names[k]}' for k in others)}: these recordings tell"
                    " them together only"
                )
        return out


def _power(name: str, exponent: float) -> str:
    return name if exponent == 1 else f"{name}^{exponent:g}"


def structure_of(
    slopes: np.ndarray, names: Sequence[str], doubt: np.ndarray | None = None, some: np.ndarray | None = None
) -> Structure:
    """From sensitivities (N, k), by the logarithms of the letters, and what they are off by: a direction in which they
    say no more than that does nothing.

    Args:
        doubt: what they are off by (N, k).
        some: the rows (N,) that are looked at, all of them where it is None.
    """
    told = _triangle(slopes, some)
    size = np.linalg.norm(told, axis=0)
    scale = np.maximum(size, 1e-8 * size.max() + 1e-300)
    _, singular, turn = np.linalg.svd(told / scale)
    unsure = np.zeros(len(names))
    if doubt is not None:
        unsure = np.linalg.norm(_triangle(doubt, some) / scale @ turn.T, axis=0)
    # a direction does nothing whose singular value is that small, or no more than three times what it is off by
    null = turn[singular <= np.maximum(1e-6 * singular[0], 3.0 * unsure)] / scale
    null, pivots = _reduced(null / np.maximum(np.abs(null).max(axis=1, keepdims=True), 1e-300), names)
    for array in (null, singular):
        array.setflags(write=False)
    return Structure(tuple(names), null, pivots, singular)


def _triangle(rows: np.ndarray, some: np.ndarray | None, at_once: int = 100_000) -> np.ndarray:
    """R (k, k) with R'R = A'A for some of the rows A (N, k), which has their singular values and directions; block by
    block, so that an hour's rows are not copied (QR of tall matrices, Demmel et al. 2012).
    """
    k = rows.shape[1]
    found = np.zeros((k, k))
    for begin in range(0, len(rows), at_once):
        part = rows[begin : begin + at_once]
        part = part if some is None else part[some[begin : begin + at_once]]
        found = np.linalg.qr(np.vstack([found, part])).R
    return found


def _reduced(null: np.ndarray, names: Sequence[str]) -> tuple[np.ndarray, tuple[int, ...]]:
    """Gauss-Jordan on the rows (d, k), pivots in the order of HELD_FIRST; what is all but zero becomes zero."""
    rows = null.copy()
    pivots: list[int] = []
    for k in sorted(
        range(len(names)), key=lambda k: HELD_FIRST.index(names[k]) if names[k] in HELD_FIRST else len(HELD_FIRST)
    ):
        d = len(pivots)
        if d == len(rows):
            break
        best = d + int(np.argmax(np.abs(rows[d:, k])))
        if abs(rows[best, k]) < WHOLE:
            continue
        rows[[d, best]] = rows[[best, d]]
        rows[d] /= rows[d, k]
        for other in range(len(rows)):
            if other != d:
                rows[other] -= rows[other, k] * rows[d]
        pivots.append(k)
    rows[np.abs(rows) < 1e-4] = 0.0
    return rows[: len(pivots)], tuple(pivots)
