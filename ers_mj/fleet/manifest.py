"""The list of servos: a CSV with a name and recordings a row, all of it checked before any work starts."""

from __future__ import annotations

import csv
import glob
import io
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ers_mj.data.tables import reason
from ers_mj.errors import InputError

REQUIRED, OPTIONAL = ("name", "recordings"), ("datasheet", "holdout", "map")
OURS = ("batch.csv", "batch.json", "report.html")  # what the folder holds beside the servos


@dataclass(frozen=True)
class Servo:
    """A row: recordings and those held out as paths relative to `folder`, what is known (path, "table1" or nothing),
    and contract name -> column.
    """

    name: str
    folder: Path
    recordings: tuple[str, ...]
    holdout: tuple[str, ...] = ()
    datasheet: str = ""
    mapping: tuple[tuple[str, str], ...] = ()

    def path(self, relative: str) -> Path:
        """Where something lies that the row names."""
        return self.folder / relative


def read_manifest(given: str) -> list[Servo]:
    """The servos, in order.

    Raises:
        InputError: the file, a column, a name or a pattern cannot be used; one sentence, with the line.
    """
    path = Path(given)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or "is no UTF-8 text"
        raise InputError(f"{given}: cannot be read ({why}), a CSV with name,recordings was expected") from None
    table = csv.DictReader(io.StringIO(text), skipinitialspace=True, restkey="")
    heads = [head.strip() for head in table.fieldnames or ()]
    _refuse_heads(given, heads)
    table.fieldnames = heads
    servos: dict[str, Servo] = {}
    for row in table:
        where = f"{given}, line {table.line_num}"
        if "" in row:
            raise InputError(f"{where}: has more cells than the {len(heads)} columns, quote a cell that holds a comma")
        servo = _servo(where, {key: (cell or "").strip() for key, cell in row.items()}, path.parent)
        twin = servos.setdefault(servo.name.casefold(), servo)
        if twin is not servo:
            raise InputError(f"{where}: the name {servo.name!r} stands twice, each servo needs one of its own")
    if not servos:
        raise InputError(f"{given}: names no servo, a line of name,recordings was expected for each")
    return list(servos.values())


def _refuse_heads(given: str, heads: list[str]) -> None:
    known = (*REQUIRED, *OPTIONAL)
    for head in REQUIRED:
        if head not in heads:
            raise InputError(f"{given}: has no column {head!r}; {', '.join(heads) or 'none'} was given")
    for head in heads:
        if head not in known or heads.count(head) > 1:
            twice = "twice a column" if head in known else "a column"
            raise InputError(f"{given}: has {twice} {head[:40]!r}; there are {', '.join(known)}")


def _servo(where: str, row: Mapping[str, str], folder: Path) -> Servo:
    _refuse_name(where, row["name"])
    found = {key: _paths(where, row.get(key, ""), folder) for key in ("recordings", "holdout")}
    if not found["recordings"]:
        raise InputError(f"{where}: {row['name']} has no recordings, at least one path was expected")
    pairs = _mapping(where, row.get("map", ""))
    return Servo(row["name"], folder, found["recordings"], found["holdout"], row.get("datasheet", ""), pairs)


def _refuse_name(where: str, name: str) -> None:
    """Raise InputError where a name is no name of one folder within another."""
    if not name:
        raise InputError(f"{where}: a servo has no name")
    if ".." in name or name.startswith(".") or re.search(r"[/\\:\x00-\x1f]", name) or len(name.encode()) > 200:
        raise InputError(
            f"{where}: the name {name[:60]!r} cannot be that of a folder; one without .. and separators, that does not"
            " begin with a dot, was expected"
        )
    if name.casefold() in OURS:
        raise InputError(f"{where}: the name {name!r} is that of a file of the results, another was expected")


def _paths(where: str, cell: str, folder: Path) -> tuple[str, ...]:
    """Paths of a cell, each glob as what it finds, in order; `#run=17` stays behind each path."""
    out = []
    for part in filter(None, map(str.strip, cell.split(";"))):
        pattern, mark, run = part.partition("#")
        if not glob.has_magic(pattern) or os.path.exists(folder / pattern):
            out.append(part)
            continue
        try:
            found = sorted(glob.glob(pattern, root_dir=folder, recursive=True))
        except (RecursionError, re.error) as error:
            raise InputError(f"{where}: {pattern[:80]!r} is no pattern of files ({reason(error)})") from None
        if len(pattern) > 4096:  # no file system has such a path
            raise InputError(f"{where}: {pattern[:80]!r} and so on finds no file, a shorter pattern was expected")
        # what finds nothing is a path that is not there: its row says so, the other rows go on
        out += [path + mark + run for path in found] or [part]
    return tuple(out)


def _mapping(where: str, cell: str) -> tuple[tuple[str, str], ...]:
    pairs = []
    for part in filter(None, map(str.strip, cell.split(";"))):
        name, mark, column = part.partition("=")
        if not (mark and name and column):
            raise InputError(f"{where}: map {part[:40]!r} is not of the form name=column, as in t_s=Time")
        pairs.append((name, column))
    if len(dict(pairs)) < len(pairs):
        raise InputError(f"{where}: map gives a name twice, one column was expected")
    return tuple(pairs)
