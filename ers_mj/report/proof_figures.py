"""The pictures of a proof as inline SVG: confusion, accuracy against visibility, reliability, error over noise floor,
time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ers_mj.proving.scoring import NO_ANSWER, NOTHING, OUTSIDE, UNEXPLAINED, class_of
from ers_mj.report.drawing import both_widths, plain_ticks
from ers_mj.report.style import HEAT, STYLE

LAST = (NOTHING, UNEXPLAINED, NO_ANSWER)


def drawn(results: Mapping, rows: Sequence[Mapping]) -> dict[str, str]:
    """Caption -> figure, of all that these cases support."""
    pictures = {}
    singles = {truth: named for truth, named in results["confusion"].items() if "+" not in truth}
    if singles:
        pictures[
            "What was concealed (rows) and what was named first (columns): cases with one effect, with none and with"
            " one outside the library. Framed: right, or of the same class."
        ] = both_widths(lambda w: _confusion(singles, w), "confusion matrix")
    if results["accuracy"]:
        pictures[
            "Single effects named right by class, against what the refitted model without them leaves, in sigmas of the"
            " noise; 95 % intervals (Wilson), each dot a case."
        ] = both_widths(lambda w: _accuracy(results["accuracy"], rows, w), "accuracy against visibility")
    if results["reliability"]:
        pictures[
            "How often what was said with a probability was so. On the diagonal the probabilities are reliable."
        ] = both_widths(lambda w: _reliability(results["reliability"], w), "reliability diagram")
    if results["error_over_floor"].get("values"):
        pictures["Held-out error of the improved model over the noise floor; one is perfect."] = both_widths(
            lambda w: _histogram(
                [("all cases", results["error_over_floor"]["values"])], "held-out error / noise floor", w
            ),
            "error over noise floor",
        )
    times = [r["cpu_s"] for r in rows if r["cpu_s"] is not None]
    if times:
        pictures["Processor time of a diagnosis."] = both_widths(
            lambda w: _histogram([("all cases", times)], "one processor [s]", w), "time a case"
        )
    return pictures


def _confusion(table: Mapping[str, Mapping[str, int]], width: float) -> Figure:
    rows, columns = _in_order(table, whole=width == STYLE.wide)
    figure = Figure(figsize=(width, 1.9 + 0.27 * len(rows)), layout="constrained")
    ax = figure.subplots()
    values = np.array([[table[r].get(c, 0) for c in columns] for r in rows], float)
    share = values / values.sum(1, keepdims=True)
    cells = {"cmap": HEAT, "vmin": 0, "vmax": 1, "shading": "nearest"}
    ax.pcolormesh(range(len(columns)), range(len(rows)), np.ma.masked_equal(share, 0.0), **cells)
    for (i, j), count in np.ndenumerate(values):
        if _is_right(rows[i], columns[j]):
            ax.plot(
                [j - 0.5, j + 0.5, j + 0.5, j - 0.5, j - 0.5],
                [i - 0.5, i - 0.5, i + 0.5, i + 0.5, i - 0.5],
                color=STYLE.after,
                linewidth=1.1,
            )
        if count:
            ax.text(j, i, f"{count:.0f}", ha="center", va="center", fontsize=8.5, color=STYLE.on_heat(share[i, j]))
    small = 8 if width == STYLE.wide else 6.5
    ax.set_xticks(range(len(columns)), [c.replace("_", " ") for c in columns], rotation=90, fontsize=small)
    ax.set_yticks(range(len(rows)), [r.replace("_", " ") for r in rows], fontsize=8)
    ax.set_xlim(-0.55, len(columns) - 0.45)
    ax.set_ylim(len(rows) - 0.45, -0.55)
    ax.grid(False)
    ax.tick_params(length=0)
    ax.spines[:].set_visible(False)
    return figure


def _in_order(table: Mapping[str, Mapping[str, int]], whole: bool) -> tuple[list[str], list[str]]:
    """Rows (concealed) and columns (named), what is no effect last; columns that nothing was named by only where there
    is room for the whole.
    """
    rows = sorted(table, key=lambda name: (name == OUTSIDE, name == NOTHING, name))
    named = {name for counts in table.values() for name in counts}
    told = named | (set(rows) - {OUTSIDE} if whole else set())
    return rows, sorted(told, key=lambda name: (name in LAST, LAST.index(name) if name in LAST else 0, name))


def _is_right(concealed: str, named: str) -> bool:
    return class_of(concealed) == class_of(named) or (concealed, named) == (OUTSIDE, UNEXPLAINED)


def _accuracy(bins: Sequence[Mapping], rows: Sequence[Mapping], width: float) -> Figure:
    least, most = 0.02, 100.0  # [sigma] that are drawn
    figure = Figure(figsize=(width, 3.4), layout="constrained")
    ax = figure.subplots()
    for b in bins:
        low, high = max(b["from_sigma"], least), b["to_sigma"] or most
        middle, share = np.sqrt(low * high), b["right"] / b["of"]
        ax.plot([low, high], [share, share], color=STYLE.after, linewidth=2.2, solid_capstyle="butt")
        ax.plot([middle, middle], b["ci95"], color=STYLE.after, linewidth=1.2)
        ax.annotate(
            f"{b['right']}/{b['of']}",
            (middle, share),
            xytext=(5, 5 if share < 0.9 else -13),
            textcoords="offset points",
            fontsize=8.5,
            color=STYLE.ink,
        )
    for r in rows:
        if r["kind"] == "single" and np.isfinite(r["visibility"]):
            fits = bool(r["named"]) and class_of(r["named"][0]) == class_of(r["labels"][0])
            ax.plot(
                [np.clip(r["visibility"], least, most)],
                [1.06 if fits else -0.06],
                "o",
                markersize=4,
                alpha=0.6,
                color=STYLE.after if fits else STYLE.before,
            )
    ax.set_xscale("log")
    ticks = [t for t in (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100) if t >= 0.8 * ax.get_xlim()[0]]
    plain_ticks(ax, ticks)
    ax.set_ylim(-0.12, 1.12)
    ax.set_yticks(np.arange(0, 1.01, 0.25))
    ax.set_xlabel("left after refit [sigma of the noise]")
    ax.set_ylabel("named right")
    return figure


def _reliability(bins: Sequence[Mapping], width: float) -> Figure:
    figure = Figure(figsize=(width, 4.4), layout="constrained")
    ax = figure.subplots()
    ax.set_aspect("equal", anchor="W")
    ax.plot([0, 1], [0, 1], color=STYLE.faint, linewidth=1.0, linestyle=(0, (3, 3)))
    x, share = [b["probability"] for b in bins], [b["right"] / b["of"] for b in bins]
    ax.plot(x, share, "o-", color=STYLE.after, linewidth=1.3)
    for b, here, p in zip(bins, share, x, strict=True):
        ax.plot([p, p], b["ci95"], color=STYLE.after, linewidth=1.2)
        left = p > 0.85
        ax.annotate(
            str(b["of"]),
            (p, here),
            xytext=(-6 if left else 6, -11),
            textcoords="offset points",
            fontsize=8.5,
            color=STYLE.ink,
            ha="right" if left else "left",
        )
    ax.set_xlim(-0.03, 1.03)
    ax.set_ylim(-0.03, 1.03)
    ax.set_xlabel("probability that was said")
    ax.set_ylabel("share that was so")
    return figure


def _histogram(groups: Sequence[tuple[str, Sequence[float]]], label: str, width: float) -> Figure:
    figure = Figure(figsize=(width, 2.6), layout="constrained")
    ax = figure.subplots()
    every = np.concatenate([np.asarray(values, float) for _, values in groups])
    low, high = 0.95 * every.min(), 1.05 * every.max()
    edges = np.geomspace(low, high, 25)
    for _, values in groups:
        ax.hist(values, bins=edges, color=STYLE.after, alpha=0.85)
    ax.margins(y=0.18)
    _line(ax, float(np.median(every)))
    ax.set_xscale("log")
    ticks = [t for t in (0.5, 0.7, 1, 1.5, 2, 3, 5, 7, 10, 15, 20, 30, 50, 70, 100, 200, 300, 1000) if low <= t <= high]
    plain_ticks(ax, ticks)
    ax.set_xlabel(label)
    ax.set_ylabel("cases")
    ax.yaxis.get_major_locator().set_params(integer=True)
    return figure


def _line(ax: Axes, median: float) -> None:
    ax.axvline(median, color=STYLE.before, linewidth=1.2)
    ax.annotate(
        f"median {median:.3g}",
        (median, 1.0),
        xycoords=("data", "axes fraction"),
        xytext=(4, -10),
        textcoords="offset points",
        fontsize=8.5,
        color=STYLE.before,
    )
