"""Student's t distribution."""

from __future__ import annotations

import math
from functools import cache


@cache
def quantile(freedom: int, share: float) -> float:
    """The t below which a ``share`` of at least a half lies, of so many degrees of freedom, by bisection.

    Written here since scipy.special brings a third of a second of imports.
    """
    low, high = 0.0, 1.0
    while below(freedom, high) < share:
        low, high = high, 2.0 * high
    while high - low > 1e-15 * high:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (middle, high) if below(freedom, middle) < share else (low, middle)
    return 0.5 * (low + high)


def below(freedom: int, t: float) -> float:
    """The share below t >= 0: the finite sum of Abramowitz and Stegun, 26.7.3 and 26.7.4."""
    angle = math.atan2(t, math.sqrt(freedom))
    sine, square = math.sin(angle), math.cos(angle) ** 2
    first, term = (1, math.cos(angle)) if freedom % 2 else (0, 1.0)
    total = 0.0
    for k in range(first, freedom - 1, 2):
        total += term
        term *= square * (k + 1) / (k + 2)
    within = (angle + sine * total) * 2.0 / math.pi if freedom % 2 else sine * total
    return 0.5 + 0.5 * within
