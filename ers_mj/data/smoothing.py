"""Parabolas through the neighbours of every sample (Savitzky and Golay 1964): values or slopes, to the very ends.

Written here since scipy.signal brings a second of imports.
"""

from __future__ import annotations

import numpy as np


def parabolic(y: np.ndarray, window: int, step: float | None = None) -> np.ndarray:
    """The values (N,) of parabolas through an odd ``window`` of samples around each; their slopes where the ``step``
    between samples is given.
    """
    window = min(window, y.size - 1 + y.size % 2)
    half = window // 2
    place = np.arange(-half, half + 1)
    of_samples = np.linalg.pinv(np.vander(place, 3, increasing=True))
    shown = lambda at: np.vander(at, 3, increasing=True)
    scale = 1.0
    if step is not None:
        shown, scale = lambda at: np.column_stack([0.0 * at, 1.0 + 0.0 * at, 2.0 * at]), 1.0 / step
    ends = [
        shown(at) @ of_samples @ some for at, some in ((place[:half], y[:window]), (place[half + 1 :], y[-window:]))
    ]
    inner = np.correlate(y, (shown(np.zeros(1)) @ of_samples)[0], "valid")
    return scale * np.concatenate([ends[0], inner, ends[1]])
