"""The page of `ers compare`: one table of what differs, and one picture of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure

from ers_mj.report import page
from ers_mj.report.display import NONE, interval, missing, shown
from ers_mj.report.drawing import both_widths, restart_ids
from ers_mj.report.style import STYLE

HEADS = ("what", "A", "B", "B - A, 95 %", "beyond chance")
ROW = 0.3  # height of a line of the picture [in]


def cells(line: Mapping) -> tuple[str, ...]:
    """A difference as the cells of a table, in plain text."""
    unit = shown(line["unit"], line["a"] if not isinstance(line["a"], str) else None)
    if isinstance(line["a"], bool):
        values = [{True: "yes", False: "no"}[line[side]] for side in ("a", "b")]
    else:
        values = [unit(line[side]) for side in ("a", "b")]
    judged = NONE if line["untold"] else "yes" if line["significant"] else "no"
    if line["p_value"] is not None and not line["untold"]:
        judged += f" (p {line['p_value']:.2g})"
    name = line["what"].replace("_", " ") if line["kind"] != "parameter" else line["what"]
    return name, *values, interval(line["ci95"], unit), judged


def compare_page(document: Mapping) -> str:
    """The page as HTML, of what `ers compare --json` prints."""
    restart_ids()
    lines = document["differences"]
    beyond = sum(line["significant"] for line in lines)
    tiles = [
        *(
            (f"{side.upper()}: {page.text(document[side]['name'])}", page.named(document[side]["verdict"]))
            for side in "ab"
        ),
        ("beyond chance", str(beyond)),
        ("tests", str(document["chance"]["tests"])),
    ]
    rows = [([page.text(cell) for cell in cells(line)], "chosen" if line["significant"] else "") for line in lines]
    described = "how far each parameter of B lies from that of A, with its 95 % interval"
    drawn = [line for line in lines if line["ci95"] and not all(missing(x) or x == 0 for x in (line["a"], line["b"]))]
    svg = both_widths(lambda width: _picture(drawn, width), described) if drawn else None
    caption = (
        "B - A over the larger of the two values, with its 95 % interval; what differs beyond chance is filled. An"
        " interval that reaches beyond the picture is cut at its edge."
    )
    body = [
        page.header("consistent", "Two diagnoses", "ers compare", document["sentence"], tiles),
        page.section("In one picture", "", page.figure(svg, caption)),
        page.section("What differs", page.text(document["chance"]["sentence"]) + ".", page.table(HEADS, rows)),
        page.section(
            "In words",
            "",
            page.listed(line["sentence"] for line in lines if line["significant"] or line["kind"] == "effect"),
        ),
        page.section("To be known", "", page.listed(document["notes"])),
    ]
    return page.frame("Two diagnoses", "consistent", "\n".join(body))


def _picture(lines: Sequence[Mapping], width: float) -> Figure:
    """A line for each: its difference as a share of the larger value, and the interval of that."""
    figure = Figure(figsize=(width, 0.7 + ROW * len(lines)))
    ax = figure.subplots()
    height = figure.get_size_inches()[1]
    figure.subplots_adjust(left=1.9 / width, right=1.0 - 0.15 / width, bottom=0.5 / height, top=1.0 - 0.1 / height)
    for row, line in enumerate(lines):
        size = max(abs(line["a"]), abs(line["b"]))
        low, high = (100.0 * end / size for end in line["ci95"])
        colour = STYLE.before if line["significant"] else STYLE.faint
        ax.plot([low, high], [row, row], color=colour, linewidth=1.6)
        face = colour if line["significant"] else "white"
        ax.plot(100.0 * (line["b"] - line["a"]) / size, row, "o", color=colour, markerfacecolor=face, markersize=5)
    ax.axvline(0.0, color=STYLE.ink, linewidth=0.8)
    edge = max(10.0, *(110.0 * abs(line["b"] - line["a"]) / max(abs(line["a"]), abs(line["b"])) for line in lines))
    ax.set_xlim(-1.5 * edge, 1.5 * edge)
    ax.set_ylim(len(lines) - 0.5, -0.5)
    ax.set_yticks(range(len(lines)), [cells(line)[0] for line in lines])
    ax.set_xlabel("B - A [% of the larger]")
    return figure
