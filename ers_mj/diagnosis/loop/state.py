"""What differs between recordings of a servo under a position command: loads and gains as they were recorded, and what
a single recording says of gain, offset and friction against all of them together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ers_mj.diagnosis.loop.case import LoopCase
from ers_mj.diagnosis.sentences import shown
from ers_mj.position_loop.fit import Data, fitted
from ers_mj.position_loop.intervals import Intervals, Told
from ers_mj.position_loop.model import only_letters
from ers_mj.position_loop.runs import Run

STEPS = 8  # of the fit of one recording's state
MOST_TOLD = 8  # recordings that are told one by one
SURE = 1.5  # of a 95 % interval, within which so many numbers differ by chance
LETTERS = ("K", "offset", "c_2")
State = tuple[str, str, list[float], list[tuple[float, float]]]  # name, unit, values and intervals, a recording each


def record_state(case: LoopCase) -> list[dict]:
    """The states of diagnosis.json, of training recordings first, then of held-out ones."""
    runs = [*case.runs, *(case.held if case.holdout else [])]
    names = [recording.name for recording in (*case.recordings, *case.holdout)]
    if len(runs) < 2:
        return []
    gains, *others = _fitted(case, runs)
    told = [state for state in (_gains(case, runs, gains), _loads(case, runs)) if max(state[2]) > min(state[2])]
    told += [state for state in others if _differs(case, state)]
    return [_entry(state, names) for state in told]


def _gains(case: LoopCase, runs: Sequence[Run], found: State) -> State:
    """The firmware's gain over that of the first recording: as it was recorded, times what is fitted beside it."""
    given = [run.gain for run in runs]
    if not _differs(case, found):
        return "gain", "-", given, [(g, g) for g in given]
    _, _, values, ends = found
    first = values[0]
    scaled = [g * v / first for g, v in zip(given, values, strict=True)]
    return "gain", "-", scaled, [(g * a / first, g * b / first) for g, (a, b) in zip(given, ends, strict=True)]


def _loads(case: LoopCase, runs: Sequence[Run]) -> State:
    """Inertia over that of the first recording, by the loads as they were recorded."""
    model, rotor = case.model, case.intervals.told("", "rotor")
    values = [1.0 / model.lightness(run) for run in runs]
    known = rotor.ci95 if rotor is not None else (model["rotor"],) * 2
    ends = [[1.0 / model.fixed(rotor=x).lightness(run) for x in known] for run in runs]
    return "load", "-", values, [(min(pair), max(pair)) for pair in ends]


def _fitted(case: LoopCase, runs: Sequence[Run]) -> list[State]:
    """Gain, offset and friction level that each recording alone asks for beside the answer."""
    model = case.model
    alone = only_letters(model, LETTERS)
    columns: list[list[Told]] = [[], [], []]
    for run in runs:
        data = Data.of([run])
        found = Intervals.of(fitted(alone, data, STEPS), data)
        wide = replace(found, factor=SURE * found.factor)
        for column, letter in zip(columns, LETTERS, strict=True):
            told = wide.told("", letter)
            assert told is not None
            column.append(told)
    gains, offsets, levels = columns
    taken = [run.offset for run in runs]
    return [
        ("gain", "-", *_scaled(gains, model["K"])),
        (
            "offset",
            case.output_unit,
            [x.value + y for x, y in zip(offsets, taken, strict=True)],
            [(x.ci95[0] + y, x.ci95[1] + y) for x, y in zip(offsets, taken, strict=True)],
        ),
        ("friction_level", "-", *_scaled(levels, max(model["c_2"], 1e-300))),
    ]


def _scaled(column: Sequence[Told], size: float) -> tuple[list[float], list[tuple[float, float]]]:
    return [x.value / size for x in column], [(x.ci95[0] / size, x.ci95[1] / size) for x in column]


def _differs(case: LoopCase, state: State) -> bool:
    """Whether recordings differ beyond their intervals, and by enough to be worth a line."""
    name, _, values, ends = state
    travel = max(float(np.nanmax(run.y) - np.nanmin(run.y)) for run in case.runs)
    least = case.policy.state_offset * 0.5 * travel if name == "offset" else case.policy.state_factor
    apart = max(low for low, _ in ends) > min(high for _, high in ends)
    return apart and max(values) - min(values) > least


def _entry(state: State, names: Sequence[str]) -> dict:
    name, unit, values, ends = state
    told = ", ".join(f"{of} {shown(v, unit)}" for of, v in zip(names, values, strict=True))
    if len(values) > MOST_TOLD:
        low, high = int(np.argmin(values)), int(np.argmax(values))
        least, most = (f"{shown(values[k], unit)} ({names[k]})" for k in (low, high))
        told = f"from {least} to {most}, over {len(values)} of them"
    return {
        "name": name,
        "unit": unit,
        "values": [float(v) for v in values],
        "ci95": [[float(a), float(b)] for a, b in ends],
        "sentence": f"{name.replace('_', ' ')} differs between the recordings: {told}",
    }
