"""Columns that are refreshed more slowly than they are logged: only a fresh value is a measurement."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ers_mj.data.consistency.sheet import Found, Sheet
from ers_mj.errors import InputError


@dataclass(frozen=True)
class Refresh:
    """When the repeats of a column are those of its own, slower clock."""

    fewest: int = 20  # changes that must be seen
    sizes: int = 4  # different changes: a coarse converter at a steady speed has one
    locked: float = 0.97  # share of the changes that come in step
    beating: float = 0.8  # share of the intervals that are of one length, or one row longer
    shortest_beat: int = 3  # rows of an interval, below which repeats by a coarse converter may look alike
    longest: int = 500  # rows
    least: int = 100  # values that must be left
    edge: float = 0.05  # of its range, by which an input must change to be kept as an edge
    most_edges: float = 0.2  # of the fresh rows; of an input with more all rows are kept


REFRESH = Refresh()


def held(sheet: Sheet) -> Found:
    """Keep the output where it is fresh, and of the other rows what the input needs (see ``_thinned``); a sensor beside
    it counts in its own fresh rows.
    """
    faults = []
    rows = fresh_rows(sheet.y, sheet.t)
    if rows is not None:
        period, step = float(np.median(np.diff(rows))), float(np.median(np.diff(sheet.t)))
        column = sheet.labels["y"]
        sentence = (
            f"{column} is refreshed every {period:.4g} rows ({period * step:.4g} s): each value stands for"
            f" {period:.4g} rows, of which the first counts"
        )
        if rows.size < REFRESH.least:
            raise InputError(
                f"{sheet.name}: {column} is refreshed every {period:.4g} rows, which leaves {rows.size} values, at"
                f" least {REFRESH.least} are needed"
            )
        faults.append(sheet.fault("held", "y", np.setdiff1d(np.arange(sheet.t.size), rows), sentence))
        sheet = _thinned(sheet, rows)
    for field in ("omega", "current", "theta_m", "second"):
        if field not in sheet.fields or (own := fresh_rows(sheet.fields[field], sheet.t)) is None:
            continue
        stale = np.ones(sheet.t.size, bool)
        stale[own] = False
        period = float(np.median(np.diff(own)))
        sentence = f"{sheet.labels[field]} is refreshed every {period:.4g} rows: the repeats are left out"
        faults.append(sheet.fault("held", field, stale, sentence))
        sheet = sheet.masked(field, stale)
    return sheet, faults


def fresh_rows(x: np.ndarray, t: np.ndarray) -> np.ndarray | None:
    """The rows in which x (N,) at the times t (N,) is measured anew; None where it may be so in every row."""
    known = np.flatnonzero(np.isfinite(x))
    change = np.diff(x[known])
    at = known[1:][change != 0.0]
    ticks = _ticks(t)
    if at.size < REFRESH.fewest or 2 * at.size > ticks[-1] + 1:
        return None
    finest = 1e-6 * float(np.ptp(x[known]))
    if np.unique(np.rint(np.abs(change[change != 0.0]) / finest)).size < REFRESH.sizes:
        return None
    return _beating(at) if (rows := _locked(at, ticks)) is None else rows


def _ticks(t: np.ndarray) -> np.ndarray:
    """Which tick of the log's clock each of the times t (N,) is, those of lost rows counted."""
    step = float(np.median(np.diff(t)))
    near = np.cumsum(np.maximum(np.rint(np.diff(t, prepend=t[0] - step) / step), 1.0))
    step = float(np.polyfit(near, t, 1)[0])
    return np.rint((t - t[0]) / step).astype(int)


def _locked(at: np.ndarray, ticks: np.ndarray) -> np.ndarray | None:
    """The rows of every so many ticks (N,), where the changes keep step with the log."""
    for n in range(min(REFRESH.longest, ticks.size // REFRESH.fewest), 1, -1):
        phases = np.bincount(ticks[at] % n)
        if np.max(phases) >= REFRESH.locked * at.size:
            return np.flatnonzero(ticks % n == int(np.argmax(phases)))
    return None


def _beating(at: np.ndarray) -> np.ndarray | None:
    """The changes, and as many rows within longer holds as fit, where most intervals are alike to a row."""
    apart = np.diff(at)
    n = int(np.quantile(apart, 0.1))
    alike = (apart == n) | (apart == n + 1)
    if n < REFRESH.shortest_beat or n > REFRESH.longest or np.mean(alike) < REFRESH.beating:
        return None
    mean = float(np.mean(apart[alike]))
    before = np.rint(np.arange(at[0] - mean, -0.5, -mean))[::-1]
    parts = [np.rint(np.linspace(a, b, max(round((b - a) / mean), 1), endpoint=False)) for a, b in pairwise(at)]
    return np.concatenate([before, *parts, at[-1:]]).astype(int)


def _edges(u: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Rows beside the fresh ones in which an input (N,) changes: all of them, or the large ones, if these are few."""
    for least in (0.0, REFRESH.edge * float(np.ptp(u))):
        edges = 1 + np.flatnonzero(np.abs(np.diff(u)) > least)
        edges = np.setdiff1d(edges[(edges > rows[0]) & (edges < rows[-1])], rows)
        if edges.size <= REFRESH.most_edges * rows.size:
            return edges
    return edges[:0]


def _thinned(sheet: Sheet, rows: np.ndarray) -> Sheet:
    """The fresh rows, and those of a few edges of the input, under its mean up to the next row; where the input changes
    more often all rows from the first fresh one on, without the repeats: its mean moves a servo elsewhere.
    """
    kept = np.union1d(rows, _edges(sheet.u, rows))
    if np.count_nonzero(np.diff(sheet.u)) > REFRESH.most_edges * rows.size:
        kept = np.arange(rows[0], sheet.t.size)
    width = np.diff(sheet.t, append=2 * sheet.t[-1] - sheet.t[-2])
    last = kept[-1] + 1
    total, time = (np.add.reduceat(a[:last], kept) for a in (sheet.u * width, width))
    flat = np.maximum.reduceat(sheet.u[:last], kept) == np.minimum.reduceat(sheet.u[:last], kept)
    mean = np.where(flat, sheet.u[kept], total / time)
    thin = sheet.only(kept).changed(u=mean)
    stale = ~np.isin(kept, rows)
    for field in ("y", "omega", "current", "theta_m", "second"):
        if field in thin.fields and stale.any():
            thin = thin.masked(field, stale)
    return thin
