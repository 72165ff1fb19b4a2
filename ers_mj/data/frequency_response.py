"""The frequency response of a recording, with what noise and distortion leave of it, and how far a model is from it.

    recording -> period of the input -> lines (periodic, as a multisine) or local polynomials (any other) -> Response;
    Response, model -> Gap

A periodic input excites some lines of the recording's spectrum and no others. At an excited line stands the best
linear approximation; lines between the harmonics of the period hold noise and the decay of the first state; harmonics
that are not excited hold the distortion besides. The decay is smooth over the lines, so that a parabola through the
quiet neighbours takes it off (Pintelon and Schoukens, System Identification, 2nd ed., chapters 4 and 7). Of one period
alone noise and distortion are told together.

Any other input excites neighbouring lines alike. About a line k the response and the decay are both taken as parabolas
over r = -n..n (local polynomial method, ibid., chapter 7), fitted to Y[k + r] = (G + G_1 r + G_2 r^2) U[k + r] + T +
T_1 r + T_2 r^2, which neither leaks nor smears a sweep as averaged segments do.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ers_mj.data.recording import Recording
from ers_mj.errors import InputError


@dataclass(frozen=True)
class Lines:
    """How the lines of a periodic input are told from what lies between them."""

    same: float = 1e-6  # share of the energy by which two periods of the input may differ
    quiet: float = 1e-6  # share of the strongest line's power: most of an unexcited line
    excited: float = 1e-4  # the same: least of an excited one
    # share of all lines up to the highest excited one that one period may excite and still be a multisine
    few: float = 0.25
    least_period: int = 50  # samples
    neighbours: int = 10  # quiet lines from which decay and noise are taken


LINES = Lines()


@dataclass(frozen=True)
class LocalFits:
    """How local polynomials are laid over the lines of any other input."""

    first: int = 2  # lowest line
    least_half: int = 8  # lines on either side, at least
    most_half: int = 60  # at most
    width: float = 1 / 6  # in shares of the frequency
    # times what even excitation leaves of a line's uncertainty (2.25 of a parabola): more extrapolates
    leverage: float = 6.0


LOCAL = LocalFits()

SURE = 0.95  # coherence from which a line counts


@dataclass(frozen=True, eq=False)
class Response:
    """A recording's frequency response, each (F,).

    Attributes:
        name: of the recording.
        kind: "periodic", or "local" (polynomials).
        periods: how many were averaged; 1 of any other input.
        f_hz: frequencies [Hz].
        g: output over input, complex [output unit / input unit].
        coherence: share of the output's power that the input explains linearly.
        error: standard deviation of g, relative.
        noise: standard deviation, in one period, of the output's amplitude that does not repeat [output unit]; of a
            single period or any other input, which cannot tell them apart, with the distortion in it.
        distortion: the same of what repeats and is not linear; NaN where it cannot be told apart.
        output: the output's amplitude [output unit].
    """

    name: str
    kind: str
    periods: int
    f_hz: np.ndarray
    g: np.ndarray
    coherence: np.ndarray
    error: np.ndarray
    noise: np.ndarray
    distortion: np.ndarray
    output: np.ndarray

    @property
    def sure(self) -> np.ndarray:
        """Which lines count (F,)."""
        return self.coherence > SURE


@dataclass(frozen=True)
class Gap:
    """How far a model is from a response where the response is sure: [dB], [deg], and in which band [Hz] most of it
    lies.

    ``linear`` tells whether the gap is more than what distortion and noise leave open, so that another linear model
    would close it.
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
        InputError: its input does not vary or excites no band, or its samples are not evenly spaced.
    """
    u, y = _even(recording)
    period = find_period(u)
    if period is not None and u.size >= 2 * period:
        count = u.size // period
        used = (count - 1 if count > 2 else count) * period  # the first of three or more holds most of the decay
        return _of_lines(recording, u[-used:], y[-used:], used // period)
    whole = u.size if period is None else period
    return (
        _of_lines(recording, u[-whole:], y[-whole:], 1) if _is_sparse(u[-whole:]) else _of_neighbours(recording, u, y)
    )


def _even(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Input and output (N,) less the output's mean, holes filled straight."""
    h = np.diff(recording.t)
    if np.ptp(h) > 0.05 * h.mean():
        raise InputError(
            f"{recording.name}: its samples are {1e3 * h.min():.4g} to {1e3 * h.max():.4g} ms apart, a frequency"
            " response needs even spacing"
        )
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
    lags = np.arange(LINES.least_period, n - max(n // 20, LINES.least_period))
    if not lags.size:
        return None
    both = energy[n - lags] + energy[n] - energy[lags]
    same = lags[both - 2.0 * products[lags] <= LINES.same * both]
    return int(same[0]) if same.size else None


def _is_sparse(u: np.ndarray) -> bool:
    """Whether the spectrum of u (N,) is a few lines and nothing between them."""
    power = np.abs(np.fft.rfft(u)) ** 2
    excited = power > LINES.excited * power.max()
    return bool(
        (power[~excited] < LINES.quiet * power.max()).all() and excited.sum() <= LINES.few * np.flatnonzero(excited)[-1]
    )


def _of_lines(recording: Recording, u: np.ndarray, y: np.ndarray, periods: int) -> Response:
    n = u.size
    U, Y = 2.0 * np.fft.rfft(u) / n, 2.0 * np.fft.rfft(y) / n
    power = np.abs(U) ** 2
    lines = np.flatnonzero(power > LINES.excited * power.max())
    lines = lines[(lines > 0) & (lines < n // 2)]
    harmonic = np.arange(U.size) % periods == 0
    quiet = np.flatnonzero(~harmonic if periods > 1 else power <= LINES.excited * power.max())
    idle = np.setdiff1d(np.flatnonzero(harmonic), lines) if periods > 1 else np.empty(0, int)
    quiet, idle = quiet[quiet > 0], idle[idle > 0]
    true, spread = _cleaned(Y, lines, quiet)
    distorted = np.full(lines.size, np.nan)
    if idle.size:
        rest, noise = _cleaned(Y, idle, quiet)
        excess = np.abs(rest) ** 2 - noise
        distorted = np.array([max(excess[_nearest(idle, int(k))].mean(), 0.0) for k in lines])
    spread *= periods
    total = spread + np.nan_to_num(distorted)
    size = np.abs(true) ** 2
    return Response(
        recording.name,
        "periodic",
        periods,
        lines / (n * recording.sample_time),
        true / U[lines],
        size / (size + total),
        np.sqrt(total / (periods * size)),
        np.sqrt(spread),
        np.sqrt(distorted),
        np.abs(true),
    )


def _cleaned(Y: np.ndarray, lines: np.ndarray, quiet: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Y (K,) at some lines less the decay that a parabola through the quiet lines around tells, and those lines'
    variance about it (K,).
    """
    true, spread = np.empty(lines.size, complex), np.empty(lines.size)
    for i, k in enumerate(lines):
        near = quiet[_nearest(quiet, k)]
        x = (near - k) / np.abs(near - k).max()
        c = np.linalg.lstsq(np.vander(x, 3).astype(complex), Y[near], rcond=None)[0]
        true[i] = Y[k] - c[-1]
        spread[i] = np.sum(np.abs(Y[near] - np.polyval(c, x)) ** 2) / max(near.size - 3, 1)
    return true, spread


def _nearest(lines: np.ndarray, k: int) -> slice:
    """Which LINES.neighbours of the sorted lines are nearest to k, of both sides alike."""
    at, half = int(np.searchsorted(lines, k)), LINES.neighbours // 2
    begin = min(max(at - half, 0), max(lines.size - LINES.neighbours, 0))
    return slice(begin, begin + LINES.neighbours)


def _of_neighbours(recording: Recording, u: np.ndarray, y: np.ndarray) -> Response:
    """By local polynomials, of the output's differences from sample to sample: a servo's speed follows its input more
    evenly than its angle.
    """
    h, u, y = recording.sample_time, u[:-1], np.diff(y)
    U, Y = 2.0 * np.fft.rfft(u) / u.size, 2.0 * np.fft.rfft(y) / u.size
    least, found, k = LINES.excited * np.max(np.abs(U) ** 2), [], LOCAL.first
    while k < U.size - LOCAL.least_half:
        half = round(min(max(LOCAL.least_half, LOCAL.width * k), LOCAL.most_half))
        begin = min(max(k - half, 1), max(U.size - 2 * half - 1, 1))
        near = np.arange(begin, min(begin + 2 * half + 1, U.size))
        power = float(np.mean(np.abs(U[near]) ** 2))
        if power > least and near.size > 6:
            g, variance, rest = _local(U[near], Y[near], (near - k) / half, math.sqrt(power))
            if variance * power * near.size <= LOCAL.leverage:
                found.append((k, g, variance * rest, rest, power))
        k += half // 2
    if not found:
        raise InputError(
            f"{recording.name}: its input excites no band of frequencies evenly, a frequency response needs a"
            " multisine, a sweep, steps or noise"
        )
    lines, gains, spreads, rests, powers = (np.array(column) for column in zip(*found))
    f_hz = lines / (u.size * h)
    differing = np.exp(2j * np.pi * f_hz * h) - 1.0
    size, rests = np.abs(gains / differing) ** 2 * powers, rests / np.abs(differing) ** 2
    return Response(
        recording.name,
        "local",
        1,
        f_hz,
        gains / differing,
        size / (size + rests),
        np.sqrt(spreads) / np.abs(gains),
        np.sqrt(rests),
        np.full(f_hz.size, np.nan),
        np.sqrt(size + rests),
    )


def _local(U: np.ndarray, Y: np.ndarray, r: np.ndarray, scale: float) -> tuple[complex, float, float]:
    """(g, its variance over that of the rest, variance of the rest) at r = 0 of lines (K,), from parabolas of the
    response and of the decay.
    """
    powers = np.vander(r, 3, increasing=True)
    A = np.concatenate([U[:, None] * powers, scale * powers], axis=1)
    inverse = np.linalg.pinv(A.conj().T @ A, hermitian=True)
    c = inverse @ (A.conj().T @ Y)
    return complex(c[0]), float(inverse[0, 0].real), float(np.sum(np.abs(Y - A @ c) ** 2) / (r.size - 6))


# -- against a model
# ------------------------------------------------------------------------------------------------------


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
    linear = bool(
        off.mean() > 4.0 * np.mean(response.error[k] ** 2) + 0.03**2
    )  # 3 %: what leakage leaves of an exact response
    band = shortest_band(response.f_hz[k], off)
    what = (
        "more than noise and distortion leave open, its linear part is off"
        if linear
        else "no more than noise and distortion leave open"
    )
    sentence = (
        f"{response.name}: the model is {_rms(db):.2g} dB and {_rms(deg):.2g} deg off (RMS over {k.sum()} lines), most"
        f" of it at {band[0]:.3g} to {band[1]:.3g} Hz: {what}"
    )
    return Gap(
        int(k.sum()), _rms(db), float(np.abs(db).max()), _rms(deg), float(np.abs(deg).max()), band, linear, sentence
    )


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
