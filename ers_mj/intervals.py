"""Intervals that survive model error: recording-level jackknife, or a block sandwich where there are too few recordings.

(J^T J)^-1 takes neighbouring residuals for independent; a model error is anything but that.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import t as student

from ers_mj.identification import jacobian_of, residuals
from ers_mj.model import OBSERVER_RATE, Model
from ers_mj.traces import Blocks, Trace

FEWEST_RECORDS = 3
RUN = 4  # neighbouring blocks that are resampled together


def standard_errors(model: Model, traces: Sequence[Trace], left_out: Sequence[Model], tau: float) -> tuple[np.ndarray, float]:
    """Standard errors (k,) of the model's transformed numbers, and the factor that makes them 95 % half-widths.

    ``left_out`` holds the model refitted without each recording in turn; with fewer than three, or where
    some numbers belong to one recording only, the block sandwich serves.
    """
    layout = model.layout()
    if len(left_out) >= FEWEST_RECORDS and not any(f.local for f in layout):
        z = np.array([m.vector(layout) for m in left_out])
        n = len(left_out)
        return np.sqrt((n - 1) / n * np.sum((z - z.mean(axis=0)) ** 2, axis=0)), float(student.ppf(0.975, n - 1))
    return _sandwich(model, traces, tau)


def _sandwich(model: Model, traces: Sequence[Trace], tau: float) -> tuple[np.ndarray, float]:
    """H^-1 (sum of outer products of the slopes of runs of blocks) H^-1."""
    layout, blocks = model.layout(), Blocks.of(traces)
    e = residuals(model, traces, OBSERVER_RATE)
    jacobian = jacobian_of(model, layout, model.vector(layout), e, traces, OBSERVER_RATE)
    weight = (2.0 / ((tau + blocks.misfit(e)) * blocks.counts))[blocks.index]
    weighted = jacobian * weight[:, None]
    hessian = weighted.T @ jacobian
    run = blocks.index // RUN
    slopes = np.array([np.bincount(run, weighted[:, k] * e, run.max() + 1) for k in range(len(layout))]).T
    inverse = np.linalg.pinv(hessian + 1e-12 * np.trace(hessian) * np.eye(len(layout)), rcond=1e-12)
    n = slopes.shape[0]
    covariance = inverse @ (slopes.T @ slopes) @ inverse * n / max(n - len(layout), 1)
    return np.sqrt(np.maximum(np.diag(covariance), 0.0)), float(student.ppf(0.975, max(n - len(layout), 1)))
