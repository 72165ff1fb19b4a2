"""What the figures of all pages share: inline SVG at two widths, room for labels, axes and ticks.

draw(width) -> Figure, once wide and once narrow for a phone -> SVG text in the page
"""

from __future__ import annotations

import io
import itertools
import re
from collections.abc import Callable, Sequence
from functools import cache
from html import escape
from importlib.resources import files

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from ers_mj.report.style import STYLE

_serial = itertools.count(1)


def restart_ids() -> None:
    """Number the figures from 1 again, so that the same diagnosis gives the same page."""
    global _serial
    _serial = itertools.count(1)


def both_widths(draw: Callable[[float], Figure], described: str) -> str:
    """One figure drawn for a desktop and for a phone; the page's style shows the one that fits."""
    with matplotlib.rc_context(STYLE.settings):
        wide, narrow = _svg(draw(STYLE.wide), described), _svg(draw(STYLE.narrow), described)
    return f'<div class="wide">{wide}</div><div class="narrow">{narrow}</div>'


def _svg(figure: Figure, described: str) -> str:
    """The figure as an SVG element: scalable, its ids unique in the page, no address in it, its colours the page's."""
    FigureCanvasSVG(figure)
    out = io.StringIO()
    figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = out.getvalue()
    text = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.S)
    text = re.sub(r'\sxmlns(:\w+)?="[^"]*"', "", text)
    text = re.sub(r": (#[0-9a-f]{6})\b", lambda found: f": {of_page(found[1])}", text)
    mark = f"f{next(_serial)}-"
    text = re.sub(r'\bid="', f'id="{mark}', text)
    text = re.sub(r'href="#', f'href="#{mark}', text).replace("url(#", f"url(#{mark}")
    told = escape(described, quote=True)  # it may hold the name of a file
    begin = lambda found: f'<svg viewBox="{found[1]}" role="img" aria-label="{told}">'
    text = re.sub(r'<svg [^>]*?viewBox="([^"]+)"[^>]*>', begin, text, count=1)
    return re.sub(r"\n\s*", "\n", text)


def of_page(colour: str) -> str:
    """A colour as the page gives it: itself, its twin on a dark page where figures.css has one."""
    return f"var(--c{colour[1:]}, {colour})" if colour in _with_a_twin() else colour


@cache
def _with_a_twin() -> frozenset[str]:
    css = files("ers_mj.report").joinpath("figures.css").read_text(encoding="utf-8")
    return frozenset(f"#{digits}" for digits in re.findall(r"--c([0-9a-f]{6}):", css))


def margins(figure: Figure, top: float = 0.1) -> None:
    """Room for labels about the axes, in inches: a layout that measures every text takes longer than all the
    drawing.
    """
    width, height = figure.get_size_inches()
    figure.subplots_adjust(
        left=0.8 / width, right=1.0 - 0.12 / width, bottom=0.5 / height, top=1.0 - top / height, hspace=0.1
    )
    for ax in figure.axes:
        ax.yaxis.set_label_coords(-0.62 / (width - 0.92), 0.5)


def plain_ticks(ax: Axes, ticks: Sequence[float]) -> None:
    """These ticks alone along a logarithmic axis, in plain numbers."""
    ax.set_xticks(ticks, [f"{t:g}" for t in ticks])
    ax.xaxis.minorticks_off()
