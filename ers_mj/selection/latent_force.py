"""What acceleration does a recording ask for beside a model, and where would one push give it?

Begun where the output was measured to be, the model misses it after a short while T by e; held over T, an acceleration
of 2 e / T^2 would have brought it there. Nothing where stick holds both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ers_mj.data.prepared import Trace
from ers_mj.servo.model import Model

SPAN = 8  # samples over which an error grows, and over which a speed is taken
LONGEST = 0.1  # [s] of a span
MOST = 1500  # spans of a recording that are looked at


@dataclass(frozen=True)
class Around:
    """The part of a recording around a hot span in which a push is looked for, and how many spans of it at most."""

    before: float = 0.6  # [s]
    after: float = 1.2  # [s]
    spans: int = 240


AROUND = Around()


def span_of(trace: Trace) -> int:
    """Samples of a span, so many that its ends may all be seen."""
    n = max(2, min(SPAN, int(LONGEST / trace.sample_time)))
    return trace.refresh * max(2, n // trace.refresh) if trace.refresh > 1 else n


def asked_for(
    model: Model, trace: Trace, record: int = 0, first: int = 0, last: int | None = None, most: int = MOST
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(samples at which a span begins, speed there, acceleration that is asked for), each (K,), between two samples of
    a trace; spans with blanks are left out. ``record`` tells whose numbers of its own are taken.
    """
    n = span_of(trace)
    begins = np.arange(max(first, n), min(last or trace.t.size, trace.t.size) - n - 1)
    begins = begins[np.isin(begins, trace.known)]
    begins = begins[:: max(n // trace.refresh, begins.size // most, 1)]
    needed = np.arange(-n, n + 1, trace.refresh)
    begins = np.array([k for k in begins if trace.valid[k + needed].all()], int)
    speed = (trace.y[begins + n] - trace.y[begins - n]) / (trace.t[begins + n] - trace.t[begins - n])
    asked = [_asked(model, trace, int(k), n, float(w), record) for k, w in zip(begins, speed, strict=True)]
    return begins, speed, np.array(asked)


def _asked(model: Model, trace: Trace, k: int, n: int, speed: float, record: int) -> float:
    part = trace.part(k, k + n + 1, (float(trace.y[k]), speed))
    run = model.predict(part, record)
    return 2.0 * float(trace.y[k + n] - run[-1]) / float(part.t[-1] - part.t[0]) ** 2


def pushes(model: Model, traces: Sequence[Trace], hot: Sequence[tuple[int, float, float]]) -> tuple:
    """(recording, begin [s], length [s], acceleration) of the push that gives most of what is asked for around each hot
    span (recording, begin [s], length [s]); one for each place.
    """
    places = dict.fromkeys((record, begin) for record, begin, _ in hot)
    found = (_push(model, traces[record], record, begin) for record, begin in places)
    return tuple(one for one in found if one is not None)


def _push(model: Model, trace: Trace, record: int, begin: float) -> tuple[int, float, float, float] | None:
    first, last = np.searchsorted(trace.t, (begin - AROUND.before, begin + AROUND.after))
    begins, _, asked = asked_for(model, trace, record, int(first), int(last), AROUND.spans)
    if begins.size < 3 or not np.all(np.isfinite(asked)):
        return None
    total = np.concatenate([[0.0], np.cumsum(asked)])
    firsts, lasts = np.triu_indices(total.size, k=2)  # what lasts a span only is the noise of one
    given = (total[lasts] - total[firsts]) / np.sqrt(lasts - firsts)
    best = int(np.argmax(np.abs(given)))
    i, j = int(firsts[best]), int(lasts[best])
    t_0, end = trace.t[begins[i]], trace.t[min(begins[j - 1] + span_of(trace), trace.t.size - 1)]
    return record, float(t_0), float(end - t_0), float((total[j] - total[i]) / (j - i))
