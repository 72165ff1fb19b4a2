"""Validity maps as inline SVG: one cell a run, its number in it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from ers_mj.report.display import figure as digits
from ers_mj.report.drawing import both_widths
from ers_mj.report.style import HEAT, STYLE
from ers_mj.validation.cases import ValidityMap


def sine_map(sines: ValidityMap, valid: float) -> str:
    """Deviation over amplitude and frequency, in degrees and in per cent of the motion; cells up to `valid` are
    framed.
    """
    return both_widths(lambda width: _sine_map(sines, valid, width), "rms deviation over amplitude and frequency")


def play_map(play: ValidityMap) -> str:
    """Deviation over play and inductance, in degrees."""
    return both_widths(lambda width: _play_map(play, width), "rms deviation over play and inductance")


def _sine_map(sines: ValidityMap, valid: float, width: float) -> Figure:
    wide = width == STYLE.wide
    figure = Figure(figsize=(width, 3.7 if wide else 6.8), layout="constrained")
    axes = figure.subplots(1, 2) if wide else figure.subplots(2, 1)
    good = sines.relative <= valid
    for ax, values, title in zip(
        axes, (np.degrees(sines.rms), 100 * sines.relative), ("rms deviation [°]", "in % of the motion"), strict=True
    ):
        _cells(ax, values, good, [f"{x:.3g}" for x in sines.x], [f"{y:.3g}" for y in sines.y])
        ax.set_title(title, color=STYLE.ink, fontweight="bold")
        ax.set_xlabel("frequency [Hz]")
        ax.set_ylabel("amplitude [V]")
    return figure


def _play_map(play: ValidityMap, width: float) -> Figure:
    figure = Figure(figsize=(width if width != STYLE.wide else 0.62 * STYLE.wide, 3.2), layout="constrained")
    ax = figure.subplots()
    _cells(
        ax,
        np.degrees(play.rms),
        np.zeros(play.rms.shape, bool),
        [f"±{np.degrees(x):.3g}" if x else "0" for x in play.x],
        [f"{1e3 * y:.3g}" for y in play.y],
    )
    ax.set_title("rms deviation [°]", color=STYLE.ink, fontweight="bold")
    ax.set_xlabel("inductance L [mH]")
    ax.set_ylabel("play [°]")
    return figure


def _cells(ax, values: np.ndarray, framed: np.ndarray, rows: Sequence[str], columns: Sequence[str]) -> None:
    """values (X, Y) as coloured cells, x upwards, the colour by the logarithm."""
    positive = values[np.isfinite(values) & (values > 0)]
    low, high = np.log(positive.min()), np.log(positive.max())
    shade = (np.log(np.where(values > 0, values, np.nan)) - low) / max(high - low, 1e-9)
    ax.pcolormesh(
        range(len(columns)), range(len(rows)), np.ma.masked_invalid(shade), cmap=HEAT, vmin=0, vmax=1, shading="nearest"
    )
    for (i, j), x in np.ndenumerate(values):
        if np.isfinite(x):
            ax.text(j, i, digits(x, 2), ha="center", va="center", fontsize=8.5, color=STYLE.on_heat(shade[i, j]))
        if framed[i, j]:
            ax.add_patch(Rectangle((j - 0.46, i - 0.46), 0.92, 0.92, fill=False, edgecolor=STYLE.after, linewidth=1.6))
    ax.set_xticks(range(len(columns)), columns)
    ax.set_yticks(range(len(rows)), rows)
    ax.grid(False)
    ax.tick_params(length=0)
    ax.spines[:].set_visible(False)
