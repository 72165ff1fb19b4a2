"""Charts that a page draws itself: a place for each, their data as one block of JSON, and our script (script/*.js).

data (plain records of numbers and packed series) -> frame: HTML, block, script; no address outside the page
"""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Mapping
from functools import cache
from hashlib import sha256
from importlib.resources import files

import numpy as np

from ers_mj.report import page

PARTS = "base", "timeline", "traces", "figures", "recordings", "page"
ABSENT = 2**16 - 1  # the packed number that stands for none; the others are steps from the lowest to the highest value
NO_SCRIPT = (
    "The charts are drawn by a script inside this page, which is switched off here; every number that was found stands"
    " in the text and the tables."
)


def packed(x: np.ndarray) -> dict:
    """x (N,) as 16-bit steps in base64, a tenth of what its digits would take; what is not finite is absent."""
    known = np.isfinite(x)
    low, high = (float(x[known].min()), float(x[known].max())) if known.any() else (0.0, 0.0)
    step = (high - low) / (ABSENT - 1) or 1.0
    steps = np.full(x.size, ABSENT, "<u2")
    steps[known] = np.rint((x[known] - low) / step)
    return {"o": low, "s": step, "b": b64encode(steps.tobytes()).decode("ascii")}


def place(name: str, described: str, caption: str = "") -> str:
    """Where the chart of this name is drawn; `described` is read out in its place."""
    caption = f"<figcaption>{caption}</figcaption>" if caption else ""
    return (
        f'<figure data-chart="{page.text(name)}" data-described="{page.text(described)}">'
        f"<noscript><p>{NO_SCRIPT}</p></noscript>{caption}</figure>"
    )


def frame(title: str, kind: str, body: str, data: Mapping) -> str:
    """The whole page as HTML, with the data of its charts; other scripts than ours do not run in it."""
    script = _script()
    digest = b64encode(sha256(script.encode()).digest()).decode("ascii")
    allowed = f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
    head = f'<meta http-equiv="Content-Security-Policy" content="{allowed}">\n'
    foot = f'<script type="application/json" id="chart-data">{block(data)}</script>\n<script>{script}</script>\n'
    return page.frame(title, kind, body, ("report.css", "charts.css"), head, foot if data["charts"] else "")


def block(data: Mapping) -> str:
    """Data as JSON that ends no element: what HTML would read is written as escapes."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


@cache
def _script() -> str:
    folder = files("ers_mj.report").joinpath("script")
    parts = (folder.joinpath(f"{name}.js").read_text(encoding="utf-8") for name in PARTS)
    return '"use strict";\n(() => {\n' + "\n".join(parts) + "})();\n"
