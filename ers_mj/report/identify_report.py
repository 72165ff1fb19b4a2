"""The report of `ers identify`: the parameters, what could not be told and why, how well the model runs, and the way
there.

sentence -> parameters -> combinations and what is not told -> recordings -> search and profiles -> how it was made
"""

from __future__ import annotations

from collections.abc import Mapping

from ers_mj.identification.answer import Identified, Row
from ers_mj.report import identify_figures, page
from ers_mj.report.diagnosis_tables import parameters
from ers_mj.report.display import NONE, pretty, shown
from ers_mj.report.display import figure as digits
from ers_mj.report.drawing import restart_ids

HEADS = ("parameter", ">value", ">95 % interval", ">datasheet", "")


def identify_page(document: Mapping, found: Identified) -> str:
    """The page as HTML, of what `ers identify --json` prints and the search behind it."""
    restart_ids()
    kind = "parameters_only" if found.explains else "unexplained"
    sections = [
        _parameters(found),
        *(_recording(found, k, document["data"]["output_unit"]) for k in range(len(found.traces))),
        _search(found),
        page.section("Be careful", "", page.listed([*found.warnings, *document["data"]["problems"]])),
    ]
    body = "\n".join([_header(document, found, kind), *sections, _footer(document)])
    return page.frame("Identified parameters", kind, body)


def _header(document: Mapping, found: Identified, kind: str) -> str:
    left = shown(document["data"]["output_unit"])
    sigma = max(t.sigma for t in found.traces)
    tiles = [
        ("what the model leaves", f'<span class="a">{left(sigma * found.misfit**0.5)}</span>'),
        ("noise", left(sigma)),
        ("told", f"{found.structure.rank} of {len(found.structure.names)}"),
        ("simulations", str(found.evaluations)),
    ]
    return page.header(kind, "Identified parameters", "ers identify", document["sentence"], tiles)


def _parameters(found: Identified) -> str:
    rows = [(_cells(row), "" if row.identifiable else "untold") for row in found.rows]
    lead = (
        "Intervals: the wider of Fisher's information and resampled pieces of the recordings; for what is weak the"
        " profile likelihood. A letter that the recordings cannot tell has no number, the combination that they can has"
        " a row of its own."
    )
    return page.section("Parameters", lead, page.table(HEADS, rows))


def _cells(row: Row) -> tuple[str, ...]:
    unit = shown(row.unit) if row.name == "theta_0" else None

    def number(x):
        return NONE if x is None else unit.bare(x, 4) if unit else digits(x, 4)

    low, high = row.ci95
    label = unit.label if unit else pretty(row.unit)
    ends = NONE if low is None else f"{number(low)} … {number(high)}"
    return (
        f'{page.text(row.name)} <span class="why">{page.text(label)}</span>',
        number(row.value),
        ends,
        number(row.datasheet),
        f'<span class="why">{page.text(row.why)}</span>',
    )


def _recording(found: Identified, k: int, unit: str) -> str:
    trace = found.traces[k]
    return page.section(
        f"Recording {page.text(trace.name)}",
        "",
        page.figure(identify_figures.compared(trace, found.predicted[k], unit)),
    )


def _search(found: Identified) -> str:
    drawn = page.figure(
        identify_figures.descent(found),
        f"The search by {page.text(found.settings.method)}: {found.minimum.evaluations} evaluations.",
    )
    weak = page.figure(
        identify_figures.profiles(found.profiles),
        "Profiles: the misfit where one parameter is held and all others are fitted again; dashed the 95 % level.",
    )
    return page.section("Search", "", drawn + weak)


def _footer(document: Mapping) -> str:
    told = [
        f"method {document['method']}",
        f"plant {document['plant']}",
        f"seed {document['seed']}",
        f"{document['wall_s']:.2g} s",
        *(f"{name} {value}" for name, value in document["versions"].items()),
    ]
    return page.footer(told)


def loop_page(document: Mapping) -> str:
    """The page of a position loop's numbers."""
    restart_ids()
    kind = "parameters_only" if document["explains"] else "unexplained"
    left = [("simulations", str(document["evaluations"]))]
    head = page.header(kind, "Identified parameters", "ers identify", document["sentence"], left)
    problems = page.section("Be careful", "", page.listed(document["data"]["problems"]) or "<p>Nothing.</p>")
    return page.frame("Identified parameters", kind, "\n".join([head, parameters(document), problems]))
