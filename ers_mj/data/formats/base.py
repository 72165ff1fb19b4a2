"""What a reader of files gives, and what it is asked."""

from __future__ import annotations

import importlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType

import numpy as np
import pyarrow as pa

from ers_mj.data.tables import listed
from ers_mj.errors import InputError, MissingPackage


@dataclass(frozen=True)
class File:
    """What is to be read.

    Attributes:
        path: of the file, or of a folder where a format is one.
        content: its bytes, unpacked; none of a folder.
        name: for messages.
        wanted: what a person has mapped, as it was given.
        beside: further files that the format needs (a DBC).
    """

    path: Path
    content: bytes
    name: str
    wanted: Mapping[str, str] = field(default_factory=dict)
    beside: Sequence[Path] = ()


@dataclass(frozen=True)
class Loaded:
    """A file as a table.

    Attributes:
        table: its columns.
        notes: what was skipped or assumed, a sentence each.
        units: column -> unit, where the file says one.
        left_out: what of the file is no column -> why not.
    """

    table: pa.Table
    notes: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Most:
    """What a file may hold, unpacked: a few bytes may say that they stand for more than there is memory."""

    columns: int = 10_000
    cells: int = 500_000_000
    size: int = 4 << 30  # [bytes]
    text: int = 1 << 30  # [bytes], which take several times their size to read


MOST = Most()


def refuse_large(name: str, columns: int = 0, rows: int = 0, size: int = 0, text: int = 0) -> None:
    """Raise InputError where a file holds more than can be read into memory."""
    for what, count, most in (
        ("columns", columns, MOST.columns),
        ("cells", columns * rows, MOST.cells),
        ("bytes unpacked", size, MOST.size),
        ("bytes of text", text, MOST.text),
    ):
        if count > most:
            raise InputError(
                f"{name}: holds {count} {what}, at most {most} were expected, cut it or leave out what is not needed"
            )


def library(module: str, package: str, extra: str, name: str) -> ModuleType:
    """The library that reads a format.

    Raises:
        MissingPackage: it is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError:
        raise MissingPackage(
            f"{name}: is read by the package {package}, which is not installed: pip install 'ers-mj[{extra}]'"
        ) from None


def table_of(columns: Mapping[str, np.ndarray], name: str) -> pa.Table:
    """Columns of one length as a table; arrays (N, k) become lists.

    Raises:
        InputError: there is none, or they differ in length.
    """
    lengths = {column: len(x) for column, x in columns.items()}
    if not lengths:
        raise InputError(f"{name}: holds no columns of numbers")
    if len(set(lengths.values())) > 1:
        told = listed(f"{column} ({count})" for column, count in lengths.items())
        raise InputError(f"{name}: its columns differ in length: {told}")
    arrays = {c: pa.array(list(x) if x.ndim > 1 else x) for c, x in columns.items()}
    return pa.table(arrays)


def refuse_twice(columns: Sequence[str], name: str) -> None:
    """Raise InputError where a column stands there more than once."""
    if twice := [column for column, count in Counter(columns).items() if count > 1]:
        raise InputError(f"{name}: the column {listed(twice)} stands there more than once")
