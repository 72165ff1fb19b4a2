"""What a model's file carries of the diagnosis that made it."""

from __future__ import annotations

import math
from dataclasses import replace

from ers_mj.servo.datasheet import Datasheet


def with_diagnosis(sheet: Datasheet, document: dict) -> Datasheet:
    """The model with its units, the verdict that made it, and the intervals of what was identified of it."""
    held = {**sheet.lumped, **sheet.loop, **sheet.baseline}
    rows = {name: row["ci95"] for name, row in document["parameters"].items() if name in held and row["identifiable"]}
    for missing in document["missing"]:
        given = dict(sheet.effects).get(missing["effect"], {})
        told = missing["parameters"].items()
        rows |= {f"{missing['effect']}.{name}": row["ci95"] for name, row in told if name in given}
    ends = {key: [math.nan if x is None else float(x) for x in row] for key, row in rows.items()}
    known = {key: (low, high) for key, (low, high) in ends.items() if -math.inf < low <= high < math.inf}
    units = {key: document["data"][key] for key in ("output_unit", "input_unit")}
    return replace(sheet, **units, verdict=document["verdict"], intervals=known)
