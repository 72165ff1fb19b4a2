"""JSON: a list of records, records line by line, or a record of lists; records within records get dotted names."""

from __future__ import annotations

import contextlib
import json
from typing import Any

import numpy as np

from ers_mj.data.formats import arrays
from ers_mj.data.formats.base import File, Loaded, refuse_large
from ers_mj.errors import InputError

FORMAT = "JSON file"


def load(file: File) -> Loaded:
    """The records as columns; what a record lacks is missing there."""
    refuse_large(file.name, text=len(file.content))
    tree = _parsed(file)
    while isinstance(tree, dict) and len(tree) == 1 and isinstance(next(iter(tree.values())), (list, dict)):
        tree = next(iter(tree.values()))
    if isinstance(tree, list) and tree and all(isinstance(row, dict) for row in tree):
        return arrays.loaded(_of_records([dict(_flat(row)) for row in tree]), file.name)
    if isinstance(tree, dict):
        return arrays.loaded({k: _array(x) for k, x in _flat(tree)}, file.name)
    raise InputError(f"{file.name}: a list of records, or a record of lists, was expected")


def _parsed(file: File) -> Any:
    text = file.content.decode("utf-8-sig")
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return _lines(text)


def _lines(text: str) -> list[Any]:
    """The records of lines; the last one may be cut off, as a logger that was stopped leaves it."""
    lines = [line for line in text.splitlines() if line.strip()]
    if len(lines) < 2:
        return json.loads(text)
    *whole, last = lines
    rows = [json.loads(line) for line in whole]
    with contextlib.suppress(json.JSONDecodeError):
        rows.append(json.loads(last))
    return rows


def _flat(tree: dict, path: str = "") -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []
    for key, value in tree.items():
        found += _flat(value, f"{path}{key}.") if isinstance(value, dict) else [(f"{path}{key}", value)]
    return found


def _of_records(rows: list[dict[str, Any]]) -> dict[str, np.ndarray]:
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: _array([row.get(name) for row in rows]) for name in names}


def _array(values: Any) -> np.ndarray:
    """Numbers with NaN where null stands; what is none of these as objects."""
    if isinstance(values, list):
        values = [float("nan") if x is None else x for x in values]
    try:
        array = np.array(values)
    except ValueError:  # lists of several lengths
        return np.array(values, object)
    return array
