"""Measured over simulated output, before and after, and what is left of it, as inline SVG: a recording on a page."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ers_mj.diagnosis.evidence import Evidence, RecordView
from ers_mj.report.display import Unit, noun, shown
from ers_mj.report.drawing import both_widths, margins
from ers_mj.report.style import STYLE
from ers_mj.report.thinning import decimate, largest, merged, worst_span

LABELS = ("measured", "model before", "model after")


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


def _traces(
    view: RecordView, evidence: Evidence, width: float, span: tuple[float, float] | None, labels: tuple[str, str, str]
) -> Figure:
    figure = Figure(figsize=(width, 4.9 if width == STYLE.wide else 4.7))
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1))
    margins(figure, top=0.35 if width == STYLE.wide else 0.6)
    inside = slice(None) if span is None else slice(*np.searchsorted(view.t, span))
    t, measured, before, after = (x[inside] for x in (view.t, view.measured, view.before, view.after))
    unit = shown(evidence.output_unit, largest(view.measured))
    points = 1500 if width == STYLE.wide else 700
    for x, colour, label, order in zip(
        (measured, before, after), (STYLE.measured, STYLE.before, STYLE.after), labels, (2, 3, 4), strict=True
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
        ncols=4 if width == STYLE.wide else 2,
        handlelength=1.6,
        columnspacing=1.4,
        borderaxespad=0.2,
    )
    return figure


def _residual(axes, t, measured, before, after, evidence: Evidence, unit: Unit, points: int) -> None:
    fine = shown(evidence.output_unit, largest(measured - before)) if unit.label != "mm" else unit
    noise = evidence.noise * fine.factor
    if np.isfinite(noise) and noise > 0:
        axes.axhspan(-2 * noise, 2 * noise, color="#dfe4ea", zorder=0, linewidth=0)
    for x, colour, order in ((before, STYLE.before, 2), (after, STYLE.after, 3)):
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
            begin,
            end,
            color=STYLE.shade,
            alpha=0.28,
            linewidth=0,
            zorder=0,
            label=None if labelled else "where it fails",
        )
        below.axvspan(begin, end, color=STYLE.shade, alpha=0.28, linewidth=0, zorder=0)
        labelled = True
