"""Eq. (6)'s coefficients from a recording alone: where a fit starts when there is no datasheet.

Weak form: Eq. (6) is multiplied by a bump that vanishes with its slope at both ends of a window, and integrated by
parts, so that the output is never differentiated twice. What is left is linear in a_1, a_2, b, c_1, c_2 once theta_0 is
given, and theta_0 is scanned over the travel.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import nnls
from scipy.signal import savgol_filter

from ers_mj.data.prepared import Trace

WINDOWS = (0.1, 0.3, 1.0)  # [s], never shorter than SHORTEST samples
SHORTEST = 16
EDGE = 0.02  # share of the travel next to its ends that is left out: a stop may act there
PLACES = np.linspace(0.05, 0.95, 13)  # quantiles of the output at which theta_0 is tried
SIGNED = [1, 3]  # columns whose coefficients may be negative: b and the constant
# [1/s] acceleration by the largest input over the speeds that are met: what makes more was guessed from no input at all
FASTEST = 1e4


def _rows(trace: Trace, window: float, still: float):
    """Weak-form rows of one trace: right side (W,), columns -y', u, -sgn(w), 1, -y (W, 5), and a maker of -sgn(y -
    theta_0).
    """
    h = trace.sample_time
    n = max(SHORTEST, int(window / h))
    if trace.t.size < 2 * n:
        return None
    s = (np.arange(n + 1)) / n
    bump = (s * (1 - s)) ** 3 * 64
    slope = np.gradient(bump, n * h / n)
    bend = np.gradient(slope, h)
    y = np.interp(trace.t, trace.t[trace.valid], trace.y[trace.valid])
    w = savgol_filter(y, max(5, min(n // 2 * 2 + 1, 2 * int(0.02 / h) + 5)), 2, deriv=1, delta=h)
    sign = np.clip(w / still, -1.0, 1.0)
    starts = np.arange(0, y.size - n - 1, max(n // 4, 1))
    index = starts[:, None] + np.arange(n + 1)
    margin = EDGE * (y.max() - y.min())
    inside = np.all((y[index] > y.min() + margin) & (y[index] < y.max() - margin), axis=1)
    moving = np.mean(np.abs(sign[index]), axis=1) > 0.6
    index = index[moving & inside]
    if index.shape[0] < 8:
        return None
    take = lambda f, v: (v[index] * f).sum(axis=1) * h
    columns = np.column_stack(
        [
            take(slope, y),
            take(bump, trace.u),
            -take(bump, sign),
            np.full(index.shape[0], bump.sum() * h),
            -take(bump, y),
        ]
    )
    return take(bend, y), columns, lambda theta_0: -take(bump, np.sign(y - theta_0))


def guesses(traces: Sequence[Trace]) -> list[dict[str, float]]:
    """Starting values of Eq. (6), best regression first, with and without spring and preload; none of an absurd
    gain.
    """
    y = np.concatenate([t.y[t.valid] for t in traces])
    speed = np.concatenate([np.abs(np.diff(savgol_filter(t.y[t.valid], 9, 2))) / t.sample_time for t in traces])
    still = max(0.02 * float(np.quantile(speed, 0.98)), 1e-12)
    found = [one for window in WINDOWS for one in _by_window(traces, window, still, y)]
    found.sort(key=lambda item: item[0])
    most, peak = FASTEST * float(np.quantile(speed, 0.98)), max(float(np.max(np.abs(t.u))) for t in traces)
    return [values for _, values in found if abs(values["b"]) * peak <= most]


def _by_window(traces: Sequence[Trace], window: float, still: float, y: np.ndarray) -> list[tuple[float, dict]]:
    """The regressions over windows of one length [s], without spring and with one at each place, as (misfit,
    values).
    """
    rows = [r for r in (_rows(t, window, still) for t in traces) if r is not None]
    if not rows:
        return []
    right, columns = np.concatenate([r[0] for r in rows]), np.vstack([r[1] for r in rows])
    places = [(None, False), (None, True), *((theta_0, True) for theta_0 in np.quantile(y, PLACES))]
    with np.errstate(all="ignore"):  # of a constant input next to nothing follows
        return [_solve(right, columns, rows, at, spring, float(np.median(y))) for at, spring in places]


def _solve(right, columns, rows, theta_0, spring, middle):
    """(relative residual, values) of one bounded regression, reweighted towards its smaller residuals."""
    design = columns[:, :5] if spring else columns[:, :4]
    if theta_0 is not None:
        design = np.column_stack([design, np.concatenate([r[2](theta_0) for r in rows])])
    size = np.maximum(np.abs(design).max(axis=0), 1e-300)
    signed = np.column_stack([design / size, -design[:, SIGNED] / size[SIGNED]])
    weight = np.ones(right.size)
    for _ in range(4):
        x = nnls(signed * weight[:, None], right * weight)[0]
        x[SIGNED] -= x[design.shape[1] :]
        x = x[: design.shape[1]] / size
        e = right - design @ x
        weight = 1.0 / np.sqrt(1.0 + (e / (2 * np.median(np.abs(e)) + 1e-300)) ** 2)
    a_1 = x[4] if spring else 0.0
    rest = x[3] / a_1 if a_1 > 0 else middle
    values = {
        "a_1": a_1,
        "a_2": max(x[0], 1e-3),
        "b": x[1],
        "c_1": x[5] if theta_0 is not None else 0.0,
        "c_2": max(x[2], 1e-3 * abs(x[1]) * 1.0),
        "theta_0": theta_0 if theta_0 is not None else rest,
    }
    return float(np.median(np.abs(e)) / np.median(np.abs(right))), values
