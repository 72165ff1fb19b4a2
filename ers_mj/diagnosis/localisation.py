"""Where does the refitted baseline fail? In time, angle, speed, direction, input level, frequency, and in which
subsystem.

The error that is located is that of a fast observer (LOCAL_RATE): it forgets within 1 / LOCAL_RATE, so that a force
that was missing shows where it was missing and not where its effect on the angle ended.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ers_mj.data.prepared import Trace, smooth_speed
from ers_mj.diagnosis.evidence import ResidualMap
from ers_mj.diagnosis.mismatch_spectrum import Mismatch, mismatch
from ers_mj.effects import BY_NAME
from ers_mj.servo.model import Model

LOCAL_RATE = 30.0  # [1/s]


@dataclass(frozen=True)
class Telling:
    """What is worth a sentence."""

    bins: int = 24  # of an axis
    least_share: float = 0.05  # of the misfit from which a subsystem is told
    least_excess: float = 0.2  # share of error minus share of time from which a region is


TELLING = Telling()


@dataclass(frozen=True)
class Samples:
    """All valid samples of several recordings, each (N,): record, t, angle, speed, input, two squared local errors, and
    the first with its sign.
    """

    record: np.ndarray
    t: np.ndarray
    angle: np.ndarray
    speed: np.ndarray
    input: np.ndarray
    before: np.ndarray
    after: np.ndarray
    error: np.ndarray


@dataclass(frozen=True)
class Place:
    """A region in which more of the squared error lives than its share of time (of the motion's power, on the axis of
    frequency).
    """

    axis: str
    region: tuple[float, float] | None
    unit: str | None
    label: str | None
    share_of_error: float | None
    share_of_time: float | None
    sentence: str

    @property
    def excess(self) -> float:
        """How much more of the error lives there than its share of time."""
        return (self.share_of_error or 0.0) - (self.share_of_time or 0.0)


class Timed(Protocol):
    """A recording's name and times."""

    @property
    def name(self) -> str: ...
    @property
    def t(self) -> np.ndarray: ...


class Ranked(Protocol):
    """A candidate's name and gain."""

    @property
    def name(self) -> str: ...
    @property
    def gain(self) -> float: ...


def gather(before: Model, after: Model, traces: Sequence[Trace]) -> Samples:
    """The samples that the localiser looks at."""
    parts = []
    for k, trace in enumerate(traces):
        v = trace.valid
        first, second = (np.nan_to_num((trace.y - model.predict(trace, k, LOCAL_RATE))[v]) for model in (before, after))
        parts.append(
            (
                np.full(v.sum(), k),
                trace.t[v],
                trace.y[v],
                smooth_speed(trace)[v],
                trace.u[v],
                first**2,
                second**2,
                first,
            )
        )
    return Samples(*(np.concatenate(column) for column in zip(*parts)))


def over_frequency(samples: Samples, traces: Sequence[Trace]) -> Mismatch | None:
    """What the model before leaves over frequency; None where the recordings are too short."""
    return mismatch(traces, [samples.error[samples.record == k] for k in range(len(traces))], LOCAL_RATE)


def _best_interval(values: np.ndarray, squares: np.ndarray, edges: np.ndarray):
    """(low, high, share of error, share of samples) of the run of bins with the greatest excess of error over time."""
    bins = np.clip(np.digitize(values, edges) - 1, 0, edges.size - 2)
    error = np.bincount(bins, squares, edges.size - 1) / max(squares.sum(), 1e-300)
    time = np.bincount(bins, minlength=edges.size - 1) / values.size
    total = np.concatenate([[0.0], np.cumsum(error - time)])
    excess = total[None, :] - total[:, None]
    i, j = np.unravel_index(np.argmax(np.triu(excess)), excess.shape)
    return edges[i], edges[j], float(error[i:j].sum()), float(time[i:j].sum())


def places(
    samples: Samples,
    traces: Sequence[Timed],
    rounds: Sequence[Sequence[Ranked]],
    base_cost: float,
    named: Sequence[str],
    output_unit: str,
    input_unit: str,
    spectrum: Mismatch | None = None,
) -> list[Place]:
    """Regions worth telling, subsystem first (of the ``named`` effects before others), then by how much more error than
    time they hold.
    """
    found = [*_by_value(samples, output_unit, input_unit), *_by_direction(samples), *_by_time(samples, traces)]
    found = [p for p in found if p.excess >= TELLING.least_excess]
    if spectrum is not None and spectrum.region is not None:
        found.append(
            Place(
                "frequency",
                spectrum.region,
                "Hz",
                spectrum.kind,
                spectrum.share_of_error,
                spectrum.share_of_motion,
                spectrum.sentence,
            )
        )
    found.sort(key=lambda p: -p.excess)
    return [*_by_subsystem(rounds, base_cost, named), *found]


def _shown(value: float, unit: str) -> str:
    return f"{math.degrees(value):.3g} deg" + unit[3:] if unit.startswith("rad") else f"{value:.3g} {unit}"


def _by_value(samples: Samples, output_unit: str, input_unit: str) -> list[Place]:
    axes = (
        ("angle", samples.angle, output_unit, "the output is"),
        ("speed", np.abs(samples.speed), f"{output_unit}/s", "speed is"),
        ("input", np.abs(samples.input), input_unit, "|u| is"),
    )
    out = []
    for axis, values, unit, words in axes:
        low, high = np.quantile(values, [0.001, 0.999])
        if high <= low:
            continue
        a, b, error, time = _best_interval(values, samples.before, np.linspace(low, high, TELLING.bins + 1))
        out.append(
            Place(
                axis,
                (float(a), float(b)),
                unit,
                None,
                error,
                time,
                f"{error:.0%} of the squared error lies in the {time:.0%} of the time where {words} between "
                f"{_shown(a, unit)} and {_shown(b, unit)}",
            )
        )
    return out


def _by_direction(samples: Samples) -> list[Place]:
    still = 0.05 * float(np.quantile(np.abs(samples.speed), 0.95))
    total, out = max(samples.before.sum(), 1e-300), []
    for label, mask in (
        ("up", samples.speed > still),
        ("down", samples.speed < -still),
        ("at rest", np.abs(samples.speed) <= still),
    ):
        error, time = float(samples.before[mask].sum() / total), float(mask.mean())
        words = "the output is at rest" if label == "at rest" else f"the output moves {label}"
        out.append(
            Place(
                "direction",
                None,
                None,
                label,
                error,
                time,
                f"{error:.0%} of the squared error lies in the {time:.0%} of the time where {words}",
            )
        )
    return out


def _by_time(samples: Samples, traces: Sequence[Timed]) -> list[Place]:
    """The recording, and the span in it, that holds most of the error beyond its share of time."""
    out = []
    for k, trace in enumerate(traces):
        mask = samples.record == k
        if not mask.any():
            continue
        a, b, error, time = _best_interval(
            samples.t[mask], samples.before[mask], np.linspace(trace.t[0], trace.t[-1], TELLING.bins + 1)
        )
        part = float(samples.before[mask].sum() / max(samples.before.sum(), 1e-300))
        whole = float(mask.mean())
        out.append(
            Place(
                "time",
                (float(a), float(b)),
                "s",
                trace.name,
                part * error,
                whole * time,
                f"{part * error:.0%} of the squared error lies between {a:.2f} s and {b:.2f} s of {trace.name}, "
                f"{whole * time:.0%} of the time",
            )
        )
    return sorted(out, key=lambda p: -p.excess)[:2]


def _by_subsystem(rounds: Sequence[Sequence[Ranked]], base_cost: float, named: Sequence[str]) -> list[Place]:
    """Subsystems by what their best effect explains of the baseline's cost; those of the named effects lead, in their
    order.
    """
    best: dict[str, tuple[float, str]] = {}
    for candidate in (c for ranked in rounds for c in ranked):
        if candidate.name in BY_NAME:
            share = min(max(candidate.gain, 0.0) / max(base_cost, 1e-9), 1.0)
            subsystem = BY_NAME[candidate.name].subsystem
            best[subsystem] = max(best.get(subsystem, (0.0, "")), (share, candidate.name))
    lead = list(dict.fromkeys(BY_NAME[name].subsystem for name in named))
    ranked = sorted((s for s in best if s not in lead and best[s][0] > TELLING.least_share), key=lambda s: -best[s][0])
    out = []
    for subsystem in (*lead, *ranked):
        if subsystem in best:
            share, name = best[subsystem]
            words = f"{share:.0%} of the misfit can be explained in the {subsystem} ({name.replace('_', ' ')})"
            out.append(Place("subsystem", None, None, subsystem, share, 1.0, words))
        else:
            words = f"the data itself shows it: the {subsystem}"
            out.append(Place("subsystem", None, None, subsystem, None, None, words))
    return out


def shaded(trace: Timed, record: int, samples: Samples) -> tuple[tuple[float, float], ...]:
    """Spans of time [s] of one recording in which the local error is largest: those that hold two thirds of it, at most
    8.
    """
    mask = samples.record == record
    if not mask.any():
        return ()
    edges = np.linspace(trace.t[0], trace.t[-1], 81)
    error = np.bincount(np.clip(np.digitize(samples.t[mask], edges) - 1, 0, 79), samples.before[mask], 80)
    order = np.argsort(-error)
    keep = np.sort(order[: max(1, int(np.searchsorted(np.cumsum(error[order]), 0.66 * error.sum())) + 1)])
    spans: list[list[float]] = []
    for k in keep:
        if spans and edges[k] - spans[-1][1] < 1e-9:
            spans[-1][1] = edges[k + 1]
        else:
            spans.append([edges[k], edges[k + 1]])
    spans.sort(key=lambda s: s[0] - s[1])
    return tuple((float(a), float(b)) for a, b in sorted(spans[:8]))


def residual_map(samples: Samples) -> ResidualMap:
    """Rms local error over angle and speed, before and after."""
    ends = (np.quantile(v, [0.001, 0.999]) for v in (samples.angle, samples.speed))
    edges = [np.linspace(low, high, 25) for low, high in ends]
    count, *_ = np.histogram2d(samples.angle, samples.speed, edges)
    with np.errstate(invalid="ignore", divide="ignore"):
        rms = [
            np.sqrt(np.histogram2d(samples.angle, samples.speed, edges, weights=w)[0] / count)
            for w in (samples.before, samples.after)
        ]
    return ResidualMap(edges[0], edges[1], *(np.where(count >= 5, r, np.nan) for r in rms))
