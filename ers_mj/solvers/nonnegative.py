"""Least squares of numbers that are not negative, by the active sets of Lawson and Hanson (1974).

Written here since scipy.optimize brings half a second of imports.
"""

from __future__ import annotations

import numpy as np

MOST_ROUNDS = 3  # times the columns


def nonnegative(design: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The x (k,) >= 0 for which |design x - right| of a design (N, k) is least."""
    columns = design.shape[1]
    upper = np.asarray(np.linalg.qr(np.column_stack([design, right]), mode="r"))  # all that the two tell
    small, seen = upper[:, :columns], upper[:, columns]
    x, is_in = np.zeros(columns), np.zeros(columns, bool)
    least = 1e-12 * float(np.max(np.abs(small.T @ seen), initial=0.0))
    for _ in range(MOST_ROUNDS * columns):
        slope = np.where(is_in, -np.inf, small.T @ (seen - small @ x))
        if not np.max(slope) > least:
            break
        is_in[np.argmax(slope)] = True
        x = _within(small, seen, x, is_in)
    return x


def _within(small: np.ndarray, seen: np.ndarray, x: np.ndarray, is_in: np.ndarray) -> np.ndarray:
    """The best x of the columns that are in, of which those leave that would become negative on the way."""
    while is_in.any():
        best = np.zeros(x.size)
        best[is_in] = np.linalg.lstsq(small[:, is_in], seen, rcond=None)[0]
        falling = is_in & (best <= 0.0)
        if not falling.any():
            return best
        share = np.min(x[falling] / (x[falling] - best[falling] + 1e-300))
        x = x + share * (best - x)
        is_in &= ~(falling & (x <= 1e-14 * np.max(np.abs(x), initial=1e-300)))
        x = np.where(is_in, x, 0.0)
    return np.zeros(x.size)
