"""Which waves along the travel does what a model leaves hold? A spectrum over the angle, up to what speed and rate
resolve.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ers_mj.data.prepared import Trace
from ers_mj.estimation.objective import Run
from ers_mj.servo.model import OBSERVER_RATE


@dataclass(frozen=True)
class Sizes:
    """Periods within the travel that are looked for: from how many on (fewer are starts of the effects themselves), how
    far apart, up to how many; samples, and converter steps, that a period has at least; samples that are read at most;
    by what factor a peak stands above the median, and how many are told of a kind.
    """

    first: float = 8.0
    apart: float = 0.5
    most: float = 400.0
    samples: float = 4.0
    steps: float = 4.0
    longest: int = 16000
    stands_out: float = 4.0
    peaks: int = 2


SIZES = Sizes()
LAGS = 8  # samples of memory that are taken from what is left
KINDS = "torque", "friction", "reading"  # where a wave may act


def waves_of(run: Run, traces: Sequence[Trace], sizes: Sizes = SIZES) -> tuple[tuple[str, float], ...]:
    """The (kind, period) of the waves that stand out of what a run leaves, the clearest first of each kind.

    A wave exp(2 pi i y / period) of a torque moves the output through the plant and the observer that follows it,
    1 / ((s + a_2) (s + rate)); one of friction does so either way; one of the reading shows as it is. Each is compared
    with what is left, as a share of its own size, both whitened: what is left holds slow errors far larger than a wave.
    """
    scales = run.model.scales
    travel = scales.high - scales.low
    finest = max(sizes.samples * scales.sample_time * 0.5 * scales.speed, sizes.steps * scales.quantum)
    most = min(sizes.most, travel / max(finest, 1e-12))
    orders = np.arange(sizes.first, most, sizes.apart)
    if orders.size < 3:
        return ()
    hits, powers = np.zeros((len(KINDS), orders.size), complex), np.zeros((len(KINDS), orders.size))
    begin, read = 0, 0
    for trace in traces:
        left = run.left[begin : begin + trace.t.size]
        begin += trace.rows
        if read > sizes.longest or not np.all(np.isfinite(left)):
            continue
        read += left.size
        for k, (hit, power) in enumerate(
            _compared(left, trace, 2.0 * np.pi * orders / travel, run.model.values["a_2"])
        ):
            hits[k] += hit
            powers[k] += power
    found = []
    for kind, hit, power in zip(KINDS, hits, powers, strict=True):
        share = np.abs(hit) ** 2 / np.maximum(power, 1e-300)
        found += [(kind, float(travel / orders[k])) for k in _peaks(share, sizes)]
    return tuple(found)


def _compared(left: np.ndarray, trace: Trace, rates: np.ndarray, a_2: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """(products with what is left, squared sizes) (orders,) of waves of each kind and each of these ``rates`` [1/output
    unit], in one recording.
    """
    from scipy.signal import lfilter  # takes a second to import

    h = trace.sample_time
    y = np.interp(trace.t, trace.t[trace.valid], trace.y[trace.valid])
    way = np.sign(np.convolve(np.gradient(y, h), np.ones(5) / 5, "same"))
    slow, fast = np.exp(-OBSERVER_RATE * h), np.exp(-a_2 * h)

    def through(wave: np.ndarray) -> np.ndarray:
        return lfilter([h * h], [1.0, -slow - fast, slow * fast], wave)

    white = _whitening(left)
    left = lfilter(white, 1.0, left)
    left = left / max(float(np.std(left)), 1e-300)
    out = [(np.empty(rates.size, complex), np.empty(rates.size)) for _ in KINDS]
    for k, rate in enumerate(rates):
        wave = np.exp(1j * rate * y)
        for (hit, power), moved in zip(out, (through(wave), through(wave * way), wave), strict=True):
            seen = lfilter(white, 1.0, moved)
            hit[k], power[k] = left @ seen.conj(), float(np.vdot(seen, seen).real)
    return out


def _whitening(left: np.ndarray) -> np.ndarray:
    """A filter (LAGS + 1,) after which what is left has no memory: each sample less what the ones before foretell."""
    before = np.column_stack([left[LAGS - k - 1 : -k - 1] for k in range(LAGS)])
    return np.append(1.0, -np.linalg.lstsq(before, left[LAGS:], rcond=1e-9)[0])


def _peaks(share: np.ndarray, sizes: Sizes) -> list[int]:
    """The places of the highest peaks that stand out of shares (orders,)."""
    inner = np.flatnonzero((share[1:-1] >= share[:-2]) & (share[1:-1] >= share[2:])) + 1
    high = inner[share[inner] > sizes.stands_out * np.median(share)]
    return [int(k) for k in high[np.argsort(-share[high], kind="stable")][: sizes.peaks]]
