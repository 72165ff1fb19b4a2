"""Recordings as a fit sees them: noise level, time blocks, initial state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ers_mj.data.beginnings import BEGINNING, speed_about, start_samples, start_seen
from ers_mj.data.channels import Channel, channels_of, supply_of
from ers_mj.data.kept import Kept
from ers_mj.data.quantisation import Converter
from ers_mj.data.recording import Recording
from ers_mj.data.sensor_faults import (
    at_extreme,
    frozen_spans,
    leapt_spans,
    noise_sigma,
    repeated_spans,
    spikes,
    unmoved_spans,
)
from ers_mj.decisions.thresholds import POLICY
from ers_mj.errors import InputError

BLOCK = 0.25  # [s]


@dataclass(frozen=True, eq=False)
class Signals:
    """What a recording holds, (N,) each: time, input, output, where the output is valid, whether the drive was on, and
    a known load as an acceleration; the last two None where nothing is known.
    """

    t: np.ndarray
    u: np.ndarray
    y: np.ndarray
    valid: np.ndarray
    enable: np.ndarray | None = None
    load: np.ndarray | None = None

    @staticmethod
    def empty(t: np.ndarray, u: np.ndarray) -> Signals:
        """Of a recording that does not exist yet."""
        return Signals(t, u, np.zeros(t.size), np.ones(t.size, bool))


@dataclass(frozen=True)
class Trace:
    """One recording as the fit sees it: arrays (N,), noise sigma, blocks, the (reading, speed) it starts with, and the
    spans that its sensor lost.

    ``channels`` are what further sensors saw; each is judged in blocks of its own behind those of the output.
    ``supply`` is the measured one [V] (N,), None where none was measured or it does not vary; ``speeds`` the least and
    the largest at the first sample where samples before it tell them; ``converter`` the one
    whose steps are coarse for the travel, where there is one; ``input_kind`` the recording's (a torque and a current
    are told, no back-EMF takes from them).
    """

    name: str
    t: np.ndarray
    u: np.ndarray
    y: np.ndarray
    valid: np.ndarray
    enable: np.ndarray | None
    load: np.ndarray | None
    sigma: float
    quantum: float
    start: tuple[float, float]
    block: np.ndarray
    counts: np.ndarray
    lost: tuple[slice, ...] = ()
    channels: tuple[Channel, ...] = ()
    supply: np.ndarray | None = None
    converter: Converter | None = None
    input_kind: str = "voltage"
    speeds: tuple[float, float] | None = None

    @property
    def is_coarse(self) -> bool:
        """Whether the converter makes most of the noise."""
        return self.quantum**2 / 12 > 0.5 * self.sigma**2

    @cached_property
    def sample_time(self) -> float:
        """Median step [s]."""
        return float(np.median(np.diff(self.t)))

    @cached_property
    def refresh(self) -> int:
        """Samples for each that the sensor saw, where it is refreshed more slowly than the log; else 1."""
        return seen_every(self.valid)

    @cached_property
    def known(self) -> np.ndarray:
        """The samples that a sensor refreshed more slowly saw; all of them where it is not."""
        return np.flatnonzero(self.valid) if self.refresh > 1 else np.arange(self.t.size)

    @cached_property
    def beginning(self) -> int:
        """Number of samples that an initial state is taken from: 50 ms or 10 that were seen, whichever is longer."""
        n = start_samples(self.t)
        return n if self.refresh == 1 else max(n, int(self.known[: BEGINNING.samples][-1]) + 1)

    @cached_property
    def blocks(self) -> Blocks:
        """The blocks of this trace alone."""
        return Blocks.of([self])

    @cached_property
    def runs(self) -> Kept:
        """What models' runs along it left."""
        return Kept()

    @cached_property
    def is_uniform(self) -> bool:
        """Whether all steps are alike."""
        return self.t.size > 1 and bool(np.ptp(np.diff(self.t)) < 1e-5 * self.sample_time)

    def part(self, begin: int, end: int, start: tuple[float, float] | None = None) -> Trace:
        """Samples begin..end as a trace of their own, which begins in the state ``start``, else as the samples there
        and before show it.
        """
        cut = slice(begin, end)
        speeds = None if start else speed_about(self.t, self.y, begin, self.sigma)
        pick = lambda a: None if a is None else a[cut]
        signals = self.t[cut], self.u[cut], self.y[cut], self.valid[cut]
        kept = Signals(*signals, pick(self.enable), pick(self.load))
        return replace(
            make_trace(self.name, kept, self.sigma, self.quantum, start, speeds),
            channels=tuple(replace(c, values=c.values[cut]) for c in self.channels),
            supply=pick(self.supply),
            converter=self.converter,
            input_kind=self.input_kind,
        )

    def sparse(self, stride: int) -> Trace:
        """Every so many samples of a uniform trace, under the mean of what was put in between."""
        if stride <= 1:
            return self
        some, begins = slice(None, None, stride), np.arange(0, self.t.size, stride)
        every = lambda a: np.ascontiguousarray(a[some])
        pick = lambda a: None if a is None else every(a)
        mean = np.add.reduceat(self.u, begins) / np.diff(np.append(begins, self.t.size))
        block = self.block[some]
        return replace(
            self,
            t=every(self.t),
            u=mean,
            y=every(self.y),
            valid=every(self.valid),
            enable=pick(self.enable),
            load=pick(self.load),
            block=block,
            counts=np.bincount(block[self.valid[some]], minlength=block[-1] + 1).astype(float),
            supply=pick(self.supply),
            channels=tuple(replace(c, values=every(c.values)) for c in self.channels),
        )

    def without(self, spans: Sequence[slice]) -> Trace:
        """The trace with further spans lost."""
        if not spans:
            return self
        valid = self.valid.copy()
        for span in spans:
            valid[span] = False
        signals = Signals(self.t, self.u, self.y, valid, self.enable, self.load)
        made = make_trace(self.name, signals, self.sigma, self.quantum, self.start)
        return replace(
            made,
            channels=self.channels,
            supply=self.supply,
            converter=self.converter,
            lost=(*self.lost, *spans),
            input_kind=self.input_kind,
        )

    @cached_property
    def seen(self) -> np.ndarray:
        """Which of its residuals (rows,) a sensor saw."""
        return np.concatenate([self.valid, *(np.isfinite(c.values) for c in self.channels)])

    @cached_property
    def unseen(self) -> np.ndarray:
        """The places of the others among them."""
        return np.flatnonzero(~self.seen)

    @cached_property
    def followed(self) -> np.ndarray:
        """What an observer may follow (N,), NaN where nothing; what a slower sensor passed between its readings."""
        t, y = self.t[self.known], self.y[self.known]
        passed = y if self.converter is None else self.converter.path(t, y)
        return passed if self.refresh == 1 else np.interp(self.t, t, passed)

    @property
    def sure_noise(self) -> float:
        """The noise in what a reading surely tells (see cross_validation.Score)."""
        return self.sigma if self.converter is None else self.converter.sure_noise

    def weighed(self, theta: np.ndarray) -> np.ndarray:
        """The output less a simulated one (N,), in sigmas."""
        return (self.y - theta) / self.sigma if self.converter is None else self.converter.weighed(self.y - theta)

    def plain(self, e: np.ndarray) -> np.ndarray:
        """Residuals (rows,) in sigmas as they would be without what a coarse converter's thresholds tell."""
        return (
            e if self.converter is None else np.concatenate([self.converter.plain(e[: self.t.size]), e[self.t.size :]])
        )

    @property
    def rows(self) -> int:
        """Residuals that the recording gives: samples times (1 + channels)."""
        return self.t.size * (1 + len(self.channels))


def trace_of(recording: Recording, inertia: float | None) -> Trace:
    """A recording as a trace; its known load torque becomes an acceleration where the inertia [kg m^2] is known, else
    nothing.

    Spans in which the sensor shows a spike, or hangs, are no measurement of the output.

    Raises:
        InputError: the input is a position command, for which there is no model.
    """
    if recording.input_kind == "position":
        raise InputError(
            f"{recording.name}: is commanded by a position, which diagnose, identify and simulate take; record here"
            " what the drive is told (u_V, u_duty_pct, tau_cmd_Nm or i_cmd_A)"
        )
    load = -recording.load / inertia if recording.load is not None and inertia else None
    y, sigma = recording.y, noise_sigma(recording.y[recording.valid], recording.quantum)
    seen = np.flatnonzero(recording.valid) if seen_every(recording.valid) > 1 else np.arange(y.size)
    lost = [
        slice(int(seen[s.start]), int(seen[s.stop - 1]) + 1)
        for s in _lost(np.where(recording.valid, y, np.nan)[seen], y[seen], recording.quantum, sigma)
    ]
    signals = Signals(recording.t, recording.u, y, recording.valid, recording.enable, load)
    trace = make_trace(recording.name, signals, sigma, recording.quantum)
    trace = trace.without(lost)
    channels, supply = channels_of(recording, trace.valid), supply_of(recording)
    return replace(trace, start=_started(trace), input_kind=recording.input_kind, channels=channels, supply=supply)


def _lost(y: np.ndarray, read: np.ndarray, quantum: float, sigma: float) -> list[slice]:
    """Spans of an output y (N,) in which the sensor shows a spike or hangs; ``read`` with what is masked in it."""
    stuck: list[slice] = []
    for found in (frozen_spans(read, quantum), unmoved_spans(read, quantum, sigma)):
        stuck += [s for s in found if not at_extreme(read, s) and not _meets(s, stuck)]
    for found in (leapt_spans(read, quantum, sigma), repeated_spans(read, quantum)):
        stuck += [s for s in found if not _meets(s, stuck)]
    return [*spikes(y, sigma), *stuck]


def seen_every(valid: np.ndarray, most: float = 0.75) -> int:
    """Samples for each valid one (N,), where a sensor is refreshed more slowly than the log, so that it saw no more
    than ``most`` of them; else 1.
    """
    seen = np.flatnonzero(valid)
    return int(np.median(np.diff(seen))) if 1 < seen.size < most * valid.size else 1


def _meets(span: slice, others: Sequence[slice]) -> bool:
    return any(span.start < other.stop and other.start < span.stop for other in others)


def counted(traces: Sequence[Trace], travel: float) -> list[Trace]:
    """The traces with their converters, where these are coarse for the travel [output unit]."""
    return [
        replace(t, converter=Converter(t.quantum, t.sigma)) if t.quantum > POLICY.coarse_step * travel else t
        for t in traces
    ]


def make_trace(
    name: str,
    s: Signals,
    sigma: float,
    quantum: float = 0.0,
    start: tuple[float, float] | None = None,
    speeds: tuple[float, float] | None = None,
) -> Trace:
    """A trace with its blocks of BLOCK seconds and its initial state, where that is not known as the samples show it:
    these, or what lay before them (``speeds``, least and largest).
    """
    t = s.t
    block = np.minimum(np.floor((t - t[0]) / BLOCK), max(np.floor((t[-1] - t[0]) / BLOCK) - 1, 0))
    if block[-1] > t.size:  # blocks of one sample and none: those without are not laid out
        block = np.unique(block, return_inverse=True)[1]
    block = block.astype(np.int64)
    counts = np.bincount(block[s.valid], minlength=block[-1] + 1).astype(float)
    y = np.where(s.valid, s.y, np.nan)
    signals = name, t, s.u, y, s.valid, s.enable, s.load
    trace = Trace(*signals, sigma, quantum, start or (0.0, 0.0), block, counts, speeds=speeds)
    return trace if start else replace(trace, start=_started(trace))


def _started(trace: Trace) -> tuple[float, float]:
    n = trace.beginning
    low, high = trace.speeds or start_seen(trace.t[:n], trace.y[:n], trace.sigma)
    y = trace.y[:n][trace.valid[:n]]
    still = y[: int(np.argmax(np.append(np.abs(y - y[0]) > 3.0 * trace.sigma, True)))] if y.size else np.zeros(1)
    return float(np.mean(still)) if low == high else float(y[0]), 0.5 * (low + high)


@dataclass(frozen=True)
class Blocks:
    """Block bookkeeping over several traces: index of each sample (N,), which rises, samples in each block (B,)."""

    index: np.ndarray
    counts: np.ndarray

    @staticmethod
    def of(traces: Sequence[Trace]) -> Blocks:
        index, counts, base = [], [], 0
        for trace in traces:
            every = [
                trace.counts,
                *(np.bincount(trace.block[np.isfinite(c.values)], minlength=trace.counts.size) for c in trace.channels),
            ]
            for count in every:
                index.append(trace.block + base)
                counts.append(count)
                base += count.size
        return Blocks(np.concatenate(index), np.maximum(np.concatenate(counts), 1.0).astype(float))

    def misfit(self, e: np.ndarray) -> np.ndarray:
        """Mean squared residual (in sigmas) of each block; infinite where a run has all but run away."""
        begins, empty = self._begins
        with np.errstate(over="ignore"):
            sums = np.add.reduceat(e * e, begins)
        sums[empty] = 0.0
        return sums / self.counts

    @cached_property
    def _begins(self) -> tuple[np.ndarray, np.ndarray]:
        """(B,) the first sample of each block, and whether it has none."""
        begins = np.searchsorted(self.index, np.arange(self.counts.size + 1))
        return np.minimum(begins[:-1], self.index.size - 1), begins[:-1] == begins[1:]


def smooth_speed(trace: Trace | Recording) -> np.ndarray:
    """Speed (N,) [output unit / s] by differences over about 20 ms."""
    k = max(1, round(0.01 / trace.sample_time))
    y = np.interp(trace.t, trace.t[trace.valid], trace.y[trace.valid])
    padded_y, padded_t = np.pad(y, k, mode="edge"), np.pad(trace.t, k, mode="edge")
    return (padded_y[2 * k :] - padded_y[: -2 * k]) / np.maximum(padded_t[2 * k :] - padded_t[: -2 * k], 1e-12)
