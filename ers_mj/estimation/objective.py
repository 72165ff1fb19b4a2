"""What a fit minimises: the block cost C of what a model's run leaves of recordings.

The model runs as an observer of low gain, theta_hat' = w_hat + rate (y - theta_hat), so that one late stick event does
not become a lasting offset, while forces stay in open loop. Time is cut into blocks; each block's misfit m_b = SSE_b /
(n_b sigma^2) enters as C = sum_b ln(1 + m_b / tau): a few blocks where stick and slip fork cannot decide everything.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ers_mj.data.prepared import Blocks, Trace
from ers_mj.decisions import explained
from ers_mj.servo.model import Free, Model


@dataclass(frozen=True)
class Fit:
    """A fitted model: its cost C, block misfits m (B,), and the curvature in transformed parameters (k, k)."""

    model: Model
    cost: float
    misfit: np.ndarray
    hessian: np.ndarray

    @property
    def size(self) -> int:
        """Number of fitted numbers."""
        return self.hessian.shape[0]


@dataclass(frozen=True)
class Run:
    """A model run along recordings: y - y_hat in sigmas over all traces and their channels (N,), 0 where a sample is
    missing, NaN where the simulation ran away; and the motion (n, 4) in each trace."""

    model: Model
    left: np.ndarray
    motions: tuple[np.ndarray, ...]


def run_of(model: Model, traces: Sequence[Trace], rate: float) -> Run:
    """The model's run along the traces, in observer form where ``rate`` [1/s] > 0."""
    parts, motions = zip(*(_run_in(model, trace, k, rate) for k, trace in enumerate(traces)))
    return Run(model, np.concatenate(parts), motions)


def residuals(model: Model, traces: Sequence[Trace], rate: float) -> np.ndarray:
    """What the run leaves (N,) (see Run)."""
    return np.concatenate([residuals_in(model, trace, k, rate) for k, trace in enumerate(traces)])


def residuals_in(model: Model, trace: Trace, record: int, rate: float) -> np.ndarray:
    """The same (rows,) in one recording."""
    return _run_in(model, trace, record, rate, moves=False)[0]


def _run_in(model: Model, trace: Trace, record: int, rate: float, moves: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """What a run leaves (rows,), and its motion (n, 4): kept with the trace, since fits, comparisons and intervals ask
    for the same places again; of what ``moves`` are not asked for only what it leaves, a fifth of it all. The effort
    is counted each time, so that it tells the same whatever is kept.
    """
    plant = model.plant(record, trace.supply)
    key = (*plant.told, rate, model.offset(record), model.values.get("ampere"), model.dead_time)
    kept = trace.runs.get(key)
    if kept is not None and (kept[1].size or not moves):
        plant.count_outputs(trace.t, rate > 0, int(kept[2][0]))
        return kept[0], kept[1]
    (theta, *others), motion, beyond = model.observed(trace, record, rate)
    left = np.empty((1 + len(others), trace.t.size))
    left[0] = trace.weighed(theta)
    for channel, seen, row in zip(trace.channels, others, left[1:]):
        np.divide(channel.values - seen, channel.sigma, out=row)
        if (
            channel.kind == "current" and model.dead_time > 0
        ):  # before it is over it follows a command that was not recorded
            row[trace.t < trace.t[0] + model.dead_time] = 0.0
    flat = left.ravel()
    flat[trace.unseen] = 0.0
    flat.flags.writeable = False
    trace.runs.keep(key, (flat, motion if moves else motion[:0].copy(), np.array([beyond])))
    return flat, motion


def cost_of(model: Model, traces: Sequence[Trace], rate: float, tau: float) -> float:
    """C of a model as it stands, without its priors; infinite where the simulation ran away."""
    cost = explained.cost(Blocks.of(traces).misfit(residuals(model, traces, rate)), tau)
    return cost if math.isfinite(cost) else math.inf


def tau_of(misfit: np.ndarray) -> float:
    """The misfit at which C turns from squares to logarithms: a tenth of the median, never below the noise."""
    return max(1.0, 0.1 * float(np.median(misfit)))


def begun(model: Model, traces: Sequence[Trace], rate: float) -> Run:
    """The run of a model whose numbers lie within their bounds."""
    layout = model.layout()
    return run_of(model.at(layout, model.vector(layout)), traces, rate)


def is_rough(traces: Sequence[Trace]) -> bool:
    """Whether a converter is so coarse that C has a local minimum wherever a threshold is passed."""
    return any(trace.converter is not None for trace in traces)


def prior_cost(layout: Sequence[Free], z: np.ndarray) -> float:
    """What the priors of the fitted numbers add to C at z (k,)."""
    return sum(0.5 * ((q - f.prior[0]) / f.prior[1]) ** 2 for f, q in zip(layout, z) if f.prior)


def add_prior(layout: Sequence[Free], z: np.ndarray, hessian: np.ndarray, slope: np.ndarray) -> None:
    """The same of C's curvature (k, k) and slope (k,), in place."""
    for k, f in enumerate(layout):
        if f.prior:
            hessian[k, k] += 1.0 / f.prior[1] ** 2
            slope[k] += (z[k] - f.prior[0]) / f.prior[1] ** 2
