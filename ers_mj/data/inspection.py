"""What a recording is, before anything is fitted: its channels, what they cover, and what they could tell.

Recording -> channels (rate, refresh, noise, quantum, blanks) -> coverage (of angle, speed, input)
          -> spectrum -> what can be identified, and which physics could be seen at all
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ers_mj.data.checks import gaps_in
from ers_mj.data.consistency.refresh import fresh_rows
from ers_mj.data.sensor_faults import converter_step, held_spans, noise_sigma


@dataclass(frozen=True)
class Seeing:
    """From where on a recording can tell of something."""

    bins: int = 12  # of a histogram
    power: float = 0.95  # of the input's power, below which its band ends
    rest: float = 0.02  # of the top speed, below which it rests
    slow: float = 0.2  # of the top speed, below which it moves slowly
    share: float = 0.02  # of the time, that a way of moving must take up
    reversals: int = 6  # of the motion
    levels: int = 3  # of the input
    settled: int = 3  # spans of rest
    steps: float = 50.0  # converter steps of travel
    band: float = 0.05  # of the sample rate, up to which an input's band should reach to tell lags


SEEING = Seeing()


Recorded = Any  # a `Recording`, which has this file as its method and so stands on its right


@dataclass(frozen=True)
class Channel:
    """One column: rates [Hz], times [s], the rest in its own unit.

    Attributes:
        refresh_s: how often it is measured anew.
        noise: standard deviation from sample to sample.
        quantum: the step of its converter, 0 where there is none.
        blanks: samples that are missing.
        at_ends: share of the samples in spans that lie at its lowest or highest value.
    """

    name: str
    rate_hz: float
    refresh_s: float
    noise: float
    quantum: float
    low: float
    high: float
    blanks: int
    at_ends: float

    def as_document(self) -> dict[str, Any]:
        """The row of `ers inspect --json`."""
        return dict(self.__dict__)


@dataclass(frozen=True)
class Tells:
    """Something that a recording can or cannot tell, and why."""

    what: str
    can: bool
    why: str


@dataclass(frozen=True, eq=False)
class Inspection:
    """What a recording holds.

    Attributes:
        record: the recording itself.
        jitter: rms of the steps of time over their median, less one.
        channels: of its columns, time left out.
        coverage: "output", "speed" and "input": edges (bins + 1,) and share of the time (bins,) between them.
        spectrum: frequencies [Hz] and power densities of input and output, (F,) each.
        tells: what can be identified.
    """

    record: Recorded
    jitter: float
    channels: tuple[Channel, ...]
    coverage: Mapping[str, tuple[np.ndarray, np.ndarray]]
    spectrum: tuple[np.ndarray, np.ndarray, np.ndarray]
    tells: tuple[Tells, ...]

    @property
    def rate_hz(self) -> float:
        """Sample rate [Hz]."""
        return 1.0 / float(np.median(np.diff(self.record.t)))

    def to_dict(self) -> dict[str, Any]:
        """What `ers inspect --json` prints of one recording."""
        r = self.record
        return {
            "file": r.name,
            "input_kind": r.input_kind,
            "input_unit": {"pct": "%"}.get(r.input_unit, r.input_unit),
            "output_unit": r.output_unit,
            "samples": int(r.t.size),
            "duration_s": float(r.t[-1] - r.t[0]),
            "rate_hz": self.rate_hz,
            "jitter": self.jitter,
            "channels": [channel.as_document() for channel in self.channels],
            "faults": [fault.as_document(r.name) for fault in r.faults],
            "problems": list(r.problems),
            "coverage": {k: {"edges": e.tolist(), "share": s.tolist()} for k, (e, s) in self.coverage.items()},
            "input_band_hz": _band(self.spectrum),
            "tells": [dict(told.__dict__) for told in self.tells],
        }


def inspected(record: Recorded) -> Inspection:
    """Look a recording over."""
    dt = np.diff(record.t)
    ordinary = dt[~gaps_in(record.t)] / np.median(dt) - 1.0
    speed = speed_of(record)
    columns = {name: x for name, x in record.columns().items() if name != "t_s"}
    channels = tuple(_channel(name, x, record) for name, x in columns.items())
    spectrum = _spectrum(record)
    coverage = {"output": _shares(record.y), "speed": _shares(speed), "input": _shares(record.u)}
    jitter = float(np.sqrt(np.mean(ordinary**2)))
    return Inspection(record, jitter, channels, coverage, spectrum, tuple(_tells(record, speed, spectrum)))


def speed_of(record: Recorded) -> np.ndarray:
    """The output's speed (N,) by differences over about 20 ms, or three samples."""
    y = np.interp(record.t, record.t[record.valid], record.y[record.valid])
    k = _half_span(record)
    late, early = np.minimum(np.arange(y.size) + k, y.size - 1), np.maximum(np.arange(y.size) - k, 0)
    return (y[late] - y[early]) / (record.t[late] - record.t[early])


def _half_span(record: Recorded) -> int:
    """Samples on either side, of the difference that a speed is."""
    return max(1, round(0.01 / float(np.median(np.diff(record.t)))))


def _speed_noise(record: Recorded, noise: float) -> float:
    """What noise of the output, standard deviation, does to :func:`speed_of`."""
    return noise / (np.sqrt(2.0) * _half_span(record) * float(np.median(np.diff(record.t))))


def _channel(name: str, x: np.ndarray, record: Recorded) -> Channel:
    x = np.asarray(x, float)
    known = x[np.isfinite(x)]
    step = float(np.median(np.diff(record.t)))
    rows = fresh_rows(x, record.t)
    held = float(np.median(np.diff(rows))) if rows is not None else 1.0
    quantum = record.quantum if x is record.y else (converter_step(known) if known.size else 0.0)
    ends = sum(s.stop - s.start for s in held_spans(x) if x[s.start] in (np.min(known), np.max(known)))
    return Channel(
        name=name,
        rate_hz=1.0 / step,
        refresh_s=held * step,
        noise=noise_sigma(known, quantum) if known.size and np.ptp(known) > 0.0 else 0.0,
        quantum=quantum,
        low=float(np.min(known)) if known.size else float("nan"),
        high=float(np.max(known)) if known.size else float("nan"),
        blanks=int(np.count_nonzero(~np.isfinite(x))),
        at_ends=ends / x.size,
    )


def _shares(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges (bins + 1,) over the range of x (N,), and the share of the samples between them."""
    known = x[np.isfinite(x)]
    low, high = float(np.min(known)), float(np.max(known))
    least = 1e-9 * max(abs(low), abs(high), 1e-30)  # of a range that still has edges between its ends
    count, edges = np.histogram(known, bins=SEEING.bins, range=(low, max(high, low + least)))
    return edges, count / known.size


def _spectrum(record: Recorded) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frequencies [Hz] and power densities of input and output (F,), over windows of an eighth of the recording."""
    step = float(np.median(np.diff(record.t)))
    grid = np.arange(record.t[0], record.t[-1], step)
    held = np.maximum(np.searchsorted(record.t, grid, side="right") - 1, 0)
    u, y = record.u[held], np.interp(grid, record.t[record.valid], record.y[record.valid])
    n = max(32, grid.size // 4)
    window = np.hanning(n)
    begins = range(0, max(grid.size - n, 0) + 1, max(n // 2, 1))
    found = []
    for x in (u, y):
        parts = [np.abs(np.fft.rfft((x[k : k + n] - np.mean(x[k : k + n])) * window)) ** 2 for k in begins]
        found.append(np.mean(parts, axis=0) * 2.0 * step / np.sum(window**2))
    return np.fft.rfftfreq(n, step), found[0], found[1]


def _band(spectrum: tuple[np.ndarray, np.ndarray, np.ndarray]) -> float:
    """The frequency [Hz] below which most of the input's power lies; 0 where it does not vary."""
    f, power, _ = spectrum
    total = np.cumsum(power)
    return float(f[np.searchsorted(total, SEEING.power * total[-1])]) if total[-1] > 0.0 else 0.0


# -- what can be told -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Motion:
    """How the output moves, in counts and shares of the time."""

    moves_up: float
    moves_down: float
    rests: float
    slow: float
    reversals: int
    stops: int
    travel_steps: float


def _motion(record: Recorded, v: np.ndarray) -> Motion:
    top = float(np.quantile(np.abs(v), 0.99))
    noise = noise_sigma(record.y[record.valid], record.quantum)
    rest = max(SEEING.rest * top, 1e-300)
    still, moves = np.abs(v) < rest, np.abs(v) > 3.0 * max(rest, _speed_noise(record, noise))
    signs = np.sign(np.where(moves, v, 0.0))
    moving = signs[signs != 0.0]
    told = np.r_[True, moves[still | moves]]  # what is neither keeps what was before
    travel = float(np.ptp(record.y[record.valid]))
    return Motion(
        moves_up=float(np.mean(signs > 0)),
        moves_down=float(np.mean(signs < 0)),
        rests=float(np.mean(still)),
        slow=float(np.mean(~still & (np.abs(v) < SEEING.slow * top))),
        reversals=int(np.count_nonzero(np.diff(moving) != 0.0)),
        stops=int(np.count_nonzero(told[:-1] & ~told[1:])),
        travel_steps=travel / max(record.quantum, noise),
    )


def _tells(record: Recorded, v: np.ndarray, spectrum: tuple[np.ndarray, np.ndarray, np.ndarray]) -> list[Tells]:
    """What this recording by itself can tell, in the order in which it is asked."""
    m, band = _motion(record, v), _band(spectrum)
    rate = 1.0 / float(np.median(np.diff(record.t)))
    levels = np.unique(np.round(record.u / max(float(np.ptp(record.u)), 1e-300), 3)).size
    both = min(m.moves_up, m.moves_down) > SEEING.share
    position = record.input_kind == "position"
    gain = "the gain of its loop over inertia" if position else f"the gain from {record.input_kind} over inertia"
    ways = f"it moves one way for {m.moves_up:.0%} of the time and the other way for {m.moves_down:.0%}"
    columns = record.columns()
    found = [
        Tells(gain, levels > 1, f"the input takes {levels} levels" if levels > 1 else "the input never changes"),
        Tells("viscous drag or back-EMF", levels > 1 and both, ways),
        Tells("dry friction, and whether it depends on the direction", both, ways),
        Tells(
            "friction that depends on speed",
            both and m.slow > SEEING.share,
            f"it moves slowly for {m.slow:.0%} of the time and rests for {m.rests:.0%}",
        ),
        Tells(
            "breaking loose and creep before it",
            m.stops >= SEEING.settled and m.rests > SEEING.share,
            f"it comes to rest {m.stops} times and rests for {m.rests:.0%} of the time",
        ),
        Tells(
            "a spring, gravity or another force by place",
            m.travel_steps > SEEING.steps,
            f"its travel is {m.travel_steps:.0f} times what its sensor resolves",
        ),
        Tells("play and elastic parts", m.reversals >= SEEING.reversals, f"it turns round {m.reversals} times"),
        Tells(
            "lags and delays",
            band > SEEING.band * rate or levels <= 12,
            f"95 % of the input's power lies below {band:.3g} Hz, the sample rate is {rate:.4g} Hz",
        ),
    ]
    beside = {"i_A": "what the current's limit or a load at the motor does", "vin_V": "a supply that sags"}
    beside |= {"theta_m_rad": "play and twist between motor and load by themselves"}
    for column, what in beside.items():
        there = column in columns
        found.append(Tells(what, there, f"{column} is {'' if there else 'not '}recorded"))
    return found
