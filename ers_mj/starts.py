"""What a model says of a recording before it is fitted: its initial state, and the spikes that are no motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ers_mj.model import OBSERVER_RATE, Model
from ers_mj.symptoms import excursions
from ers_mj.traces import Trace, start_samples, start_seen

SPIKE = 3.5, 0.9  # times nine tenths of the changes of a model's error: 8 sigma where that is noise
SPIKE_SAMPLES, SPIKE_TIME = 3, 0.005  # length of a spike at most, and [s]
FEWEST_SPIKES = 3  # that the recordings must show by themselves before the model's error is searched


def without_spikes(model: Model, traces: Sequence[Trace]) -> list[Trace]:
    """The traces without the spikes that stand out of the model's error, where the recordings themselves show that their sensor has some.

    Within SPIKE_TIME a rudder's own error is smooth, but for the blows of a play or a stop, which look like a spike.
    """
    if sum(len(trace.lost) for trace in traces) < FEWEST_SPIKES:
        return list(traces)
    out = []
    for k, trace in enumerate(traces):
        e = np.where(trace.valid, (trace.y - model.predict(trace, k, OBSERVER_RATE)) / trace.sigma, np.nan)
        longest = min(SPIKE_SAMPLES, int(SPIKE_TIME / trace.sample_time + 1e-6))
        out.append(trace.without(excursions(e, 1.0, *SPIKE, longest)) if longest and np.isfinite(e[trace.valid]).all() else trace)
    return out


def with_starts(model: Model, traces: Sequence[Trace]) -> list[Trace]:
    """The traces with their initial states fitted by the model on the first 50 ms or 10 samples of each."""
    return [replace(trace, start=fitted_start(model, trace, k)) for k, trace in enumerate(traces)]


def fitted_start(model: Model, trace: Trace, record: int = 0) -> tuple[float, float]:
    """(output, speed) at the first sample by least squares of a free run on the first 50 ms or 10 samples.

    A speed is a poor excuse for a wrong model: it starts at rest unless the recording itself shows a speed, and with one that this allows (start_seen).
    """
    n = start_samples(trace.t)
    head = trace.part(0, n)

    def misses(x):
        e = np.where(head.valid, head.y - model.predict(head, record, start=x), 0.0) / trace.sigma
        return e if np.all(np.isfinite(e)) else np.full(n, 1e9)

    def settle(x, moving):
        step = np.array([0.1 * trace.sigma, trace.sigma / (trace.t[n - 1] - trace.t[0])])[:1 + moving]
        e = misses(x)
        for _ in range(6):
            j = np.column_stack([(misses(x + np.eye(2)[k] * step[k]) - e) / step[k] for k in range(1 + moving)])
            move = np.zeros(2)
            move[:1 + moving] = -np.linalg.lstsq(j, e, rcond=1e-9)[0]
            trial = misses(x + move)
            if not trial @ trial < e @ e:
                break
            x, e = x + move, trial
        return x

    low, high = start_seen(head.t, head.y, head.sigma)
    begun = np.array([trace.start[0], 0.5 * (low + high)])
    fitted = settle(begun, moving=low != high)
    if low <= fitted[1] <= high:
        return float(fitted[0]), float(fitted[1])
    speed = min(max(float(fitted[1]), low), high)
    return float(settle(np.array([begun[0], speed]), moving=False)[0]), speed
