"""The page of `ers inspect`: what was read, over time, over its range and over frequency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from ers_mj.data.inspection import Inspection
from ers_mj.report import page
from ers_mj.report.display import shown
from ers_mj.report.drawing import both_widths, margins, restart_ids
from ers_mj.report.style import STYLE
from ers_mj.report.thinning import decimate

POINTS = {True: 900, False: 450}
HEADS = ("channel", ">refresh", ">lowest", ">highest", ">noise", ">quantum", ">at an end", ">blank")


def inspect_page(document: Mapping, found: Sequence[Inspection]) -> str:
    """The page as HTML, of what `ers inspect --json` prints and the recordings behind it."""
    restart_ids()
    faults = document["faults"]
    several = ("s"[: len(faults) != 1], "s"[: len(found) != 1])
    sentence = f"{len(faults)} fault{several[0]} in {len(found)} recording{several[1]}"
    counts = (("input", document["input_kind"]), ("recordings", len(found)), ("faults", len(faults)))
    tiles = [(name, page.text(value)) for name, value in counts]
    parts = [page.header("consistent", "Recordings", "ers inspect", sentence, tiles)]
    parts += [_one(one, inspection) for one, inspection in zip(document["recordings"], found)]
    return page.frame("Recordings", "consistent", "\n".join(parts))


def _one(one: Mapping, inspection: Inspection) -> str:
    lead = (
        f"{one['samples']} samples, {one['duration_s']:.4g} s at {one['rate_hz']:.5g} Hz; 95 % of the input's power"
        f" lies below {one['input_band_hz']:.3g} Hz."
    )
    rows = [(_cells(channel), "") for channel in one["channels"]]
    tells = [f"{'could tell' if t['can'] else 'cannot tell'} {t['what']}: {t['why']}" for t in one["tells"]]
    content = [
        page.listed(one["problems"]),
        page.table(HEADS, rows),
        page.figure(both_widths(lambda width: _over_time(inspection, width), "input and output over time")),
        page.figure(both_widths(lambda width: _over_range(inspection, width), "where the time is spent")),
        page.figure(both_widths(lambda width: _over_frequency(inspection, width), "power over frequency")),
        page.listed(tells),
    ]
    return page.section(page.text(one["file"]), page.text(lead), "\n".join(content))


def _cells(c: Mapping) -> tuple[str, ...]:
    numbers = (c["low"], c["high"], c["noise"], c["quantum"])
    told = [f"{x:.4g}" if x is not None else "" for x in numbers]
    return (page.text(c["name"]), f"{c['refresh_s']:.4g} s", *told, page.share(c["at_ends"]), str(c["blanks"]))


def _over_time(inspection: Inspection, width: float) -> Figure:
    r, points = inspection.record, POINTS[width == STYLE.wide]
    u, y = shown(r.input_unit), shown(r.output_unit)
    figure = Figure(figsize=(width, 4.0))
    above, below = figure.subplots(2, 1, sharex=True)
    margins(figure)
    above.plot(*decimate(r.t, y.factor * r.y, points), color=STYLE.after, linewidth=1.0)
    below.plot(*decimate(r.t, u.factor * r.u, points), color=STYLE.ink, linewidth=0.8)
    for fault in r.faults:
        if fault.region:
            above.axvspan(*fault.region, color=STYLE.shade, alpha=0.25, linewidth=0)
    above.set_ylabel(f"output [{y.label}]")
    below.set_ylabel(f"input [{u.label}]")
    below.set_xlabel("time [s]")
    return figure


def _over_range(inspection: Inspection, width: float) -> Figure:
    r = inspection.record
    y, u = shown(r.output_unit), shown(r.input_unit)
    labels = {"output": f"output [{y.label}]", "speed": f"speed [{y.label}/s]", "input": f"input [{u.label}]"}
    figure = Figure(figsize=(width, 2.4))
    axes = figure.subplots(1, 3, sharey=True)
    figure.subplots_adjust(left=0.1, right=0.98, bottom=0.25, top=0.95, wspace=0.12)
    for ax, (name, (edges, share)) in zip(axes, inspection.coverage.items()):
        factor = u.factor if name == "input" else y.factor
        ax.stairs(100 * share, factor * edges, fill=True, color=STYLE.measured)
        ax.set_xlabel(labels[name])
    axes[0].set_ylabel("time [%]")
    return figure


def _over_frequency(inspection: Inspection, width: float) -> Figure:
    f, u, y = inspection.spectrum
    figure = Figure(figsize=(width, 2.8))
    ax = figure.subplots()
    margins(figure)
    for power, colour, label in ((u, STYLE.ink, "input"), (y, STYLE.after, "output")):
        if np.max(power[1:]) > 0.0:
            ax.loglog(f[1:], power[1:] / np.max(power[1:]), color=colour, linewidth=1.0, label=label)
    ax.set_ylabel("power over its peak")
    ax.set_xlabel("frequency [Hz]")
    ax.legend(fontsize=8)
    return figure
