"""What to command next, so that a position loop tells more of itself."""

from __future__ import annotations

import math

import numpy as np

from ers_mj.diagnosis.loop.case import LoopCase
from ers_mj.diagnosis.sentences import shown

SATURATED = 0.01  # share of the samples on the limit from which it parts the plant's damping from the loop's
GAINS = 3.0  # between the firmware's gains in the recordings, from which loop and plant part
FEW_CHANGES = 3  # of a reference from which it excites anything


def next_recording(case: LoopCase) -> dict:
    """The advice, and what it would settle."""
    runs = case.runs
    travel = max(float(np.nanmax(run.y) - np.nanmin(run.y)) for run in runs)
    reached = max(_on_limit(case))
    gains = [run.gain for run in runs]
    asked = []
    if reached < SATURATED:
        asked.append(
            f"steps of the reference of {shown(1.5 * travel, case.output_unit)} and more, so large that the motor is at"
            " its limit for a while: only there do the limit, the plant's own damping and the loop's D part"
        )
    if max(gains) < GAINS * min(gains):
        asked.append(
            "the same steps at a second gain of the firmware, four times higher or lower (column kp): the low gain"
            " shows friction, the high one inertia and latency"
        )
    if case.more_is_left or not asked:
        asked.append(
            "a slow ramp up and down over the whole travel, and a sweep: friction, play and loads show in the first,"
            " latency in the second"
        )
    return {"sentence": f"Command {'; then '.join(asked)}.", "excitation": {}}


def _on_limit(case: LoopCase) -> list[float]:
    """Share of each run's samples at which the drive is at its limit."""
    limit = case.model["L"]
    if not math.isfinite(limit):
        return [0.0]
    out = []
    for run in case.runs:
        drive = np.abs(case.model.motion(run)[:, 3])
        out.append(float(np.mean(drive > 0.999 * case.model.of(run)[0].L)))
    return out
