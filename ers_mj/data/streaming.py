"""Text that arrives in pieces, in a recording's CSV format -> samples of time, input and output, checked as they come.

    pieces of text -> whole lines -> header: columns by role -> rows: numbers -> (t, u, y)

The columns are a recording's (see columns.COLUMNS) with its units; whatever else a line holds is ignored. A missing
output is NaN, a missing input the one before.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ers_mj.data.columns import COLUMNS, Asking, choose_columns
from ers_mj.data.tables import BLANK
from ers_mj.errors import InputError

FIELDS = ("t", "u", "y")
DELIMITERS = ",;\t"  # semicolons and tabs bring decimal commas


class Stream:
    """Reads a stream of text: ``feed`` returns the samples of the lines that have become whole.

    Attributes:
        name: of the stream, for messages.
        units: of "t", "u" and "y", once the header has come.
    """

    def __init__(self, name: str, mapping: Mapping[str, str] | None = None):
        """``mapping`` is contract name -> column, as in `read_recording`."""
        self.name = name
        self.units: dict[str, str] = {}
        self._mapping, self._rest, self._rows = dict(mapping or {}), "", 0
        self._time, self._input = -math.inf, math.nan

    def feed(self, text: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Samples t [s], u, y (N,) of the lines that this text completes; u and y in ``units``.

        Raises:
            InputError: the header or a row cannot be used.
        """
        *lines, self._rest = (self._rest + text).replace("\r\n", "\n").split("\n")
        rows = []
        for line in lines:
            if not self.units:
                if line.strip("\ufeff \t\r"):
                    self._read_header(line)
            elif line.strip():
                rows.append(self._row(line))
        t, u, y = (np.array(column, float) for column in zip(*rows)) if rows else (np.zeros(0),) * 3
        return t, u, y

    def _read_header(self, line: str) -> None:
        if "\0" in line:
            raise InputError(f"{self.name}: is binary, lines of CSV were expected")
        line = line.strip("\ufeff\r")
        self._delimiter = max(DELIMITERS, key=line.count)
        columns = [column.strip(' \t"') for column in line.split(self._delimiter)]
        if twice := [c for c in columns if columns.count(c) > 1]:
            raise InputError(f"{self.name}: the column {twice[0]} stands there more than once")
        choice = choose_columns(columns, Asking(self._mapping), self.name)
        roles, self._width = choice.roles(), len(columns)
        sources = [choice.sources[roles[field]] for field in FIELDS]
        for source in sources:
            if not source.is_plain:
                raise InputError(f"{self.name}: --map gives {source.text!r}, a stream takes single columns")
        self._cells = [(columns.index(s.columns[0]), s.unit.factor, s.columns[0]) for s in sources]
        self.units = {field: COLUMNS[roles[field]].unit for field in FIELDS}

    def _row(self, line: str) -> tuple[float, float, float]:
        cells, self._rows = line.split(self._delimiter), self._rows + 1
        if len(cells) != self._width:
            raise InputError(f"{self.name}: data row {self._rows} has {len(cells)} cells, the header has {self._width}")
        t, u, y = (self._number(cells[k], label) * factor for k, factor, label in self._cells)
        if not t > self._time:
            what = "is missing" if t != t else "repeats" if t == self._time else "runs backwards"
            raise InputError(f"{self.name}: the time {self._cells[0][2]} {what} in data row {self._rows}")
        self._time, self._input = t, self._input if u != u else u
        if self._input != self._input:
            raise InputError(
                f"{self.name}: {self._cells[1][2]} is missing in data row {self._rows}, before any value of it"
            )
        return t, self._input, y

    def _number(self, cell: str, label: str) -> float:
        text = cell.strip(' "\r')
        if text.lower() in BLANK:
            return math.nan
        try:
            x = float(text if self._delimiter == "," else text.replace(",", "."))
        except ValueError:
            raise InputError(
                f"{self.name}: the column {label} has the text {text[:40]!r} in data row {self._rows}, a number was"
                " expected"
            ) from None
        if math.isinf(x):
            raise InputError(f"{self.name}: {label} is infinite in data row {self._rows}")
        return x
