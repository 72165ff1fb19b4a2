"""Recordings of a position command as a fit sees them: noise, blocks, the state before the first sample."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ers_mj.data.beginnings import start_seen
from ers_mj.data.recording import Recording
from ers_mj.data.sensor_faults import converter_step, spikes
from ers_mj.effects.quantities import Scales
from ers_mj.errors import InputError

KINDS = {"u_V": "voltage", "u_duty_pct": "duty", "i_A": "current", "i_cmd_A": "current"}  # of a drive's signals
BLOCK = 0.1  # [s] that a servo's errors hang together


@dataclass(frozen=True)
class Reading:
    """How the noise and the beginning of a run are read."""

    window: int = 20  # samples over which the noise is taken
    quiet: float = 0.1  # quantile of the windows: the rest is motion
    fast: float = 0.6  # of the samples, fewer of which a slower sensor read
    share: float = 0.7  # of the noise that this quantile of windows of noise alone shows
    settled: float = 0.02  # of the travel: a reference so near the output stood there before
    start: float = 0.05  # [s] over which the first speed is taken,
    samples: int = 10  # or so many samples
    rest: float = 0.1  # [s] within which an output that has been commanded away leaves its place
    sure: float = 4.0  # standard deviations by which it must do so
    unsaturated: float = 0.9  # of the largest drive signal, below which it follows the loop's error


READING = Reading()


@dataclass(frozen=True, eq=False)
class Beside:
    """A drive signal recorded beside: values and the samples that are scored (N,), noise sigma [its own unit],
    that unit, and whether it is a current.
    """

    values: np.ndarray
    scored: np.ndarray
    sigma: float
    unit: str
    is_current: bool


@dataclass(frozen=True, eq=False)
class Run:
    """One recording: time, reference and output (N,), the samples that are scored, whether the drive was on, noise
    sigma [output unit] and the converter's quantum, (angle, speed) at the start, and the reference before it.

    ``gain`` is the firmware's gain over that of the first run, ``inertia`` and ``pull`` the load's m l^2 and m l over
    those of the first; ``beside`` a drive signal to explain as well, or None; ``offset`` [output unit]
    what was taken off its output.
    """

    name: str
    t: np.ndarray
    r: np.ndarray
    y: np.ndarray
    scored: np.ndarray
    enable: np.ndarray
    sigma: float
    quantum: float
    start: tuple[float, float]
    before: float
    gain: float = 1.0
    inertia: float = 1.0
    pull: float = 1.0
    beside: Beside | None = field(default=None, repr=False)
    offset: float = 0.0

    @property
    def sample_time(self) -> float:
        """Median step [s]."""
        return float(np.median(np.diff(self.t)))

    @property
    def block(self) -> np.ndarray:
        """Block (N,) of each sample."""
        return ((self.t - self.t[0]) / BLOCK).astype(np.int64)

    @cached_property
    def seen(self) -> np.ndarray:
        """The samples (N,) that are scored, NaN between them."""
        return np.where(self.scored, self.y, np.nan)

    def shifted(self, offset: float) -> Run:
        """The run with the offset of its log's sensor taken off."""
        start = self.start[0] - offset, self.start[1]
        return replace(self, y=self.y - offset, start=start, offset=self.offset + offset)

    def only(self, begin: float, end: float) -> Run:
        """The run, of which only the samples between these shares of its time are scored."""
        return self._scored(self._within(begin, end))

    def outside(self, begin: float, end: float) -> Run:
        """The run, of which the samples between these shares of its time are not scored."""
        return self._scored(~self._within(begin, end))

    def _within(self, begin: float, end: float) -> np.ndarray:
        share = (self.t - self.t[0]) / (self.t[-1] - self.t[0])
        return (share >= begin) & (share <= end)

    def as_far_as_scored(self) -> Run:
        """The run up to its last scored sample: what comes after it tells a fit nothing."""
        end = int(np.flatnonzero(self.scored)[-1]) + 1
        if end == self.t.size:
            return self
        rows = {name: getattr(self, name)[:end] for name in ("t", "r", "y", "scored", "enable")}
        beside = self.beside
        if beside is not None:
            beside = replace(beside, values=beside.values[:end], scored=beside.scored[:end])
        return replace(self, **rows, beside=beside)

    def _scored(self, these: np.ndarray) -> Run:
        beside = replace(self.beside, scored=self.beside.scored & these) if self.beside is not None else None
        return replace(self, scored=self.scored & these, beside=beside)


def runs_of(recordings: Sequence[Recording], first: Recording | None = None) -> list[Run]:
    """Recordings of one servo as runs; gains and loads are told over those of the ``first`` one."""
    first = recordings[0] if first is None else first
    return [_run(r, first) for r in recordings]


def _run(recording: Recording, first: Recording) -> Run:
    t = recording.t - recording.t[0]
    sigma = noise_of(recording.y, recording.quantum)
    y = np.where(recording.valid, recording.y, np.nan)
    for span in spikes(y, sigma):
        y[span] = np.nan
    enable = np.ones(t.size, bool) if recording.enable is None else np.asarray(recording.enable, bool)
    start, travel = started(t, y, sigma), float(np.nanmax(y) - np.nanmin(y))
    is_settled = stood(t, recording.u, y, sigma, travel)
    inertia, pull = _load(recording, first)
    run = Run(
        recording.name,
        t,
        np.ascontiguousarray(recording.u, float),
        y,
        np.isfinite(y) & _driven(enable),
        enable,
        sigma,
        recording.quantum,
        start if is_settled else (start[0], 0.0),
        float(recording.u[0]) if is_settled else start[0],
        gain=recording.kp / first.kp if recording.kp and first.kp else 1.0,
        inertia=inertia,
        pull=pull,
    )
    return replace(run, beside=_beside(recording, run))


def _beside(recording: Recording, run: Run) -> Beside | None:
    """The second signal of a recording; its noise is at least what the output's noise becomes within the loop.

    Raises:
        InputError: what is to be explained is no signal of the drive.
    """
    if recording.second is None:
        return None
    if recording.second_name not in KINDS:
        raise InputError(
            f"{recording.name}: --second {recording.second_name} under a position command, a signal of its drive was"
            f" expected ({', '.join(KINDS)})"
        )
    x = np.asarray(recording.second, float)
    scored = np.isfinite(x) & run.scored
    if not scored.any() or not float(np.ptp(x[scored])) > 0.0:
        raise InputError(f"{recording.name}: {recording.second_name} never changes, a signal of the drive was expected")
    e = run.r - run.y
    small = scored & (np.abs(x) < READING.unsaturated * np.max(np.abs(x[scored])))
    slope = float(np.dot(x[small], e[small]) / max(np.dot(e[small], e[small]), 1e-300)) if small.any() else 0.0
    sigma = max(noise_of(x, converter_step(x[scored]) or 0.0), abs(slope) * run.sigma)
    return Beside(x, scored, sigma, recording.second_unit, KINDS[recording.second_name] == "current")


def _driven(enable: np.ndarray) -> np.ndarray:
    """Samples (N,) before the drive is first switched off, of a recording that begins with it on."""
    if not enable[0]:
        return enable
    return np.cumsum(~enable) == 0


def _load(recording: Recording, first: Recording) -> tuple[float, float]:
    """(m l^2, m l) of a recording's load over those of the first one; 1 where either is not known."""
    m, m_1 = recording.load_kg or 0.0, first.load_kg or 0.0
    length, length_1 = recording.arm_m or 1.0, first.arm_m or 1.0
    if not (m and m_1):
        return 1.0, 1.0
    return m * length**2 / (m_1 * length_1**2), m * length / (m_1 * length_1)


def noise_of(y: np.ndarray, quantum: float) -> float:
    """Noise of a record (N,): third differences over sqrt(20) in its quieter windows, at least q / sqrt(12); of what a
    slower sensor read where that is most of the samples that are missing.
    """
    known = np.isfinite(y)
    d = np.diff(y[known] if np.mean(known) < READING.fast else y, 3)
    d = d[np.isfinite(d)]
    least = max(quantum / math.sqrt(12.0), 1e-9 * float(np.nanstd(y)) + 1e-300)
    windows = d[: d.size // READING.window * READING.window].reshape(-1, READING.window)
    if not windows.size:
        return least
    rms = np.sqrt(np.mean(windows**2, axis=1) / 20.0)
    moving = rms[rms > 0.5 * quantum / math.sqrt(12.0)] if quantum > 0 else rms
    return max(float(np.quantile(moving, READING.quiet)) / READING.share if moving.size else 0.0, least)


def started(t: np.ndarray, y: np.ndarray, sigma: float) -> tuple[float, float]:
    """(angle, speed) at the first sample: at rest where the first samples allow it."""
    known = np.isfinite(y)
    t, y = t[known], y[known]
    n = max(READING.samples, int(np.searchsorted(t, READING.start)))
    low, high = start_seen(t[:n], y[:n], sigma)
    return float(y[0]), 0.5 * (low + high)


def stood(t: np.ndarray, r: np.ndarray, y: np.ndarray, sigma: float, travel: float) -> bool:
    """Whether the reference had stood at its first value before: the output is near it, or does not leave its place
    while the reference keeps its own.
    """
    if abs(r[0] - y[np.isfinite(y)][0]) < READING.settled * travel:
        return True
    held = t < min(READING.rest, float(t[int(np.argmax(r != r[0]))]) if np.any(r != r[0]) else np.inf)
    first = y[held & np.isfinite(y)]
    return first.size > 2 and float(np.ptp(first)) < READING.sure * sigma


def scales_of(runs: Sequence[Run], is_angle: bool, friction: float, drive: float) -> Scales:
    """The sizes from which effects take their starts; ``friction`` and ``drive`` [output unit/s^2] as fitted."""
    low = min(float(np.nanmin(run.y)) for run in runs)
    high = max(float(np.nanmax(run.y)) for run in runs)
    speed = max(float(np.quantile(np.abs(speed_of(run)), 0.95)) for run in runs)
    return Scales(
        position=0.5 * (high - low),
        low=low,
        high=high,
        speed=speed,
        acceleration=max(friction, 0.02 * drive, 1e-9),
        input=max(float(np.max(np.abs(run.r - np.nan_to_num(run.y, nan=0.0)))) for run in runs),
        sample_time=max(run.sample_time for run in runs),
        noise=max(run.sigma for run in runs),
        quantum=max(run.quantum for run in runs),
        is_angle=is_angle,
        drive=drive,
        duration=max(float(run.t[-1]) for run in runs),
        recordings=len(runs),
    )


def speed_of(run: Run, width: float = 0.02) -> np.ndarray:
    """Speed (N,) [output unit/s] by differences over +-``width`` [s]."""
    k = max(1, round(width / run.sample_time))
    known = np.isfinite(run.y)
    y = np.interp(run.t, run.t[known], run.y[known])
    i, j = np.clip(np.arange(y.size) - k, 0, None), np.clip(np.arange(y.size) + k, None, y.size - 1)
    return (y[j] - y[i]) / np.maximum(run.t[j] - run.t[i], 1e-12)


def spread_out(runs: Sequence[Run], seconds: float) -> list[Run]:
    """Runs evenly picked of many, of so many seconds together; at least four."""
    total = sum(float(run.t[-1]) for run in runs)
    count = max(4, round(len(runs) * seconds / total))
    if count >= len(runs):
        return list(runs)
    return [runs[k] for k in np.unique(np.linspace(0, len(runs) - 1, count).round().astype(int))]
