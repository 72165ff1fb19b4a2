"""How far apart two estimates are, and what of many such distances is beyond chance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from scipy.stats import norm

LEVEL = 0.05  # chance that anything at all is called different where nothing is
SIDE = float(norm.ppf(0.975))  # a side of a 95 % interval [standard errors]


@dataclass(frozen=True)
class Estimate:
    """A value and its 95 % interval, whose ends may be infinite; equal ends where the value is exact."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, value: float, ends: Sequence[float | None] | None) -> Estimate:
        """From a document, in which an end that is not known is null."""
        low, high = ends or (None, None)
        return cls(value, -math.inf if low is None else low, math.inf if high is None else high)

    @property
    def log_error(self) -> float | None:
        """Standard error of ln(value) where the interval is one of a positive quantity, as far up as down by factor;
        None where it is not.
        """
        if not 0.0 < self.low < self.high < math.inf or not self.low < self.value < self.high:
            return None
        down, up = math.log(self.value / self.low), math.log(self.high / self.value)
        return 0.5 * (down + up) / SIDE if abs(down - up) < 0.05 * (down + up) else None  # in the digits of the ends


def between(a: Estimate, b: Estimate) -> tuple[float, float]:
    """95 % interval of b - a, of independent estimates whose intervals need not be symmetric: the sides that matter
    are added in squares.

    Source: Zou and Donner, Statistics in Medicine 27 (2008), "construction of confidence limits about effect measures".
    """
    apart = b.value - a.value
    return (
        apart - math.hypot(b.value - b.low, a.high - a.value),
        apart + math.hypot(b.high - b.value, a.value - a.low),
    )


def p_value(a: Estimate, b: Estimate) -> float:
    """Chance of two estimates at least so far apart where both mean one value; by their ratio where both are of a
    positive quantity.
    """
    if a.value == b.value:
        return 1.0
    one, other = a.log_error, b.log_error
    if one is not None and other is not None:
        return float(2.0 * norm.sf(abs(math.log(b.value / a.value)) / math.hypot(one, other)))
    low, high = between(a, b)
    apart = b.value - a.value
    side = apart - low if apart > 0.0 else high - apart
    return float(2.0 * norm.sf(SIDE * abs(apart) / side)) if side > 0.0 else 0.0


def beyond_chance(p: Sequence[float], level: float = LEVEL) -> list[bool]:
    """Which of many tests hold together, so that the chance of a single wrong one among them stays at the level.

    Source: Holm, Scandinavian Journal of Statistics 6 (1979).
    """
    out = [False] * len(p)
    for passed, k in enumerate(sorted(range(len(p)), key=lambda k: p[k])):
        if p[k] > level / (len(p) - passed):
            break
        out[k] = True
    return out
