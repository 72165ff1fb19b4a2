"""Curves of trials as inline SVG: angle, error and voltage of every controller over one reference."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ers_mj.control.monte_carlo import Spread
from ers_mj.control.trial import Trial
from ers_mj.report.drawing import both_widths
from ers_mj.report.style import STYLE
from ers_mj.report.thinning import decimate

COLOURS = {
    "ftrc": STYLE.after,
    "ftrc-literal": "#7cc2bb",
    "pid": STYLE.before,
    "pid-ff": "#a83a1e",
    "hinf": "#8a6bb8",
    "time-optimal": "#1d4f91",
}
MORE = ("#4c8c2b", "#b8336a", "#5b6b7b")
POINTS = {True: 700, False: 350}
CLOSE = {"step": (0.0, 0.15), "square": (0.49, 0.64), "ramp": (0.45, 0.6), "chirp": (4.7, 5.0)}  # [s]


def colour(name: str, order: int = 0) -> str:
    """The colour of a controller."""
    return COLOURS.get(name, MORE[order % len(MORE)])


def curves(trials: Sequence[Trial]) -> str:
    """All trials of one case on one plant, over all of the time."""
    return both_widths(lambda width: _curves(trials, width, None), "angle, error and voltage or drive over time")


def close_up(trials: Sequence[Trial]) -> str:
    """The same over a short span, where the laws differ."""
    return both_widths(lambda width: _curves(trials, width, span(trials)), "the same, a short span enlarged")


def span(trials: Sequence[Trial]) -> tuple[float, float]:
    """The span [s] of the close-up: the case's own, else a tenth of the time about the largest error of the first
    trial.
    """
    first = trials[0]
    if first.case in CLOSE:
        return CLOSE[first.case]
    t = first.run.reference.t
    middle = t[int(np.argmax(np.nan_to_num(np.abs(first.run.theta - first.run.reference.theta))))]
    begin = float(np.clip(middle - 0.03 * t[-1], t[0], 0.9 * t[-1]))
    return begin, begin + 0.1 * float(t[-1])


def _curves(trials: Sequence[Trial], width: float, over: tuple[float, float] | None) -> Figure:
    wide = width == STYLE.wide
    figure = Figure(figsize=(width, 6.0 if wide else 6.4), layout="constrained")
    angle, error, effort = figure.subplots(3, 1, sharex=True, height_ratios=(1.7, 1.2, 1.2))
    reference, volts = trials[0].run.reference, trials[0].run.has_volts
    inside = slice(None) if over is None else slice(*np.searchsorted(reference.t, over))
    t, points = reference.t[inside], POINTS[wide]
    angle.plot(
        *decimate(t, np.degrees(reference.theta[inside]), points),
        color=STYLE.measured,
        linewidth=3.0,
        label="reference",
        zorder=2,
    )
    largest = []
    for k, trial in enumerate(trials):
        shade = colour(trial.controller, k)
        off = np.degrees(trial.run.theta - reference.theta)[inside]
        angle.plot(
            *decimate(t, np.degrees(trial.run.theta[inside]), points),
            color=shade,
            linewidth=1.2,
            label=trial.controller,
            zorder=3,
        )
        error.plot(*decimate(t, off, points), color=shade, linewidth=1.0)
        told = trial.run.u if volts else trial.run.drive
        effort.plot(*decimate(t, told[inside], points), color=shade, linewidth=0.8)
        if np.isfinite(off).any():
            largest.append(float(np.nanmax(np.abs(off))))
    ends = np.degrees([*reference.theta[inside], trials[0].run.theta[inside][0]])
    angle.set_ylim(*_reach(ends, [np.degrees(trial.run.theta[inside]) for trial in trials]))
    if largest:
        limit = error_limit(largest) or 1.0
        error.set_ylim(-limit, limit)
    for ax, label in (
        (angle, "angle [°]"),
        (error, "error [°]"),
        (effort, "voltage [V]" if volts else "drive [rad/s²]"),
    ):
        ax.set_ylabel(label, color=STYLE.ink)
        ax.margins(x=0)
    effort.set_xlabel("time [s]")
    handles, labels = angle.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside upper left", ncols=7 if wide else 3, handlelength=1.6, columnspacing=1.2
    )
    return figure


def _reach(ends: np.ndarray, ran: Sequence[np.ndarray]) -> tuple[float, float]:
    """How far an axis of angles goes: beyond the reference as far as the trials; those that run away leave it."""
    span = float(np.ptp(ends)) or 1.0
    near = np.concatenate([ends, *(x[np.abs(x - ends.mean()) < span] for x in ran)])
    return float(near.min()) - 0.2 * span, float(near.max()) + 0.2 * span


def error_limit(largest: Sequence[float]) -> float:
    """How far an axis of errors goes, of the largest error of each law: those that run away leave the picture."""
    return min(1.05 * max(largest), 3.0 * float(np.median(largest)))


def spreads(found: Sequence[Spread]) -> str:
    """RMS error of every servo, a row a controller, a panel a case and plant."""
    return both_widths(lambda width: _spreads(found, width), "RMS error on scattered servos")


def _spreads(found: Sequence[Spread], width: float) -> Figure:
    groups = list(dict.fromkeys((s.case, s.plant) for s in found))
    rows = len(found) // len(groups)
    columns = min(len(groups), 2 if width == STYLE.wide else 1)
    lines = -(-len(groups) // columns)
    figure = Figure(figsize=(width, lines * (0.9 + 0.3 * rows)), layout="constrained")
    axes = figure.subplots(lines, columns, squeeze=False).ravel()
    for ax in axes[len(groups) :]:
        ax.set_visible(False)
    for ax, (case, plant) in zip(axes, groups, strict=False):
        group = [s for s in found if (s.case, s.plant) == (case, plant)]
        for k, s in enumerate(group):
            x = np.degrees(s.values("rmse_rad"))
            ax.plot(x, np.full(x.size, k), "|", color=colour(s.controller, k), markersize=9, alpha=0.6)
            if x.size:
                ax.plot([np.median(x)], [k], "o", color=colour(s.controller, k), markersize=6)
        ax.set_yticks(range(len(group)), [s.controller for s in group])
        ax.set_ylim(len(group) - 0.4, -0.6)
        ax.set_xscale("log")
        ax.set_title(f"{case}, {plant} plant", color=STYLE.ink)
        ax.set_xlabel("RMS error [°]")
    return figure
