"""The two diagnoses that are compared, as files, and what keeps them from being compared."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ers_mj.errors import InputError

FILE = "diagnosis.json"


@dataclass(frozen=True)
class Told:
    """A diagnosis as it was written: its document, and how it is called beside another."""

    name: str
    document: Mapping[str, Any]

    @property
    def data(self) -> Mapping[str, Any]:
        """What it rests on."""
        return self.document["data"]


def read_told(given: str | os.PathLike[str]) -> Told:
    """A diagnosis from its folder or its diagnosis.json.

    Raises:
        InputError: there is none, or the file is none.
    """
    path = Path(given)
    file = path / FILE if path.is_dir() else path
    if not file.is_file():
        what = f"the folder holds no {FILE}" if path.is_dir() else "there is no such file or folder"
        raise InputError(f"{given}: {what}; a folder that `ers diagnose` wrote was expected, or its {FILE}")
    try:
        document = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise InputError(f"{file}: is no JSON, a {FILE} was expected") from None
    missing = [key for key in ("version", "verdict", "parameters", "data") if not _has(document, key)]
    if missing:
        raise InputError(f"{file}: has no {missing[0]!r}, a {FILE} of `ers diagnose` was expected")
    if document["version"] != 1:
        raise InputError(f"{file}: is a diagnosis of version {document['version']}, version 1 was expected")
    return Told(str(given), document)


def _has(document: object, key: str) -> bool:
    return isinstance(document, Mapping) and (
        isinstance(document.get(key), Mapping) if key in ("parameters", "data") else key in document
    )


def refuse_unlike(a: Told, b: Told) -> None:
    """Raise InputError where numbers of one mean another thing in the other."""
    for key, what in (("input_kind", "input is a"), ("input_unit", "input is in"), ("output_unit", "output is in")):
        ours, theirs = a.data.get(key), b.data.get(key)
        if ours != theirs:
            raise InputError(
                f"{b.name}: its {what} {theirs}, that of {a.name} {what.partition(' ')[2]} {ours}; diagnoses of one"
                " kind of input and of the same units can be compared"
            )


def reservations(a: Told, b: Told) -> list[str]:
    """What a reader should know before the differences, a sentence each."""
    told = []
    if shared := set(a.data.get("sha256") or ()) & set(b.data.get("sha256") or ()):
        told.append(
            f"both rest on {len(shared)} recording{'s'[: len(shared) != 1]} in common, so that chance moved them alike:"
            " the intervals of the differences are wider than they need be"
        )
    sheets = [{k: row.get("datasheet") for k, row in told.document["parameters"].items()} for told in (a, b)]
    other = [name for name in sheets[0] if name in sheets[1] and sheets[0][name] != sheets[1][name]]
    if other:
        told.append(
            f"their datasheets differ ({', '.join(other[:6])}), on which every torque of an effect stands: these are"
            " compared as they were written"
        )
    for one in (a, b):
        if one.document.get("left_out"):
            told.append(f"{one.name} is a quick look, which leaves parts of the search out")
    return told
