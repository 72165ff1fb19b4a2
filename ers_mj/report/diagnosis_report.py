"""The report: one self-contained page from a diagnosis and its evidence.
 verdict -> curves -> frames -> where -> what -> map -> ladder -> fit -> parameters -> recordings -> data -> next ->
footer
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence

from ers_mj.diagnosis.evidence import Evidence, RecordView, Rung
from ers_mj.report import diagnosis_figures as figures
from ers_mj.report import page
from ers_mj.report.display import NONE, Unit, figure, interval, missing, pretty, shown
from ers_mj.view.frames import Frame, Frames

VERDICTS = {
    "consistent": "The datasheet’s model explains the data",
    "parameters_only": "Only the parameters were off",
    "missing_physics": "Missing physics found",
    "unexplained": "A mismatch that nothing in the library explains",
}
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
MOST_RECORDS = 12  # figures of recordings in one page
SHORT_HASH = 12


def report_page(document: Mapping, evidence: Evidence, frames: Frames | None = None) -> str:
    """The page as HTML: no script, no font, no address outside it."""
    figures.restart_ids()
    verdict = str(document.get("verdict") or "")
    parts = (
        _header,
        _curves,
        lambda *_: _frames(frames),
        _where,
        _missing,
        _residuals,
        _ladder,
        _fit,
        _parameters,
        _record_state,
        _data,
        _next,
    )
    body = "\n".join(part(document, evidence) for part in parts)
    return page.frame(f"{VERDICTS.get(verdict, verdict)} · servo diagnosis", verdict, f"{body}\n{_footer(document)}")


def _output_unit(document: Mapping, evidence: Evidence) -> str:
    return (document.get("data") or {}).get("output_unit") or evidence.output_unit


def _error_unit(document: Mapping, evidence: Evidence) -> Unit:
    """One unit for all errors of the page."""
    sizes = [x for key, x in (document.get("fit") or {}).items() if key.endswith("_rad") and not missing(x)]
    return shown(_output_unit(document, evidence), max(sizes, default=None))


# -- the sections in their order ------------------------------------------------------------------------------------


def _header(document: Mapping, evidence: Evidence) -> str:
    verdict = str(document.get("verdict") or "")
    return page.header(
        verdict, VERDICTS.get(verdict, "No verdict"), verdict, document.get("sentence"), _tiles(document, evidence)
    )


def _tiles(document: Mapping, evidence: Evidence) -> list[tuple[str, str]]:
    """The numbers to take away: held-out error before and after, what is explained, the noise."""
    fit, unit = document.get("fit") or {}, _error_unit(document, evidence)
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


def _curves(document: Mapping, evidence: Evidence) -> str:
    """Held-out recordings first and open, the others to unfold."""
    records = sorted(evidence.records, key=lambda view: not view.held_out)
    if not records:
        return ""
    first, rest = records[0], records[1:MOST_RECORDS]
    content = [_record(first, evidence, with_close_up=True)]
    content += [
        f"<details><summary>{_record_title(view)}</summary>{_record(view, evidence, titled=False)}</details>"
        for view in rest
    ]
    if len(records) > MOST_RECORDS:
        content.append(f'<p class="note">{len(records) - MOST_RECORDS} more recordings are not drawn.</p>')
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
    content = title + page.figure(figures.traces(view, evidence))
    if with_close_up and (enlarged := figures.close_up(view, evidence)):
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
        figures.spectrum(evidence.spectrum, evidence),
        "The error of an observer that forgets within 33 ms. Linear is what a linear filter of input and motion"
        " explains of it; no such filter explains a distortion. On the right only lines at which both motions cohere.",
    )


def _missing(document: Mapping, evidence: Evidence) -> str:
    unit = _error_unit(document, evidence)
    effects = "\n".join(_effect(effect, unit) for effect in document.get("missing") or [])
    none = {
        "consistent": "Nothing is missing: the datasheet’s model meets the data within noise.",
        "parameters_only": "Nothing is missing: with its parameters refitted the model meets the data within noise.",
        "unexplained": "No effect of the library accounts for half of the mismatch, so none is named.",
    }.get(str(document.get("verdict")), "No effect is named.")
    content = (effects or f"<p>{none}</p>") + _suspects(document) + _remainder(document)
    return page.section("The physics that was left out", "", content)


def _effect(effect: Mapping, unit: Unit) -> str:
    return (
        f'<div class="effect"><h3>{page.named(effect.get("effect"))}<span'
        f' class="place-name">{page.text(effect.get("subsystem"))}</span></h3>'
        f'<p class="says">{page.text(effect.get("sentence"))}</p>{_effect_parameters(effect.get("parameters") or {})}'
        f"{_effect_evidence(effect.get('evidence') or {}, unit)}{_alternatives(effect.get('alternatives') or [])}</div>"
    )


def _effect_parameters(parameters: Mapping) -> str:
    rows = []
    for name, entry in parameters.items():
        unit = shown(entry.get("unit"), entry.get("value"))
        rows.append(
            (
                (
                    f"<code>{page.text(name)}</code>",
                    unit.bare(entry.get("value")),
                    interval(entry.get("ci95"), unit),
                    page.text(unit.label),
                    page.text(entry.get("meaning")),
                ),
                "",
            )
        )
    meaning = any(cells[-1] for cells, _ in rows)
    heads = ["parameter", ">value", ">95 % interval", "unit", "meaning"]
    return page.table(
        heads if meaning else heads[:-1], [(cells if meaning else cells[:-1], kind) for cells, kind in rows]
    )


def _effect_evidence(evidence: Mapping, unit: Unit) -> str:
    without, with_it = evidence.get("heldout_rmse_without_rad"), evidence.get("heldout_rmse_with_rad")
    told = []
    if not missing(without) and not missing(with_it):
        told.append(
            f'held-out error <span class="b">{unit(without)}</span> without it, <span class="a">{unit(with_it)}</span>'
            " with it"
        )
    else:
        told.append("held-out error not scored: the effect was judged in its own window or in the data itself")
    if not missing(evidence.get("delta_bic")):
        told.append(f"ΔBIC {figure(evidence['delta_bic'])}")
    if not missing(evidence.get("p_value")):
        told.append(f"chance of this by luck: p = {figure(evidence['p_value'], 2)}")
    return f'<p class="note">{"; ".join(told)}.</p>'


def _alternatives(alternatives: Sequence[Mapping]) -> str:
    if not alternatives:
        return ""
    items = "\n".join(
        f"<li><b>{page.named(other.get('effect'))}</b>{_probability(other.get('probability'))}: "
        f"{page.text(other.get('why_not_excluded') or 'not excluded by these recordings')}</li>"
        for other in alternatives
    )
    return f'<p class="note">Could also be:</p><ul class="note">\n{items}\n</ul>'


def _probability(x: float | None) -> str:
    return "" if missing(x) else f" ({page.share(x)})"


def _suspects(document: Mapping) -> str:
    suspects = document.get("suspects") or []
    told = [
        (
            s
            if isinstance(s, str)
            else " · ".join(filter(None, (str(s.get("effect") or "").replace("_", " "), s.get("sentence"))))
        )
        for s in suspects
    ]
    return f'<p class="note">Suspects, none of them proven:</p>{page.listed(told)}' if told else ""


def _remainder(document: Mapping) -> str:
    remainder = document.get("remainder") or {}
    if not remainder.get("sentence"):
        return ""
    return f'<p class="{"flag" if remainder.get("significant") else "note"}">{page.text(remainder["sentence"])}</p>'


def _residuals(document: Mapping, evidence: Evidence) -> str:
    if evidence.residual_map is None:
        return ""
    noun = figures.noun(evidence.output_unit)
    lead = (
        f"Rms residual of the free runs in each bin of {noun} and speed, one scale for both; white bins hold no data."
    )
    return page.section(
        f"Residual over {noun} and speed", lead, page.figure(figures.residual_map(evidence.residual_map, evidence))
    )


def _ladder(document: Mapping, evidence: Evidence) -> str:
    if not evidence.ladder:
        return ""
    baseline = next((r.heldout_rmse for r in evidence.ladder if not r.effects), None)
    baseline = (document.get("fit") or {}).get("heldout_rmse_before_rad") if baseline is None else baseline
    unit = _error_unit(document, evidence)
    drawn = page.figure(
        figures.ladder(evidence.ladder, evidence, baseline),
        'The <span class="b">orange line</span> is the model before, the dashed one the noise floor; what was '
        '<span class="a">chosen</span> is green.',
    )
    rows = [(_rung(rung, unit), "chosen" if rung.chosen else "") for rung in evidence.ladder]
    heads = ["candidate", ">held-out error", ">gain", ">z", ">numbers", "note"]
    table = page.table(
        [head.replace("held-out error", f"held-out error [{page.text(unit.label)}]") for head in heads], rows
    )
    if len(evidence.ladder) > figures.MOST_RUNGS:
        table = f"<details><summary>All {len(evidence.ladder)} candidates as a table</summary>{table}</details>"
    lead = (
        "Every candidate was fitted in simulation; gain is what it takes off the training cost, z how surely, paired by"
        " blocks of time, numbers how many it adds."
    )
    return page.section("The candidates", lead, drawn + table)


def _rung(rung: Rung, unit: Unit) -> tuple[str, ...]:
    gain, z = (
        NONE if missing(rung.gain) else figure(rung.gain),
        NONE if missing(rung.z) else f"{rung.z:.1f}".replace("-", "−"),
    )
    return (
        page.text(figures.rung_name(rung)),
        unit.bare(rung.heldout_rmse),
        gain,
        z,
        str(rung.parameters),
        page.text(rung.note),
    )


def _fit(document: Mapping, evidence: Evidence) -> str:
    fit, unit = document.get("fit") or {}, _error_unit(document, evidence)
    noise, rows = fit.get("noise_floor_rad"), []
    for key, title, what, why in FITS:
        before, after = fit.get(f"{key}_rmse_before_rad"), fit.get(f"{key}_rmse_after_rad")
        if key.startswith("mujoco") and missing(before) and missing(after):
            continue
        what = f"{NONE} {why}" if missing(before) and missing(after) else what
        rows.append(
            ((title, unit.bare(before), unit.bare(after), _times(after, noise), f'<span class="why">{what}</span>'), "")
        )
    rows.append(
        (("Noise floor", unit.bare(noise), "", "", '<span class="why">of the sensor, from the recordings</span>'), "")
    )
    known = {f"{key}_rmse_{when}_rad" for key, *_ in FITS for when in ("before", "after")} | {"noise_floor_rad"}
    rows += [
        ((page.named(key.removesuffix("_rad")), "", unit.bare(x) if key.endswith("_rad") else figure(x), "", ""), "")
        for key, x in fit.items()
        if key not in known and not missing(x)
    ]
    told = "".join(f'<p class="note">{page.text(x)}</p>' for key, x in fit.items() if isinstance(x, str))
    table = page.table(
        [
            "free-run rms error",
            f">before [{page.text(unit.label)}]",
            f">after [{page.text(unit.label)}]",
            ">after/noise",
            "",
        ],
        rows,
    )
    return page.section(
        "How well it fits", "Root-mean-square error of free runs from the first sample on.", table + told
    )


def _times(x: float | None, noise: float | None) -> str:
    return NONE if missing(x) or missing(noise) or noise <= 0 else f"{figure(x / noise, 2)}×"


def _parameters(document: Mapping, evidence: Evidence) -> str:
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


def _record_state(document: Mapping, evidence: Evidence) -> str:
    states = document.get("record_state") or []
    sentences = page.listed(state.get("sentence") for state in states)
    rows = [row for state in states for row in _state_rows(state, evidence)]
    lead = "What changed from one recording to the next: the state of the rig on the day, not its structure."
    return page.section(
        "What differs between recordings",
        lead,
        sentences + page.table(["state", "recording", ">value", ">95 % interval", "unit"], rows) if states else "",
    )


def _state_rows(state: Mapping, evidence: Evidence) -> Iterable[tuple[tuple[str, ...], str]]:
    values, cis = state.get("values") or [], state.get("ci95") or []
    unit = shown(state.get("unit"), max((abs(x) for x in values if not missing(x)), default=None))
    names = [view.name for view in sorted(evidence.records, key=lambda view: view.held_out)]
    for k, value in enumerate(values):
        name = names[k] if len(names) == len(values) else f"recording {k + 1}"
        ci = cis[k] if k < len(cis) else None
        yield (
            (
                page.named(state.get("name")) if k == 0 else "",
                page.text(name),
                unit.bare(value),
                interval(ci, unit),
                page.text(unit.label),
            ),
            "",
        )


def _data(document: Mapping, evidence: Evidence) -> str:
    problems = (document.get("data") or {}).get("problems") or []
    lead = "Worked around or ignored, and told." if problems else ""
    return page.section("Problems found in the data", lead, page.listed(problems) or "<p>None.</p>")


def _next(document: Mapping, evidence: Evidence) -> str:
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
        ((page.text(name), f"<code>{page.text((hashes[k] if k < len(hashes) else '') or '')[:SHORT_HASH]}</code>"), "")
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
