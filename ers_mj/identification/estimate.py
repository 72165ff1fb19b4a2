"""From recordings to parameters: what to search, the search, what the data tell, and how surely.

traces -> unknowns -> structure (rank) -> search of the combinations -> starts -> precision -> rows and model
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import Recording
from ers_mj.errors import InputError
from ers_mj.identification.answer import Identified, answer
from ers_mj.identification.finding import Settings, best_structure, found_by, polished
from ers_mj.identification.minimisers import MINIMISERS, Minimum
from ers_mj.identification.misfit import Search, Simulator, structure_at
from ers_mj.identification.rollouts import rollouts
from ers_mj.identification.unknowns import unknowns_of
from ers_mj.servo.datasheet import Datasheet

Progress = Callable[[str, float], None]


def identify(
    recordings: Sequence[Recording],
    datasheet: Datasheet | None,
    settings: Settings = Settings(),
    progress: Progress = lambda text, share: None,
) -> Identified:
    """Identify a servo from recordings.

    Args:
        recordings: one or many, of one unit.
        datasheet: where the search begins and what bounds it, or None.
        settings: see there.
        progress: told what is being done and how far it is.

    Raises:
        InputError: a method, a name or bounds that do not exist or contradict each other.
    """
    began = time.monotonic()
    if settings.method not in MINIMISERS:
        raise InputError(f"there is no method {settings.method[:40]!r}; there are {', '.join(MINIMISERS)}")
    progress("looking at what the recordings can tell", 0.02)
    search = _begun(recordings, datasheet, settings)
    progress(f"searching by {settings.method}", 0.1)
    simulate = (
        rollouts(settings.jobs, recordings[0].output_unit == "rad", settings.timestep)
        if settings.plant == "mujoco"
        else None
    )
    x, search, minimum, used = _found(search, settings, simulate)
    progress("measuring how sure that is", 0.8)
    told = answer(recordings, datasheet, settings, search, x, simulate, minimum, used)
    return replace(told, wall_s=time.monotonic() - began)


def _begun(recordings: Sequence[Recording], datasheet: Datasheet | None, settings: Settings) -> Search:
    """What is searched, at what is known beforehand."""
    fixed, bounds = settings.fixed or {}, settings.bounds or {}
    inertia = fixed.get("J") or (datasheet.parameters.get("J") if datasheet is not None else None)
    traces = tuple(trace_of(r, inertia) for r in recordings)
    is_angle = recordings[0].output_unit == "rad"
    unknowns = unknowns_of(traces, datasheet, fixed, bounds, settings.factors, is_angle)
    scale = 0.5 * float(np.ptp(np.concatenate([t.y[t.valid] for t in traces])))
    structure = best_structure(unknowns, traces, scale, settings.seed)
    return Search(unknowns, structure, scale, traces).at_home(unknowns.reference, surely=False)


def _found(begun: Search, settings: Settings, simulate: Simulator | None) -> tuple[np.ndarray, Search, Minimum, int]:
    """As ``found_by``, once more where what was found tells more than the reference did."""
    x, search, minimum, used = found_by(begun, settings, simulate)
    again = structure_at(search.unknowns, begun.traces, search.letters(x), search.scale)
    if not again.rank:
        raise InputError(
            "where the model comes nearest to these recordings no parameter shows: check that the input is the one that"
            " moved the output"
        )
    if again.rank > search.structure.rank:  # the reference was a place where less can be told
        before = used
        x, search, minimum, used = found_by(replace(search, structure=again, traces=begun.traces), settings, simulate)
        return x, search, minimum, used + before
    # or one where stick and slip forked at a touch: what is told is what the found model says
    letters = search.letters(x)
    fewer = again.rank < search.structure.rank
    search = replace(search, unknowns=replace(search.unknowns, reference=letters), structure=again)
    x = search.coordinates(letters)
    if fewer and (settings.method == "ls" or settings.polish):  # what a coordinate that cannot be told had kept apart
        x, search, more = polished(search, x, math.inf, simulate)
        used += more
    return x, search, minimum, used
