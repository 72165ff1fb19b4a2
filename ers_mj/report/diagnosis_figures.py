"""The report's figures as inline SVG: each (evidence) -> text, drawn once wide and once narrow for a phone."""

from __future__ import annotations

import io
import itertools
import re
from collections.abc import Callable, Iterator

import matplotlib
import numpy as np
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from ers_mj.diagnosis.evidence import Evidence, RecordView, ResidualMap, Rung
from ers_mj.diagnosis.mismatch_spectrum import Mismatch
from ers_mj.report.display import Unit, shown

MEASURED, BEFORE, AFTER = "#a3afbc", "#d9762b", "#0b7a75"
SHADE, GRID, INK, FAINT, DISTORTION = "#f3c64e", "#e6e9ee", "#3b4654", "#8b95a3", "#a83a1e"
HEAT = LinearSegmentedColormap.from_list("heat", ["#f4f6f8", "#f6d9a8", "#e2893a", "#a83a1e", "#4c1512"], N=32)
WIDE, NARROW = 9.8, 4.5  # [in]
STYLE = {
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 9.5,
    "axes.edgecolor": "#c3cad3",
    "axes.labelcolor": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.grid": True,
    "grid.color": GRID,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "path.simplify": True,
    "svg.hashsalt": "ers",
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
}
MOST_RUNGS = 16
LABELS = ("measured", "model before", "model after")
CLOSE_UP = 0.08  # share of a recording that the close-up shows
_serial = itertools.count(1)


def both_widths(draw: Callable[[float], Figure], described: str) -> str:
    """One figure drawn for a desktop and for a phone; the page's style shows the one that fits."""
    with matplotlib.rc_context(STYLE):
        wide, narrow = _svg(draw(WIDE), described), _svg(draw(NARROW), described)
    return f'<div class="wide">{wide}</div><div class="narrow">{narrow}</div>'


def _svg(figure: Figure, described: str) -> str:
    """The figure as an SVG element: scalable, its ids unique in the page, no address in it."""
    FigureCanvasSVG(figure)
    out = io.StringIO()
    figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = out.getvalue()
    text = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.S)
    text = re.sub(r'\sxmlns(:\w+)?="[^"]*"', "", text)
    mark = f"f{next(_serial)}-"
    text = re.sub(r'\bid="', f'id="{mark}', text)
    text = re.sub(r'href="#', f'href="#{mark}', text).replace("url(#", f"url(#{mark}")
    text = re.sub(
        r'<svg [^>]*?viewBox="([^"]+)"[^>]*>', rf'<svg viewBox="\1" role="img" aria-label="{described}">', text, count=1
    )
    return re.sub(r"\n\s*", "\n", text)


def margins(figure: Figure, top: float = 0.1) -> None:
    """Room for labels about the axes, in inches: a layout that measures every text takes longer than all the
    drawing.
    """
    width, height = figure.get_size_inches()
    figure.subplots_adjust(
        left=0.8 / width, right=1.0 - 0.12 / width, bottom=0.5 / height, top=1.0 - top / height, hspace=0.1
    )
    for ax in figure.axes:
        ax.yaxis.set_label_coords(-0.62 / (width - 0.92), 0.5)


def rect(figure: Figure, left: float, bottom: float, right: float, top: float) -> tuple[float, float, float, float]:
    """Where axes lie in a figure, from distances in inches to its left and lower edge; a negative ``right`` or ``top``
    to the opposite one.
    """
    width, height = figure.get_size_inches()
    right, top = right if right > 0 else width + right, top if top > 0 else height + top
    return left / width, bottom / height, (right - left) / width, (top - bottom) / height


def decimate(t: np.ndarray, x: np.ndarray, points: int) -> tuple[np.ndarray, np.ndarray]:
    """t and x (N,) thinned to the lowest and the highest value of each of points/2 spans; a span of NaN stays a
    hole.
    """
    bins = points // 2
    if t.size <= points:
        return t, x
    edges = np.linspace(0, t.size, bins + 1).astype(int)
    starts = edges[:-1]
    low = np.minimum.reduceat(np.where(np.isfinite(x), x, np.inf), starts)
    high = np.maximum.reduceat(np.where(np.isfinite(x), x, -np.inf), starts)
    empty = ~np.isfinite(low)
    rising = x[edges[1:] - 1] >= x[starts]
    first, second = np.where(rising, low, high), np.where(rising, high, low)
    first[empty], second[empty] = np.nan, np.nan
    middle = t[(edges[:-1] + edges[1:] - 1) // 2]
    return np.column_stack([t[starts], middle]).ravel(), np.column_stack([first, second]).ravel()


# -- traces -------------------------------------------------------------------------------------------------------


def traces(view: RecordView, evidence: Evidence, labels: tuple[str, str, str] = LABELS) -> str:
    """Measured against simulated before and after (so called in `labels`), the residual below on the same time axis."""
    return both_widths(
        lambda width: _traces(view, evidence, width, None, labels), "measured and simulated output over time"
    )


def close_up(view: RecordView, evidence: Evidence, labels: tuple[str, str, str] = LABELS) -> str | None:
    """The same over the span where the model before does worst; None where the recording is short."""
    span = worst_span(view)
    if span is None:
        return None
    return both_widths(lambda width: _traces(view, evidence, width, span, labels), "the same, the worst span enlarged")


def worst_span(view: RecordView) -> tuple[float, float] | None:
    """The span [s] of CLOSE_UP of the recording in which the squared residual before is largest."""
    n = max(int(CLOSE_UP * view.t.size), 60)
    if view.t.size < 6 * n:
        return None
    error = np.nan_to_num(view.measured - view.before) ** 2
    total = np.concatenate([[0.0], np.cumsum(error)])
    begin = int(np.argmax(total[n:] - total[:-n]))
    begin = min(max(begin - n // 4, 0), view.t.size - int(1.5 * n) - 1)
    return float(view.t[begin]), float(view.t[begin + int(1.5 * n)])


def _traces(
    view: RecordView, evidence: Evidence, width: float, span: tuple[float, float] | None, labels: tuple[str, str, str]
) -> Figure:
    figure = Figure(figsize=(width, 4.9 if width == WIDE else 4.7))
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1))
    margins(figure, top=0.35 if width == WIDE else 0.6)
    inside = slice(None) if span is None else slice(*np.searchsorted(view.t, span))
    t, measured, before, after = (x[inside] for x in (view.t, view.measured, view.before, view.after))
    unit = shown(evidence.output_unit, _size(view.measured))
    points = 1500 if width == WIDE else 700
    for x, colour, label, order in zip(
        (measured, before, after), (MEASURED, BEFORE, AFTER), labels, (2, 3, 4), strict=True
    ):
        if np.isfinite(x).any():
            above.plot(
                *decimate(t, x * unit.factor, points),
                color=colour,
                label=label,
                zorder=order,
                linewidth=3.0 if order == 2 else 1.2,
            )
    _residual(below, t, measured, before, after, evidence, unit, points)
    shade(above, below, view.shaded, t)
    above.set_ylabel(f"{noun(evidence.output_unit)} [{unit.label}]")
    below.set_xlabel("time [s]")
    above.margins(x=0)
    handles, labels = above.get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        loc="upper left",
        ncols=4 if width == WIDE else 2,
        handlelength=1.6,
        columnspacing=1.4,
        borderaxespad=0.2,
    )
    return figure


def _residual(axes, t, measured, before, after, evidence: Evidence, unit: Unit, points: int) -> None:
    fine = shown(evidence.output_unit, _size(measured - before)) if unit.label != "mm" else unit
    noise = evidence.noise * fine.factor
    if np.isfinite(noise) and noise > 0:
        axes.axhspan(-2 * noise, 2 * noise, color="#dfe4ea", zorder=0, linewidth=0)
    for x, colour, order in ((before, BEFORE, 2), (after, AFTER, 3)):
        if np.isfinite(x).any():
            axes.plot(*decimate(t, (measured - x) * fine.factor, points), color=colour, linewidth=1.0, zorder=order)
    axes.set_ylabel(f"residual [{fine.label}]")
    axes.margins(x=0)


def shade(above, below, spans: tuple[tuple[float, float], ...], t: np.ndarray) -> None:
    """The located region over both axes, spans that touch at this width drawn as one."""
    if not t.size:
        return
    closest = (t[-1] - t[0]) / 600
    labelled = False
    for begin, end in merged(spans, closest):
        if end < t[0] or begin > t[-1]:
            continue
        begin, end = max(begin, t[0]), min(max(end, begin + closest), t[-1])
        above.axvspan(
            begin, end, color=SHADE, alpha=0.28, linewidth=0, zorder=0, label=None if labelled else "where it fails"
        )
        below.axvspan(begin, end, color=SHADE, alpha=0.28, linewidth=0, zorder=0)
        labelled = True


def merged(spans: tuple[tuple[float, float], ...], closest: float) -> Iterator[tuple[float, float]]:
    """Spans in order, those nearer than `closest` joined."""
    current = None
    for begin, end in sorted(spans):
        if current is not None and begin <= current[1] + closest:
            current = (current[0], max(current[1], end))
            continue
        if current is not None:
            yield current
        current = (begin, end)
    if current is not None:
        yield current


def noun(output_unit: str) -> str:
    """What the output is called."""
    return {"rad": "angle", "m": "position"}.get(output_unit, "output")


def _size(x: np.ndarray) -> float:
    return float(np.nanmax(np.abs(x))) if np.isfinite(x).any() else 0.0


# -- the map of residuals ------------------------------------------------------------------------------------------


def residual_map(residuals: ResidualMap, evidence: Evidence) -> str:
    """Rms residual over (angle, speed), before and after on one scale of colour."""
    return both_widths(
        lambda width: _map(residuals, evidence, width), "rms residual over angle and speed, before and after"
    )


def _map(residuals: ResidualMap, evidence: Evidence, width: float) -> Figure:
    wide = width == WIDE
    figure = Figure(figsize=(width, 3.5 if wide else 6.2))
    places = (
        ((0.8, 0.55, 4.65, -0.3), (4.85, 0.55, 8.7, -0.3))
        if wide
        else ((0.8, 3.85, -0.12, -0.3), (0.8, 1.35, -0.12, 3.5))
    )
    axes = [figure.add_axes(rect(figure, *place)) for place in places]
    axes[1].sharex(axes[0])
    axes[1].sharey(axes[0])
    axes[1 if wide else 0].tick_params(labelleft=not wide, labelbottom=wide)
    angle, speed = shown(evidence.output_unit, _size(residuals.angle_edges)), shown(f"{evidence.output_unit}/s")
    if angle.label == "mm":
        speed = Unit("mm/s", 1e3)
    size = shown(evidence.output_unit, _size(residuals.rms_before))
    values = [x * size.factor for x in (residuals.rms_before, residuals.rms_after)]
    top = max((float(np.nanquantile(x, 0.98)) for x in values if np.isfinite(x).any()), default=1.0) or 1.0
    for ax, x, title in zip(axes, values, ("before", "after"), strict=True):
        ax.set_facecolor("white")
        ax.grid(False)
        mesh = ax.pcolormesh(
            residuals.angle_edges * angle.factor,
            residuals.speed_edges * speed.factor,
            np.ma.masked_invalid(x.T),
            cmap=HEAT,
            vmin=0,
            vmax=top,
            edgecolors="white",
            linewidth=0.4,
        )
        ax.axhline(0, color=FAINT, linewidth=0.6)
        ax.set_title(title, color=BEFORE if title == "before" else AFTER, fontweight="bold")
    for ax in axes if wide else axes[1:]:
        ax.set_xlabel(f"{noun(evidence.output_unit)} [{angle.label}]")
    for ax in axes[:1] if wide else axes:
        ax.set_ylabel(f"speed [{speed.label}]")
        ax.yaxis.set_label_coords(-0.62 / (ax.get_position().width * width), 0.5)
    scale = figure.add_axes(rect(figure, *((8.85, 0.55, 8.99, -0.3) if wide else (0.8, 0.6, -0.12, 0.72))))
    bar = figure.colorbar(mesh, cax=scale, orientation="vertical" if wide else "horizontal", extend="max")
    bar.set_label(f"rms residual [{size.label}]", color=INK)
    bar.outline.set_visible(False)
    return figure


# -- the error over frequency --------------------------------------------------------------------------------------


def spectrum(found: Mismatch, evidence: Evidence) -> str:
    """The error's amplitude over frequency with what is linear in it and what is not, and the gap between measured and
    simulated motion.
    """
    return both_widths(
        lambda width: _spectrum(found, evidence, width), "the error over frequency, and measured over simulated motion"
    )


def _spectrum(found: Mismatch, evidence: Evidence, width: float) -> Figure:
    wide = width == WIDE
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
        (found.motion, MEASURED, "motion", 2.6),
        (found.error, BEFORE, "error", 1.6),
        (found.linear, AFTER, "linear in it", 1.2),
        (found.distortion, DISTORTION, "distortion in it", 1.2),
        (found.noise, FAINT, "noise", 1.0),
    ):
        levels.loglog(
            f, unit.factor * np.sqrt(np.where(x > 0, x, np.nan) * step), color=colour, label=label, linewidth=line
        )
    bottom = float(np.sqrt(found.noise.min() * step)) * unit.factor
    levels.set_ylim(bottom=0.2 * bottom)
    levels.set_ylabel(f"rms in {step:.2g} Hz [{unit.label}]")
    levels.set_xlabel("frequency [Hz]")
    sure = found.response.sure & found.beyond
    size.semilogx(f[sure], 20 * np.log10(np.abs(found.response.g[sure])), ".-", color=INK, linewidth=0.8)
    phase.semilogx(f[sure], np.degrees(np.unwrap(np.angle(found.response.g[sure]))), ".-", color=INK, linewidth=0.8)
    for ax, label in ((size, "size [dB]"), (phase, "phase [°]")):
        ax.axhline(0, color=FAINT, linewidth=0.8)
        ax.set_ylabel(label)
    size.set_title("measured over simulated motion", color=INK)
    phase.set_xlabel("frequency [Hz]")
    phase.set_xlim(f[0], f[-1])
    ticks = [x for decade in range(-3, 5) for x in np.array([1.0, 2.0, 5.0]) * 10.0**decade if f[0] <= x <= f[-1]]
    for ax in (levels, size, phase):
        ax.set_xticks(ticks, [f"{x:g}" for x in ticks])
        ax.xaxis.minorticks_off()
        ax.axvspan(*found.region, color=SHADE, alpha=0.28, linewidth=0, zorder=0)
        ax.yaxis.set_label_coords(-0.62 / (ax.get_position().width * width), 0.5)
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
    unit = (
        shown(evidence.output_unit, max((r.heldout_rmse or 0 for r in rungs), default=0) or None)
        if held_out
        else Unit("")
    )
    start = (baseline or 0.0) * unit.factor if held_out else 0.0
    for row, rung in enumerate(rungs):
        x = rung.heldout_rmse if held_out else rung.gain
        colour = AFTER if rung.chosen else "#9aa5b3"
        if x is None or not np.isfinite(x):
            ax.text(start, row, " not scored", va="center", color=FAINT, fontsize=8.5)
            continue
        ax.plot(
            [start, x * unit.factor],
            [row, row],
            color=colour,
            linewidth=2.4 if rung.chosen else 1.6,
            solid_capstyle="round",
        )
        ax.plot([x * unit.factor], [row], "o", color=colour, markersize=7 if rung.chosen else 5)
    _ladder_lines(ax, evidence, start, unit, held_out)
    ax.set_yticks(range(len(rungs)), [_short(rung_name(r), 44 if width == WIDE else 24) for r in rungs])
    for label, rung in zip(ax.get_yticklabels(), rungs, strict=True):
        label.set_color(AFTER if rung.chosen else INK)
        label.set_fontweight("bold" if rung.chosen else "normal")
    ax.set_ylim(len(rungs) - 0.4, -0.6)
    ax.grid(axis="y", visible=False)
    ax.tick_params(axis="y", length=0)
    ax.set_xlabel(
        f"held-out free-run error [{unit.label}]" if held_out else "gain in block cost on the training recordings"
    )
    return figure


def _ladder_lines(ax, evidence: Evidence, start: float, unit: Unit, held_out: bool) -> None:
    ax.axvline(start, color=BEFORE, linewidth=1.2)
    if held_out and np.isfinite(evidence.noise):
        ax.axvline(evidence.noise * unit.factor, color=FAINT, linewidth=1.0, linestyle=(0, (3, 3)))
        ax.set_xlim(left=0)


def _short(text: str, most: int) -> str:
    return text if len(text) <= most else text[: most - 1] + "…"


def restart_ids() -> None:
    """Number the figures from 1 again, so that the same diagnosis gives the same page."""
    global _serial
    _serial = itertools.count(1)
