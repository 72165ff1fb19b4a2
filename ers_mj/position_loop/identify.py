"""The numbers of a position loop without a search for effects: the bare loop, its limit, latency and loads."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ers_mj.data.recording import Recording
from ers_mj.position_loop.compared import Selection
from ers_mj.position_loop.fit import Data, Fit, polished
from ers_mj.position_loop.intervals import Intervals
from ers_mj.position_loop.runs import runs_of
from ers_mj.position_loop.selection import Selector

WRONG = 1.5  # mean squared error in noise variances from which the bare loop is said to be wrong


@dataclass(frozen=True)
class Identified:
    """The fit and its data, its intervals, Eq. (13)'s fitness [output unit^2 s], simulations and time."""

    fit: Fit
    data: Data
    intervals: Intervals
    fitness: float
    evaluations: int
    wall_s: float

    @property
    def explains(self) -> bool:
        """Whether the bare loop explains the recordings within their noise."""
        return self.fit.misfit <= WRONG


def identify_loop(
    recordings: Sequence[Recording], jobs: int = 1, progress: Callable[[str, float], None] = lambda text, share: None
) -> Identified:
    """The bare loop fitted to recordings of a position command."""
    begun = time.perf_counter()
    progress("fitting the loop", 0.1)
    selector = Selector(runs_of(recordings), recordings[0].output_unit == "rad", jobs)
    base = selector.base()
    fit = polished(selector.pruned(Selection(base, base, ())).chosen, selector.data)
    errors = [((run.y - fit.model.predicted(run)) ** 2)[run.scored].mean() * run.t[-1] for run in selector.runs]
    progress("telling the intervals", 0.9)
    found = Intervals.of(fit, selector.data)
    return Identified(
        fit, selector.data, found, float(np.sum(errors)), selector.data.simulated[0], time.perf_counter() - begun
    )
