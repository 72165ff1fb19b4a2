"""How a model's run along a recording is measured: in one free run where the plant holds its place, else in windows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ers_mj.data.prepared import Trace
from ers_mj.effects import BY_NAME
from ers_mj.estimation.initial_state import fitted_start
from ers_mj.servo.model import OBSERVER_RATE, Model


@dataclass(frozen=True)
class Windows:
    """Where a run is measured in windows, how long they are, and how the state of one is fitted."""

    held: float = 0.1  # share of the friction, by which a spring's torque must change along the travel to hold it
    edge: float = 0.02  # of the travel, beyond which a preload's place is outside
    upright: float = 0.35  # [rad] from where gravity pulls the other way, within which no free run follows an arm
    length: float = 2.0  # [s] of a window,
    fewest: int = 100  # and samples that it holds at least
    steps: int = 4  # of the fit of a window's state,
    parts: tuple[float, ...] = (1.0, 0.3)  # of a step that are tried,
    nudge: float = 0.1  # and noise levels by which a slope is told


WINDOWS = Windows()


@dataclass(frozen=True)
class Measure:
    """One free run from the state that the beginning shows, or windows of ``window_s`` [s], each from a state that is
    fitted to it: the error of a plant that nothing holds at its place adds up in a free run, whatever its cause.
    """

    window_s: float | None = None

    @property
    def name(self) -> str:
        return "free_run" if self.window_s is None else "windows"

    def run(self, model: Model, trace: Trace, record: int = 0) -> np.ndarray:
        """Simulated output (N,) of a recording."""
        if self.window_s is None:
            return model.predict(trace, record, start=fitted_start(model, trace, record))
        count = max(1, round((trace.t[-1] - trace.t[0]) / self.window_s))
        ends = np.linspace(0, trace.t.size, count + 1).astype(int)
        followed = model.observed(trace, record, OBSERVER_RATE)[1]
        twist = followed[:, 3] - followed[:, 0]
        twisted = np.column_stack([twist, np.gradient(twist, trace.t)])
        first = model.staged(trace, record, 0.0, None)[1]["start"][3:]  # as a recording begins
        return np.concatenate(
            [
                _in_window(model, trace.part(a, b), record, followed[a, :2], twisted[a] if a else first)
                for a, b in pairwise(ends)
            ]
        )


FREE_RUN = Measure()


def measure_of(model: Model, traces: Sequence[Trace]) -> Measure:
    """What such a plant can hold: a free run where a spring, a preload or gravity that hangs brings it back."""
    if _springs_back(model, traces) or _hangs(model, traces):
        return FREE_RUN
    return Measure(max(WINDOWS.length, WINDOWS.fewest * float(max(trace.sample_time for trace in traces))))


def _springs_back(model: Model, traces: Sequence[Trace]) -> bool:
    """Whether the torque of a spring and of a preload changes along the travel by so much of the friction that this
    does not leave the output anywhere; a preload that the travel has on one side is a constant torque.
    """
    v, y = model.values, np.concatenate([trace.y[trace.valid] for trace in traces])
    low, high = float(y.min()), float(y.max())
    edge = WINDOWS.edge * (high - low)
    is_within = low - edge <= v["theta_0"] <= high + edge
    torque = v["a_1"] * (high - low) + 2.0 * v["c_1"] * is_within
    return torque > WINDOWS.held * v["c_2"]


def _hangs(model: Model, traces: Sequence[Trace]) -> bool:
    """Whether gravity, or what else holds the output in a spring's place, draws it back wherever it was: its torque
    falls along the travel's way from its middle, as far as the ends or nearly to where it turns.
    """
    holding = [(BY_NAME[name], p) for name, p in model.effects if BY_NAME[name].holds_place]
    if not holding:
        return False
    y = np.concatenate([trace.y[trace.valid] for trace in traces])
    ends = np.linspace(float(y.min()) - WINDOWS.upright, float(y.max()) + WINDOWS.upright, 181)
    torque = sum(effect.columns(ends) @ p for effect, p in holding)
    turns = np.flatnonzero(np.diff(np.sign(torque)) > 0)  # where it drives away: upright
    return turns.size == 0


def _in_window(
    model: Model, trace: Trace, record: int, begun: np.ndarray, twisted: Sequence[float] | np.ndarray
) -> np.ndarray:
    """Simulated output (N,) from the output and speed that fit the whole of it best, looked for from those (2,) of an
    observer; the motor's side is ``twisted`` by so much and at such a speed.
    """
    scale = np.array([WINDOWS.nudge * trace.sigma, WINDOWS.nudge * trace.sigma / (trace.t[-1] - trace.t[0])])

    def misses(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        run = model.predict(trace, record, start=(*x, *twisted))
        return run, np.nan_to_num(np.where(trace.valid, trace.y - run, 0.0), nan=1e3 * trace.sigma)

    x = np.where(np.isfinite(begun), begun, (trace.start[0], 0.0))
    run, e = misses(x)
    for _ in range(WINDOWS.steps):
        slopes = np.column_stack([(misses(x + step)[1] - e) / size for step, size in zip(np.diag(scale), scale)])
        way = -np.linalg.lstsq(slopes, e, rcond=1e-9)[0]
        tries = [(x + part * way, *misses(x + part * way)) for part in WINDOWS.parts]
        trial, there, left = min(tries, key=lambda one: float(one[2] @ one[2]))
        if not left @ left < e @ e * (1.0 - 1e-4):
            break
        x, run, e = trial, there, left
    return run
