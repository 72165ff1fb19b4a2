"""The page of `ers inspect`: what was read, over time, over its range and over frequency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ers_mj.data.inspection import Inspection
from ers_mj.report import charts, page
from ers_mj.report.charts import packed
from ers_mj.report.display import shown
from ers_mj.report.thinning import decimate, merged

POINTS = 6000  # of a series: enough for a zoom to a tenth
BANDS = 600  # of a spectrum
HEADS = ("channel", ">refresh", ">lowest", ">highest", ">noise", ">quantum", ">at an end", ">blank")


def inspect_page(document: Mapping, found: Sequence[Inspection]) -> str:
    """The page as HTML, of what `ers inspect --json` prints and the recordings behind it."""
    told = len(document["faults"])
    several = ("s"[: told != 1], "s"[: len(found) != 1])
    sentence = f"{told} finding{several[0]} on the data of {len(found)} recording{several[1]}"
    counts = (("input", document["input_kind"]), ("recordings", len(found)), ("findings", told))
    tiles = [(name, page.text(value)) for name, value in counts]
    parts = [page.header("consistent", "Recordings", "ers inspect", sentence, tiles)]
    parts += [_one(one, k) for k, one in enumerate(document["recordings"])]
    drawn = {f"{name}-{k}": draw(one) for k, one in enumerate(found) for name, draw in DRAWN.items()}
    return charts.frame("Recordings", "consistent", "\n".join(parts), {"charts": drawn})


def _one(one: Mapping, k: int) -> str:
    """The section of recording k."""
    lead = (
        f"{one['samples']} samples, {one['duration_s']:.4g} s at {one['rate_hz']:.5g} Hz; 95 % of the input's power"
        f" lies below {one['input_band_hz']:.3g} Hz."
    )
    rows = [(_cells(channel), "") for channel in one["channels"]]
    tells = [f"{'could tell' if t['can'] else 'cannot tell'} {t['what']}: {t['why']}" for t in one["tells"]]
    content = [
        page.listed(one["problems"]),
        page.table(HEADS, rows),
        charts.place(f"recorded-{k}", "input and output over time"),
        charts.place(f"coverage-{k}", "where the time is spent"),
        charts.place(f"power-{k}", "power over frequency"),
        page.listed(tells),
    ]
    return page.section(page.text(one["file"]), page.text(lead), "\n".join(content))


def _cells(c: Mapping) -> tuple[str, ...]:
    numbers = (c["low"], c["high"], c["noise"], c["quantum"])
    told = [f"{x:.4g}" if x is not None else "" for x in numbers]
    return (page.text(c["name"]), f"{c['refresh_s']:.4g} s", *told, page.share(c["at_ends"]), str(c["blanks"]))


def _recorded(inspection: Inspection) -> dict:
    """Output and input over time, and the faults that have a place there."""
    r = inspection.record
    u, y = shown(r.input_unit), shown(r.output_unit)
    closest, whole = float(r.t[-1] - r.t[0]) / POINTS, (float(r.t[0]), float(r.t[-1]))
    places = tuple(f.region for f in r.faults if f.region and f.region != whole)
    return {
        "kind": "recorded",
        "panels": [
            {"name": f"output [{y.label}]", "unit": y.label, "kind": "after", "held": False},
            {"name": f"input [{u.label}]", "unit": u.label, "kind": "input", "held": True},
        ],
        "shaded": [list(span) for span in merged(places, closest)],
        "levels": [[_series(r.t, y.factor * r.y), _series(r.t, u.factor * r.u)]],
    }


def _series(t: np.ndarray, x: np.ndarray) -> dict:
    at, thinned = decimate(t, x, POINTS)
    return {"t": packed(at), "y": packed(thinned)}


def _coverage(inspection: Inspection) -> dict:
    """The share of the time [%] over output, speed and input."""
    r = inspection.record
    y, u = shown(r.output_unit), shown(r.input_unit)
    names = {"output": f"output [{y.label}]", "speed": f"speed [{y.label}/s]", "input": f"input [{u.label}]"}
    panels = [
        {
            "name": names[name],
            "edges": ((u if name == "input" else y).factor * edges).tolist(),
            "share": (100.0 * share).tolist(),
        }
        for name, (edges, share) in inspection.coverage.items()
    ]
    return {"kind": "coverage", "panels": panels}


def _power(inspection: Inspection) -> dict:
    """Power densities over their peaks [dB]: the largest of each of some hundred bands that widen with frequency."""
    f, u, y = (x[1:] for x in inspection.spectrum)
    begins = np.unique(np.geomspace(1, f.size, BANDS).astype(int)) - 1
    levels = []
    for kind, name, power in (("input", "input", u), ("after", "output", y)):
        if (peak := float(power.max())) > 0.0:
            share = np.maximum.reduceat(power, begins) / peak
            decibels = 10.0 * np.log10(np.where(share > 0.0, share, np.nan))
            levels.append({"kind": kind, "name": name, "y": packed(decibels)})
    return {"kind": "power", "f": packed(np.log10(f[begins])), "levels": levels}


DRAWN = {"recorded": _recorded, "coverage": _coverage, "power": _power}
