"""What a simulation leaves of recordings over frequency: where it is off beyond the noise, and whether another linear
model would close that.

    errors of an observer -> frames -> spectra -> linear in input and motion | distortion | noise -> Mismatch
 The error e of the observer is split at each frequency by its coherence with the simulated motion x and the input u
together,
    E = A X + B U + rest,    S_ee = (linear) + (rest),    S_rest = (distortion) + (noise).
Where friction is known, x and u tell every linear change of the dynamics beside it (a lag, a delay, a resonance), and
no stick or slip that comes at another time. The noise is that of the sensor, and what the observer makes of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ers_mj.data.frequency_response import Response, gap, shortest_band
from ers_mj.data.prepared import Trace
from ers_mj.servo.model import OBSERVER_STEP


@dataclass(frozen=True)
class Frames:
    """How recordings are cut into frames."""

    lengths: int = 8  # of a frame in the median recording
    first: int = 2  # line from which the window's leakage leaves something to read
    top: float = 0.4  # of the rate at which the observer corrects itself: its steps are no motion
    fewest: int = 6  # of an analysis
    least_samples: int = 32  # of a frame


FRAMING = Frames()


@dataclass(frozen=True)
class Reading:
    """What spectra must show for something to be told."""

    fewest_lines: int = 3  # off beyond the noise, or coherent
    # over the root of the number of frames: excess over the noise, five deviations, from which a line is off
    beyond: float = 7.0
    region: float = 2 / 3  # of the error beyond the noise that the region holds
    linear: float = 0.6  # share of the error there that is linear, from which it is called so
    distorted: float = 0.4  # up to which it is called a distortion
    phase: float = 2.0  # times the size's gap that a phase's must be
    delay: float = 0.7  # share of it that a delay explains, to be told alone
    neighbours: int = 1  # lines on either side over which a linear part is straight
    # ln of a peak of measured over simulated motion, from which it is called a resonance (0.9 dB)
    resonant: float = 0.1


READING = Reading()


@dataclass(frozen=True, eq=False)
class Mismatch:
    """Mean power densities over all frames, each (F,) [output unit^2 / Hz], and what they say.

    Attributes:
        f_hz: frequencies [Hz], evenly spaced. motion, error, linear, distortion, noise: of the measured motion, of the
        error, of its two parts beyond the noise, and of the noise.
        beyond: which lines are off beyond the noise, (F,) of bool; in half of the frames at least, so that some in
            which stick and slip fork are not enough.
        response: measured over simulated output, as in a free run.
        region: the shortest band [Hz], in log frequency, that holds READING.region of the error beyond the noise; None
        where too few lines are off. share_of_error, share_of_motion: of the power of either that lies in it.
        linear_share: of the error beyond the noise that lies in it, the part that is linear.
        kind: "linear", "distortion" or "both"; None without a region.
        sentence: all of it in words.
    """

    f_hz: np.ndarray
    motion: np.ndarray
    error: np.ndarray
    linear: np.ndarray
    distortion: np.ndarray
    noise: np.ndarray
    beyond: np.ndarray
    response: Response
    region: tuple[float, float] | None = None
    share_of_error: float = 0.0
    share_of_motion: float = 0.0
    linear_share: float = 0.0
    kind: str | None = None
    sentence: str = "the error is hardly more than noise at any frequency"


def mismatch(traces: Sequence[Trace], errors: Sequence[np.ndarray], rate: float) -> Mismatch | None:
    """Over all recordings together.

    Args:
        traces: the recordings.
        errors: of an observer, measured less simulated, at each recording's valid samples.
        rate: of that observer [1/s].

    Returns:
        None where the recordings are too short.
    """
    length = float(np.median([t.t[-1] - t.t[0] for t in traces])) / FRAMING.lengths  # [s] of a frame
    parts = [
        _framed(t, e, length, rate)
        for t, e in zip(traces, errors, strict=True)
        if round(length / t.sample_time) >= FRAMING.least_samples
    ]
    if sum(part[0].shape[0] for part in parts) < FRAMING.fewest:
        return None
    lines = min(part[0].shape[1] for part in parts)
    X, U, E, noise = (np.concatenate([part[k][:, FRAMING.first : lines] for part in parts]) for k in range(4))
    return _told(*_split(np.arange(FRAMING.first, lines) / length, X, U, E, noise, rate))


def _framed(trace: Trace, error: np.ndarray, length: float, rate: float) -> tuple[np.ndarray, ...]:
    """Spectra (K, F) of simulated output, input and error in Hann windows that overlap by half, and the noise's power
    density in each.

    Holes are filled straight.
    """
    h, v = trace.sample_time, trace.valid
    size = round(length / h)
    t = trace.t[0] + h * np.arange(int((trace.t[-1] - trace.t[0]) / h + 1.5))
    e, y, u = np.interp(t, trace.t[v], error), np.interp(t, trace.t[v], trace.y[v]), np.interp(t, trace.t, trace.u)
    every = max(1, round(OBSERVER_STEP / h))
    lines = int(FRAMING.top * size / every) + 1
    X, U, E = (_frames(x, size, lines) * math.sqrt(h) for x in (y - e, u, e))
    noise = observed_noise(np.arange(lines) / (h * size), h, every, trace.sigma, rate)
    return X, U, E, np.broadcast_to(noise, E.shape)


def _frames(x: np.ndarray, size: int, lines: int) -> np.ndarray:
    """Windowed spectra (K, lines) of x (N,), scaled so that white noise of variance s^2 has mean square 2 s^2."""
    frames = sliding_window_view(x, size)[:: size // 2] if x.size >= size else np.empty((0, size))
    window = np.hanning(size + 1)[:size]
    return np.fft.rfft((frames - frames.mean(axis=1, keepdims=True)) * window, axis=1)[:, :lines] * math.sqrt(
        2.0 / np.sum(window**2)
    )


def observed_noise(f_hz: np.ndarray, h: float, every: int, sigma: float, rate: float) -> np.ndarray:
    """Power density (F,) of e = n - a, n white of deviation sigma: the observer's state takes some of it over every T
    seconds, a += g (n - a).
    """
    T = every * h
    g, z = 1.0 - math.exp(-rate * T), np.exp(-2j * np.pi * f_hz * T)
    held = np.exp(-2j * np.pi * h * np.multiply.outer(f_hz, np.arange(1, every + 1))).mean(axis=1)
    A = g * held / (1.0 - (1.0 - g) * z)
    return 2.0 * sigma**2 * (h * (1.0 - 2.0 * A.real) + T * np.abs(A) ** 2)


def _split(f_hz: np.ndarray, X: np.ndarray, U: np.ndarray, E: np.ndarray, noise: np.ndarray, rate: float):
    """Power densities, the lines beyond noise, and the response, from frames (K, F)."""
    K, S_ee, level = X.shape[0], np.mean(np.abs(E) ** 2, axis=0), noise.mean(axis=0)
    share = np.array([_linear_share(X, U, E, k) for k in range(f_hz.size)])
    linear, distortion = share * S_ee, np.maximum((1.0 - share) * S_ee - level, 0.0)
    beyond = np.median(np.abs(E) ** 2 / noise, axis=0) / math.log(2.0) > 1.0 + READING.beyond / math.sqrt(K)
    return (
        f_hz,
        np.mean(np.abs(X + E) ** 2, axis=0),
        S_ee,
        linear,
        distortion,
        level,
        beyond,
        _response(f_hz, X, E, rate),
    )


def _linear_share(X: np.ndarray, U: np.ndarray, E: np.ndarray, k: int) -> float:
    """Share of the error's power about line k that A X + B U explains, A and B straight over the neighbouring lines,
    freed of what chance gives them.

    A sweep passes a line in a frame or two, which one complex number explains whatever the reason; over the neighbours
    it takes more. The number of independent terms is told by how evenly the error's power is spread over them.
    """
    near = slice(max(k - READING.neighbours, 0), k + READING.neighbours + 1)
    x, u, e = X[:, near], U[:, near], E[:, near].ravel()
    r = np.arange(E.shape[1])[near] - k
    columns = [(z / math.sqrt(max(np.mean(np.abs(z) ** 2), 1e-300)) * w).ravel() for z in (x, u) for w in (1.0, r)]
    A, power = np.stack(columns, axis=1), np.abs(e) ** 2
    rest = np.abs(e - A @ np.linalg.lstsq(A, e, rcond=1e-6)[0]) ** 2
    terms = power.sum() ** 2 / max(np.sum(power**2), 1e-300)
    chance = terms / max(terms - len(columns), 1.0)
    return max(1.0 - chance * float(rest.sum()) / max(float(power.sum()), 1e-300), 0.0)


def _response(f_hz: np.ndarray, X: np.ndarray, E: np.ndarray, rate: float) -> Response:
    """Measured over simulated output. The observer's error is that of a free run behind s / (s + rate)."""
    Y, free = X + E, E * (1.0 + rate / (2j * np.pi * f_hz))
    X = Y - free
    S_xx, S_yy, S_xy = np.mean(np.abs(X) ** 2, axis=0), np.mean(np.abs(Y) ** 2, axis=0), np.mean(X.conj() * Y, axis=0)
    coherence = np.abs(S_xy) ** 2 / np.maximum(S_xx * S_yy, 1e-300)
    size = np.sqrt(S_yy * f_hz[0] / FRAMING.first)
    return Response(
        "measured over simulated",
        "frames",
        X.shape[0],
        f_hz,
        S_xy / np.maximum(S_xx, 1e-300),
        coherence,
        np.sqrt((1.0 / np.maximum(coherence, 1e-12) - 1.0) / X.shape[0]),
        size * np.sqrt(np.maximum(1.0 - coherence, 0.0)),
        np.full(f_hz.size, np.nan),
        size,
    )


def _told(f_hz, motion, error, linear, distortion, noise, beyond, response) -> Mismatch:
    """The region, and what is in it."""
    parts = f_hz, motion, error, linear, distortion, noise, beyond, response
    if beyond.sum() < READING.fewest_lines:
        return Mismatch(*parts)
    excess = np.where(beyond, np.maximum(error - noise, 0.0), 0.0)
    low, high = shortest_band(f_hz[beyond], excess[beyond], READING.region)
    inside, half = (f_hz >= low) & (f_hz <= high), 0.5 * f_hz[0] / FRAMING.first
    share, moving = float(excess[inside].sum() / excess.sum()), float(motion[inside].sum() / motion.sum())
    both = float((linear + distortion)[inside & beyond].sum())
    part = float(linear[inside & beyond].sum()) / max(both, 1e-300)
    kind = "linear" if part >= READING.linear else "distortion" if part <= READING.distorted else "both"
    region = float(low - half), float(high + half)
    sentence = (
        f"{share:.0%} of the error beyond the noise lies at {region[0]:.2g} to {region[1]:.2g} Hz, where {moving:.0%}"
        " of the motion's power is; "
        + (
            f"{1 - part:.0%} of it is a distortion, which no linear change of the model closes"
            if kind == "distortion"
            else f"{part:.0%} of it is linear{_shape(response, beyond)}"
            + (", the rest a distortion" if kind == "both" else "")
        )
    )
    return Mismatch(*parts, region, share, moving, part, kind, sentence)


def _shape(response: Response, beyond: np.ndarray) -> str:
    """What the linear part looks like from the lines where measured and simulated motion cohere: a phase, a resonance,
    sizes; nothing where they are few.
    """
    sure = response.sure & beyond
    found = gap(response, np.ones_like(response.g))
    if sure.sum() < READING.fewest_lines or found is None:
        return ""
    f, phase, size = response.f_hz[sure], np.unwrap(np.angle(response.g[sure])), np.log(np.abs(response.g[sure]))
    late = -float(f @ phase) / (2.0 * np.pi * float(f @ f))  # [s]
    if phase @ phase >= READING.phase * (size @ size) and np.sum((phase + 2.0 * np.pi * f * late) ** 2) <= (
        1.0 - READING.delay
    ) * (phase @ phase):
        return (
            f": a phase that grows with frequency, to {math.degrees(abs(2 * np.pi * f[-1] * late)):.2g} deg at"
            f" {f[-1]:.2g} Hz, as where the motion comes {1e3 * abs(late):.2g} ms {'later' if late > 0 else 'earlier'}"
            " than the model's"
        )
    peak = int(np.argmax(np.abs(size)))
    if max(abs(size[0]), abs(size[-1])) < 0.5 * abs(size[peak]):
        of_what = ", as by a resonance that the model lacks" if size[peak] > READING.resonant else ""
        return (
            f": the motion is {20 * size[peak] / math.log(10):+.2g} dB off the model's at {f[peak]:.2g} Hz and less on"
            f" either side{of_what}"
        )
    return (
        f": {found.rms_db:.2g} dB and {found.rms_deg:.2g} deg between measured and simulated motion (RMS over"
        f" {found.lines} lines)"
    )
