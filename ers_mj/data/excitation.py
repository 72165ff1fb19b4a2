"""What a rig can be asked to do next: open-loop inputs within the limits that its recordings show, each rebuilt from a
few numbers.

An excitation is a dictionary {"kind", parameters of that kind, "amplitude", "offset", "peak_u", "duration_s",
"lead_s", "rate_hz", "start"}; its input is u(t) = offset + amplitude * wave(t - lead_s), with |wave| <= 1 and ``start``
the output at which the rig should rest before. During the lead nothing acts, so that the state in which a recording
begins does not depend on its explanation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ers_mj.data.prepared import Trace


@dataclass(frozen=True)
class Asking:
    """What an input is held to."""

    margin: float = 0.05  # of the travel seen, by which a simulated motion may leave it at either end
    one_sided: float = 0.05  # of the peak: an input that goes no further below zero is taken for one that must not
    shortest: float = 2.0  # [s] of a recording that is asked for
    longest: float = 10.0  # [s] of one
    lead: float = 0.1  # [s], or lead_samples where these are longer: twice what an initial state is taken from
    lead_samples: int = 20  # before the wave begins
    top: float = 0.2  # of the sample rate: the highest frequency
    least_level: float = 0.3  # of a graded wave's first cycle


ASKING = Asking()

SHARES, GENTLE = (
    (1.0, 0.65, 0.35),
    (0.2, 0.1, 0.05),
)  # of the input's range: those tried first, and where all of them leave the travel
LEVELS = np.array(
    [1, 0, -1, 0.5, -0.75, 0, 0.75, -0.5, 0, 1, -1, 0.25, 0, -0.25, 0.5, -0.5]
)  # of the steps, in their order


@dataclass(frozen=True)
class Limits:
    """What the recordings show the rig to bear: ends of input and output, sample rate [Hz], duration [s], and where a
    recording starts.
    """

    low_u: float
    high_u: float
    low: float
    high: float
    rate_hz: float
    duration: float
    start: float

    @staticmethod
    def of(traces: Sequence[Trace], has_home: bool) -> Limits:
        """Of these recordings; a rig without a spring or preload (no home) starts in the middle of its travel."""
        low, high = (float(end([end(t.y[t.valid]) for t in traces])) for end in (np.min, np.max))
        low_u, high_u = min(float(np.min(t.u)) for t in traces), max(float(np.max(t.u)) for t in traces)
        peak = max(-low_u, high_u)
        if low_u < -ASKING.one_sided * peak and high_u > ASKING.one_sided * peak:
            low_u, high_u = -peak, peak
        start = float(np.median([t.start[0] for t in traces])) if has_home else 0.5 * (low + high)
        rate = 1.0 / float(np.median([t.sample_time for t in traces]))
        duration = float(np.median([t.t[-1] - t.t[0] for t in traces]))
        return Limits(
            low_u,
            high_u,
            low,
            high,
            round(rate, 6),
            round(min(max(duration, ASKING.shortest), ASKING.longest), 1),
            start,
        )

    def holds(self, theta: np.ndarray) -> bool:
        """Whether a motion (N,) stays within the travel and its margin."""
        margin = ASKING.margin * (self.high - self.low)
        return bool(
            np.all(np.isfinite(theta)) and theta.min() >= self.low - margin and theta.max() <= self.high + margin
        )


# -- waves: (t (N,) [s], duration [s], parameters) -> (N,) within -1..1 -----------------------------------------------


def multisine(t: np.ndarray, duration: float, from_hz: float, to_hz: float, sines: int) -> np.ndarray:
    """Sines on a logarithmic grid of the duration's harmonics, their phases Schroeder's for a low crest, over their
    peak.
    """
    f = np.unique(np.maximum(np.round(np.geomspace(from_hz, to_hz, int(sines)) * duration), 1.0)) / duration
    k = np.arange(f.size)
    wave = np.sin(2 * np.pi * np.multiply.outer(t, f) - np.pi * k * (k + 1) / f.size).sum(axis=1)
    return wave / np.max(np.abs(wave))


def chirp(t: np.ndarray, duration: float, from_hz: float, to_hz: float) -> np.ndarray:
    """A cosine whose frequency grows linearly over the duration: from its peak, so that a rig without a spring does not
    set out one way.
    """
    return np.cos(2 * np.pi * (from_hz * t + 0.5 * (to_hz - from_hz) / duration * t**2))


def square(t: np.ndarray, duration: float, period_s: float) -> np.ndarray:
    """Up and down in halves of a period, each period a little further, the first half cut in two for the sake of rigs
    without a spring.
    """
    return _grade(t, duration, period_s) * np.where(np.abs(_turn(t, period_s) - 0.5) < 0.25, -1.0, 1.0)


def triangle(t: np.ndarray, duration: float, period_s: float) -> np.ndarray:
    """Slow ramps down and up: breakaway, creep and return."""
    return _grade(t, duration, period_s) * 2 / np.pi * np.arcsin(np.cos(2 * np.pi * t / period_s))


def steps(t: np.ndarray, duration: float, hold_s: float) -> np.ndarray:
    """Held levels in a fixed order, zero among them."""
    return LEVELS[_count(t, hold_s) % LEVELS.size]


def push_and_release(t: np.ndarray, duration: float, push_s: float, rest_s: float) -> np.ndarray:
    """Pushes either way in turn, each pair a little stronger, and nothing between them."""
    s = push_s + rest_s
    way = 1.0 - 2.0 * (_count(t, s) % 2)
    return _grade(t, duration, 2 * s) * way * (_turn(t, s) * s < push_s)


WAVES: Mapping[str, tuple[Callable[..., np.ndarray], tuple[str, ...]]] = {
    wave.__name__: (wave, names)
    for wave, names in (
        (multisine, ("from_hz", "to_hz", "sines")),
        (chirp, ("from_hz", "to_hz")),
        (square, ("period_s",)),
        (triangle, ("period_s",)),
        (steps, ("hold_s",)),
        (push_and_release, ("push_s", "rest_s")),
    )
}


def _count(t: np.ndarray, period: float) -> np.ndarray:
    """Whole periods gone (N,); a sample at an end belongs to what follows."""
    return np.floor(t / period + 1e-9).astype(int)


def _turn(t: np.ndarray, period: float) -> np.ndarray:
    return np.maximum(t / period - _count(t, period), 0.0)


def _grade(t: np.ndarray, duration: float, period: float) -> np.ndarray:
    """A level for each period (N,), growing evenly from ASKING.least_level to 1 in the last that is whole."""
    last = max(int(duration / period + 1e-9) - 1, 1)
    return ASKING.least_level + (1 - ASKING.least_level) * np.minimum(_count(t, period) / last, 1.0)


# -- excitations ------------------------------------------------------------------------------------------------------


def signal(excitation: Mapping) -> tuple[np.ndarray, np.ndarray]:
    """Times (N,) [s] and input (N,) of an excitation, held between its samples.

    Raises:
        KeyError: of a kind that is none of WAVES, or without one of its numbers.
    """
    t = np.arange(round(excitation["duration_s"] * excitation["rate_hz"])) / excitation["rate_hz"]
    wave, names = WAVES[excitation["kind"]]
    rest = excitation["lead_s"]
    acting, shape = t >= rest - 1e-9, np.zeros(t.size)
    shape[acting] = wave(t[acting] - rest, excitation["duration_s"] - rest, *(excitation[name] for name in names))
    return t, excitation["offset"] + excitation["amplitude"] * np.clip(shape, -1.0, 1.0)


def shapes(limits: Limits) -> list[dict]:
    """What may be tried: slow and fast, smooth and abrupt, as far as sample rate and duration allow."""
    least = 4.0 / limits.rate_hz
    return [
        s
        for s in [*_sweeps(ASKING.top * limits.rate_hz), *_pulses()]
        if all(v >= least for k, v in s.items() if k.endswith("_s")) and s.get("period_s", 0.0) <= limits.duration
    ]


def _sweeps(top: float) -> list[dict]:
    """Multisines and chirps up to ``top`` [Hz]."""
    rise = sorted({min(f, top) for f in (5.0, 20.0, 50.0, top)})
    out = [{"kind": "multisine", "from_hz": 0.5, "to_hz": f, "sines": 24} for f in rise if f > 2.0]
    out += [{"kind": "multisine", "from_hz": 10.0, "to_hz": top, "sines": 24}] if top > 40.0 else []
    chirps = ((0.5, 8.0), (1.0, 30.0), (5.0, top))
    return out + [{"kind": "chirp", "from_hz": low, "to_hz": f} for low, f in chirps if low < f <= top]


def _pulses() -> list[dict]:
    """Squares, triangles, steps, pushes."""
    out = [{"kind": "square", "period_s": s} for s in (1.0, 0.3, 0.08)]
    out += [{"kind": "triangle", "period_s": s} for s in (4.0, 1.5)]
    out += [{"kind": "steps", "hold_s": s} for s in (0.3, 0.1)]
    return out + [{"kind": "push_and_release", "push_s": p, "rest_s": r} for p, r in ((0.3, 0.7), (0.1, 0.4))]


def excitations(limits: Limits, shares: Sequence[float] = SHARES) -> list[list[dict]]:
    """Each shape at every share of the input's range, the strongest first."""
    middle, half = 0.5 * (limits.low_u + limits.high_u), 0.5 * (limits.high_u - limits.low_u)

    def at(shape, share):
        amplitude = _floored(share * half)
        return {
            **shape,
            "amplitude": amplitude,
            "offset": middle,
            "peak_u": abs(middle) + amplitude,
            "duration_s": limits.duration,
            "lead_s": max(ASKING.lead, ASKING.lead_samples / limits.rate_hz),
            "rate_hz": limits.rate_hz,
            "start": limits.start,
        }

    return [[at(shape, share) for share in shares] for shape in shapes(limits)]


def _floored(x: float) -> float:
    """x to three digits, never above it."""
    unit = 10.0 ** (math.floor(math.log10(x)) - 2) if x > 0 else 1.0
    return math.floor(x / unit + 1e-9) * unit
