"""Sections of the diagnosis's page that are tables: the candidates, the errors before and after, the parameters, and
what differs between recordings.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ers_mj.diagnosis.evidence import Evidence, Rung
from ers_mj.report import charts, page
from ers_mj.report.diagnosis_charts import MOST_RUNGS, has_totals, rung_name
from ers_mj.report.display import NONE, Unit, figure, interval, measured, missing, shown

FITS = (
    ("train", "Training", "the recordings that the model was fitted to", "nothing was scored on them"),
    ("heldout", "Held out", "nothing touched beforehand", "no recording could be held out"),
    (
        "recalibrated",
        "Recalibrated",
        "record state fitted on the first 30 %, scored on the rest",
        "no record state was refitted",
    ),
    ("mujoco_heldout", "Held out, MuJoCo", "the same through the MuJoCo plant", "the MuJoCo plant was not run"),
)


def candidates(evidence: Evidence, unit: Unit) -> str:
    """The section of everything that was tried, as a table, and as a figure where costs can be told beside each other;
    errors in this unit.
    """
    if not evidence.ladder:
        return ""
    lead = (
        "Every candidate was fitted in simulation. Gain is how much it lowers the robust cost of its round, z how"
        " surely, paired by blocks of time, numbers how many it adds."
    )
    drawn = ""
    if has_totals(evidence.ladder):
        lead += " The chart shows what each takes off the baseline’s cost."
        drawn = charts.place(
            "ladder", "the candidates and what each takes off the cost; the same stands in the table below"
        )
    heads = ["candidate", f">held-out error [{page.text(unit.label)}]", ">gain", ">z", ">numbers", "note"]
    table = page.table(heads, [(_rung(rung, unit), "chosen" if rung.chosen else "") for rung in evidence.ladder])
    if len(evidence.ladder) > MOST_RUNGS:
        table = f"<details><summary>All {len(evidence.ladder)} candidates as a table</summary>{table}</details>"
    return page.section("The candidates", lead, drawn + table)


def _rung(rung: Rung, unit: Unit) -> tuple[str, ...]:
    gain = NONE if missing(rung.gain) else figure(rung.gain)
    z = NONE if missing(rung.z) else f"{rung.z:.1f}".replace("-", "−")
    return (
        page.text(rung_name(rung)),
        unit.bare(rung.heldout_rmse),
        gain,
        z,
        str(rung.parameters),
        page.text(rung.note),
    )


def trail(document: Mapping) -> str:
    """The section of what the selection did, move by move."""
    rows = [(_move(move), "chosen" if move.get("accepted") else "") for move in document.get("trail") or ()]
    table = page.table(["move", "before", "after", ">gain", "because"], rows)
    lead = "What was compared round by round, what was accepted and why; gain is how much it lowers the robust cost."
    return page.section("How it was decided", lead, table)


def _move(move: Mapping) -> tuple[str, ...]:
    before, after = (
        ", ".join(page.named(name) for name in move.get(key) or ()) or "baseline" for key in ("before", "after")
    )
    after = after if move.get("accepted") else "as before"
    return page.text(move.get("kind")), before, after, figure(move.get("gain")), page.text(move.get("because"))


def fit_table(document: Mapping, unit: Unit) -> str:
    """The section of errors before and after, in this unit."""
    fit = document.get("fit") or {}
    label = page.text(unit.label)
    told = "".join(f'<p class="note">{page.text(x)}</p>' for key, x in fit.items() if key.endswith("_from"))
    kind, how = measured(fit)
    table = page.table(
        [f"{kind} rms error", f">before [{label}]", f">after [{label}]", ">after/noise", ""],
        [(cells, "") for cells in (*_known_fits(fit, unit), *_other_fits(fit, unit))],
    )
    lead = f"Root-mean-square error from the first sample on. {page.text(how)}"
    return page.section("How well it fits", lead, table + told)


def _known_fits(fit: Mapping, unit: Unit) -> Iterator[tuple[str, ...]]:
    """A row for each of FITS, those through MuJoCo only where they were scored, and the noise."""
    noise = fit.get("noise_floor_rad")
    for key, title, what, why in FITS:
        before, after = fit.get(f"{key}_rmse_before_rad"), fit.get(f"{key}_rmse_after_rad")
        if missing(before) and missing(after):
            if key.startswith("mujoco"):
                continue
            what = f"{NONE} {why}"
        yield title, unit.bare(before), unit.bare(after), _times(after, noise), f'<span class="why">{what}</span>'
    yield "Noise floor", unit.bare(noise), "", "", '<span class="why">of the sensor, from the recordings</span>'


def _other_fits(fit: Mapping, unit: Unit) -> Iterator[tuple[str, ...]]:
    """A row for every other number that the document has under `fit`."""
    known = {f"{key}_rmse_{when}_rad" for key, *_ in FITS for when in ("before", "after")} | {"noise_floor_rad"}
    for key, x in fit.items():
        if key not in known and not missing(x):
            is_error = key.endswith("_rad")
            yield page.named(key.removesuffix("_rad")), "", unit.bare(x) if is_error else figure(x), "", ""


def _times(x: float | None, noise: float | None) -> str:
    return NONE if missing(x) or missing(noise) or noise <= 0 else f"{figure(x / noise, 2)}×"


def parameters(document: Mapping) -> str:
    """The section of the improved model's parameters beside the datasheet's."""
    rows = [_parameter(name, entry) for name, entry in (document.get("parameters") or {}).items()]
    heads = ["parameter", ">value", ">95 % interval", "unit", ">datasheet", ">change", ""]
    lead = "Of the improved model, fitted to the training recordings."
    return page.section("Parameters", lead, page.table(heads, rows))


def _parameter(name: str, entry: Mapping) -> tuple[tuple[str, ...], str]:
    value, sheet = entry.get("value"), entry.get("datasheet")
    unit = shown(entry.get("unit"), value if not missing(value) else sheet)
    told = entry.get("identifiable") is not False
    change = (
        NONE
        if missing(value) or missing(sheet) or sheet == 0
        else f"{100 * (value / sheet - 1):+.1f} %".replace("-", "−")
    )
    word = "" if told else '<span class="why">not identifiable from these recordings</span>'
    cells = (
        f"<code>{page.text(name)}</code>",
        unit.bare(value),
        interval(entry.get("ci95"), unit),
        page.text(unit.label),
        unit.bare(sheet),
        change,
        word,
    )
    return cells, "" if told else "untold"


def unknown_tables(document: Mapping) -> str:
    """The tables that are kept of what stays unknown, with their bands."""
    parts = []
    for table in (document.get("remainder") or {}).get("tables") or ():
        rows = []
        for name, entry in table["parameters"].items():
            unit = shown(entry["unit"], entry["value"])
            cells = unit.bare(entry["value"]), interval(entry["ci95"], unit), page.text(unit.label)
            rows.append(((f"<code>{page.text(name)}</code>", *cells), ""))
        heads = ["entry", ">value", ">95 % interval", "unit"]
        parts.append(f"<p>{page.text(table['sentence'])}</p>" + page.table(heads, rows))
    return "".join(parts)


def record_state(document: Mapping, evidence: Evidence) -> str:
    """The section of what changed from one recording to the next."""
    states = document.get("record_state") or []
    sentences = page.listed(state.get("sentence") for state in states)
    rows = [row for state in states for row in _state_rows(state, evidence)]
    lead = "What changed from one recording to the next: the state of the rig on the day, not its structure."
    return page.section(
        "What differs between recordings",
        lead,
        sentences + page.table(["state", "recording", ">value", ">95 % interval", "unit"], rows) if states else "",
    )


def _state_rows(state: Mapping, evidence: Evidence) -> Iterator[tuple[tuple[str, ...], str]]:
    values, cis = state.get("values") or [], state.get("ci95") or []
    unit = shown(state.get("unit"), max((abs(x) for x in values if not missing(x)), default=None))
    names = [view.name for view in sorted(evidence.records, key=lambda view: view.held_out)]
    for k, value in enumerate(values):
        name = names[k] if len(names) == len(values) else f"recording {k + 1}"
        ci = cis[k] if k < len(cis) else None
        cells = page.named(state.get("name")) if k == 0 else "", page.text(name), unit.bare(value), interval(ci, unit)
        yield (*cells, page.text(unit.label)), ""
