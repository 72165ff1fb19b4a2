"""The diagnosis's own figures as inline SVG: the map of residuals, the error over frequency, the candidates."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ers_mj.diagnosis.evidence import Evidence, ResidualMap, Rung
from ers_mj.diagnosis.mismatch_spectrum import Mismatch
from ers_mj.report.display import Unit, noun, shown
from ers_mj.report.drawing import both_widths, label_aside, largest, plain_ticks, rect
from ers_mj.report.style import HEAT, STYLE

MOST_RUNGS = 16  # candidates in the ladder

# -- the map of residuals ------------------------------------------------------------------------------------------


def residual_map(residuals: ResidualMap, evidence: Evidence) -> str:
    """Rms residual over (angle, speed), before and after on one scale of colour."""
    return both_widths(
        lambda width: _map(residuals, evidence, width), "rms residual over angle and speed, before and after"
    )


def _map(residuals: ResidualMap, evidence: Evidence, width: float) -> Figure:
    figure = Figure(figsize=(width, 3.5 if width == STYLE.wide else 6.2))
    angle, speed = _map_units(residuals, evidence)
    size = shown(evidence.output_unit, largest(residuals.rms_before))
    values = [x * size.factor for x in (residuals.rms_before, residuals.rms_after)]
    top = max((float(np.nanquantile(x, 0.98)) for x in values if np.isfinite(x).any()), default=1.0) or 1.0
    axes, scale = _map_axes(figure, f"{noun(evidence.output_unit)} [{angle.label}]", f"speed [{speed.label}]")
    edges = residuals.angle_edges * angle.factor, residuals.speed_edges * speed.factor
    for ax, x, title, colour in zip(axes, values, ("before", "after"), (STYLE.before, STYLE.after), strict=True):
        cells = {"cmap": HEAT, "vmin": 0, "vmax": top, "edgecolors": "white", "linewidth": 0.4}
        mesh = ax.pcolormesh(*edges, np.ma.masked_invalid(x.T), **cells)
        ax.axhline(0, color=STYLE.faint, linewidth=0.6)
        ax.set_title(title, color=colour, fontweight="bold")
    upright = "vertical" if width == STYLE.wide else "horizontal"
    bar = figure.colorbar(mesh, cax=figure.add_axes(scale), orientation=upright, extend="max")
    bar.set_label(f"rms residual [{size.label}]", color=STYLE.ink)
    bar.outline.set_visible(False)
    return figure


def _map_units(residuals: ResidualMap, evidence: Evidence) -> tuple[Unit, Unit]:
    """Of angle and speed: where the angle is told in mm the speed is too."""
    angle = shown(evidence.output_unit, largest(residuals.angle_edges))
    return angle, Unit("mm/s", 1e3) if angle.label == "mm" else shown(f"{evidence.output_unit}/s")


def _map_axes(figure: Figure, across: str, upwards: str) -> tuple[list[Axes], tuple[float, float, float, float]]:
    """Two pairs of axes that share their scales, side by side or one above the other, labelled at the outer edges; and
    the place of the colours' scale.
    """
    if figure.get_figwidth() == STYLE.wide:
        places, scale = ((0.8, 0.55, 4.65, -0.3), (4.85, 0.55, 8.7, -0.3)), (8.85, 0.55, 8.99, -0.3)
        inner, below, left = {"labelleft": False, "labelbottom": True}, (0, 1), (0,)
    else:
        places, scale = ((0.8, 3.85, -0.12, -0.3), (0.8, 1.35, -0.12, 3.5)), (0.8, 0.6, -0.12, 0.72)
        inner, below, left = {"labelleft": True, "labelbottom": False}, (1,), (0, 1)
    axes = [figure.add_axes(rect(figure, *place)) for place in places]
    axes[1].sharex(axes[0])
    axes[1].sharey(axes[0])
    axes[1 if below == (0, 1) else 0].tick_params(**inner)
    for ax in axes:
        ax.set_facecolor("white")
        ax.grid(False)
    for k in below:
        axes[k].set_xlabel(across)
    for k in left:
        axes[k].set_ylabel(upwards)
        label_aside(axes[k])
    return axes, rect(figure, *scale)


# -- the error over frequency --------------------------------------------------------------------------------------


def spectrum(found: Mismatch, evidence: Evidence) -> str:
    """The error's amplitude over frequency with what is linear in it and what is not, and the gap between measured and
    simulated motion.
    """
    return both_widths(
        lambda width: _spectrum(found, evidence, width), "the error over frequency, and measured over simulated motion"
    )


def _spectrum(found: Mismatch, evidence: Evidence, width: float) -> Figure:
    wide = width == STYLE.wide
    figure = Figure(figsize=(width, 3.5 if wide else 6.6))
    places = (
        ((0.8, 0.5, 4.75, -0.55), (5.75, 1.95, -0.12, -0.3), (5.75, 0.5, -0.12, 1.8))
        if wide
        else ((0.8, 4.05, -0.12, -0.55), (0.8, 1.95, -0.12, 3.2), (0.8, 0.5, -0.12, 1.8))
    )
    levels, size, phase = (figure.add_axes(rect(figure, *place)) for place in places)
    size.sharex(phase)
    f, step = found.f_hz, found.f_hz[1] - found.f_hz[0]
    unit = shown(evidence.output_unit, float(np.sqrt(found.error.max() * step)))
    for x, colour, label, line in (
        (found.motion, STYLE.measured, "motion", 2.6),
        (found.error, STYLE.before, "error", 1.6),
        (found.linear, STYLE.after, "linear in it", 1.2),
        (found.distortion, STYLE.distortion, "distortion in it", 1.2),
        (found.noise, STYLE.faint, "noise", 1.0),
    ):
        levels.loglog(
            f, unit.factor * np.sqrt(np.where(x > 0, x, np.nan) * step), color=colour, label=label, linewidth=line
        )
    bottom = float(np.sqrt(found.noise.min() * step)) * unit.factor
    levels.set_ylim(bottom=0.2 * bottom)
    levels.set_ylabel(f"rms in {step:.2g} Hz [{unit.label}]")
    levels.set_xlabel("frequency [Hz]")
    sure = found.response.sure & found.beyond
    size.semilogx(f[sure], 20 * np.log10(np.abs(found.response.g[sure])), ".-", color=STYLE.ink, linewidth=0.8)
    phase.semilogx(
        f[sure], np.degrees(np.unwrap(np.angle(found.response.g[sure]))), ".-", color=STYLE.ink, linewidth=0.8
    )
    for ax, label in ((size, "size [dB]"), (phase, "phase [°]")):
        ax.axhline(0, color=STYLE.faint, linewidth=0.8)
        ax.set_ylabel(label)
    size.set_title("measured over simulated motion", color=STYLE.ink)
    phase.set_xlabel("frequency [Hz]")
    phase.set_xlim(f[0], f[-1])
    ticks = [x for decade in range(-3, 5) for x in np.array([1.0, 2.0, 5.0]) * 10.0**decade if f[0] <= x <= f[-1]]
    for ax in (levels, size, phase):
        plain_ticks(ax, ticks)
        ax.axvspan(*found.region, color=STYLE.shade, alpha=0.28, linewidth=0, zorder=0)
        label_aside(ax)
    size.tick_params(labelbottom=False)
    figure.legend(*levels.get_legend_handles_labels(), loc="upper left", ncols=3, handlelength=1.6, columnspacing=1.2)
    return figure


# -- the ladder of candidates --------------------------------------------------------------------------------------


def ladder(rungs: tuple[Rung, ...], evidence: Evidence, baseline: float | None) -> str:
    """What each candidate scores on held-out data (or gains on the training data, where nothing is held out)."""
    return both_widths(
        lambda width: _ladder(rungs[:MOST_RUNGS], evidence, baseline, width), "candidates and their evidence"
    )


def rung_name(rung: Rung) -> str:
    """The effects of a rung, "baseline" where there are none."""
    return " + ".join(name.replace("_", " ") for name in rung.effects) or "baseline"


def _ladder(rungs: tuple[Rung, ...], evidence: Evidence, baseline: float | None, width: float) -> Figure:
    held_out = any(rung.heldout_rmse is not None for rung in rungs)
    figure = Figure(figsize=(width, 1.1 + 0.29 * len(rungs)), layout="constrained")
    ax = figure.subplots()
    unit, start = Unit(""), 0.0
    if held_out:
        unit = shown(evidence.output_unit, max((r.heldout_rmse or 0 for r in rungs), default=0) or None)
        start = (baseline or 0.0) * unit.factor
    for row, rung in enumerate(rungs):
        _rung(ax, row, rung, start, rung.heldout_rmse if held_out else rung.gain, unit)
    _ladder_lines(ax, evidence, start, unit, held_out)
    ax.set_yticks(range(len(rungs)), [_short(rung_name(r), 44 if width == STYLE.wide else 24) for r in rungs])
    for label, rung in zip(ax.get_yticklabels(), rungs, strict=True):
        label.set_color(STYLE.after if rung.chosen else STYLE.ink)
        label.set_fontweight("bold" if rung.chosen else "normal")
    ax.set_ylim(len(rungs) - 0.4, -0.6)
    ax.grid(axis="y", visible=False)
    ax.tick_params(axis="y", length=0)
    ax.set_xlabel(
        f"held-out free-run error [{unit.label}]" if held_out else "gain in block cost on the training recordings"
    )
    return figure


def _rung(ax: Axes, row: int, rung: Rung, start: float, score: float | None, unit: Unit) -> None:
    """One candidate: a line from where all start to its score, or that it has none."""
    if score is None or not np.isfinite(score):
        ax.text(start, row, " not scored", va="center", color=STYLE.faint, fontsize=8.5)
        return
    end = score * unit.factor
    colour, line, dot = (STYLE.after, 2.4, 7) if rung.chosen else ("#9aa5b3", 1.6, 5)
    ax.plot([start, end], [row, row], color=colour, linewidth=line, solid_capstyle="round")
    ax.plot([end], [row], "o", color=colour, markersize=dot)


def _ladder_lines(ax: Axes, evidence: Evidence, start: float, unit: Unit, held_out: bool) -> None:
    ax.axvline(start, color=STYLE.before, linewidth=1.2)
    if held_out and np.isfinite(evidence.noise):
        ax.axvline(evidence.noise * unit.factor, color=STYLE.faint, linewidth=1.0, linestyle=(0, (3, 3)))
        ax.set_xlim(left=0)


def _short(text: str, most: int) -> str:
    return text if len(text) <= most else text[: most - 1] + "…"
