"""What was put in while rows of a log were lost: nobody recorded it, but the motion behind it goes on at the speed that
it left.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.checks import gaps_in
from ers_mj.data.prepared import Trace
from ers_mj.estimation.initial_state import without_spikes
from ers_mj.servo.model import Model


@dataclass(frozen=True)
class Nearby:
    """What of a recording is looked at around lost rows."""

    samples: tuple[int, int] = (8, 40)  # at least and at most, on either side,
    seconds: float = 0.15  # and for so long at most
    like: int = 10  # rows on either side whose inputs tell how much another one may have been
    most: float = 4.0  # times that, up to which an input is tried,
    tried: int = 41  # in so many steps


NEARBY = Nearby()


def cleaned(model: Model, traces: Sequence[Trace]) -> list[Trace]:
    """The traces as a model's motion shows them: without spikes and holds, and with the inputs of lost rows."""
    return with_lost_inputs(model, without_spikes(model, traces))


def with_lost_inputs(model: Model, traces: Sequence[Trace]) -> list[Trace]:
    """The traces with an input, at each row behind which others are lost, whose mean over that step makes the motion
    there what was seen: by least squares beside another place, speed and steady torque, an input being as likely to
    change as it does nearby. Where friction holds, nothing is told, and the input stays.
    """
    return [_with_lost_inputs(model, trace, k) for k, trace in enumerate(traces)]


def _with_lost_inputs(model: Model, trace: Trace, record: int) -> Trace:
    u = trace.u.copy()
    for k, begin, end in _around(trace):
        near = u[max(k - NEARBY.like, 0) : k + NEARBY.like + 1]
        likely = float(np.sqrt(np.mean((near - u[k]) ** 2)))
        if likely > 0.0:
            change = _change(model, replace(trace, u=u).part(begin, end), record, k - begin, likely)
            u[k] = min(max(u[k] + change, trace.u.min()), trace.u.max())
    return trace if np.array_equal(u, trace.u) else replace(trace, u=u)


def _around(trace: Trace) -> Iterator[tuple[int, int, int]]:
    """(the last row before lost ones, first and last row + 1 of what is looked at), between other such places."""
    lost = np.flatnonzero(gaps_in(trace.t))
    fewest, most = NEARBY.samples
    most = max(min(most, int(NEARBY.seconds / trace.sample_time)), fewest)
    ends = np.r_[-1, lost, trace.t.size - 1]
    for before, k, after in zip(ends, lost, ends[2:], strict=False):
        begin, end = max(k + 1 - most, before + 1), min(k + 1 + most, after + 1)
        seen = trace.valid[begin:end]
        if min(np.sum(seen[: k + 1 - begin]), np.sum(seen[k + 1 - begin :])) >= fewest:
            yield int(k), int(begin), int(end)


def _change(model: Model, part: Trace, record: int, at: int, likely: float) -> float:
    """By how much another input at sample ``at`` explains a part of a trace."""
    time, seen = part.t - part.t[at], part.valid
    design = np.column_stack([np.ones(time.size), time, time**2])[seen]
    basis = np.linalg.qr(design)[0]

    def cost(more: float) -> float:
        u = part.u.copy()
        u[at] += more
        e = ((part.y - model.predict(replace(part, u=u), record)) / part.sigma)[seen]
        e -= basis @ (basis.T @ e)
        left = float(e @ e) + (more / likely) ** 2
        return left if np.isfinite(left) else np.inf

    tried = likely * np.linspace(-NEARBY.most, NEARBY.most, NEARBY.tried)
    costs = [cost(more) for more in tried]
    k = min(max(int(np.argmin(costs)), 1), tried.size - 2)
    before, now, after = costs[k - 1 : k + 2]
    bend = before - 2.0 * now + after
    step = tried[1] - tried[0]
    return float(tried[k] + (0.5 * step * (before - after) / bend if 0.0 < bend < np.inf else 0.0))
