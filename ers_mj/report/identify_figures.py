"""Pictures of an identification as inline SVG: measured over simulated, the way to the minimum, profiles of what is
weak.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from ers_mj.data.prepared import Trace
from ers_mj.identification.answer import Identified
from ers_mj.identification.precision import Profile
from ers_mj.report.display import SUPERSCRIPT, shown
from ers_mj.report.drawing import both_widths, margins
from ers_mj.report.style import STYLE
from ers_mj.report.thinning import decimate

POINTS = {True: 900, False: 450}
SHADES = (STYLE.after, STYLE.before, "#1d4f91", "#8a6bb8", "#a83a1e", "#4c8c2b", "#5b6b7b")


def compared(trace: Trace, predicted: np.ndarray, unit: str) -> str:
    """One recording: measured and simulated, and what is left, with the noise beside it."""
    return both_widths(
        lambda width: _compared(trace, predicted, unit, width), f"{trace.name}: measured and simulated output over time"
    )


def _compared(trace: Trace, predicted: np.ndarray, unit: str, width: float) -> Figure:
    wide, u = width == STYLE.wide, shown(unit)
    figure = Figure(figsize=(width, 4.4))
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.8, 1.0))
    margins(figure, top=0.35)
    above.plot(
        *decimate(trace.t, u.factor * trace.y, POINTS[wide]), color=STYLE.measured, linewidth=2.6, label="measured"
    )
    above.plot(
        *decimate(trace.t, u.factor * predicted, POINTS[wide]),
        color=STYLE.after,
        linewidth=1.1,
        label="identified model, free run",
    )
    below.plot(*decimate(trace.t, u.factor * (trace.y - predicted), POINTS[wide]), color=STYLE.ink, linewidth=0.7)
    for k, edge in enumerate((-2, 2)):
        below.axhline(
            edge * u.factor * trace.sigma, color=STYLE.before, linewidth=1.0, label=None if k else "noise, ±2σ"
        )
    for ax, label in ((above, f"output [{u.label}]"), (below, f"left [{u.label}]")):
        ax.set_ylabel(label)
        ax.margins(x=0)
    figure.legend(loc="upper left", ncols=3, fontsize=8, borderaxespad=0.2)
    below.set_xlabel("time [s]")
    return figure


def descent(found: Identified) -> str:
    """Best fitness over evaluations of the search."""
    return both_widths(
        lambda width: progress_figure({found.settings.method: [found.minimum.trace]}, width),
        "best fitness over evaluations",
    )


def progress_figure(traces: Mapping[str, Sequence[np.ndarray]], width: float) -> Figure:
    """Median best fitness over evaluations by method, of the traces (T, 2) of its runs."""
    figure = Figure(figsize=(width, 3.2))
    ax = figure.subplots()
    margins(figure)
    last = max(run[-1, 0] for runs in traces.values() for run in runs)
    grid = np.unique(np.round(np.geomspace(1, last, 300)))
    for k, (method, runs) in enumerate(traces.items()):
        levels = np.array([run[np.maximum(np.searchsorted(run[:, 0], grid, side="right") - 1, 0), 1] for run in runs])
        ax.loglog(grid, np.maximum(np.median(levels, axis=0), 1e-30), color=SHADES[k % len(SHADES)], label=method)
    low, high = (math.log10(x) for x in ax.get_ylim())
    ax.set_ylim(10.0 ** math.floor(low), 10.0 ** math.ceil(high))
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_formatter(_power)
        axis.set_minor_formatter(NullFormatter())
    ax.set_xlabel("evaluations")
    ax.set_ylabel("fitness, Eq. (13) [rad² s]")
    ax.legend(loc="lower left", fontsize=8)
    return figure


def _power(x: float, place: int) -> str:
    """The label of a power of ten."""
    return f"10{f'{math.log10(x):.0f}'.translate(SUPERSCRIPT)}"


def profiles(found: Sequence[Profile]) -> str | None:
    """How the misfit rises about what is weak; None where nothing is."""
    return (
        both_widths(lambda width: _profiles(found, width), "profile likelihood of the weak parameters")
        if found
        else None
    )


def _profiles(found: Sequence[Profile], width: float) -> Figure:
    columns = min(len(found), 3 if width == STYLE.wide else 1)
    rows = math.ceil(len(found) / columns)
    figure = Figure(figsize=(width, 2.8 * rows), layout="constrained")
    for ax, p in zip(figure.subplots(rows, columns, squeeze=False).ravel(), found, strict=False):
        ax.plot(p.x, p.rise, color=STYLE.after, marker="o", markersize=3.5)
        ax.axhline(p.level, color=STYLE.faint, linewidth=0.8, linestyle=(0, (3, 3)))
        ax.set_ylim(0, 2.5 * p.level)
        ax.set_title(p.name)
        ax.set_xlabel("over the reference")
        ax.set_ylabel("rise of χ²")
    return figure
