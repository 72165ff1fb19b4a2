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
from ers_mj.identification.minimisers import MINIMISERS
from ers_mj.identification.misfit import Search, structure_at
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
    inertia = (settings.fixed or {}).get("J") or (datasheet.parameters.get("J") if datasheet is not None else None)
    traces = tuple(trace_of(r, inertia) for r in recordings)
    unknowns = unknowns_of(
        traces,
        datasheet,
        settings.fixed or {},
        settings.bounds or {},
        settings.factors,
        recordings[0].output_unit == "rad",
    )
    y = np.concatenate([t.y[t.valid] for t in traces])
    scale = 0.5 * float(np.ptp(y))
    search = Search(unknowns, best_structure(unknowns, traces, scale, settings.seed), scale, traces).at_home(
        unknowns.reference, surely=False
    )
    progress(f"searching by {settings.method}", 0.1)
    simulate = (
        rollouts(settings.jobs, recordings[0].output_unit == "rad", settings.timestep)
        if settings.plant == "mujoco"
        else None
    )
    x, search, minimum, used = found_by(search, settings, simulate)
    again = structure_at(search.unknowns, traces, search.letters(x), scale)
    if not again.rank:
        raise InputError(
            "where the model comes nearest to these recordings no parameter shows: check that the input is the one that"
            " moved the output"
        )
    if again.rank > search.structure.rank:  # the reference was a place where less can be told
        before = used
        x, search, minimum, used = found_by(replace(search, structure=again, traces=traces), settings, simulate)
        used += before
    else:  # or one where stick and slip forked at a touch: what is told is what the found model says
        letters = search.letters(x)
        fewer = again.rank < search.structure.rank
        search = replace(search, unknowns=replace(search.unknowns, reference=letters), structure=again)
        x = search.coordinates(letters)
        if fewer and (settings.method == "ls" or settings.polish):  # what one coordinate too many had kept apart
            x, search, more = polished(search, x, math.inf, simulate)
            used += more
    progress("measuring how sure that is", 0.8)
    told = answer(recordings, datasheet, settings, search, x, simulate, minimum, used)
    return replace(told, wall_s=time.monotonic() - began)
