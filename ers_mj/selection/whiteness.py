"""How much of a mismatch a model leaves, told from the noise by memory: noise forgets from sample to sample, a mismatch
does not.

    what a run leaves, e(t) = noise + mismatch -> products e(t) e(t + k h), k = 1, 2, 3 -> their mean in each block is
    the mismatch's power there

The size of the noise need not be known for that, so that a mismatch of a third of the noise shows. What a converter
makes of a slow motion has a memory, too: that of the simulated motion read with the same step is taken off.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ers_mj.data.prepared import BLOCK, Trace
from ers_mj.data.sensor_faults import converter_step
from ers_mj.decisions.thresholds import POLICY, Policy
from ers_mj.estimation.objective import is_rough, residuals_in
from ers_mj.servo.model import OBSERVER_RATE, Model

LAGS = (1, 2, 3)  # samples


@dataclass(frozen=True)
class Judged:
    """Which blocks are judged, and from what power on."""

    samples: int = 20  # in a block at least; at low sample rates several blocks are one
    pairs: int = 12  # a lag at least, in a block that is judged
    least: float = -0.9  # power of a block, in those of the noise, that chance does not go below


JUDGED = Judged()


def left_by_sensor(model: Model, traces: Sequence[Trace]) -> dict[str, float]:
    """What the model's observer leaves beyond the noise, by sensor ("output", and the kinds of the further channels); 0
    where no block is long enough.

    The mean over blocks of ln(1 + power), the power in that of the noise: a few blocks in which stick and slip fork do
    not decide it.
    """
    told: dict[str, list[np.ndarray]] = {}
    for record, trace in enumerate(traces):
        for kind, logs in _told(model, trace, record).items():
            told.setdefault(kind, []).append(logs)
    return {kind: _mean(np.concatenate(parts)) for kind, parts in told.items()}


def left_elsewhere(model: Model, traces: Sequence[Trace]) -> float:
    """The same of the output in the mean over the recordings but the one in which it leaves most: what is missing from
    a model seldom shows in one alone, in which stick and slip that fork may leave as much. 0 of one recording.
    """
    left = sorted(max(_mean(_told(model, trace, record)["output"]), 0.0) for record, trace in enumerate(traces))
    return float(np.mean(left[:-1])) if len(left) > 1 else 0.0


def is_beyond_rounding(model: Model, traces: Sequence[Trace], policy: Policy = POLICY) -> bool:
    """Whether a model of one body is further from the readings of a coarse converter than their noise is: behind one, C
    is so rough that a screening promises nothing of what acts, and what is left has lost its memory.
    """
    if model.plant().coupled or not is_rough(traces):
        return False
    parts = [
        trace.plain(residuals_in(model, trace, k, OBSERVER_RATE)[: trace.t.size])[trace.valid]
        for k, trace in enumerate(traces)
    ]
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) > policy.beyond_rounding


def _told(model: Model, trace: Trace, record: int) -> dict[str, np.ndarray]:
    """ln(1 + power) in each block of a recording, by sensor; NaN in a block of too few known samples."""
    parts = trace.plain(residuals_in(model, trace, record, OBSERVER_RATE)).reshape(-1, trace.t.size)
    block = trace.block // math.ceil(JUDGED.samples * trace.sample_time / BLOCK)
    sensors = [("output", trace.y, trace.sigma, trace.quantum, trace.valid)]
    sensors += [(c.kind, c.values, c.sigma, converter_step(c.values), np.isfinite(c.values)) for c in trace.channels]
    told = {}
    for e, (kind, values, sigma, step, known) in zip(parts, sensors, strict=True):
        power = remembered(e, known, block)
        if step > 0:
            power = power - _converted(values - e * sigma, values, sigma, step, known, block)
        told[kind] = np.log1p(np.maximum(power, JUDGED.least))
    return told


def _mean(logs: np.ndarray) -> float:
    return float(np.mean(logs[np.isfinite(logs)])) if np.isfinite(logs).any() else 0.0


def remembered(e: np.ndarray, known: np.ndarray, block: np.ndarray) -> np.ndarray:
    """Power (B,) of what e (N,) keeps from sample to sample in each block; NaN in a block of too few known samples."""
    size = int(block[-1]) + 1
    total, pairs = np.zeros(size), np.zeros(size)
    for lag in LAGS:
        both = known[:-lag] & known[lag:] & (block[:-lag] == block[lag:])
        where = block[:-lag][both]
        total += np.bincount(where, (e[:-lag] * e[lag:])[both], size)
        pairs += np.bincount(where, minlength=size)
    return np.where(pairs >= JUDGED.pairs * len(LAGS), total / np.maximum(pairs, 1.0), np.nan)


def _converted(
    simulated: np.ndarray, measured: np.ndarray, sigma: float, step: float, known: np.ndarray, block: np.ndarray
) -> np.ndarray:
    """The same power (B,), in the noise's, of what a converter makes of the simulated output: noise ahead of it takes
    its sawtooth's waves away.
    """
    zero = measured[np.argmax(known)]
    sawtooth = zero + step * np.rint((simulated - zero) / step) - simulated
    noise = max(sigma**2 - step**2 / 12.0, 0.0)
    return remembered(sawtooth / sigma, known, block) * math.exp(-4.0 * math.pi**2 * noise / step**2)
