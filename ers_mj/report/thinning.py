"""Curves and spans thinned to what can be seen."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ers_mj.diagnosis.evidence import RecordView


def decimate(t: np.ndarray, x: np.ndarray, points: int) -> tuple[np.ndarray, np.ndarray]:
    """t and x (N,) thinned to the lowest and the highest value of each of points/2 spans; a span of NaN stays a
    hole.
    """
    bins = points // 2
    if t.size <= points:
        return t, x
    edges = np.linspace(0, t.size, bins + 1).astype(int)
    starts = edges[:-1]
    low = np.minimum.reduceat(np.where(np.isfinite(x), x, np.inf), starts)
    high = np.maximum.reduceat(np.where(np.isfinite(x), x, -np.inf), starts)
    empty = ~np.isfinite(low)
    rising = x[edges[1:] - 1] >= x[starts]
    first, second = np.where(rising, low, high), np.where(rising, high, low)
    first[empty], second[empty] = np.nan, np.nan
    middle = t[(edges[:-1] + edges[1:] - 1) // 2]
    return np.column_stack([t[starts], middle]).ravel(), np.column_stack([first, second]).ravel()


def largest(x: np.ndarray) -> float:
    """The largest size in x, 0 where nothing is known."""
    return float(np.nanmax(np.abs(x))) if np.isfinite(x).any() else 0.0


def merged(spans: tuple[tuple[float, float], ...], closest: float) -> Iterator[tuple[float, float]]:
    """Spans in order, those nearer than `closest` joined."""
    current = None
    for begin, end in sorted(spans):
        if current is not None and begin <= current[1] + closest:
            current = (current[0], max(current[1], end))
            continue
        if current is not None:
            yield current
        current = (begin, end)
    if current is not None:
        yield current


def worst_span(view: RecordView, share: float = 0.08) -> tuple[float, float] | None:
    """The span [s] of this share of the recording in which the squared residual before is largest."""
    n = max(int(share * view.t.size), 60)
    if view.t.size < 6 * n:
        return None
    error = np.nan_to_num(view.measured - view.before) ** 2
    total = np.concatenate([[0.0], np.cumsum(error)])
    begin = int(np.argmax(total[n:] - total[:-n]))
    begin = min(max(begin - n // 4, 0), view.t.size - int(1.5 * n) - 1)
    return float(view.t[begin]), float(view.t[begin + int(1.5 * n)])
