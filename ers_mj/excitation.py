"""What to record next: the named input whose response the two best explanations disagree on most."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ers_mj.plants.inputs import INPUTS
from ers_mj.selection import Candidate
from ers_mj.traces import Trace

DURATION = 10.0  # [s]


def next_recording(rivals: tuple[Candidate, Candidate] | None, traces: Sequence[Trace], input_unit: str) -> dict:
    """{"sentence", "excitation"}: both rivals are simulated under every named input, scaled to the input's peak so far."""
    if rivals is None:
        return {"sentence": "No two explanations are left to tell apart; a second recording of the same kind would confirm this one.",
                "excitation": {}}
    peak, step = max(float(np.max(np.abs(t.u))) for t in traces), min(t.sample_time for t in traces)
    t, start = np.arange(0.0, DURATION, step), (float(np.median([x.start[0] for x in traces])), 0.0)
    best = ("", 0.0)
    for name, wave in INPUTS.items():
        u = wave(t)
        u = u * peak / np.max(np.abs(u))
        a, b = (rival.fit.model.plant().theta(t, u, start) for rival in rivals)
        size = float(np.sqrt(np.mean((a - b) ** 2))) / traces[0].sigma
        if np.isfinite(size) and size > best[1]:
            best = (name, size)
    first, second = (rival.name.replace("_", " ") for rival in rivals)
    return {"sentence": f"Record a {best[0]} with peaks of {peak:.3g} {input_unit}: {first} and {second}, which these recordings cannot tell "
                        f"apart, differ there by {best[1]:.3g} times the noise (both simulated as they stand, without a refit).",
            "excitation": {"input": best[0], "peak": peak, "duration_s": DURATION, "separation_sigma": best[1],
                           "between": [rival.name for rival in rivals]}}
