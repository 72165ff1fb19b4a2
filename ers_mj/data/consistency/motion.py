"""How signals of a recording move, and how alike two of them are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ers_mj.data.consistency.sheet import Sheet


@dataclass(frozen=True)
class Following:
    """Over what a speed is taken, and how late a servo may follow."""

    over: float = 0.02  # [s] over which a speed is taken
    alike: float = 0.05  # of a correlation, by which two lags are as good as alike
    latest: float = 0.5  # [s] by which a servo may follow late,
    tried: int = 12  # and how many lags are tried


FOLLOWING = Following()


def speed(sheet: Sheet) -> np.ndarray:
    """The output's (N,) [output unit / s], by differences over about FOLLOWING.over; 0 where nothing is known."""
    known = np.isfinite(sheet.y)
    y = np.interp(sheet.t, sheet.t[known], sheet.y[known])
    k = min(max(1, round(0.5 * FOLLOWING.over / float(np.median(np.diff(sheet.t))))), y.size // 4)
    late, early = np.minimum(np.arange(y.size) + k, y.size - 1), np.maximum(np.arange(y.size) - k, 0)
    return (y[late] - y[early]) / (sheet.t[late] - sheet.t[early])


def likeness(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Slope of y over x (N,), and their correlation, both 0 where one of them does not vary."""
    known = np.isfinite(x) & np.isfinite(y)
    if np.count_nonzero(known) < 3:
        return 0.0, 0.0
    x, y = x[known] - np.mean(x[known]), y[known] - np.mean(y[known])
    xx, yy = float(x @ x), float(y @ y)
    return (float(x @ y) / xx, float(x @ y) / np.sqrt(xx * yy)) if xx > 0.0 and yy > 0.0 else (0.0, 0.0)


def lagged(x: np.ndarray, y: np.ndarray, lags: np.ndarray) -> tuple[float, float]:
    """Slope and correlation of y over x (N,) at the lag of y (samples) at which they are most alike; of lags at which
    they are as good as most alike the first, since a wave is alike again, upside down, half a period later.
    """
    found = [likeness(x[: x.size - k], y[k:]) for k in lags]
    most = max(abs(alike) for _, alike in found)
    first = next(k for k, (_, alike) in enumerate(found) if abs(alike) > most - FOLLOWING.alike)
    run = [pair for pair in found[first:] if pair[1] * found[first][1] >= 0.0]
    return max(run, key=lambda pair: abs(pair[1]))


def lags_of(sheet: Sheet) -> np.ndarray:
    """Samples by which an output may follow late."""
    step = float(np.median(np.diff(sheet.t)))
    most = min(round(FOLLOWING.latest / step), sheet.t.size // 4)
    return np.unique(np.linspace(0, most, FOLLOWING.tried).astype(int))
