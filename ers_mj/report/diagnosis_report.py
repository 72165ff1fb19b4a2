"""The report: one self-contained page from a diagnosis and its evidence.

verdict, what to record next, data -> curves -> frames -> where -> what -> map -> candidates -> fit -> parameters ->
recordings -> how it was made
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass

from ers_mj.diagnosis.evidence import Evidence, RecordView
from ers_mj.report import charts, diagnosis_charts, page
from ers_mj.report.diagnosis_effects import missing_physics
from ers_mj.report.diagnosis_tables import candidates, fit_table, parameters, record_state, trail, unknown_tables
from ers_mj.report.display import NONE, Unit, figure, measured, missing, noun, pretty, shown
from ers_mj.view.frames import Frame, Frames

NEXT_INPUT = "next_recording.csv"  # the file that holds the input to record next
MOST_DRAWN = 12  # recordings on the page
MOST_PROBLEMS = 3  # of the data on the first screen, the others to unfold

VERDICTS = {
    "consistent": "The datasheet’s model explains the data",
    "parameters_only": "Only the parameters were off",
    "missing_physics": "Missing physics found",
    "unexplained": "A mismatch that nothing in the library explains",
}


@dataclass(frozen=True)
class Made:
    """How a page came about: the command line, the day, and the names of the files that lie beside it."""

    command: str = ""
    day: str = ""
    beside: tuple[str, ...] = ()


def report_page(document: Mapping, evidence: Evidence, frames: Frames | None = None, made: Made = Made()) -> str:
    """The page as HTML, which draws its charts itself: no font, no address outside it."""
    verdict, unit = str(document.get("verdict") or ""), _error_unit(document, evidence)
    sections = (
        _curves(document, evidence, frames),
        _frames(frames),
        _where(document, evidence),
        missing_physics(document, unit),
        _residuals(evidence),
        _unknown(document, evidence),
        candidates(evidence, unit),
        trail(document),
        fit_table(document, unit),
        parameters(document),
        record_state(document, evidence),
    )
    body = "\n".join(filter(None, sections))
    first = _next(document, made), _data(document)
    begin = _header(document, unit, _made(made)) + f'<div class="first">{"".join(first)}</div>'
    parts = begin, page.contents("".join(first) + body), body, _footer(document)
    title = f"{VERDICTS.get(verdict, verdict)} · servo diagnosis"
    return charts.frame(title, verdict, "\n".join(parts), _chart_data(document, evidence))


def _chart_data(document: Mapping, evidence: Evidence) -> dict:
    """The data of every chart, by the name of its place."""
    records = evidence.told[:MOST_DRAWN]
    effects = diagnosis_charts.effects_of(records)
    out = {f"trace-{k}": diagnosis_charts.trace(view, evidence, effects) for k, view in enumerate(records)}
    if evidence.residual_map is not None:
        out["map"] = diagnosis_charts.residual_map(evidence.residual_map, evidence)
    if evidence.latent is not None:
        out["latent"] = diagnosis_charts.latent(evidence.latent, evidence)
    if _has_spectrum(document, evidence):
        out["spectrum"] = diagnosis_charts.spectrum(evidence.spectrum, evidence)
    if diagnosis_charts.has_totals(evidence.ladder):
        out["ladder"] = diagnosis_charts.ladder(evidence.ladder, evidence)
    switched = diagnosis_charts.switched(records[0], effects, _error_unit(document, evidence)) if effects else {}
    return {"charts": out, "switched": switched}


def summary_page(document: Mapping, evidence: Evidence) -> str:
    """The verdict, the first recording and the table of errors: what a notebook shows of it."""
    verdict, unit, records = str(document.get("verdict") or ""), _error_unit(document, evidence), evidence.told[:1]
    body = (
        _header(document, unit),
        *(page.section("Measured and simulated", "", _record(0, view)) for view in records),
        missing_physics(document, unit),
        fit_table(document, unit),
    )
    drawn = {f"trace-{k}": diagnosis_charts.trace(view, evidence, ()) for k, view in enumerate(records)}
    data = {"charts": drawn, "switched": {}}
    return charts.frame(VERDICTS.get(verdict, verdict), verdict, "\n".join(body), data)


def _error_unit(document: Mapping, evidence: Evidence) -> Unit:
    """One unit for all errors of the page."""
    sizes = [x for key, x in (document.get("fit") or {}).items() if key.endswith("_rad") and not missing(x)]
    output_unit = (document.get("data") or {}).get("output_unit") or evidence.output_unit
    return shown(output_unit, max(sizes, default=None))


# -- the sections in their order ------------------------------------------------------------------------------------


def _header(document: Mapping, unit: Unit, below: str = "") -> str:
    verdict = str(document.get("verdict") or "")
    header = page.header(
        _tone(document), _told(document), verdict, document.get("sentence"), _tiles(document, unit), below
    )
    return header + _left_out(document)


def _told(document: Mapping) -> str:
    """The verdict in words, with what it does not cover: a mismatch that is left, recordings that go further."""
    verdict, remainder = str(document.get("verdict") or ""), document.get("remainder") or {}
    words = VERDICTS.get(verdict, "No verdict")
    if verdict != "unexplained" and remainder.get("significant"):
        words += ", and more is left"
    return words + (", judged beyond what it was fitted to" if remainder.get("beyond_training") else "")


def _tone(document: Mapping) -> str:
    """The verdict, by which the page is coloured; as unexplained, where an answer leaves a mismatch."""
    is_left = (document.get("remainder") or {}).get("significant")
    return "unexplained" if is_left else str(document.get("verdict") or "")


def _left_out(document: Mapping) -> str:
    """What was left out: of a quick look, or as the budget ended."""
    told = [str(part.get("sentence")) for part in document.get("left_out") or ()]
    return f'<p class="note">Left out: {page.text("; ".join(told))}.</p>' if told else ""


def _made(made: Made) -> str:
    """Files to take away, the day and the command."""
    links = "\n".join(f'<li><a href="{page.text(name)}" download>{page.text(name)}</a></li>' for name in made.beside)
    links = f'<ul class="beside" aria-label="Files beside this page">\n{links}\n</ul>' if links else ""
    told = [page.text(made.day), f"<code>{page.text(made.command)}</code>" if made.command else ""]
    line = " · ".join(filter(None, told))
    return links + (f'<p class="made">{line}</p>\n' if line else "")


def _tiles(document: Mapping, unit: Unit) -> list[tuple[str, str]]:
    """The numbers to take away: held-out error before and after, what is explained, the noise."""
    fit = document.get("fit") or {}
    before, after = fit.get("heldout_rmse_before_rad"), fit.get("heldout_rmse_after_rad")
    tiles = []
    if not missing(before) or not missing(after):
        tiles.append(
            (
                "held-out error, before <i>→</i> after",
                f'<span class="b">{unit.bare(before)}</span><i>→</i><span class="a">{unit(after)}</span>',
            )
        )
    share = (document.get("remainder") or {}).get("explained_share")
    if not missing(share):
        tiles.append(("of the squared error explained", page.share(share)))
    if not missing(fit.get("noise_floor_rad")):
        tiles.append(("noise floor", unit(fit["noise_floor_rad"])))
    named = document.get("missing") or []
    tiles.append(("effects named", ", ".join(page.named(effect.get("effect")) for effect in named) or "none"))
    return tiles


def _curves(document: Mapping, evidence: Evidence, frames: Frames | None) -> str:
    """The first recording open, the others to unfold, and the switches of the effects."""
    records = evidence.told[:MOST_DRAWN]
    if not records:
        return ""
    content = [_switches(evidence, records), f'<p class="note">{_record_title(records[0])}</p>', _record(0, records[0])]
    content += [
        f"<details><summary>{_record_title(view)}</summary>{_record(k, view)}</details>"
        for k, view in enumerate(records[1:], 1)
    ]
    if len(evidence.records) > len(records):
        content.append(f'<p class="note">{len(evidence.records) - len(records)} more recordings are not drawn.</p>')
    lead = (
        f"{page.text(measured(document.get('fit') or {})[1])} "
        f'<span class="b">Before</span> is {_plain(document, frames)}, refitted to the training recordings; '
        '<span class="a">after</span> has the named physics in it. The grey band is ±2 standard deviations of noise.'
    )
    return page.section("Measured and simulated", lead, "\n".join(content))


def _plain(document: Mapping, frames: Frames | None) -> str:
    """What the model is called that has no named physics in it."""
    if (document.get("data") or {}).get("input_kind") == "position":
        return "a plain joint within the servo’s position loop"
    return "the paper’s model" if frames is not None and frames.rig == "rudder" else "a plain joint"


def _record_title(view: RecordView) -> str:
    return f"{page.text(view.name)} · {'held out' if view.held_out else 'training'}"


def _record(k: int, view: RecordView) -> str:
    return charts.place(f"trace-{k}", f"{view.name}: measured and simulated output, residual and input over time")


def _switches(evidence: Evidence, records: list[RecordView]) -> str:
    """A box for each effect whose absence was simulated; shown by the script that they work with."""
    effects = diagnosis_charts.effects_of(records)
    if not effects:
        return ""
    boxes = [f'<label><input type="checkbox" data-effect checked> {page.named(name)}</label>' for name in effects]
    if len(effects) > 1:
        boxes.insert(0, '<label><input type="checkbox" data-all checked> all named effects</label>')
    several = ", one at a time or all together" if len(effects) > 1 else ""
    return (
        f'<fieldset id="switches" hidden><legend>Switch an effect off in “after”{several}</legend>'
        f"{''.join(boxes)}<output></output></fieldset>"
    )


def _frames(frames: Frames | None) -> str:
    """Moments of a recording on the plant in three dimensions; a sentence where they cannot be drawn."""
    if frames is None:
        return ""
    title = f"The {frames.rig} at the worst moments"
    if frames.why_not:
        return page.section(title, "", f'<p class="note">No frames are shown: {page.text(frames.why_not)}.</p>')
    lead = (
        f"{page.text(frames.name)} on the plant in three dimensions, when the model before is furthest off. Solid is"
        f" the simulated {frames.rig}, translucent amber the measured one."
    )
    if frames.enlarged > 1:
        lead += f" The difference between them is drawn {frames.enlarged} times as large as it is."
    cells = "\n".join(f"<div>{_frame(f, frames, 'before')}{_frame(f, frames, 'after')}</div>" for f in frames.moments)
    return page.section(title, lead, f'<div class="frames">{cells}</div>')


def _frame(frame: Frame, frames: Frames, when: str) -> str:
    unit = shown(frames.output_unit, frame.measured)
    simulated, picture = getattr(frame, when), getattr(frame, f"picture_{when}")
    told = f'{frame.t:.2f} s, <span class="{when[0]}">{when}</span> {unit(simulated)}, measured {unit(frame.measured)}'
    data = b64encode(picture).decode("ascii")
    return (
        f'<figure><img alt="the {frames.rig} {when}, at {frame.t:.2f} s"'
        f' src="data:image/jpeg;base64,{data}"><figcaption>{told}</figcaption></figure>'
    )


def _where(document: Mapping, evidence: Evidence) -> str:
    places = "\n".join(page.place(place) for place in document.get("where") or [])
    lead = "Where the error of the refitted model lives, before any physics is added."
    if not _has_spectrum(document, evidence):
        return page.section("Where it fails", lead, places)
    drawn = charts.place(
        "spectrum",
        "the error over frequency, and measured over simulated motion",
        "The error of an observer that forgets within 33 ms. Linear is what a linear filter of input and motion"
        " explains of it; no such filter explains a distortion. Measured over simulated motion only where both cohere.",
    )
    return page.section("Where it fails", lead, places + drawn)


def _has_spectrum(document: Mapping, evidence: Evidence) -> bool:
    """Whether the error is beyond the noise over frequency, and told."""
    return bool(document.get("where")) and evidence.spectrum is not None and evidence.spectrum.region is not None


def _residuals(evidence: Evidence) -> str:
    if evidence.residual_map is None:
        return ""
    output = noun(evidence.output_unit)
    lead = (
        f"Rms residual of the runs in each bin of {output} and speed, one scale for both; bins without colour hold"
        " no data."
    )
    drawn = charts.place("map", f"rms residual over {output} and speed, before and after")
    return page.section(f"Residual over {output} and speed", lead, drawn)


def _unknown(document: Mapping, evidence: Evidence) -> str:
    """What the answer lacks over time, and the tables that are kept of it."""
    force = evidence.latent
    if force is None:
        return ""
    lead = (
        f"The acceleration that {page.text(force.name)} asks for beside the answer, from where the output was measured"
        f" to be; noise alone makes {figure(force.noise)} {page.text(evidence.output_unit)}/s²."
    )
    drawn = charts.place("latent", "the acceleration that the recording asks for beside the answer, over time")
    return page.section("What stays unknown", lead, drawn + unknown_tables(document))


def _data(document: Mapping) -> str:
    problems = [problem for problem in (document.get("data") or {}).get("problems") or [] if problem]
    first, others = page.listed(problems[:MOST_PROBLEMS]), page.listed(problems[MOST_PROBLEMS:])
    if others:
        first += f"<details><summary>{len(problems) - MOST_PROBLEMS} more</summary>{others}</details>"
    lead = "Worked around or ignored, and told." if problems else ""
    return page.section("Problems found in the data", lead, first or "<p>None.</p>")


def _next(document: Mapping, made: Made) -> str:
    following = document.get("next_recording") or {}
    excitation = following.get("excitation")
    content = f"<p>{page.text(following['sentence'])}</p>" if following.get("sentence") else ""
    if NEXT_INPUT in made.beside:
        content += f'<p><a href="{NEXT_INPUT}" download>{NEXT_INPUT}</a> is that input, sample by sample.</p>'
    if isinstance(excitation, Mapping):
        rows = [((page.named(key), page.text(_value(value))), "") for key, value in excitation.items()]
        table = page.table(["excitation", ""], rows)
        content += f"<details><summary>The input in numbers</summary>{table}</details>" if table else ""
    return page.section("What to record next", "", content, "next")


def _value(x: object) -> str:
    if isinstance(x, list | tuple):
        return ", ".join(_value(entry) for entry in x)
    return figure(float(x), 4) if isinstance(x, int | float) and not missing(x) else NONE if x is None else str(x)


def _footer(document: Mapping) -> str:
    data = document.get("data") or {}
    names, hashes = data.get("files") or [], data.get("sha256") or []
    rows = [
        ((page.text(name), f"<code>{page.text((hashes[k] if k < len(hashes) else '') or '')[:12]}</code>"), "")
        for k, name in enumerate(names)
    ]
    versions = ", ".join(
        f"{page.text(name)} {page.text(version)}" for name, version in (document.get("versions") or {}).items()
    )
    told = [
        f"seed {page.text(document.get('seed'))}",
        f"output [{page.text(pretty(data.get('output_unit')))}], input [{page.text(pretty(data.get('input_unit')))}]",
        versions,
    ]
    return f"<footer>{page.table(['file', 'sha256'], rows)}<p>{' · '.join(filter(None, told))}</p></footer>"
