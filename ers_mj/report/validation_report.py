"""The report of a validation: where the reduced model holds, where it stops, and why.

sentence -> table -> each departure: where, curves, map -> map over play and inductance -> how it was made
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ers_mj.diagnosis.evidence import Evidence, RecordView
from ers_mj.report import maps, page
from ers_mj.report.display import NONE
from ers_mj.report.drawing import restart_ids
from ers_mj.report.traces import close_up, traces
from ers_mj.report.validity import VALID, Departure, called, degrees, departures, headline, per_cent
from ers_mj.validation.cases import GRID, Case, Validation, rms, spoken

NO_EVIDENCE = Evidence((), (), None, float("nan"), "rad", "V")


def validation_page(validation: Validation, about: Mapping[str, str]) -> str:
    """The page as HTML; `about` is told in its last lines."""
    restart_ids()
    found = departures(validation)
    kind = "missing_physics" if found else "consistent"
    sections = [_table(validation), *(_departure(d) for d in found), _play(validation)]
    footer = page.footer(f"{name} {value}" for name, value in about.items())
    body = "\n".join([_header(validation, found, kind), *sections, footer])
    return page.frame("Where the reduced model holds", kind, body)


def _header(validation: Validation, found: list[Departure], kind: str) -> str:
    plain = [case for case in validation.cases if not case.condition.departures]
    tiles = (
        [
            (
                "no play, no rod, no inductance: at most",
                f'<span class="a">{degrees(max(case.rms for case in plain))}</span>',
            )
        ]
        if plain
        else []
    )
    tiles += [
        (f"{page.text(called(d.condition))}: up to", f'<span class="b">{degrees(rms(d.worst.error_eq_5))}</span>')
        for d in found[:4]
    ]
    return page.header(kind, "Where the reduced model holds", "ers validate", headline(validation), tiles)


def _table(validation: Validation) -> str:
    inputs = list(dict.fromkeys(case.input for case in validation.cases))
    rows = []
    for condition in dict.fromkeys(case.condition for case in validation.cases):
        cases = {case.input: case for case in validation.cases if case.condition == condition}
        rows.append(((page.text(spoken(condition)), *(_cell(cases[name]) for name in inputs)), ""))
    lead = (
        "RMS deviation of the angle [°] under the same voltages, and what that is of the motion; <b>bold</b> above"
        f" {100 * VALID:.0f} %. The reduced model is Eq. (6), or Eq. (1) where the inductance is on; it never has the"
        " play or the rod."
    )
    return page.section(
        "Reduced model against MuJoCo", lead, page.table(["MuJoCo has", *(f">{name}" for name in inputs)], rows)
    )


def _cell(case: Case) -> str:
    share = case.rms / case.motion if case.motion else float("nan")
    size = degrees(case.rms)
    return (
        f"{f'<b>{size}</b>' if share > VALID else size}<br><span"
        f' class="why">{per_cent(share) if np.isfinite(share) else NONE}</span>'
    )


def _departure(departure: Departure) -> str:
    places = "\n".join(page.place(finding.as_document()) for finding in departure.findings)
    case = departure.worst
    has_play = case.with_play is not None
    labels = ("MuJoCo", "Eq. (6)", "Eq. (6) with the play" if has_play else "Eq. (1)")
    view = RecordView(case.input, False, case.t, case.u, case.mujoco, case.eq_5, _better(case))
    caption = f"The {page.text(case.input)}, where it is furthest off; the span where it does worst, enlarged."
    drawn = page.figure(traces(view, NO_EVIDENCE, labels))
    drawn += page.figure(close_up(view, NO_EVIDENCE, labels), caption)
    if departure.sines is not None:
        drawn += page.figure(
            maps.sine_map(departure.sines, VALID),
            f"Sines of 2 s. Framed: within {100 * VALID:.0f} % of the motion. Empty: Eq. (6) would turn more than "
            f"{np.degrees(GRID.most_travel):.0f}° from θ₀, or nothing moves.",
        )
    title = called(departure.condition)
    return page.section(page.text(title[0].upper() + title[1:]), "", places + drawn)


def _better(case: Case) -> np.ndarray:
    """The reduced model with what can be put into it: the play, else the inductance; NaN where neither can."""
    if case.with_play is not None:
        return case.with_play
    return case.reduced if case.condition.inductance else np.full(case.t.size, np.nan)


def _play(validation: Validation) -> str:
    if validation.play is None:
        return ""
    caption = "Multisine, constant linkage. Eq. (6), with neither, against MuJoCo with both."
    return page.section("Play and inductance together", "", page.figure(maps.play_map(validation.play), caption))
