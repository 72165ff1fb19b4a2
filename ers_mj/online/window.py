"""The last seconds of a stream, fitted: the parameters p and the state (theta, w) in which the window began.

    minimise  sum_b n_b (1 + tau) / 2 ln((tau + m_b) / (1 + tau)) + |(z - z_0) / drift|^2 / 2,    z = ln p,

m_b the mean squared residual [sigma^2] of a short block of n_b samples: least squares near the noise, where a block
beyond it counts ever less. Stick and slip are inside the simulation and its tangents, so that nothing is smoothed. z_0
is what was last believed, so that what the window does not excite stays.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.prepared import Blocks, Signals, Trace, make_trace
from ers_mj.estimation.jacobian import jacobian_of
from ers_mj.estimation.objective import Run
from ers_mj.online.horizon import HORIZON
from ers_mj.servo.model import OBSERVER_RATE, Free, Model


@dataclass(frozen=True)
class Window:
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
        return {
            f.name: float(s * (1.0 if f.positive else f.scale)) for f, s in zip(self.layout, self.spread, strict=True)
        }

    def state_at(self, t: float) -> tuple[float, float] | None:
        """(theta, w) of the motion at a sample's time, None where it has none."""
        k = int(np.searchsorted(self.trace.t, t - 1e-9))
        return (
            (float(self.motion[k, 0]), float(self.motion[k, 1]))
            if k < self.trace.t.size and self.trace.t[0] <= t + 1e-9
            else None
        )


def windowed(t: np.ndarray, u: np.ndarray, y: np.ndarray, sigma: float) -> Trace:
    """A window with its short blocks."""
    valid = np.isfinite(y)
    span = max(HORIZON.block, HORIZON.block_samples * float(np.median(np.diff(t))))
    block = np.minimum(((t - t[0]) / span).astype(np.int64), max(int((t[-1] - t[0]) / span) - 1, 0))
    counts = np.bincount(block[valid], minlength=block[-1] + 1).astype(float)
    return replace(make_trace("stream", Signals(t, u, y, valid), sigma), block=block, counts=counts)


def fitted(model: Model, trace: Trace) -> Window:
    """The model's free numbers and the window's first state, fitted from the model's own values and the trace's start.

    Levenberg-Marquardt, from afar first at a tau near the misfits' geometric mean (see estimation.fit). What begins
    near gets one step: the next hop brings the next one.
    """
    layout, blocks = model.layout(), Blocks.of([trace])
    z_0 = model.vector(layout)
    scale = np.array([*np.full(z_0.size, HORIZON.drift), trace.sigma, HORIZON.speed * model.scales.speed])
    stiff = np.array([*np.ones(z_0.size), 0.0, 1.0])

    def at(x):
        theta, omega = trace.start
        return model.at(layout, z_0 + HORIZON.drift * x[:-2]), replace(
            trace, start=(theta + x[-2] * scale[-2], omega + x[-1] * scale[-1])
        )

    def evaluate(x):
        moved, begun = at(x)
        plant, run = moved.staged(begun, 0, OBSERVER_RATE, None)
        theta, motion = plant.outputs(begun.t, begun.u, **run)
        e = np.where(trace.valid, (trace.y - theta) / trace.sigma, 0.0)
        m = blocks.misfit(e) if np.all(np.isfinite(e)) else np.full(blocks.counts.size, HORIZON.runaway)
        return np.nan_to_num(e), m, motion

    def cost(x, m, tau):
        return _cost(m, blocks.counts, tau) + 0.5 * float(stiff @ x**2)

    x, damping, hessian = np.zeros(scale.size), 1e-3, np.diag(stiff)
    e, m, motion = evaluate(x)
    is_near = _misfit(m, blocks.counts) <= HORIZON.explained
    tau = HORIZON.tau if is_near else max(HORIZON.tau, float(np.exp(np.mean(np.log(m + HORIZON.tau)))))
    for _ in range(1 if is_near else HORIZON.steps):
        jacobian = _slopes(at, evaluate, x, e, motion)
        weighted = jacobian * ((1 + tau) / (tau + m))[blocks.index][:, None]
        hessian, slope, now, gain = (
            weighted.T @ jacobian + np.diag(stiff),
            weighted.T @ e + stiff * x,
            cost(x, m, tau),
            0.0,
        )
        for _ in range(HORIZON.trials):
            step = np.clip(-np.linalg.solve(hessian + damping * np.diag(np.diag(hessian) + 1e-9), slope), -3.0, 3.0)
            trial = evaluate(x + step)
            if (then := cost(x + step, trial[1], tau)) < now:
                gain, x, (e, m, motion), damping = now - then, x + step, trial, damping / 8
                break
            damping = max(damping * 16, 1e-4)
        if gain < max(HORIZON.tolerance[0], HORIZON.tolerance[1] * now):
            if tau == HORIZON.tau:
                break
            tau, damping = (HORIZON.tau if tau < 15 * HORIZON.tau else 0.1 * tau), 1e-3
    moved, begun = at(x)
    spread = HORIZON.drift * np.sqrt(np.diag(np.linalg.inv(hessian + 1e-9 * np.eye(scale.size))))[:-2]
    return Window(moved, layout, moved.vector(layout), spread, _misfit(m, blocks.counts), begun, motion)


def _cost(m: np.ndarray, counts: np.ndarray, tau: float) -> float:
    return 0.5 * (1 + tau) * float(np.sum(counts * np.log((tau + m) / (1 + tau))))


def _misfit(m: np.ndarray, counts: np.ndarray) -> float:
    """What blocks miss on a logarithmic average [sigma^2], by which a spike is one block's matter."""
    tau = HORIZON.tau
    return (1 + tau) * math.exp(min(2 * _cost(m, counts, tau) / ((1 + tau) * counts.sum()), 60.0)) - tau


def _slopes(at: Callable, evaluate: Callable, x: np.ndarray, e: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Slopes (N, k + 2) of the residuals e (N,) by x: tangents of the motion for the parameters, differences for the
    first state.
    """
    model, trace = at(x)
    columns = [HORIZON.drift * jacobian_of(Run(model, e, (motion,)), [trace], OBSERVER_RATE)]
    for k in (-2, -1):
        nudged = x.copy()
        nudged[k] += HORIZON.nudge
        columns.append((evaluate(nudged)[0] - e)[:, None] / HORIZON.nudge)
    return np.column_stack(columns)
