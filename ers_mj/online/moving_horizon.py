"""Eq. (6)'s parameters from a stream, and whether the model still explains it: moving-horizon estimation on the
event-exact model.

Every hop the parameters and the state in which the window began are fitted to the last seconds. The window grows as
long as one set of parameters explains it; then a single Newton step a hop is enough. Where none explains it, it is cut
to its shortest: either other parameters explain these seconds, and a change of parameters is announced, or for too long
none do, and the model is no longer the servo's. No parameter can adapt to such data, so that the test outlives
adaptation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.checks import GAP
from ers_mj.data.prepared import Signals, make_trace
from ers_mj.data.sensor_faults import converter_step, noise_sigma
from ers_mj.estimation.baseline import baseline
from ers_mj.estimation.fit import fit
from ers_mj.estimation.initial_state import fitted_start, with_starts
from ers_mj.estimation.known_model import model_of
from ers_mj.online.horizon import HORIZON
from ers_mj.online.window import Window, fitted, windowed
from ers_mj.servo.datasheet import LUMPED, Datasheet
from ers_mj.servo.model import Model


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
        known.size > HORIZON.fewest // 2
        and np.ptp(u) > 0
        and float(np.ptp(known)) > HORIZON.moving * noise_sigma(known, converter_step(known))
    )


def opening(t: np.ndarray, u: np.ndarray, y: np.ndarray, datasheet: Datasheet | None, is_angle: bool) -> Model:
    """A model to begin with, fitted to the stream's first seconds: the datasheet's with its effects, or without one the
    best of a search from scratch.

    Args:
        t, u, y: the first seconds (N,) of the stream, in which it ``is_moving``.
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
    """Follows a stream: ``push`` takes samples and yields an Estimate for every hop of them."""

    def __init__(self, model: Model):
        """Start from a model (see ``opening``) whose free numbers are to be followed; its effects stay as they are."""
        self._model = model
        self._spread = {f.name: HORIZON.drift * (1.0 if f.positive else f.scale) for f in model.layout()}
        slower = max(1.0, HORIZON.fewest * model.scales.sample_time / HORIZON.shortest)
        spans = HORIZON.shortest, HORIZON.longest, HORIZON.patience
        self._shortest, self._longest, self._patience = (slower * x for x in spans)
        self._restart()

    def _restart(self) -> None:
        """Forget the stream, not the parameters."""
        self._t, self._u, self._y = np.zeros(0), np.zeros(0), np.zeros(0)
        # the next estimate, the window's begin, and the last estimate that explained it
        self._due = self._begin = self._fine = math.nan
        self._last: Window | None = None
        self._before: Window | None = None  # what was believed before the stream had to be explained anew
        self._told: set[str] = set()
        self._unexplained = 0.0

    def push(self, t: np.ndarray, u: np.ndarray, y: np.ndarray) -> Iterator[Estimate]:
        """Take samples (N,) of time [s], which grows, input and output (NaN where missing); estimates as they fall due.

        A gap in time begins a new window.
        """
        while t.size:
            if self._t.size > 1:
                usual = float(np.median(np.diff(self._t[-20:])))
                if t[0] - self._t[-1] > max(GAP * usual, HORIZON.hop):
                    self._restart()
            if not self._t.size:
                self._due, self._begin, self._fine = t[0] + self._shortest, t[0], t[0] + self._shortest - HORIZON.hop
            cut = min(int(np.searchsorted(t, self._due - 1e-9)) + 1, t.size)
            most = max(GAP * self._model.scales.sample_time, HORIZON.hop)
            if (gaps := np.flatnonzero(np.diff(t[:cut]) > most)).size:
                cut = int(gaps[0]) + 1
            self._t, self._u, self._y = (np.append(a, b[:cut]) for a, b in ((self._t, t), (self._u, u), (self._y, y)))
            t, u, y = t[cut:], u[cut:], y[cut:]
            if self._t[-1] >= self._due - 1e-9:
                self._due += HORIZON.hop if self._unexplained <= self._patience else HORIZON.patient_hop
                old = np.searchsorted(self._t, self._t[-1] - max(HORIZON.kept, self._longest))
                self._t, self._u, self._y = self._t[old:], self._u[old:], self._y[old:]
                if (known := np.isfinite(self._y)).mean() > 0.5 and np.ptp(self._y[known]) > 0:
                    yield self._estimate()

    def _estimate(self) -> Estimate:
        now, known = float(self._t[-1]), self._y[np.isfinite(self._y)]
        sigma = noise_sigma(known, converter_step(known))
        window = self._fit(max(self._begin, now - self._longest), sigma)
        if window.misfit > HORIZON.explained and window.length > self._shortest + 0.5 * HORIZON.hop:
            short = self._fit(now - self._shortest, sigma)
            window = short if short.misfit < window.misfit else window
        changed: dict[str, tuple[float, float]] = {}
        if window.misfit <= HORIZON.explained:
            changed = self._changes(window)
            self._model, self._spread = window.model, window.spreads()
            self._begin, self._unexplained, self._fine = float(window.trace.t[0]), 0.0, now
        else:
            if self._before is None and self._last is not None and self._last.misfit <= HORIZON.explained:
                self._before, self._told = self._last, set()
            self._begin, self._unexplained = now + HORIZON.hop - self._shortest, now - self._fine
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

    def _changes(self, window: Window) -> dict[str, tuple[float, float]]:
        """What has moved beyond chance since the stream had to be explained anew; each is told once, until the window
        is long again.
        """
        if self._before is None:
            return {}
        out, was = {}, self._before
        for f, z, z_was, spread in zip(
            window.layout, window.z, was.z, np.hypot(window.spread, was.spread), strict=True
        ):
            if f.name not in self._told and abs(z - z_was) > max(HORIZON.sure * spread, HORIZON.least_change):
                out[f.name] = was.model.values[f.name], window.model.values[f.name]
        self._told |= out.keys()
        if window.length > 2 * self._shortest:
            self._before = None
        return out

    def _fit(self, begin: float, sigma: float) -> Window:
        """The stream from ``begin`` on, from the parameters believed last; the state there as the last window has it,
        if it explains it.
        """
        first = int(np.searchsorted(self._t, begin - 1e-9))
        trace = windowed(self._t[first:], self._u[first:], self._y[first:], sigma)
        last = self._last
        known = last.state_at(trace.t[0]) if last is not None and last.misfit <= HORIZON.explained else None
        return fitted(self._model, replace(trace, start=known or fitted_start(self._model, trace)))
