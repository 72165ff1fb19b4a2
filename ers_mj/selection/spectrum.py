"""What does that hold which a model leaves: waves along the travel, by a spectrum over the angle up to what speed and
rate resolve, and what rings, by one over time.
"""

from __future__ import annotations

import math
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
ECHO, FULL = 1.0, 512  # [s] in which a wave dies out after its recording; lengths of which spectra are made fast
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


@dataclass(frozen=True)
class Band:
    """Where what rings is looked for: [Hz] and turns in the longest recording from which, share of the sample rate up
    to which; by what factor two frequencies are apart, over what factor a line is averaged, and how far its neighbours
    lie; by what factor it stands above those below and those above, and how many are told.
    """

    lowest: float = 3.0
    turns: float = 8.0
    highest: float = 0.4
    apart: float = 1.02
    line: float = 1.03
    beside: tuple[float, float] = (1.15, 2.0)
    stands_out: float = 4.0
    most: int = 2


BAND = Band()


def rings_of(run: Run, traces: Sequence[Trace], band: Band = BAND) -> tuple[float, ...]:
    """The frequencies [Hz] that stand out of what a run leaves, the clearest first: of a body that swings on a spring,
    however little it is damped.
    """
    longest = max(float(trace.t[-1] - trace.t[0]) for trace in traces)
    first, last = max(band.lowest, band.turns / longest), band.highest / max(trace.sample_time for trace in traces)
    f_hz = first * band.apart ** np.arange(max(0.0, math.log(last / first) / math.log(band.apart)))
    power, begin = np.zeros(f_hz.size), 0
    for trace in traces:
        left = run.left[begin : begin + trace.t.size]
        begin += trace.rows
        if np.all(np.isfinite(left)):
            power += left.size * _around(left, trace.sample_time, f_hz, band.line)
    outstanding = np.zeros(f_hz.size)
    near, far = band.beside
    for k, f in enumerate(f_hz):
        below, above = power[(f_hz > f / far) & (f_hz < f / near)], power[(f_hz > f * near) & (f_hz < f * far)]
        if min(below.size, above.size) > 4:
            outstanding[k] = power[k] / max(float(np.median(below)), float(np.median(above)), 1e-300)
    inner = np.flatnonzero((outstanding[1:-1] >= outstanding[:-2]) & (outstanding[1:-1] >= outstanding[2:])) + 1
    high = inner[outstanding[inner] > band.stands_out]
    high = high[np.argsort(-outstanding[high], kind="stable")]
    told: list[float] = []
    for f in f_hz[high].tolist():
        if all(abs(math.log(f / other)) > math.log(near) for other in told):
            told.append(f)
    return tuple(told[: band.most])


def _around(left: np.ndarray, h: float, f_hz: np.ndarray, line: float) -> np.ndarray:
    """Power (F,) of a signal (N,) about each frequency [Hz], averaged over its line."""
    window = np.hanning(left.size)
    spectrum = np.abs(np.fft.rfft((left - left.mean()) * window)) ** 2 / (window @ window)
    at = np.fft.rfftfreq(left.size, h)
    summed = np.concatenate([[0.0], np.cumsum(spectrum)])
    end = np.minimum(np.maximum(np.searchsorted(at, f_hz * line), np.searchsorted(at, f_hz / line) + 2), spectrum.size)
    begin = np.minimum(np.searchsorted(at, f_hz / line), end - 1)
    return (summed[end] - summed[begin]) / (end - begin)


def _compared(left: np.ndarray, trace: Trace, rates: np.ndarray, a_2: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """(products with what is left, squared sizes) (orders,) of waves of each kind and each of these ``rates`` [1/output
    unit], which are evenly apart, in one recording: both by Parseval's theorem, since filters are products of spectra.
    """
    h = trace.sample_time
    y = np.interp(trace.t, trace.t[trace.valid], trace.y[trace.valid])
    way = np.sign(np.convolve(np.gradient(y, h), np.ones(5) / 5, "same"))
    size = FULL * math.ceil((y.size + ECHO / h) / FULL)
    back = np.exp(-2j * np.pi * np.fft.fftfreq(size))  # by a sample
    moves = h * h / ((1.0 - np.exp(-OBSERVER_RATE * h) * back) * (1.0 - np.exp(-a_2 * h) * back))
    white = _whitening(left)
    left = np.convolve(left, white)[: left.size]
    there = np.fft.fft(left / max(float(np.std(left)), 1e-300), size) / size
    white = np.fft.fft(white, size)
    through = (white * moves, white * moves, white)
    sought = [there * each.conj() for each in through]
    gains = [np.abs(each) ** 2 / size for each in through]
    wave, further = np.exp(1j * rates[0] * y), np.exp(1j * (rates[1] - rates[0]) * y)
    out = [(np.empty(rates.size, complex), np.empty(rates.size)) for _ in KINDS]
    for k in range(rates.size):
        straight, either = np.fft.fft(wave, size), np.fft.fft(wave * way, size)
        for (hit, power), kind, gain, spectrum in zip(out, sought, gains, (straight, either, straight), strict=True):
            hit[k], power[k] = np.vdot(spectrum, kind), gain @ (spectrum.real**2 + spectrum.imag**2)
        wave *= further
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
