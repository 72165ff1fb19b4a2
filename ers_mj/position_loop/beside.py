"""A drive signal that was recorded beside the output: what the loop's drive and the speed explain of it.

    voltage, duty   second = s_1 drive
    current         second = s_1 drive + s_2 w      (the back-EMF takes its share)

with the drive [output unit/s^2] of the first run's inertia. The factors s belong to the servo and follow from the
motion by linear least squares over all runs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ers_mj.position_loop.model import LoopModel
from ers_mj.position_loop.runs import Beside, Run


def columns(model: LoopModel, run: Run, motion: np.ndarray) -> np.ndarray:
    """What the signal is made of (N, 1 or 2), over the scored samples."""
    assert run.beside is not None
    drive = motion[:, 3:4] / model.lightness(run)
    made = np.hstack([drive, motion[:, 1:2]]) if run.beside.is_current else drive
    return made[run.beside.scored]


def factors(model: LoopModel, runs: Sequence[Run], motions: Sequence[np.ndarray]) -> np.ndarray:
    """The factors s (1 or 2,) over all runs that have the signal."""
    pairs = [(columns(model, run, m) / b.sigma, b.values[b.scored] / b.sigma) for run, b, m in _having(runs, motions)]
    if not all(np.isfinite(a).all() for a, _ in pairs):
        return np.full(pairs[0][0].shape[1], np.nan)
    return np.linalg.lstsq(np.concatenate([a for a, _ in pairs]), np.concatenate([x for _, x in pairs]), rcond=None)[0]


def errors(model: LoopModel, runs: Sequence[Run], motions: Sequence[np.ndarray]) -> list[tuple[Beside, np.ndarray]]:
    """The signal of each run that has it, and what the motions leave of it (scored samples) [its unit]."""
    having = _having(runs, motions)
    if not having:
        return []
    s = factors(model, runs, motions)
    return [(b, b.values[b.scored] - columns(model, run, m) @ s) for run, b, m in having]


def _having(runs: Sequence[Run], motions: Sequence[np.ndarray]) -> list[tuple[Run, Beside, np.ndarray]]:
    return [(run, run.beside, m) for run, m in zip(runs, motions, strict=True) if run.beside is not None]
