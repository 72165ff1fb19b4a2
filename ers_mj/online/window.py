"""The last seconds of a stream, fitted: the parameters p and the state (theta, w) in which the window began.

    minimise  sum_b n_b (1 + tau) / 2 ln((tau + m_b) / (1 + tau)) + |(z - z_0) / drift|^2 / 2,    z = ln p,

m_b the mean squared residual [sigma^2] of a short block of n_b samples: least squares near the noise, where a block
beyond it counts ever less. Stick and slip are inside the simulation and its tangents, so that nothing is smoothed. z_0
is what was last believed, so that what the window does not excite stays.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.prepared import Blocks, Signals, Trace, make_trace
from ers_mj.estimation.jacobian import jacobian_of
from ers_mj.estimation.objective import Run
from ers_mj.online.horizon import HORIZON
from ers_mj.servo.model import OBSERVER_RATE, Free, Model
from ers_mj.solvers.levenberg_marquardt import Damping, Descent


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


@dataclass(frozen=True)
class _Reached:
    """A place on the way: x (k + 2,), what is left there (N,), the block misfits (B,), the motion (N, 4), and the
    cost.
    """

    z: np.ndarray
    e: np.ndarray
    misfit: np.ndarray
    motion: np.ndarray
    cost: float


class _Fit:
    """The cost of a window by x, the model's numbers and the first state, as solvers.levenberg_marquardt has a problem.

    The last two of x are the first angle and speed; x is 0 where the model and the trace begin, and of a size with what
    may change from window to window.
    """

    def __init__(self, model: Model, trace: Trace):
        self.model, self.trace, self.layout, self.blocks = model, trace, model.layout(), Blocks.of([trace])
        self.z_0, self.tau = model.vector(self.layout), HORIZON.tau
        self.scale = np.array([trace.sigma, HORIZON.speed * model.scales.speed])
        self.stiff = np.array([*np.ones(self.z_0.size), 0.0, 1.0])

    def at(self, x: np.ndarray) -> tuple[Model, Trace]:
        """The model and the trace's start at x."""
        theta, omega = self.trace.start
        start = theta + x[-2] * self.scale[0], omega + x[-1] * self.scale[1]
        return self.model.at(self.layout, self.z_0 + HORIZON.drift * x[:-2]), replace(self.trace, start=start)

    def reach(self, z: np.ndarray) -> _Reached:
        moved, begun = self.at(z)
        plant, run = moved.staged(begun, 0, OBSERVER_RATE, None)
        theta, motion = plant.outputs(begun.t, begun.u, **run)
        e = np.where(self.trace.valid, (self.trace.y - theta) / self.trace.sigma, 0.0)
        ran_away = not np.all(np.isfinite(e))
        m = np.full(self.blocks.counts.size, HORIZON.runaway) if ran_away else self.blocks.misfit(e)
        return self.priced(_Reached(z, np.nan_to_num(e), m, motion, 0.0))

    def priced(self, point: _Reached) -> _Reached:
        """The place with its cost at this tau."""
        left = _cost(point.misfit, self.blocks.counts, self.tau)
        return replace(point, cost=left + 0.5 * float(self.stiff @ point.z**2))

    def normal(self, point: _Reached, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        weighted = slopes * ((1 + self.tau) / (self.tau + point.misfit))[self.blocks.index][:, None]
        return weighted.T @ slopes + np.diag(self.stiff), weighted.T @ point.e + self.stiff * point.z

    def step(self, point: _Reached, curvature: np.ndarray, slope: np.ndarray, damping: float) -> np.ndarray:
        scale = np.diag(np.diag(curvature) + 1e-9)
        return np.clip(-np.linalg.solve(curvature + damping * scale, slope), -3.0, 3.0)

    def slopes(self, point: _Reached) -> np.ndarray:
        """Slopes (N, k + 2) of what is left: tangents of the motion for the parameters, differences for the first
        state.
        """
        model, trace = self.at(point.z)
        run = Run(model, point.e, (point.motion,))
        columns = [HORIZON.drift * jacobian_of(run, [trace], OBSERVER_RATE)]
        for k in (-2, -1):
            nudged = point.z.copy()
            nudged[k] += HORIZON.nudge
            columns.append((self.reach(nudged).e - point.e)[:, None] / HORIZON.nudge)
        return np.column_stack(columns)


def fitted(model: Model, trace: Trace) -> Window:
    """The model's free numbers and the window's first state, fitted from the model's own values and the trace's start.

    From afar first at a tau near the misfits' geometric mean (see estimation.fit). What begins near gets one step: the
    next hop brings the next one.
    """
    problem = _Fit(model, trace)
    here, counts = problem.reach(np.zeros(problem.stiff.size)), problem.blocks.counts
    is_near = _misfit(here.misfit, counts) <= HORIZON.explained
    if not is_near:
        problem.tau = max(HORIZON.tau, float(np.exp(np.mean(np.log(here.misfit + HORIZON.tau)))))
    descent = Descent(problem, problem.priced(here), Damping(raised=16.0, from_=1e-4, least=0.0, keeps=np.inf))
    for _ in range(1 if is_near else HORIZON.steps):
        before = descent.point.cost
        descent.renew(problem.slopes(descent.point))
        step = descent.advance(HORIZON.trials)
        if step is None or step.gain < max(HORIZON.tolerance[0], HORIZON.tolerance[1] * before):
            if problem.tau == HORIZON.tau:
                break
            problem.tau = HORIZON.tau if problem.tau < 15 * HORIZON.tau else 0.1 * problem.tau
            descent.point, descent.damping = problem.priced(descent.point), descent.rule.first
    end = descent.point
    moved, begun = problem.at(end.z)
    inverse = np.linalg.inv(descent.curvature + 1e-9 * np.eye(problem.stiff.size))
    spread = HORIZON.drift * np.sqrt(np.diag(inverse))[:-2]
    return Window(
        moved, problem.layout, moved.vector(problem.layout), spread, _misfit(end.misfit, counts), begun, end.motion
    )


def _cost(m: np.ndarray, counts: np.ndarray, tau: float) -> float:
    return 0.5 * (1 + tau) * float(np.sum(counts * np.log((tau + m) / (1 + tau))))


def _misfit(m: np.ndarray, counts: np.ndarray) -> float:
    """What blocks miss on a logarithmic average [sigma^2], by which a spike is one block's matter."""
    tau = HORIZON.tau
    return (1 + tau) * math.exp(min(2 * _cost(m, counts, tau) / ((1 + tau) * counts.sum()), 60.0)) - tau
