"""Intervals that survive model error: a jackknife over recordings and a sandwich over blocks.

(J^T J)^-1 takes neighbouring residuals for independent; a model error is anything but that. The jackknife sees what differs between
recordings, but a refit may rest in the dent of the cost where it begins, and then says nothing; the sandwich only sees
the scatter within them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import t as student

from ers_mj.identification import central_jacobian, residuals
from ers_mj.model import OBSERVER_RATE, Model
from ers_mj.traces import Blocks, Trace

FEWEST_RECORDS = 3
RUN = 4  # neighbouring blocks that are resampled together


def half_widths(model: Model, traces: Sequence[Trace], left_out: Sequence[Model], tau: float) -> np.ndarray:
    """95 % half-widths (k,) of the model's transformed numbers: those of jackknife and sandwich, squared and added.

    ``left_out`` holds the model refitted without each recording in turn; with fewer than three, or where
    some numbers belong to one recording only, the sandwich serves alone.
    """
    layout = model.layout()
    widths = _sandwich(model, traces, tau)
    if len(left_out) >= FEWEST_RECORDS and not any(f.local for f in layout):
        z = np.array([m.vector(layout) for m in left_out])
        n = len(left_out)
        widths = np.hypot(widths, student.ppf(0.975, n - 1) * np.sqrt((n - 1) / n * np.sum((z - z.mean(axis=0)) ** 2, axis=0)))
    return widths


def _sandwich(model: Model, traces: Sequence[Trace], tau: float) -> np.ndarray:
    """95 % half-widths (k,) by H^-1 (sum of outer products of the slopes of runs of blocks) H^-1."""
    layout, blocks = model.layout(), Blocks.of(traces)
    e, z = residuals(model, traces, OBSERVER_RATE), model.vector(layout)
    jacobian = central_jacobian(model, layout, z, traces, OBSERVER_RATE)
    weight = (2.0 / ((tau + blocks.misfit(e)) * blocks.counts))[blocks.index]
    weighted = jacobian * weight[:, None]
    hessian = weighted.T @ jacobian
    run = blocks.index // RUN
    slopes = np.array([np.bincount(run, weighted[:, k] * e, run.max() + 1) for k in range(len(layout))]).T
    inverse = np.linalg.pinv(hessian + 1e-12 * np.trace(hessian) * np.eye(len(layout)), rcond=1e-12)
    n = slopes.shape[0]
    covariance = inverse @ (slopes.T @ slopes) @ inverse * n / max(n - len(layout), 1)
    return student.ppf(0.975, max(n - len(layout), 1)) * np.sqrt(np.maximum(np.diag(covariance), 0.0))
