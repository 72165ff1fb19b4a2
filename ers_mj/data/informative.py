"""Which part of a long recording a search looks at: the one that tells most; the rest is held out, and scored whole.

    recordings, held-out recordings -> searched -> the parts to search, what is held out

What a fit costs grows with its samples, what it learns with how much the motion varies: the part is the one whose
regressors of Eq. (6) have the largest determinant (D-optimality; Ljung, System Identification, 1999, 13.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ers_mj.data.recording import Recording


@dataclass(frozen=True)
class Long:
    """How much is searched.

    Attributes:
        samples: of all recordings together, about.
        least: of a recording at least; none shorter is cut.
        block: [s] between the places where a part may begin.
        worth_holding: [s] that a piece of the rest lasts at least to be held out.
    """

    samples: int = 60_000
    least: int = 20_000
    block: float = 1.0
    worth_holding: float = 5.0


LONG = Long()


def searched(
    recordings: Sequence[Recording], holdout: Sequence[Recording], long: Long = LONG
) -> tuple[list[Recording], list[Recording]]:
    """The recordings as a search gets them, and what is held out: long ones cut to the part that tells most; the rest
    is held out where nothing else is.
    """
    most = max(long.samples // max(len(recordings), 1), long.least)
    chosen, rests = [], []
    for recording in recordings:
        if recording.t.size <= most + most // 2:
            chosen.append(recording)
            continue
        begin = most_telling(recording, most, long.block)
        told = _told(recording, begin, begin + most, bool(holdout))
        chosen.append(replace(part_of(recording, begin, begin + most), problems=(*recording.problems, told)))
        rests += [(recording, 0, begin), (recording, begin + most, recording.t.size)]
    if holdout:
        return chosen, list(holdout)
    worth = [(r, a, b) for r, a, b in rests if b - a > long.worth_holding / r.sample_time]
    return chosen, [part_of(*piece) for piece in worth]


def _told(recording: Recording, begin: int, end: int, has_holdout: bool) -> str:
    t, rest = recording.t, "was not looked at" if has_holdout else "was held out"
    return (
        f"{recording.name}: lasts {recording.duration:.4g} s; {t[begin]:.4g} s to {t[end - 1]:.4g} s, which tell most,"
        f" were searched, the rest {rest}"
    )


def part_of(recording: Recording, begin: int, end: int) -> Recording:
    """Samples begin..end of a recording as one of their own."""
    cut: dict[str, Any] = {
        f.name: x[begin:end]
        for f in fields(recording)
        if isinstance(x := getattr(recording, f.name), np.ndarray) and x.shape[:1] == recording.t.shape
    }
    name = f"{recording.name} ({recording.t[begin]:.4g} s to {recording.t[end - 1]:.4g} s)"
    return replace(recording, **cut, name=name, problems=())


def most_telling(recording: Recording, samples: int, block: float) -> int:
    """Where the ``samples`` begin whose regressors of Eq. (6), angle, speed, its sign and the input, have the largest
    determinant.
    """
    size = max(1, round(block / recording.sample_time))
    y = np.interp(recording.t, recording.t[recording.valid], recording.y[recording.valid])
    speed = np.gradient(y, recording.t)
    quiet = np.median(np.abs(speed))
    regressors = [_scaled(x) for x in (y, speed, np.tanh(speed / max(quiet, 1e-12)), np.asarray(recording.u, float))]
    regressors.append(np.ones(y.size))
    starts = np.arange(0, y.size - size + 1, size)
    gram = np.empty((starts.size + 1, 5, 5))
    gram[0] = 0.0
    for i, a in enumerate(regressors):
        for j, b in enumerate(regressors):
            gram[1:, i, j] = np.cumsum(np.add.reduceat(a * b, starts))
    width = max(1, samples // size)
    inside = gram[width:-1] - gram[: -1 - width] if starts.size > width else gram[-1:]
    told = np.linalg.slogdet(inside / samples + 1e-9 * np.eye(5))[1]
    return min(int(np.argmax(told)) * size, y.size - samples)


def _scaled(x: np.ndarray) -> np.ndarray:
    return (x - x.mean()) / (x.std() or 1.0)
