"""A section of the diagnosis's page: the physics that was left out, each effect with its numbers, its evidence and its
rivals, then what is suspected and what remains.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ers_mj.report import page
from ers_mj.report.display import Unit, figure, interval, missing, shown


def missing_physics(document: Mapping, unit: Unit) -> str:
    """The section; errors are told in this unit."""
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
        value, ends = unit.bare(entry.get("value")), interval(entry.get("ci95"), unit)
        told = page.text(unit.label), page.text(entry.get("meaning"))
        rows.append(((f"<code>{page.text(name)}</code>", value, ends, *told), ""))
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
