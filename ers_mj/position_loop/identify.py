"""The numbers of a position loop without a search for effects: the bare loop, its limit, latency and loads."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from ers_mj.data.recording import Recording
from ers_mj.errors import InputError
from ers_mj.position_loop.compared import Selection
from ers_mj.position_loop.fit import Data, Fit, fitted, polished
from ers_mj.position_loop.intervals import Intervals
from ers_mj.position_loop.model import LETTERS, LoopModel
from ers_mj.position_loop.runs import runs_of, scales_of
from ers_mj.position_loop.selection import EFFORT, Selector

HELD = ("heavy", "buried")  # what no fit moves
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
    recordings: Sequence[Recording],
    jobs: int = 1,
    progress: Callable[[str, float], None] = lambda text, share: None,
    known: LoopModel | None = None,
    fix: Mapping[str, float] = MappingProxyType({}),
) -> Identified:
    """The bare loop fitted to recordings of a position command, or one that is ``known`` but for its numbers; those of
    ``fix`` are held.

    Raises:
        InputError: a number is held that the loop does not have, or where no loop has it.
    """
    begun = time.perf_counter()
    progress("fitting the loop", 0.1)
    selector = Selector(runs_of(recordings), recordings[0].output_unit == "rad", jobs)
    if known is None:
        base = selector.base()
        chosen = selector.pruned(Selection(base, base, ())).chosen
    else:
        chosen = fitted(_begun(known, selector, fix), selector.data, EFFORT.full)
    fit = polished(chosen, selector.data)
    errors = [((run.y - fit.model.predicted(run)) ** 2)[run.scored].mean() * run.t[-1] for run in selector.runs]
    progress("telling the intervals", 0.9)
    found = Intervals.of(fit, selector.data)
    return Identified(
        fit, selector.data, found, float(np.sum(errors)), selector.data.simulated[0], time.perf_counter() - begun
    )


def _begun(known: LoopModel, selector: Selector, fix: Mapping[str, float]) -> LoopModel:
    """A known loop whose numbers are to be fitted, all that it has but those that are held."""
    there = [x for x in LETTERS if math.isfinite(known[x]) and known[x] != LETTERS[x].absent and x not in HELD]
    for name, value in fix.items():
        if name not in there:
            raise InputError(f"{name} cannot be fixed: this loop has {', '.join(there)}")
        letter = LETTERS[name]
        low = letter.lower - letter.late * known["K"]
        if not low <= value <= letter.upper:
            raise InputError(f"{name} cannot be fixed at {value:g}: {low:g} to {letter.upper:g} was expected")
    drive = known["L"] if math.isfinite(known["L"]) else 0.0
    scales = scales_of(selector.runs, selector.is_angle, known["c_2"], drive)
    model = replace(known, free=tuple(x for x in there if x not in fix), scales=scales)
    return replace(model, values={**model.values, **fix})
