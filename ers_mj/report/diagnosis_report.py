"""The report: one self-contained page from a diagnosis and its evidence.

verdict -> curves -> frames -> where -> what -> map -> candidates -> fit -> parameters -> recordings -> data -> next
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping

from ers_mj.diagnosis.evidence import Evidence, RecordView
from ers_mj.report import diagnosis_figures, page
from ers_mj.report.diagnosis_effects import missing_physics
from ers_mj.report.diagnosis_tables import candidates, fit_table, parameters, record_state, trail
from ers_mj.report.display import NONE, Unit, figure, missing, noun, pretty, shown
from ers_mj.report.drawing import restart_ids
from ers_mj.report.traces import close_up, traces
from ers_mj.view.frames import Frame, Frames

VERDICTS = {
    "consistent": "The datasheet’s model explains the data",
    "parameters_only": "Only the parameters were off",
    "missing_physics": "Missing physics found",
    "unexplained": "A mismatch that nothing in the library explains",
}


def report_page(document: Mapping, evidence: Evidence, frames: Frames | None = None) -> str:
    """The page as HTML: no script, no font, no address outside it."""
    restart_ids()
    verdict, unit = str(document.get("verdict") or ""), _error_unit(document, evidence)
    parts = (
        _header(document, unit),
        _curves(evidence),
        _frames(frames),
        _where(document, evidence),
        missing_physics(document, unit),
        _residuals(evidence),
        candidates(document, evidence, unit),
        trail(document),
        fit_table(document, unit),
        parameters(document),
        record_state(document, evidence),
        _data(document),
        _next(document),
        _footer(document),
    )
    return page.frame(f"{VERDICTS.get(verdict, verdict)} · servo diagnosis", verdict, "\n".join(parts))


def summary_page(document: Mapping, evidence: Evidence) -> str:
    """The verdict, the first recording and the table of errors: what a notebook shows of it."""
    restart_ids()
    verdict, unit = str(document.get("verdict") or ""), _error_unit(document, evidence)
    records = sorted(evidence.records, key=lambda view: not view.held_out)
    parts = (
        _header(document, unit),
        page.section("Measured and simulated", "", _record(records[0], evidence)) if records else "",
        missing_physics(document, unit),
        fit_table(document, unit),
    )
    return page.frame(VERDICTS.get(verdict, verdict), verdict, "\n".join(parts))


def _error_unit(document: Mapping, evidence: Evidence) -> Unit:
    """One unit for all errors of the page."""
    sizes = [x for key, x in (document.get("fit") or {}).items() if key.endswith("_rad") and not missing(x)]
    output_unit = (document.get("data") or {}).get("output_unit") or evidence.output_unit
    return shown(output_unit, max(sizes, default=None))


# -- the sections in their order ------------------------------------------------------------------------------------


def _header(document: Mapping, unit: Unit) -> str:
    verdict = str(document.get("verdict") or "")
    header = page.header(
        verdict, VERDICTS.get(verdict, "No verdict"), verdict, document.get("sentence"), _tiles(document, unit)
    )
    return header + _left_out(document)


def _left_out(document: Mapping) -> str:
    """What a quick look left out."""
    told = [str(part.get("sentence")) for part in document.get("left_out") or ()]
    return f'<p class="note">A quick look: {page.text("; ".join(told))}.</p>' if told else ""


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


def _curves(evidence: Evidence, most: int = 12) -> str:
    """Held-out recordings first and open, the others to unfold; at most so many."""
    records = sorted(evidence.records, key=lambda view: not view.held_out)
    if not records:
        return ""
    first, rest = records[0], records[1:most]
    content = [_record(first, evidence, with_close_up=True)]
    content += [
        f"<details><summary>{_record_title(view)}</summary>{_record(view, evidence, titled=False)}</details>"
        for view in rest
    ]
    if len(records) > most:
        content.append(f'<p class="note">{len(records) - most} more recordings are not drawn.</p>')
    lead = (
        "Each model runs free: it gets the input and the initial state, never the measurement. "
        '<span class="b">Before</span> is the paper’s model refitted to the training recordings, '
        '<span class="a">after</span> has the named physics in it. The grey band is ±2 standard deviations of noise.'
    )
    return page.section("Measured and simulated", lead, "\n".join(content))


def _record_title(view: RecordView) -> str:
    return f"{page.text(view.name)} · {'held out' if view.held_out else 'training'}"


def _record(view: RecordView, evidence: Evidence, titled: bool = True, with_close_up: bool = False) -> str:
    title = f'<p class="note">{_record_title(view)}</p>' if titled else ""
    content = title + page.figure(traces(view, evidence))
    if with_close_up and (enlarged := close_up(view, evidence)):
        content += page.figure(enlarged, "The span in which the model before does worst, enlarged.")
    return content


def _frames(frames: Frames | None) -> str:
    """Moments of a recording on the plant in three dimensions; a sentence where they cannot be drawn."""
    if frames is None:
        return ""
    title = "The rudder at the worst moments"
    if frames.why_not:
        return page.section(title, "", f'<p class="note">No frames are shown: {page.text(frames.why_not)}.</p>')
    lead = (
        f"{page.text(frames.name)} on the plant in three dimensions, when the model before is furthest off. "
        "White is the simulated rudder, translucent amber the measured one."
    )
    if frames.enlarged > 1:
        lead += f" The difference between them is drawn {frames.enlarged} times as large as it is."
    cells = "\n".join(
        f"<div>{_frame(f, 'before', f.before, f.picture_before)}{_frame(f, 'after', f.after, f.picture_after)}</div>"
        for f in frames.moments
    )
    return page.section(title, lead, f'<div class="frames">{cells}</div>')


def _frame(frame: Frame, when: str, simulated: float, picture: bytes) -> str:
    unit = shown("rad")
    told = f'{frame.t:.2f} s, <span class="{when[0]}">{when}</span> {unit(simulated)}, measured {unit(frame.measured)}'
    data = b64encode(picture).decode("ascii")
    return (
        f'<figure><img alt="the rudder {when}"'
        f' src="data:image/jpeg;base64,{data}"><figcaption>{told}</figcaption></figure>'
    )


def _where(document: Mapping, evidence: Evidence) -> str:
    places = "\n".join(page.place(place) for place in document.get("where") or [])
    return page.section(
        "Where it fails",
        "Where the error of the refitted model lives, before any physics is added.",
        places and places + _spectrum(evidence),
    )


def _spectrum(evidence: Evidence) -> str:
    """The error over frequency, where it is beyond the noise."""
    if evidence.spectrum is None or evidence.spectrum.region is None:
        return ""
    return page.figure(
        diagnosis_figures.spectrum(evidence.spectrum, evidence),
        "The error of an observer that forgets within 33 ms. Linear is what a linear filter of input and motion"
        " explains of it; no such filter explains a distortion. On the right only lines at which both motions cohere.",
    )


def _residuals(evidence: Evidence) -> str:
    if evidence.residual_map is None:
        return ""
    output = noun(evidence.output_unit)
    lead = (
        f"Rms residual of the free runs in each bin of {output} and speed, one scale for both; white bins hold no data."
    )
    return page.section(
        f"Residual over {output} and speed",
        lead,
        page.figure(diagnosis_figures.residual_map(evidence.residual_map, evidence)),
    )


def _data(document: Mapping) -> str:
    problems = (document.get("data") or {}).get("problems") or []
    lead = "Worked around or ignored, and told." if problems else ""
    return page.section("Problems found in the data", lead, page.listed(problems) or "<p>None.</p>")


def _next(document: Mapping) -> str:
    following = document.get("next_recording") or {}
    excitation = following.get("excitation")
    rows = (
        [((page.named(key), page.text(_value(value))), "") for key, value in excitation.items()]
        if isinstance(excitation, Mapping)
        else []
    )
    content = f"<p>{page.text(following['sentence'])}</p>" if following.get("sentence") else ""
    return page.section("What to record next", "", content + page.table(["excitation", ""], rows), "next")


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
