"""What was read, and what was found in it: the part of diagnosis.json that tells of the data."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ers_mj.data.consistency.sheet import Fault
from ers_mj.data.recording import Recording
from ers_mj.servo.datasheet import Datasheet


def data_of(recordings: Sequence[Recording], holdout: Sequence[Recording], datasheet: Datasheet | None) -> dict:
    """Files, units, problems and faults of what was read."""
    every, first = [*recordings, *holdout], recordings[0]
    degrees = [_degrees(r) if datasheet is not None else [] for r in recordings]
    found = [(r, fault) for r in every for fault in r.faults]
    found += [(r, fault) for r, faults in zip(recordings, degrees, strict=True) for fault in faults]
    return {
        "files": [r.name for r in every],
        "sha256": [r.sha256 for r in every],
        "output_unit": first.output_unit,
        "input_unit": {"pct": "%"}.get(first.input_unit, first.input_unit),
        "input_kind": first.input_kind,
        "problems": [
            *(f"{r.name}: {p}" for r in every for p in r.problems),
            *(f"{r.name}: {fault.sentence}" for r, faults in zip(recordings, degrees, strict=True) for fault in faults),
        ],
        "faults": [fault.as_document(r.name) for r, fault in found],
    }


def _degrees(recording: Recording) -> list[Fault]:
    """A travel far beyond a turn, where a datasheet speaks of a servo, looks like degrees that are named radians."""
    far = np.flatnonzero(np.abs(recording.y) > 2 * math.pi) if recording.output_unit == "rad" else np.zeros(0, int)
    if not far.size:
        return []
    most = float(np.nanmax(np.abs(recording.y)))
    sentence = f"the output reaches {most:.3g} rad, more than a full turn: are these degrees?"
    place = float(recording.t[far[0]]), float(recording.t[far[-1]])
    return [Fault("unit", "theta_rad", sentence, int(far.size), place)]
