"""What a person says of the columns: `--map theta_rad=...` and the TOML that keeps it.

"Time [ms]" -> the column of that name, or the column Time in milliseconds
"enc:counts/4096" -> the column enc, 4096 counts of which are a turn
"pwm*24/255" -> arithmetic over columns; "observation.state[3]" -> an element of a column of lists
"""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from ers_mj.data.expressions import Column, Unreadable, columns_of, tokens, value
from ers_mj.data.tables import listed, read_content, reason
from ers_mj.data.units import COUNTS, Unit, conversion, is_unit, split_header, suffix_of
from ers_mj.errors import InputError

KEYS = ("map", "input", "second", "episode", "dbc")  # of a mapping that is kept in a TOML


@dataclass(frozen=True)
class Source:
    """Where a quantity of a recording comes from.

    Attributes:
        text: as it was given.
        parts: the tokens of its arithmetic.
        unit: from what the arithmetic gives to the recording's unit.
        sure: whether a person gave the unit or the factor.
        told: what was understood, for a person to check; "" where nothing was assumed.
    """

    text: str
    parts: tuple[str | float | Column, ...]
    unit: Unit
    sure: bool = False
    told: str = ""

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns it reads."""
        return tuple(dict.fromkeys(name for name, _ in columns_of(self.parts)))

    @property
    def is_plain(self) -> bool:
        """Whether it is one column, as it stands but for a factor."""
        return len(self.parts) == 1 and self.unit.offset == 0.0

    def values(self, column: Callable[[Column], np.ndarray], name: str) -> tuple[np.ndarray, float]:
        """Values (N,) as the file prints them, and the factor to the recording's unit; what is more than one column
        comes in that unit already, under the factor 1.
        """
        try:
            found = value(self.parts, column)
        except Unreadable as error:
            raise InputError(f"{name}: --map gives {self.text!r}, which cannot be worked out ({error})") from None
        array = np.asarray(found, float)
        if self.is_plain:
            return array, self.unit.factor
        return array * self.unit.factor + self.unit.offset, 1.0


Target = tuple[str, float]  # a recording's unit, and the factor to it from that of the contract's name


def source_of(
    contract: str, text: str, target: Target, columns: Sequence[str], file_units: Mapping[str, str], name: str
) -> Source:
    """What is mapped to a contract name.

    Args:
        file_units: column -> unit, where the file says one.

    Raises:
        InputError: the text names no column, or a unit that does not fit.
    """
    if text in columns:
        return _column(contract, text, (text, None), target, file_units, name)
    body, given = _split_unit(text, columns)
    parts = _parts(body, columns, name)
    if given is None:
        if len(parts) == 1 and isinstance(parts[0], tuple):
            return _column(contract, text, parts[0], target, file_units, name)
        return Source(text, tuple(parts), Unit("", target[1]), True, f"{contract} is {body}")
    turned = _conversion(contract, given, target[0], name)
    return Source(text, tuple(parts), turned, True, f"{contract} is {body} in {given}")


def _column(contract: str, text: str, part: Column, target: Target, file_units: Mapping[str, str], name: str) -> Source:
    """A column by itself, in the unit that its file or its header says, or its name ends in, else in that of the
    contract's name.
    """
    said = file_units.get(part[0]) or split_header(part[0])[1]
    if said is None and (ending := suffix_of(part[0])) and (turned := conversion(ending, target[0])):
        told = "" if turned.factor == target[1] else f"{contract} is {part[0]}, in {ending} as its name says"
        return Source(text, (part,), turned, told=told)
    if said is None or not is_unit(said) or target[0] == "-":
        return Source(text, (part,), Unit("", target[1]))
    turned = _conversion(contract, said, target[0], name)
    if turned.factor == target[1]:
        return Source(text, (part,), turned)
    return Source(text, (part,), turned, True, f"{contract} is {part[0]}, in {said} as its file says")


def _split_unit(text: str, columns: Sequence[str]) -> tuple[str, str | None]:
    """Arithmetic and unit of "Time [ms]" and of "enc:counts/4096"; no unit where there is none."""
    bracket = re.fullmatch(r"(.*?)\s*\[\s*([^\[\]]+?)\s*\]\s*", text)
    if bracket and not bracket[2].isdigit() and not _is_readable(text, columns):
        return bracket[1], bracket[2]
    head, colon, tail = text.rpartition(":")
    return (head, tail.strip()) if colon and (is_unit(tail) or head.strip() in columns) else (text, None)


def _is_readable(text: str, columns: Sequence[str]) -> bool:
    """Whether it is arithmetic as it stands: names of columns may end in brackets."""
    try:
        return bool(tokens(text, columns))
    except Unreadable:
        return False


def _parts(body: str, columns: Sequence[str], name: str) -> list[str | float | Column]:
    """The tokens of arithmetic that names at least one column, all of them there."""
    try:
        parts = tokens(body, columns)
    except Unreadable:
        parts = []
    if not columns_of(parts):
        near = get_close_matches(body, columns, n=1)
        hint = f" (did you mean {near[0]}?)" if near else ""
        raise InputError(f"{name}: --map asks for the column {body!r}{hint}, the columns are {listed(columns)}")
    return parts


def _conversion(contract: str, text: str, unit: str, name: str) -> Unit:
    found = conversion(text, unit)
    if found is not None:
        return found
    if unit == "rad" and text.strip().lower() in COUNTS:
        raise InputError(f"{name}: {contract} is given in {text}, say how many make a turn, as in counts/4096")
    what = "measures something else" if is_unit(text) else "is no unit that is known"
    raise InputError(f"{name}: {contract} is given in {text!r}, which {what}; a unit such as {unit} was expected")


def read_map_file(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The mapping that a TOML keeps: a table [map] of contract name = "column", and input, second, episode.

    Raises:
        InputError: it is no such file.
    """
    file = Path(path)
    try:
        found = tomllib.loads(read_content(file).decode())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{file}: is not a readable TOML file ({reason(error)})") from None
    if strange := [key for key in found if key not in KEYS]:
        raise InputError(f"{file}: holds {listed(strange)}, known are {listed(KEYS)}")
    table = found.get("map", {})
    if not isinstance(table, dict) or not all(isinstance(text, str) for text in table.values()):
        raise InputError(f'{file}: [map] holds lines such as t_s = "Time [ms]", {listed(table)} was given')
    return found
