"""The page of `ers batch`: a fleet at a glance: every servo, what is missing in how many, how far units differ."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from urllib.parse import quote

import numpy as np
from matplotlib.figure import Figure

from ers_mj.report import page
from ers_mj.report.display import NONE, missing, shown
from ers_mj.report.display import figure as digits
from ers_mj.report.drawing import both_widths, restart_ids
from ers_mj.report.style import STYLE

VERDICTS = {
    "consistent": "consistent",
    "parameters_only": "other parameters",
    "missing_physics": "missing physics",
    "unexplained": "unexplained",
}
NAMED = 60  # servos up to which each has its name on the picture


def headline(rows: Sequence[Mapping]) -> str:
    """One sentence."""
    verdicts = Counter(row["verdict"] for row in rows)
    told = [f"{verdicts[key]} {words}" for key, words in VERDICTS.items() if verdicts[key]]
    told += [f"{verdicts['']} without an answer"] if verdicts[""] else []
    return f"{len(rows)} servo{'s'[: len(rows) != 1]}: {', '.join(told)}."


def batch_page(rows: Sequence[Mapping], documents: Mapping[str, Mapping], made_by: str, made_on: str) -> str:
    """The page as HTML, of the rows and every diagnosis behind them."""
    restart_ids()
    tiles = [(words, str(n)) for key, words in VERDICTS.items() if (n := sum(r["verdict"] == key for r in rows))]
    failed = sum(bool(row["error"]) for row in rows)
    tiles += [("without an answer", str(failed))] if failed else []
    judged = [row for row in rows if row["heldout_after"] is not None and row["noise_floor"]]
    spread = _spread(documents)
    body = [
        page.header("consistent", "A fleet", "ers batch", headline(rows), tiles),
        page.section("At a glance", "", page.figure(_errors(judged), ERRORS)),
        page.section("What is missing", "", _effects(rows)),
        page.section("From unit to unit", SPREAD, page.figure(_units(spread), UNITS) + _table(spread)),
        page.section("Every servo", "", _servos(rows)),
        page.footer(filter(None, [made_by, made_on])),
    ]
    return page.frame("A fleet", "consistent", "\n".join(body))


ERRORS = (
    "Held-out error of each servo over its noise floor: without what is named (open) and with it (filled). At 1 the"
    " noise is all that is left."
)
SPREAD = (
    "Parameters that most of the servos can tell. The last column is how far units differ beyond what their intervals"
    " account for: standard deviation, as a share of the median."
)
UNITS = "Each servo's value over the median of all."


def _errors(rows: Sequence[Mapping]) -> str | None:
    if not rows:
        return None
    return both_widths(lambda width: _draw_errors(rows, width), "held-out error of each servo over its noise floor")


def _draw_errors(rows: Sequence[Mapping], width: float) -> Figure:
    each = 0.24 if len(rows) <= NAMED else 0.05  # [in]
    figure = Figure(figsize=(width, min(0.8 + each * len(rows), 40.0)))
    ax, height = figure.subplots(), figure.get_size_inches()[1]
    figure.subplots_adjust(left=1.5 / width, right=1.0 - 0.15 / width, bottom=0.5 / height, top=1.0 - 0.1 / height)
    places = np.arange(len(rows))
    after = np.array([row["heldout_after"] / row["noise_floor"] for row in rows])
    known = [missing(row["heldout_before"]) for row in rows]
    before = np.array([a if m else r["heldout_before"] / r["noise_floor"] for r, a, m in zip(rows, after, known)])
    ax.hlines(places, after, before, color=STYLE.measured, linewidth=1.4)
    ax.plot(before, places, "o", color=STYLE.before, markerfacecolor="white", markersize=5)
    ax.plot(after, places, "o", color=STYLE.after, markersize=5)
    ax.axvline(1.0, color=STYLE.ink, linewidth=0.8)
    ax.set_xscale("log")
    ax.set_ylim(len(rows) - 0.5, -0.5)
    few = len(rows) <= NAMED
    ax.set_yticks(places if few else [], [_short(row["name"]) for row in rows] if few else [])
    ax.set_xlabel("error over noise floor")
    return figure


def _short(name: str, most: int = 18) -> str:
    return name if len(name) <= most else name[: most - 1] + "…"


def _effects(rows: Sequence[Mapping]) -> str:
    """What is named in how many servos."""
    named: dict[str, list[str]] = {}
    for row in rows:
        for effect in filter(None, row["effects"].split(";")):
            named.setdefault(effect, []).append(row["name"])
    lines = sorted(named.items(), key=lambda item: -len(item[1]))
    told = lambda names: page.text(", ".join(names[:12]) + (f" and {len(names) - 12} more" if len(names) > 12 else ""))
    return page.table(
        ["effect", ">servos", "which"], [((page.named(e), str(len(names)), told(names)), "") for e, names in lines]
    )


def _servos(rows: Sequence[Mapping]) -> str:
    lines = []
    for row in rows:
        over = row["heldout_after"] / row["noise_floor"] if row["heldout_after"] and row["noise_floor"] else None
        name = page.text(row["name"])
        link = name if row["error"] else f'<a href="{quote(row["name"])}/report.html">{name}</a>'
        verdict = page.text(VERDICTS.get(row["verdict"], "no answer"))
        what = page.text(row["error"] or row["effects"].replace("_", " ").replace(";", ", ") or NONE)
        lines.append(((link, verdict, NONE if over is None else digits(over), what), "untold" if row["error"] else ""))
    return page.table(["servo", "verdict", ">error / floor", "effects"], lines)


# -- from unit to unit ------------------------------------------------------------------------------------------------

Spread = dict[tuple[str, str], np.ndarray]  # (name, unit) -> values, low and high ends (3, M)


def _spread(documents: Mapping[str, Mapping]) -> Spread:
    """Parameters that at least two thirds of the servos can tell, and three servos at that."""
    found: dict[tuple[str, str], list] = {}
    for document in documents.values():
        seen = set()
        for name, entry in (document.get("parameters") or {}).items():
            value, ends = entry.get("value"), entry.get("ci95") or (None, None)
            if value is None or None in ends or (value, *ends) in seen:
                continue
            seen.add((value, *ends))
            found.setdefault((name, entry.get("unit") or ""), []).append((value, *ends))
    least = max(3, 2 * len(documents) / 3)
    return {key: np.array(rows, float).T for key, rows in found.items() if len(rows) >= least}


def _units(spread: Spread) -> str | None:
    drawn = {name: x[0] / np.median(x[0]) for (name, _), x in spread.items() if np.median(x[0])}
    if not drawn:
        return None
    return both_widths(lambda width: _draw_units(drawn, width), "each servo's parameters over the median of all")


def _draw_units(drawn: Mapping[str, np.ndarray], width: float) -> Figure:
    figure = Figure(figsize=(width, 0.8 + 0.34 * len(drawn)))
    ax, height = figure.subplots(), figure.get_size_inches()[1]
    figure.subplots_adjust(left=1.3 / width, right=1.0 - 0.15 / width, bottom=0.5 / height, top=1.0 - 0.1 / height)
    for row, x in enumerate(drawn.values()):
        ax.plot(x, np.full(x.size, row), "|", color=STYLE.after, markersize=11, markeredgewidth=1.4)
    ax.axvline(1.0, color=STYLE.ink, linewidth=0.8)
    every = np.concatenate(list(drawn.values()))
    ax.set_xlim(np.clip(every.min(), 0.0, 0.9), np.clip(every.max(), 1.1, 3.0))
    ax.set_ylim(len(drawn) - 0.5, -0.5)
    ax.set_yticks(range(len(drawn)), list(drawn))
    ax.set_xlabel("value over the median")
    return figure


def _table(spread: Spread) -> str:
    rows = []
    for (name, unit), (values, low, high) in spread.items():
        as_shown = shown(unit, float(np.median(values)))
        ends = np.quantile(values, (0.05, 0.95))
        told = [as_shown(float(np.median(values))), f"{as_shown.bare(ends[0])} … {as_shown.bare(ends[1])}"]
        rows.append(((page.text(name), str(values.size), *told, _beyond(values, low, high)), ""))
    return page.table(["parameter", ">servos", ">median", ">5 % … 95 %", ">units differ by"], rows)


def _beyond(values: np.ndarray, low: np.ndarray, high: np.ndarray) -> str:
    """Standard deviation of the units beyond that of their estimates, as a share of the median."""
    own = float(np.median(((high - low) / 3.92) ** 2))  # a 95 % interval is 3.92 standard errors wide
    middle = float(np.median(values))
    beyond = max(float(np.var(values, ddof=1)) - own, 0.0) ** 0.5
    return page.share(beyond / abs(middle)) if middle else NONE
