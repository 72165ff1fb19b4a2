"""The numbers of a position loop in the contract's letters, and as a model.toml."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from ers_mj.effects import BY_NAME
from ers_mj.position_loop.fit import Data
from ers_mj.position_loop.intervals import COMBINED, DOUBT, Intervals, Told
from ers_mj.position_loop.model import LETTERS, LoopModel
from ers_mj.servo.datasheet import LOOP, Datasheet

ROWS = ("K", "D", "I", "L", "tau_s", "dead_time_s", "R", "a_1", "a_2", "c_2")
SELDOM = ("least",)
COMBINED_UNITS = {"a_2+D": "1/s", "c_2/K": "{y}", "(a_2+D)/K": "s", "L/K": "{y}", "I/K": "1/s"}
UNKNOWN = {"value": None, "ci95": [None, None], "datasheet": None, "identifiable": False}
NOTHING = Told(0.0, (0.0, 0.0), True)


def parameters(found: Intervals, y: str, data: Data, known: Mapping[str, float] = MappingProxyType({})) -> dict:
    """Every letter of the loop and the plant, null where the recordings cannot tell it, and what combinations they
    tell; beside them what is ``known`` beforehand.
    """
    rows = {}
    for letter in (*ROWS, *(x for x in SELDOM if x in found.model.free)):
        rows[letter] = _row(_letter(found, letter), LETTERS[letter].unit.format(y=y))
    if found.model["dead_time_s"] > 0.0:  # the latency is the whole loop's, not the command's
        rows["tau_s"] = dict(rows["dead_time_s"])
    signal = next((run.beside.unit for run in data.runs if run.beside is not None), y)
    rows["b"] = _row(found.input_gain(data), f"{y}/s^2/{signal}")
    rows["c_1"] = UNKNOWN | {"unit": f"{y}/s^2"}
    rows["theta_0"] = UNKNOWN | {"unit": y}
    for name in COMBINED:
        rows[name] = _row(found.combined(name), COMBINED_UNITS[name].format(y=y))
    return {name: row | {"datasheet": known.get(name)} for name, row in rows.items()}


def _letter(found: Intervals, letter: str) -> Told | None:
    """A letter as the recordings tell it; a sum that stands in for its parts tells none of them."""
    model = found.model
    if letter in ("a_2", "D") and not _is_parted(model):
        return None
    if letter in model.free:
        return found.told("", letter)
    if letter in ("tau_s", "dead_time_s"):  # less than the firmware's own steps is not seen
        return Told(0.0, (0.0, 2.0 * DOUBT.clock), True)
    return None if letter in ("L", "R") else NOTHING


def _is_parted(model: LoopModel) -> bool:
    """Whether anything tells the loop's damping from the plant's: a limit that acts, a dead time."""
    return "L" in model.free or "dead_time_s" in model.free or "most" in model.free


def _row(found: Told | None, unit: str) -> dict:
    if found is None or not found.identifiable:
        ends = [None, None] if found is None else [float(x) for x in found.ci95]
        return UNKNOWN | {"unit": unit, "ci95": ends}
    return {
        "value": float(found.value),
        "unit": unit,
        "ci95": [float(x) for x in found.ci95],
        "datasheet": None,
        "identifiable": True,
    }


def improved(model: LoopModel) -> Datasheet:
    """The model as a model.toml: [lumped], [loop] and the effects with laws of their own."""
    loop = {k: float(model[k]) for k in LOOP if k in model.values and math.isfinite(model[k])}
    lumped = {k: float(model[k]) for k in ("a_1", "a_2", "c_2")}
    effects = tuple(
        (name, {p.name: float(v) for p, v in zip(BY_NAME[name].parameters, values, strict=True) if np.isfinite(v)})
        for name, values in model.effects
    )
    return Datasheet(
        lumped={k: max(v, 0.0) for k, v in lumped.items()},
        effects=effects,
        loop={k: v for k, v in loop.items() if v != LETTERS[k].absent},
        loop_kind=model.kind,
        loop_sensor=model.side,
        name="model.toml",
    )
