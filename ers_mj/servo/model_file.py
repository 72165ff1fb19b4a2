"""The file that a diagnosis hands back (`model.toml`): a datasheet as TOML that `read_datasheet` reads back exactly."""

import json
import os
import re
from collections.abc import Mapping
from pathlib import Path

from ers_mj.data.whole import write_whole
from ers_mj.effects import TABLES
from ers_mj.servo.datasheet import Datasheet


def write_model(path: str | os.PathLike[str], datasheet: Datasheet) -> None:
    """Write a model as TOML that reads back exactly; whole or not at all.

    Raises:
        InputError: the path cannot be written.
    """
    sections = {"parameters": datasheet.parameters, "lumped": datasheet.lumped}
    lines = [line for title, table in sections.items() if table for line in _lines(f"[{title}]", table)]
    lines += _comes_with(datasheet)
    lines += _lines("[baseline]", datasheet.baseline)
    if datasheet.loop:
        title = f'[loop]\nkind = "{datasheet.loop_kind}"\nsensor = "{datasheet.loop_sensor}"'
        lines += _lines(title, datasheet.loop)
    for name, values in datasheet.effects:
        section = "remainder" if name in TABLES else "effect"
        lines += [f"[[{section}]]", f"name = {_quoted(name)}", *_lines(f"[{section}.parameters]", values)]
    if datasheet.verdict:
        lines += ["[diagnosis]", f"verdict = {_quoted(datasheet.verdict)}", ""]
    if datasheet.intervals:
        ends = (f"{_key(key)} = [{low!r}, {high!r}]" for key, (low, high) in datasheet.intervals.items())
        lines += ["[diagnosis.ci95]", *ends, ""]
    write_whole(Path(path), "\n".join(lines))


def _comes_with(datasheet: Datasheet) -> list[str]:
    """The section of the recordings; no line where nothing is told of them."""
    units = {"output_unit": datasheet.output_unit, "input_unit": datasheet.input_unit}
    told = [f"{key} = {_quoted(unit)}" for key, unit in units.items() if unit]
    if datasheet.sample_rate_hz is not None:
        told.insert(0, f"sample_rate_hz = {float(datasheet.sample_rate_hz)!r}")
    return ["[recording]", *told, ""] if told else []


def _lines(title: str, table: Mapping[str, float]) -> list[str]:
    return [title, *(f"{_key(key)} = {float(x)!r}" for key, x in table.items()), ""]


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _quoted(key)


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
