"""Eq. (6)'s parameters from a stream, and whether the model still explains it: moving-horizon estimation on the
event-exact model.

Every HOP seconds the parameters p and the state (theta, w) in which the window began are fitted to the last L seconds,

    minimise  sum_b n_b (1 + TAU) / 2 ln((TAU + m_b) / (1 + TAU)) + |(z - z_0) / DRIFT|^2 / 2,    z = ln p,
 m_b the mean squared residual [sigma^2] of a short block of n_b samples: least squares near the noise, where a block
beyond it counts ever less. Stick and slip are inside the simulation and its tangents, so that nothing is smoothed. z_0
is what was last believed, so that what the window does not excite stays. L grows to LONGEST as long as one set of
parameters explains the window; then a single Newton step a hop is enough. Where none explains it, the window is cut to
its last SHORTEST seconds: either other parameters explain these, and a change of parameters is announced, or for
PATIENCE seconds none do, and the model is no longer the servo's. No parameter can adapt to such data, so that the test
outlives adaptation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.prepared import Blocks, Signals, Trace, make_trace, noise_sigma
from ers_mj.data.recording import GAP
from ers_mj.data.sensor_faults import converter_step
from ers_mj.estimation.baseline import baseline
from ers_mj.estimation.fit import Run, fit, jacobian_of
from ers_mj.estimation.initial_state import fitted_start, with_starts
from ers_mj.estimation.known_model import model_of
from ers_mj.servo.datasheet import LUMPED, Datasheet
from ers_mj.servo.model import OBSERVER_RATE, Free, Model

OPENING, UNKNOWN_OPENING = 2.0, 5.0  # [s] of a stream from which a model is made ready: with a datasheet, without one
HOP, PATIENT_HOP = 0.1, 0.25  # [s] between estimates, and while the flag is up
SHORTEST, LONGEST = 0.5, 2.0  # [s] of the window
PATIENCE = 1.0  # [s] without an explanation, of which SHORTEST may hold a change of parameters
MOVING = 30.0  # times its noise that an output must travel for a model to begin
FEWEST = 200  # samples of a window: a slower stream has all three longer
KEPT = 5.0  # [s] of the stream that the noise level is taken from
BLOCK, BLOCK_SAMPLES = 0.025, 10  # [s] and samples, whichever is longer, of a block
TAU = 4.0  # misfit of a block at which its cost turns from squares to a logarithm
EXPLAINED = 2.0  # misfit [sigma^2] of a window up to which the model explains it
DRIFT = 0.3  # standard deviation of ln p within one window; of theta_0, over half the travel
SPEED = 0.3  # standard deviation of the window's first speed about what was believed, over the largest speed
NUDGE = 1e-3  # of the scales of the first state: step of its differences
STEPS, TRIALS = 12, 4  # of a fit, and lengths that each is tried at
TOLERANCE = 0.05, 0.01  # of cost, and share of it: a step's gain at which a fit goes on to the next TAU or ends
SURE, LEAST_CHANGE = (
    4.0,
    0.05,
)  # standard deviations, and share, by which a parameter must move for its change to be announced
RUNAWAY = 1e12  # misfit of a simulation that leaves all bounds


@dataclass(frozen=True)
class Estimate:
    """What is believed at time t [s].

    Attributes:
        values: those of Eq. (6)'s parameters that are followed, as they last explained the stream.
        spread: their standard deviations: relative, but of theta_0 in the output's unit.
        window: [s] that was fitted.
        misfit: [sigma^2] what the best parameters leave of it, 1 is the noise.
        sigma: the noise [output unit].
        changed: {name: (before, after)} of a change that was found just now.
        unexplained: [s] for which nothing has explained the stream.
        flag: whether that is too long for a change of parameters.
    """

    t: float
    values: Mapping[str, float]
    spread: Mapping[str, float]
    window: float
    misfit: float
    sigma: float
    changed: Mapping[str, tuple[float, float]]
    unexplained: float
    flag: bool


def is_moving(u: np.ndarray, y: np.ndarray) -> bool:
    """Whether the output (N,) moves beyond its noise under an input (N,) that changes."""
    known = y[np.isfinite(y)]
    return (
        known.size > FEWEST // 2
        and np.ptp(u) > 0
        and float(np.ptp(known)) > MOVING * noise_sigma(known, converter_step(known))
    )


def opening(t: np.ndarray, u: np.ndarray, y: np.ndarray, datasheet: Datasheet | None, is_angle: bool) -> Model:
    """A model to begin with, fitted to the stream's first seconds: the datasheet's with its effects, or without one the
    best of a search from scratch.

    Args:
        t, u, y: the first OPENING or UNKNOWN_OPENING seconds (N,) of the stream, in which it ``is_moving``.
        datasheet: what is known of the servo.
        is_angle: whether the output is an angle in rad.

    Raises:
        InputError: the datasheet does not tell b, or nothing resembles the stream.
    """
    valid = np.isfinite(y)
    quantum = converter_step(y[valid])
    trace = make_trace("stream", Signals(t, u, y, valid), noise_sigma(y[valid], quantum), quantum)
    if datasheet is None:
        model = baseline([trace], None, is_angle).fit.model
    else:
        model = model_of(datasheet, [trace], is_angle, inductance="tau_e" in datasheet.baseline)
        model = replace(model, free=tuple(n for n in model.free if n in LUMPED))
    width = model.scales.high - model.scales.low
    model = replace(model, scales=replace(model.scales, low=model.scales.low - width, high=model.scales.high + width))
    for _ in range(2):
        model = fit(model, with_starts(model, [trace])).model
    return model


class Tracker:
    """Follows a stream: ``push`` takes samples and yields an Estimate for every HOP of them."""

    def __init__(self, model: Model):
        """Start from a model (see ``opening``) whose free numbers are to be followed; its effects stay as they are."""
        self._model = model
        self._spread = {f.name: DRIFT * (1.0 if f.positive else f.scale) for f in model.layout()}
        slower = max(1.0, FEWEST * model.scales.sample_time / SHORTEST)
        self._shortest, self._longest, self._patience = (slower * x for x in (SHORTEST, LONGEST, PATIENCE))
        self._restart()

    def _restart(self) -> None:
        """Forget the stream, not the parameters."""
        self._t, self._u, self._y = np.zeros(0), np.zeros(0), np.zeros(0)
        self._due = self._begin = self._fine = (
            math.nan
        )  # the next estimate, the window's begin, and the last estimate that explained it
        self._last: _Window | None = None
        self._before: _Window | None = None  # what was believed before the stream had to be explained anew
        self._told: set[str] = set()
        self._unexplained = 0.0

    def push(self, t: np.ndarray, u: np.ndarray, y: np.ndarray) -> Iterator[Estimate]:
        """Take samples (N,) of time [s], which grows, input and output (NaN where missing); estimates as they fall due.

        A gap in time begins a new window.
        """
        while t.size:
            if self._t.size > 1 and t[0] - self._t[-1] > max(GAP * float(np.median(np.diff(self._t[-20:]))), HOP):
                self._restart()
            if not self._t.size:
                self._due, self._begin, self._fine = t[0] + self._shortest, t[0], t[0] + self._shortest - HOP
            cut = min(int(np.searchsorted(t, self._due - 1e-9)) + 1, t.size)
            if (gaps := np.flatnonzero(np.diff(t[:cut]) > max(GAP * self._model.scales.sample_time, HOP))).size:
                cut = int(gaps[0]) + 1
            self._t, self._u, self._y = (np.append(a, b[:cut]) for a, b in ((self._t, t), (self._u, u), (self._y, y)))
            t, u, y = t[cut:], u[cut:], y[cut:]
            if self._t[-1] >= self._due - 1e-9:
                self._due += HOP if self._unexplained <= self._patience else PATIENT_HOP
                old = np.searchsorted(self._t, self._t[-1] - max(KEPT, self._longest))
                self._t, self._u, self._y = self._t[old:], self._u[old:], self._y[old:]
                if (known := np.isfinite(self._y)).mean() > 0.5 and np.ptp(self._y[known]) > 0:
                    yield self._estimate()

    def _estimate(self) -> Estimate:
        now, known = float(self._t[-1]), self._y[np.isfinite(self._y)]
        sigma = noise_sigma(known, converter_step(known))
        window = self._fit(max(self._begin, now - self._longest), sigma)
        if window.misfit > EXPLAINED and window.length > self._shortest + 0.5 * HOP:
            short = self._fit(now - self._shortest, sigma)
            window = short if short.misfit < window.misfit else window
        changed: dict[str, tuple[float, float]] = {}
        if window.misfit <= EXPLAINED:
            changed = self._changes(window)
            self._model, self._spread = window.model, window.spreads()
            self._begin, self._unexplained, self._fine = float(window.trace.t[0]), 0.0, now
        else:
            if self._before is None and self._last is not None and self._last.misfit <= EXPLAINED:
                self._before, self._told = self._last, set()
            self._begin, self._unexplained = now + HOP - self._shortest, now - self._fine
        self._last = window
        values = {f.name: self._model.values[f.name] for f in window.layout}
        return Estimate(
            now,
            values,
            dict(self._spread),
            window.length,
            window.misfit,
            sigma,
            changed,
            self._unexplained,
            self._unexplained > self._patience,
        )

    def _changes(self, window: _Window) -> dict[str, tuple[float, float]]:
        """What has moved beyond chance since the stream had to be explained anew; each is told once, until the window
        is long again.
        """
        if self._before is None:
            return {}
        out, was = {}, self._before
        for f, z, z_was, spread in zip(window.layout, window.z, was.z, np.hypot(window.spread, was.spread)):
            if f.name not in self._told and abs(z - z_was) > max(SURE * spread, LEAST_CHANGE):
                out[f.name] = was.model.values[f.name], window.model.values[f.name]
        self._told |= out.keys()
        if window.length > 2 * self._shortest:
            self._before = None
        return out

    def _fit(self, begin: float, sigma: float) -> _Window:
        """The stream from ``begin`` on, from the parameters believed last; the state there as the last window has it,
        if it explains it.
        """
        first = int(np.searchsorted(self._t, begin - 1e-9))
        trace = _trace(self._t[first:], self._u[first:], self._y[first:], sigma)
        known = self._last.state_at(trace.t[0]) if self._last is not None and self._last.misfit <= EXPLAINED else None
        return fitted(self._model, replace(trace, start=known or fitted_start(self._model, trace)))


@dataclass(frozen=True)
class _Window:
    """A fitted window: the model, z (k,) of its layout with standard deviations, the misfit, and its motion (N, 4)."""

    model: Model
    layout: Sequence[Free]
    z: np.ndarray
    spread: np.ndarray
    misfit: float
    trace: Trace
    motion: np.ndarray

    @property
    def length(self) -> float:
        return float(self.trace.t[-1] - self.trace.t[0])

    def spreads(self) -> dict[str, float]:
        """Standard deviations by name, of logarithms or in the number's own unit."""
        return {f.name: float(s * (1.0 if f.positive else f.scale)) for f, s in zip(self.layout, self.spread)}

    def state_at(self, t: float) -> tuple[float, float] | None:
        """(theta, w) of the motion at a sample's time, None where it has none."""
        k = int(np.searchsorted(self.trace.t, t - 1e-9))
        return (
            (float(self.motion[k, 0]), float(self.motion[k, 1]))
            if k < self.trace.t.size and self.trace.t[0] <= t + 1e-9
            else None
        )


def _trace(t: np.ndarray, u: np.ndarray, y: np.ndarray, sigma: float) -> Trace:
    """A window with its short blocks."""
    valid = np.isfinite(y)
    span = max(BLOCK, BLOCK_SAMPLES * float(np.median(np.diff(t))))
    block = np.minimum(((t - t[0]) / span).astype(np.int64), max(int((t[-1] - t[0]) / span) - 1, 0))
    counts = np.bincount(block[valid], minlength=block[-1] + 1).astype(float)
    return replace(make_trace("stream", Signals(t, u, y, valid), sigma), block=block, counts=counts)


def fitted(model: Model, trace: Trace) -> _Window:
    """The model's free numbers and the window's first state, fitted from the model's own values and the trace's start.

    Levenberg-Marquardt, from afar first at a TAU near the misfits' geometric mean (see identification.fit). What begins
    near gets one step: the next hop brings the next one.
    """
    layout, blocks = model.layout(), Blocks.of([trace])
    z_0 = model.vector(layout)
    scale = np.array([*np.full(z_0.size, DRIFT), trace.sigma, SPEED * model.scales.speed])
    stiff = np.array([*np.ones(z_0.size), 0.0, 1.0])

    def at(x):
        theta, omega = trace.start
        return model.at(layout, z_0 + DRIFT * x[:-2]), replace(
            trace, start=(theta + x[-2] * scale[-2], omega + x[-1] * scale[-1])
        )

    def evaluate(x):
        moved, begun = at(x)
        plant, run = moved.staged(begun, 0, OBSERVER_RATE, None)
        theta, motion = plant.outputs(begun.t, begun.u, **run)
        e = np.where(trace.valid, (trace.y - theta) / trace.sigma, 0.0)
        m = blocks.misfit(e) if np.all(np.isfinite(e)) else np.full(blocks.counts.size, RUNAWAY)
        return np.nan_to_num(e), m, motion

    def cost(x, m, tau):
        return _cost(m, blocks.counts, tau) + 0.5 * float(stiff @ x**2)

    x, damping, hessian = np.zeros(scale.size), 1e-3, np.diag(stiff)
    e, m, motion = evaluate(x)
    is_near = _misfit(m, blocks.counts) <= EXPLAINED
    tau = TAU if is_near else max(TAU, float(np.exp(np.mean(np.log(m + TAU)))))
    for _ in range(1 if is_near else STEPS):
        jacobian = _slopes(at, evaluate, x, e, motion)
        weighted = jacobian * ((1 + tau) / (tau + m))[blocks.index][:, None]
        hessian, slope, now, gain = (
            weighted.T @ jacobian + np.diag(stiff),
            weighted.T @ e + stiff * x,
            cost(x, m, tau),
            0.0,
        )
        for _ in range(TRIALS):
            step = np.clip(-np.linalg.solve(hessian + damping * np.diag(np.diag(hessian) + 1e-9), slope), -3.0, 3.0)
            trial = evaluate(x + step)
            if (then := cost(x + step, trial[1], tau)) < now:
                gain, x, (e, m, motion), damping = now - then, x + step, trial, damping / 8
                break
            damping = max(damping * 16, 1e-4)
        if gain < max(TOLERANCE[0], TOLERANCE[1] * now):
            if tau == TAU:
                break
            tau, damping = (TAU if tau < 15 * TAU else 0.1 * tau), 1e-3
    moved, begun = at(x)
    spread = DRIFT * np.sqrt(np.diag(np.linalg.inv(hessian + 1e-9 * np.eye(scale.size))))[:-2]
    return _Window(moved, layout, moved.vector(layout), spread, _misfit(m, blocks.counts), begun, motion)


def _cost(m: np.ndarray, counts: np.ndarray, tau: float) -> float:
    return 0.5 * (1 + tau) * float(np.sum(counts * np.log((tau + m) / (1 + tau))))


def _misfit(m: np.ndarray, counts: np.ndarray) -> float:
    """What blocks miss on a logarithmic average [sigma^2], by which a spike is one block's matter."""
    return (1 + TAU) * math.exp(min(2 * _cost(m, counts, TAU) / ((1 + TAU) * counts.sum()), 60.0)) - TAU


def _slopes(at: Callable, evaluate: Callable, x: np.ndarray, e: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Slopes (N, k + 2) of the residuals e (N,) by x: tangents of the motion for the parameters, differences for the
    first state.
    """
    model, trace = at(x)
    columns = [DRIFT * jacobian_of(Run(model, e, (motion,)), [trace], OBSERVER_RATE)]
    for k in (-2, -1):
        nudged = x.copy()
        nudged[k] += NUDGE
        columns.append((evaluate(nudged)[0] - e)[:, None] / NUDGE)
    return np.column_stack(columns)
