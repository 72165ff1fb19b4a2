"""What a model says of a recording before it is fitted: its initial state, and the spikes that are no motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.beginnings import start_seen
from ers_mj.data.prepared import Trace
from ers_mj.data.quantisation import thresholds
from ers_mj.data.sensor_faults import excursions, held_spans
from ers_mj.estimation.objective import cost_of, is_rough
from ers_mj.servo.model import OBSERVER_RATE, Model

SPIKE = 3.5, 0.9  # times nine tenths of the changes of a model's error: 8 sigma where that is noise


@dataclass(frozen=True)
class Signs:
    """What tells a spike, a hold and a start."""

    spike_samples: int = 3  # of the longest spike
    spike_time: float = 0.005  # [s] of it
    fewest_spikes: int = 3  # that the recordings must show by themselves before the model's error is searched
    held_sigmas: float = 6.0  # noise levels of a model's motion during a hold,
    held_steps: float = 2.0  # converter steps of it,
    held_leap: tuple[float, float] = (0.6, 1.6)  # and share of it in the leap after
    moved: float = 0.25  # [s] from the first threshold of a coarse converter, up to which it tells a start
    within: int = 17  # places within its step that are tried


SIGNS = Signs()


def without_spikes(model: Model, traces: Sequence[Trace]) -> list[Trace]:
    """The traces without the spikes and holds that only a model's motion betrays, where the recordings themselves show
    that their sensor has some.

    Within the longest spike a rudder's own error is smooth, but for the blows of a play or a stop, which look like one.
    """
    if sum(len(trace.lost) for trace in traces) < SIGNS.fewest_spikes:
        return list(traces)
    out = []
    for k, trace in enumerate(traces):
        simulated = model.predict(trace, k, OBSERVER_RATE)
        if np.isfinite(simulated).all():
            trace = trace.without(_held(trace, simulated))
            e = np.where(trace.valid, (trace.y - simulated) / trace.sigma, np.nan)
            longest = min(SIGNS.spike_samples, int(SIGNS.spike_time / trace.sample_time + 1e-6))
            trace = trace.without(excursions(e, 1.0, *SPIKE, longest)) if longest else trace
        out.append(trace)
    return out


def _held(trace: Trace, simulated: np.ndarray) -> list[slice]:
    """Repeats of the output while the model moves, after which it leaps to where the model is: a rudder that sticks has
    no such leap.
    """
    y, out, (least, most) = trace.y, [], SIGNS.held_leap
    for s in held_spans(y, 2):
        if s.stop < y.size and trace.valid[s.start : s.stop + 1].all():
            moved, leap = simulated[s.stop - 1] - simulated[s.start], y[s.stop] - y[s.start]
            way = simulated[s.stop] - simulated[s.start]
            moves = abs(moved) > max(SIGNS.held_sigmas * trace.sigma, SIGNS.held_steps * trace.quantum)
            if moves and least * abs(way) < leap * np.sign(way) < most * abs(way):
                out.append(slice(s.start + 1, s.stop))
    return out


def with_starts(model: Model, traces: Sequence[Trace]) -> list[Trace]:
    """The traces with their initial states fitted by the model on the first 50 ms or 10 samples of each."""
    return [replace(trace, start=fitted_start(model, trace, k)) for k, trace in enumerate(traces)]


def begun_again(model: Model, traces: Sequence[Trace], tau: float, least: float) -> Sequence[Trace]:
    """The traces as a model begins them, where a former, wrong one has bent where they began: behind a coarse
    converter, within whose step a model alone tells that, or where C at ``tau`` falls by more than the ``least``.
    """
    again = with_starts(model, traces)
    if is_rough(traces):
        return again
    now, before = (cost_of(model, some, OBSERVER_RATE, tau) for some in (again, traces))
    return again if now < before - least else traces


def fitted_start(model: Model, trace: Trace, record: int = 0) -> tuple[float, float]:
    """(output, speed) at the first sample by least squares of a free run on the first 50 ms or 10 samples.

    A speed is a poor excuse for a wrong model: it starts at rest unless the recording itself shows a speed, and with
    one that this allows (start_seen).
    """
    if trace.converter is not None:
        return _start_within(model, trace, record)
    n = trace.beginning
    head = trace.part(0, n, trace.start)

    def misses(x):
        e = np.where(head.valid, head.weighed(model.predict(head, record, start=x)), 0.0)
        return e if np.all(np.isfinite(e)) else np.full(n, 1e9)

    def settle(x, moving):
        step = np.array([0.1 * trace.sigma, trace.sigma / (trace.t[n - 1] - trace.t[0])])[: 1 + moving]
        e = misses(x)
        for _ in range(6):
            j = np.column_stack([(misses(x + np.eye(2)[k] * step[k]) - e) / step[k] for k in range(1 + moving)])
            move = np.zeros(2)
            move[: 1 + moving] = -np.linalg.lstsq(j, e, rcond=1e-9)[0]
            trial = misses(x + move)
            if not trial @ trial < e @ e:
                break
            x, e = x + move, trial
        return x

    low, high = trace.speeds or start_seen(head.t, head.y, head.sigma)
    begun = np.array([trace.start[0], 0.5 * (low + high)])
    fitted = settle(begun, moving=low != high)
    if low <= fitted[1] <= high:
        return float(fitted[0]), float(fitted[1])
    speed = min(max(float(fitted[1]), low), high)
    return float(settle(np.array([begun[0], speed]), moving=False)[0]), speed


def _start_within(model: Model, trace: Trace, record: int) -> tuple[float, float]:
    """The same behind a coarse converter: where within its first step the rudder was is told by when it passed the
    first thresholds.
    """
    passed = thresholds(trace.y)
    head = trace.part(
        0,
        max(
            trace.beginning,
            int(np.searchsorted(trace.t, trace.t[passed[0]] + SIGNS.moved)) if passed.size else 0,
        ),
    )
    theta, omega = trace.y[np.argmax(trace.valid)], trace.start[1]

    def missed(place):
        e = np.where(head.valid, head.weighed(model.predict(head, record, start=(place, omega))), 0.0)
        return float(np.sum(np.log1p(e**2))) if np.all(np.isfinite(e)) else np.inf

    half = 0.5 * trace.converter.step
    return float(min(np.linspace(theta - half, theta + half, SIGNS.within), key=missed)), omega
