"""The parts of any page, which *_report.py put together: frame, tiles, sections, tables, figures, places and their
bars.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files

from ers_mj.report.display import NONE, interval, missing, shown
from ers_mj.report.display import figure as digits

Row = tuple[Sequence[str], str]  # cells as html, class


def frame(
    title: str, kind: str, body: str, styles: Sequence[str] = ("report.css",), head: str = "", foot: str = ""
) -> str:
    """The whole page as HTML: no font, no address outside it, no script but what `foot` brings."""
    styles = [*styles, "figures.css"] if "<svg" in body else styles
    style = "".join(files("ers_mj.report").joinpath(name).read_text(encoding="utf-8") for name in styles)
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n{head}'
        f"<title>{text(title)}</title>\n<style>\n{style}</style>\n</head>\n"
        f'<body>\n<main class="{text(kind)}">\n{body}\n</main>\n{foot}</body>\n</html>\n'
    )


def header(
    kind: str, verdict: str, small: str, sentence: object, tiles: Iterable[tuple[str, str]], below: str = ""
) -> str:
    """What a page begins with: a verdict, a sentence, tiles of (label, value) as html, and what stands below them."""
    cells = "".join(f'<div class="tile"><span>{label}</span><b>{value}</b></div>' for label, value in tiles)
    return (
        f'<header class="{text(kind)}">\n<p class="verdict">{text(verdict)}<small>{text(small)}</small></p>\n'
        f'<h1>{text(sentence)}</h1>\n<div class="tiles">{cells}</div>\n{below}</header>'
    )


def footer(told: Iterable[object]) -> str:
    """What a page ends with: how it was made, in pieces."""
    return f"<footer><p>{' · '.join(text(x) for x in told)}</p></footer>"


def rig(conditions: Mapping) -> list[str]:
    """The play, the linkage and the inductance of a loop's plant, for a footer."""
    return [
        f"play ±{math.degrees(conditions['gap_rad']):.3g}°",
        f"{conditions['linkage']} linkage",
        f"inductance {'on' if conditions['inductance'] else 'off'}",
    ]


def origin(document: Mapping) -> list[str]:
    """The datasheets of a loop's plant and of its controllers, and the versions, for a footer."""
    return [
        f"plant {document['datasheet']}",
        f"controllers know {document['design']}",
        *(f"{name} {value}" for name, value in document["versions"].items()),
    ]


def text(x: object) -> str:
    """x escaped, nothing for None."""
    return escape("" if x is None else str(x), quote=True)


def named(name: object) -> str:
    """A name of the document as words."""
    return text(str(name or "").replace("_", " "))


def section(title: str, lead: str, content: str, kind: str = "") -> str:
    """A section, nothing where it has no content; its id is its title in lower case."""
    if not content:
        return ""
    lead = f'<p class="lead">{lead}</p>' if lead else ""
    mark = "-".join(re.findall(r"\w+", title.lower()))
    return f'<section id="{mark}" class="{kind}">\n<h2>{title}</h2>\n{lead}\n{content}\n</section>'


def contents(body: str) -> str:
    """Links to the sections of a page."""
    found = re.findall(r'<section id="([^"]+)"[^>]*>\n<h2>(.*?)</h2>', body)
    items = "\n".join(f'<li><a href="#{mark}">{title}</a></li>' for mark, title in found)
    return f'<nav aria-label="Contents"><ol>\n{items}\n</ol></nav>' if items else ""


def table(heads: Sequence[str], rows: Iterable[Row]) -> str:
    """A table in its own scrolling box; heads that begin with > stand on the right, as their cells do. On a phone each
    row stands for itself, its cells under their heads.
    """
    right = ["n" if head.startswith(">") else "" for head in heads]
    names = [head.lstrip(">") for head in heads]
    head = "".join(
        f'<th class="{side}">{name}</th>' if name else "<td></td>" for name, side in zip(names, right, strict=True)
    )

    def one(cell: str, name: str, side: str) -> str:
        kind = f"{side} none" if cell == NONE else side
        label = f' data-label="{name}"' if name else ""
        return f'<td class="{kind}"{label}>{cell}</td>'

    lines = [
        f'<tr class="{kind}">{"".join(one(*cell) for cell in zip(cells, names, right, strict=True))}</tr>'
        for cells, kind in rows
    ]
    body = "\n".join(lines)
    return (
        f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>\n{body}\n</tbody></table></div>'
        if lines
        else ""
    )


def figure(svg: str | None, caption: str = "") -> str:
    """A figure with its caption, nothing where there is none."""
    caption = f"<figcaption>{caption}</figcaption>" if caption else ""
    return f"<figure>{svg}{caption}</figure>" if svg else ""


def listed(sentences: Iterable[object]) -> str:
    """Sentences as a list."""
    items = "\n".join(f"<li>{text(sentence)}</li>" for sentence in sentences if sentence)
    return f"<ul>\n{items}\n</ul>" if items else ""


def share(x: float | None) -> str:
    """A share in per cent."""
    return NONE if missing(x) else f"{digits(100 * x, 2) if 0 < abs(x) < 0.1 else f'{100 * x:.0f}'} %"


def place(found: Mapping) -> str:
    """Where an error lives: axis, sentence, and its shares of error and time as bars."""
    sentence = text(found.get("sentence") or _region(found))
    against = "of motion" if found.get("axis") == "frequency" else "of time"
    bars = _bar("of error", found.get("share_of_error"), "error") + _bar(against, found.get("share_of_time"), "")
    return (
        f'<div class="place"><span class="axis">{text(found.get("axis"))}</span><p>{sentence}</p>'
        f'<div class="bars">{bars}</div></div>'
    )


def _region(found: Mapping) -> str:
    if found.get("label") or not found.get("region"):
        return str(found.get("label") or "")
    unit = shown(found.get("unit"))
    return f"{interval(found['region'], unit)} {unit.label}"


def _bar(label: str, x: float | None, kind: str) -> str:
    if missing(x):
        return ""
    width = 100 * min(max(x, 0.0), 1.0)
    return (
        f'<div class="bar {kind}"><span>{label}</span><div><i'
        f' style="width:{width:.1f}%"></i></div><em>{share(x)}</em></div>'
    )
