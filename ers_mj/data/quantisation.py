"""What a coarse converter tells: within a step nothing, but when a threshold is passed.

    reading y (N,) in whole steps -> the angle lies within half a step of y, to the noise ahead of the converter
                                  -> between two thresholds passed the same way it goes nearly straight

A deviation within half a step hardly counts; what is beyond counts by what the noise ahead makes of it. Taken as noise
of q / sqrt(12), rounding would hide all that is smaller than a step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Weighing:
    """How a reading within a step counts."""

    # of a step, the least noise ahead of it: what a sample time, its lattice and a sensor's small errors make
    ahead: float = 0.05
    # of the weight that a deviation has as noise, which it has within a step: hardly more than nothing
    within: float = 0.1
    straight: float = 0.05  # [s] between two thresholds, up to which the way between is taken for straight


WEIGHING = Weighing()


@dataclass(frozen=True)
class Converter:
    """A converter of this ``step`` [output unit]: ``sigma`` is the reading's noise with rounding, ``ahead`` that
    without, at least WEIGHING.ahead of a step.
    """

    step: float
    sigma: float

    @property
    def ahead(self) -> float:
        return max(math.sqrt(max(self.sigma**2 - self.step**2 / 12.0, 0.0)), WEIGHING.ahead * self.step)

    @property
    def sure_noise(self) -> float:
        """Root mean square of ``beyond`` by Gaussian noise ahead, wherever within a step."""
        return self.ahead * math.sqrt(4.0 / (3.0 * math.sqrt(2.0 * math.pi)) * self.ahead / self.step)

    def weighed(self, deviation: np.ndarray) -> np.ndarray:
        """Deviations (N,) [output unit] in sigmas: steeper beyond half a step."""
        return WEIGHING.within * deviation / self.sigma + np.sign(deviation) * self.beyond(deviation) * (
            1.0 / self.sure_noise - WEIGHING.within / self.sigma
        )

    def slope(self, deviation: np.ndarray) -> np.ndarray:
        """Of ``weighed`` by the deviation, times sigma, (N,)."""
        return np.where(self.beyond(deviation) > 0.0, self.sigma / self.sure_noise, WEIGHING.within)

    def plain(self, e: np.ndarray) -> np.ndarray:
        """The deviations over sigma of what ``weighed`` gives (N,)."""
        edge = 0.5 * self.step / self.sigma
        further = np.maximum(np.abs(e) - WEIGHING.within * edge, 0.0)
        return np.sign(e) * np.where(
            further > 0.0, edge + further * self.sure_noise / self.sigma, np.abs(e) / WEIGHING.within
        )

    def beyond(self, deviation: np.ndarray) -> np.ndarray:
        """The sizes (N,) of what is no rounding of deviations (N,) [output unit]."""
        return np.maximum(np.abs(deviation) - 0.5 * self.step, 0.0)

    def path(self, t: np.ndarray, y: np.ndarray) -> np.ndarray:
        """The way (N,) [output unit] from threshold to threshold of a reading y (N,); NaN where it is not known: it
        turned within a step, or rested.
        """
        passed = thresholds(y)
        if passed.size < 2:
            return np.full(y.size, np.nan)
        when, where = (0.5 * (x[passed] + x[passed + 1]) for x in (t, y))
        up = y[passed + 1] > y[passed]
        span = np.clip(np.searchsorted(when, t), 1, passed.size - 1)
        straight = (up[1:] == up[:-1]) & (np.diff(when) < WEIGHING.straight)
        within = (t >= when[0]) & (t <= when[-1]) & straight[span - 1]
        return np.where(within, np.clip(np.interp(t, when, where), y - 0.5 * self.step, y + 0.5 * self.step), np.nan)


def thresholds(y: np.ndarray) -> np.ndarray:
    """The samples of a reading y (N,) behind which a threshold is passed; not where one is missing."""
    return np.flatnonzero(np.abs(np.diff(y)) > 0.0)
