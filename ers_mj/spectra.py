"""The frequency response of a recording, with what noise and distortion leave of it, and how far a model is from it.

    recording -> period of the input -> lines (periodic, as a multisine) or averaged segments (any other) -> Response;  Response, model -> Gap

A periodic input excites some lines of the recording's spectrum and no others. At an excited line stands the best linear approximation; lines between
the harmonics of the period hold noise and the decay of the first state; harmonics that are not excited hold the distortion besides. The
decay is smooth over the lines, so that a parabola through the quiet neighbours takes it off (Pintelon and Schoukens, System Identification,
2nd ed., chapters 4 and 7). Of one period alone noise and distortion are told together.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import csd, welch

from ers_mj.errors import InputError
from ers_mj.recording import Recording

SAME = 1e-6  # share of the energy by which two periods of the input may differ
QUIET, EXCITED = 1e-6, 1e-4  # share of the strongest line's power: most of an unexcited line, least of an excited one
FEW = 0.25  # share of all lines up to the highest excited one that a single period may excite and still be a multisine
LEAST_PERIOD = 50  # samples
NEIGHBOURS = 10  # quiet lines from which decay and noise are taken
SEGMENTS = 8  # of a recording that is averaged
FIRST = 4  # line of a segment from which the window's leakage leaves something to read
EXACT = {"periodic": 0.03, "welch": 0.08}  # relative gap up to which nothing is missing: what leakage leaves of an exact response
SURE = 0.95  # coherence from which a line counts


@dataclass(frozen=True, eq=False)
class Response:
    """A recording's frequency response, each (F,).

    Attributes:
        name: of the recording.
        kind: "periodic" or "welch".
        periods: how many were averaged, or how many segments.
        f_hz: frequencies [Hz].
        g: output over input, complex [output unit / input unit].
        coherence: share of the output's power that the input explains linearly.
        noise: standard deviation, in one period, of the output's amplitude that does not repeat [output unit]; of a single period or of segments, which
            cannot tell them apart, with the distortion in it.
        distortion: the same of what repeats and is not linear; NaN where it cannot be told apart.
        output: the output's amplitude [output unit].
    """

    name: str
    kind: str
    periods: int
    f_hz: np.ndarray
    g: np.ndarray
    coherence: np.ndarray
    noise: np.ndarray
    distortion: np.ndarray
    output: np.ndarray

    @property
    def sure(self) -> np.ndarray:
        """Which lines count (F,)."""
        return self.coherence > SURE


@dataclass(frozen=True)
class Gap:
    """How far a model is from a response where the response is sure: [dB], [deg], and in which band [Hz] most of it lies.

    ``linear`` tells whether the gap is more than what distortion and noise leave open, so that another linear model would close it.
    """

    lines: int
    rms_db: float
    max_db: float
    rms_deg: float
    max_deg: float
    band_hz: tuple[float, float]
    linear: bool
    sentence: str


def frequency_response(recording: Recording) -> Response:
    """The response of one recording.

    Raises:
        InputError: its input does not vary, or its samples are not evenly spaced.
    """
    u, y = _even(recording)
    period = find_period(u)
    if period is not None and u.size >= 2 * period:
        count = u.size // period
        used = (count - 1 if count > 2 else count) * period  # the first of three or more holds most of the decay
        return _of_lines(recording, u[-used:], y[-used:], used // period)
    whole = u.size if period is None else period
    return _of_lines(recording, u[-whole:], y[-whole:], 1) if _is_sparse(u[-whole:]) else _of_segments(recording, u, y)


def _even(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Input and output (N,) less the output's mean, holes filled straight."""
    h = np.diff(recording.t)
    if np.ptp(h) > 0.05 * h.mean():
        raise InputError(f"{recording.name}: its samples are {1e3 * h.min():.4g} to {1e3 * h.max():.4g} ms apart, a frequency response needs even spacing")
    if np.ptp(recording.u) == 0:
        raise InputError(f"{recording.name}: its input is constant, a frequency response needs one that varies")
    y = np.interp(recording.t, recording.t[recording.valid], recording.y[recording.valid])
    return recording.u - recording.u.mean(), y - y.mean()


def find_period(u: np.ndarray) -> int | None:
    """The shortest period [samples] after which u (N,) repeats, as far as it goes on; None where it does not."""
    n = u.size
    spectrum = np.fft.rfft(u, 2 * n)
    products = np.fft.irfft(np.abs(spectrum) ** 2)[:n]  # sum of u[k] u[k + lag]
    energy = np.concatenate([[0.0], np.cumsum(u**2)])
    lags = np.arange(LEAST_PERIOD, n - max(n // 20, LEAST_PERIOD))
    if not lags.size:
        return None
    both = energy[n - lags] + energy[n] - energy[lags]
    same = lags[both - 2.0 * products[lags] <= SAME * both]
    return int(same[0]) if same.size else None


def _is_sparse(u: np.ndarray) -> bool:
    """Whether the spectrum of u (N,) is a few lines and nothing between them."""
    power = np.abs(np.fft.rfft(u)) ** 2
    excited = power > EXCITED * power.max()
    return bool((power[~excited] < QUIET * power.max()).all() and excited.sum() <= FEW * np.flatnonzero(excited)[-1])


def _of_lines(recording: Recording, u: np.ndarray, y: np.ndarray, periods: int) -> Response:
    n = u.size
    U, Y = 2.0 * np.fft.rfft(u) / n, 2.0 * np.fft.rfft(y) / n
    power = np.abs(U) ** 2
    lines = np.flatnonzero(power > EXCITED * power.max())
    lines = lines[(lines > 0) & (lines < n // 2)]
    harmonic = np.arange(U.size) % periods == 0
    quiet = np.flatnonzero(~harmonic if periods > 1 else power <= EXCITED * power.max())
    idle = np.setdiff1d(np.flatnonzero(harmonic), lines) if periods > 1 else np.empty(0, int)
    quiet, idle = quiet[quiet > 0], idle[idle > 0]
    true, spread = _cleaned(Y, lines, quiet)
    distorted = np.full(lines.size, np.nan)
    if idle.size:
        rest, noise = _cleaned(Y, idle, quiet)
        excess = np.abs(rest) ** 2 - noise
        distorted = np.array([max(excess[_nearest(idle, k)].mean(), 0.0) for k in lines])
    spread *= periods
    total = spread + np.nan_to_num(distorted)
    size = np.abs(true) ** 2
    return Response(recording.name, "periodic", periods, lines / (n * recording.sample_time), true / U[lines], size / (size + total),
                    np.sqrt(spread), np.sqrt(distorted), np.abs(true))


def _cleaned(Y: np.ndarray, lines: np.ndarray, quiet: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Y (K,) at some lines less the decay that a parabola through the quiet lines around tells, and those lines' variance about it (K,)."""
    true, spread = np.empty(lines.size, complex), np.empty(lines.size)
    for i, k in enumerate(lines):
        near = quiet[_nearest(quiet, k)]
        x = (near - k) / np.abs(near - k).max()
        c = np.linalg.lstsq(np.vander(x, 3).astype(complex), Y[near], rcond=None)[0]
        true[i] = Y[k] - c[-1]
        spread[i] = np.sum(np.abs(Y[near] - np.polyval(c, x)) ** 2) / max(near.size - 3, 1)
    return true, spread


def _nearest(lines: np.ndarray, k: int) -> slice:
    """Which NEIGHBOURS of the sorted lines are nearest to k, of both sides alike."""
    at, half = np.searchsorted(lines, k), NEIGHBOURS // 2
    begin = min(max(at - half, 0), max(lines.size - NEIGHBOURS, 0))
    return slice(begin, begin + NEIGHBOURS)


def _of_segments(recording: Recording, u: np.ndarray, y: np.ndarray) -> Response:
    """Welch's averages, Hann windows that overlap by half, of differences from sample to sample: a servo's slow motion leaks less."""
    size, h = max(u.size // SEGMENTS, 64), recording.sample_time
    options = {"fs": 1.0 / h, "nperseg": size, "detrend": "constant"}
    u, y = np.diff(u), np.diff(y)
    f, uu = welch(u, **options)
    yy, uy = welch(y, **options)[1], csd(u, y, **options)[1]
    used = (uu > EXCITED * uu.max()) & (f >= FIRST / (h * size))
    f, uu, yy, uy = f[used], uu[used], yy[used], uy[used]
    coherence = np.abs(uy) ** 2 / np.maximum(uu * yy, 1e-300)
    amplitude = np.sqrt(2.0 * yy / (h * size)) / (2.0 * np.sin(np.pi * f * h))
    return Response(recording.name, "welch", 2 * (u.size // size) - 1, f, uy / uu, coherence, amplitude * np.sqrt(np.maximum(1.0 - coherence, 0.0)),
                    np.full(f.size, np.nan), amplitude)


# -- against a model ------------------------------------------------------------------------------------------------------


def gap(response: Response, model: np.ndarray) -> Gap | None:
    """How far a model's response (F,) is from a recording's; None where the recording is nowhere sure.

    It tells the band, and whether a linear change or a distortion is missing.
    """
    k = response.sure
    if not k.any():
        return None
    ratio = model[k] / response.g[k]
    db, deg = 20.0 * np.log10(np.abs(ratio)), np.degrees(np.angle(ratio))
    off = np.abs(ratio - 1.0) ** 2
    open_ = 1.0 / response.coherence[k] - 1.0  # variance of the response, relative, of one period
    linear = bool(off.mean() > 4.0 * open_.mean() / max(response.periods, 1) + EXACT[response.kind] ** 2)
    band = shortest_band(response.f_hz[k], off)
    what = "more than noise and distortion leave open, its linear part is off" if linear else "no more than noise and distortion leave open"
    sentence = (f"{response.name}: the model is {_rms(db):.2g} dB and {_rms(deg):.2g} deg off (RMS over {k.sum()} lines), most of it at {band[0]:.3g} to "
                f"{band[1]:.3g} Hz: {what}")
    return Gap(int(k.sum()), _rms(db), float(np.abs(db).max()), _rms(deg), float(np.abs(deg).max()), band, linear, sentence)


def shortest_band(f_hz: np.ndarray, off: np.ndarray, share: float = 0.5) -> tuple[float, float]:
    """The shortest run of lines [Hz], in log frequency, that holds this share of ``off`` (F,)."""
    total = np.concatenate([[0.0], np.cumsum(off)])
    best = (math.inf, float(f_hz[0]), float(f_hz[-1]))
    for i in range(f_hz.size):
        j = int(np.searchsorted(total, total[i] + share * total[-1] * (1.0 - 1e-9)))
        if j <= f_hz.size:
            best = min(best, (math.log(f_hz[j - 1] / f_hz[i]), float(f_hz[i]), float(f_hz[j - 1])))
    return best[1], best[2]


def _rms(x: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(x))))
