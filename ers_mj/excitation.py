"""What to record next: the named input whose response the two best explanations disagree on most."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ers_mj.effects import BY_NAME
from ers_mj.plants.inputs import INPUTS
from ers_mj.selection import Selection
from ers_mj.traces import Trace

DURATION = 10.0  # [s]


def next_recording(selection: Selection, traces: Sequence[Trace], input_unit: str) -> dict:
    """{"sentence", "excitation"}: both explanations are simulated under every named input, scaled to the input's peak so far."""
    pair = _rivals(selection)
    if pair is None:
        return {"sentence": "Nothing is left to settle: a second recording of the same kind would confirm this one.", "excitation": {}}
    (name_a, a), (name_b, b) = pair
    peak, step = max(float(np.max(np.abs(t.u))) for t in traces), min(t.sample_time for t in traces)
    t = np.arange(0.0, DURATION, step)
    best = ("", 0.0)
    for name, wave in INPUTS.items():
        u = wave(t)
        u = u * peak / np.max(np.abs(u))
        start = (float(np.median([x.start[0] for x in traces])), 0.0)
        gap = a.plant().theta(t, u, start) - b.plant().theta(t, u, start)
        size = float(np.sqrt(np.mean(gap**2))) / traces[0].sigma
        if np.isfinite(size) and size > best[1]:
            best = (name, size)
    names = f"{name_a.replace('_', ' ')} from {name_b.replace('_', ' ')}"
    return {"sentence": f"Record a {best[0]} with peaks of {peak:.3g} {input_unit}: it would tell {names}, which differ there by "
                        f"{best[1]:.3g} times the noise (both simulated, before any refit).",
            "excitation": {"input": best[0], "peak": peak, "duration_s": DURATION, "separation_sigma": best[1],
                           "between": [name_a, name_b]}}


def _rivals(selection: Selection):
    """The two best single explanations of the last round that found something."""
    for ranked in reversed(selection.rounds):
        named = [c for c in ranked if c.name in BY_NAME and c.gain > 0]
        if len(named) > 1:
            return (named[0].name, named[0].fit.model), (named[1].name, named[1].fit.model)
    return None
