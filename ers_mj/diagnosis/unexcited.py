"""Recordings in which the input never changes: what they can tell, and what to record instead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ers_mj.data.excitation import SHARES, Limits, excitations
from ers_mj.data.prepared import Trace
from ers_mj.experiment_design.wording import asked

CANNOT = "The input never changes in these recordings: a gain cannot be told from a load, and no effect is looked for."


def is_unexcited(recordings: Sequence) -> bool:
    """Whether all inputs are one value throughout; of recordings or traces."""
    return float(np.ptp([end for r in recordings for end in (np.min(r.u), np.max(r.u))])) == 0.0


def told_together(traces: Sequence[Trace]) -> tuple[str, ...]:
    """The numbers that an input which never changes cannot tell: its gain, and where a spring rests unless it is 0."""
    if not is_unexcited(traces):
        return ()
    return ("b", "ampere", "theta_0") if traces[0].u[0] else ("b", "ampere")


def moving_input(traces: Sequence[Trace], input_unit: str, output_unit: str) -> dict:
    """The advice of an input that moves, of the size of the one that was held, as `next_recording` gives it."""
    level = float(traces[0].u[0])
    sentence = "Record an input that moves both ways, as far as the rig may go, such as a multisine or held steps."
    excitation: dict = {}
    if level:
        limits = replace(Limits.of(traces, False), low_u=-abs(level), high_u=abs(level))
        shapes = excitations(limits, SHARES)
        best = next((s for s in shapes if s[0]["kind"] == "multisine"), shapes[0])[0]
        excitation = {**best, "input_unit": input_unit, "output_unit": output_unit}
        sentence = f"{asked(excitation)} An input that moves tells a gain from a load."
    return {
        "sentence": sentence,
        "excitation": excitation,
        "separates": [],
        "expected_sigmas": 0.0,
        "channel": None,
        "checked": {},
    }
