"""Recordings as the first steps of a search see them: samples a few milliseconds apart, under the mean of what was put
in between, where a model is as far from those as from all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ers_mj.data.prepared import Trace
from ers_mj.estimation.objective import cost_of, is_rough
from ers_mj.servo.model import OBSERVER_RATE, Model

SPARSE = 4e-3  # [s] between the samples
ALIKE = 0.02  # share of C by which the mean input may move it


def strides(traces: Sequence[Trace]) -> list[int]:
    """Samples from one that is taken to the next, of each trace: 1 where the steps are not alike, and no part of what a
    slower sensor is refreshed by.
    """
    apart = [max(1, int(SPARSE / t.sample_time + 0.01)) if t.is_uniform else 1 for t in traces]
    return [max(1, n - n % trace.refresh) for n, trace in zip(apart, traces, strict=True)]


def few_of(model: Model, traces: Sequence[Trace], tau: float, rate: float = OBSERVER_RATE) -> Sequence[Trace]:
    """The traces with few samples, where C at ``tau`` of a model that is far from them hangs little on that; else as
    they are. A coarse converter's thresholds lie between samples.
    """
    apart = strides(traces)
    if max(apart) == 1 or is_rough(traces):
        return traces
    few = [trace.sparse(stride) for trace, stride in zip(traces, apart, strict=True)]
    asked = replace(model, effort=None)  # no search pays for what is asked before it
    whole = cost_of(asked, traces, rate, tau)
    return few if abs(cost_of(asked, few, rate, tau) - whole) <= ALIKE * whole else traces
