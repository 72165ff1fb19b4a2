"""Text in columns: commas, semicolons (decimal commas), tabs, bars or spaces, under a header that may have titles and
comments on top and units below.
"""

from __future__ import annotations

import io
import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv

from ers_mj.data.formats.base import File, Loaded, refuse_large, refuse_twice
from ers_mj.data.tables import reason
from ers_mj.data.units import is_unit
from ers_mj.errors import InputError

FORMAT = "CSV file"
DELIMITERS = ",;\t|"
COMMENT = re.compile(r"\s*(#|%|//)")
UTF_16 = b"\xff\xfe", b"\xfe\xff"  # marks at the beginning
BINARY = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f\x81\x8d\x8f\x90\x9d]")  # no characters of Windows-1252's text
TOP = 60  # lines within which a header is looked for


@dataclass(frozen=True)
class Text:
    """Header and rows of a text, and what was taken off it so far."""

    header: str
    body: str
    notes: tuple[str, ...] = ()


def load(file: File) -> Loaded:
    """The cells as text, under the names of the header."""
    refuse_large(file.name, text=len(file.content))
    text = _spaces_as_tabs(_uncommented(_below_titles(_decoded(file))))
    delimiter = max(DELIMITERS, key=text.header.count)
    text = _without_ends(text, delimiter)
    columns = [column.strip(' \t"') for column in text.header.split(delimiter)]
    refuse_large(file.name, len(columns))
    refuse_twice(columns, file.name)
    text, units = _without_units(text, columns, delimiter)
    text = _without_part(text, delimiter)
    table = _cells(text.body, columns, delimiter, file.name)
    if delimiter in ";\t|":
        table = pa.table([pc.replace_substring(cells, ",", ".") for cells in table.columns], names=columns)
    return Loaded(table, text.notes, units)


def _decoded(file: File) -> Text:
    """Header and rows. Text is in UTF-8, in UTF-16 where it begins so (as spreadsheets save it), or, where it is
    neither and holds no sign of a binary file, in Windows-1252, as many loggers write ° and µ.
    """
    notes: tuple[str, ...] = ()
    try:
        text = file.content.decode("utf-16" if file.content.startswith(UTF_16) else "utf-8-sig")
    except UnicodeDecodeError as error:
        if BINARY.search(file.content) or file.content.startswith(UTF_16):
            raise InputError(f"{file.name}: is not a text file in UTF-8 (byte {error.start} is no character)") from None
        text, notes = file.content.decode("cp1252", "replace"), ("it is not in UTF-8, Windows-1252 was taken",)
    text = text.lstrip()
    if "\0" in text:
        raise InputError(f"{file.name}: is a binary file, CSV was expected")
    header, *body = re.split(r"\r\n|\n|\r", text, maxsplit=1)
    return Text(header, "".join(body), notes)


def _below_titles(text: Text) -> Text:
    """Past comments and titles: down to the first line that is no comment and has as many cells as what stands above
    the first row of numbers; where numbers follow a comment at once, that comment is the header.
    """
    lines = re.split(r"\r\n|\n|\r", text.body, maxsplit=TOP)
    lines, rest = [text.header, *lines[:TOP]], "\n".join(lines[TOP:])
    several = [k for k, line in enumerate(lines) if _cells_in(line) > 1 and not COMMENT.match(line)]
    first = _header_among([(k, lines[k]) for k in several]) if several else 0
    if first and _is_numbers(lines[first]) and _is_header_of(lines[first - 1], lines[first]):
        first -= 1
    if not first and not COMMENT.match(lines[0]):
        return text
    header = COMMENT.sub("", lines[first]).strip() if COMMENT.match(lines[first]) else lines[first]
    body = "\n".join(lines[first + 1 :] + ([rest] if rest else []))
    told = f"the first {first} line{'s'[: first > 1]}, comments or titles, are skipped"
    return Text(header, body, (*text.notes, told) if first else text.notes)


def _header_among(lines: Sequence[tuple[int, str]]) -> int:
    """The number of the header among numbered lines of several cells: titles have fewer, or fewer that are filled."""
    above = list(itertools.takewhile(lambda numbered: not _is_numbers(numbered[1]), lines))
    if not above or len(above) == len(lines):  # no header, or no row of numbers to measure by
        return lines[0][0]
    sign = max(DELIMITERS, key=above[-1][1].count)
    filled = lambda line: sum(bool(cell.strip()) for cell in line.split(sign))
    width, most = above[-1][1].count(sign), filled(above[-1][1])
    return next(k for k, line in above if line.count(sign) == width and filled(line) >= most)


def _is_header_of(line: str, row: str) -> bool:
    """Whether a line, less a comment's sign, has as many names as a row of numbers has cells."""
    names = COMMENT.sub("", line)
    sign = max(DELIMITERS, key=row.count)
    return len(names.split(sign)) == len(row.split(sign)) if sign in row else len(names.split()) == len(row.split())


def _cells_in(line: str) -> int:
    return max(*(len(line.split(d)) for d in DELIMITERS), len(line.split()) if _is_numbers(line) else 0)


def _is_numbers(line: str) -> bool:
    cells = [c for c in re.split(r"[,;|\s]+", line.strip()) if c]
    return len(cells) > 1 and all(re.fullmatch(r"[+-]?(\d[\d.eE+-]*|\.\d+|nan)", c) for c in cells)


def _uncommented(text: Text) -> Text:
    """Without lines among the rows that begin with #."""
    if "#" not in text.body:
        return text
    body, count = re.subn(r"(?m)^[ \t]*#[^\n]*(\n|\Z)", "", text.body.replace("\r\n", "\n"))
    told = f"{count} lines that begin with # are skipped"
    return replace(text, body=body, notes=(*text.notes, told)) if count else text


def _spaces_as_tabs(text: Text) -> Text:
    """Columns between spaces come between tabs, where the header knows no other sign."""
    names = text.header.split()
    if any(d in text.header for d in DELIMITERS) or len(names) < 2:
        return text
    first = text.body.lstrip().splitlines()[:1]
    if not first or len(first[0].split()) != len(names):
        return text
    body = re.sub(r"[ \t]+", "\t", re.sub(r"(?m)^[ \t]+|[ \t]+$", "", text.body))
    return replace(text, header="\t".join(names), body=body, notes=(*text.notes, "its columns stand between spaces"))


def _without_ends(text: Text, delimiter: str) -> Text:
    """Without a separator at the end (or both ends) of each row that no column of the header belongs to."""
    header = text.header.rstrip()
    first = (text.body.lstrip("\r\n").splitlines() or [""])[0].rstrip()
    sign, notes = re.escape(delimiter), text.notes
    body = text.body
    if delimiter == "|" and header.startswith("|") and first.startswith("|"):
        header, body = header[1:], re.sub(r"(?m)^[ \t]*\|", "", body)
        first = first[1:]
    ends = header.endswith(delimiter)
    header = header[:-1] if ends else header
    if first.count(delimiter) == header.count(delimiter) + 1 and first.endswith(delimiter):
        body = re.sub(rf"(?m){sign}[ \r]*$", "", body)
        notes = (*notes, "its rows end in a separator, which is no column")
    elif not ends:
        return replace(text, body=body, header=text.header if header == text.header.rstrip() else header)
    return Text(header, body, notes)


def _without_units(text: Text, columns: list[str], delimiter: str) -> tuple[Text, dict[str, str]]:
    """A row of units below the header taken off, and what it says."""
    first, *rest = re.split(r"\r\n|\n|\r", text.body.lstrip("\r\n"), maxsplit=1)
    cells = [cell.strip(' \t"[]()') for cell in first.split(delimiter)]
    if len(cells) != len(columns) or not any(cells) or not all(is_unit(cell) for cell in cells if cell):
        return text, {}
    if all(re.fullmatch(r"[\d.]*", cell) for cell in cells):  # a row of ones is no row of units
        return text, {}
    units = {column: cell for column, cell in zip(columns, cells) if cell}
    told = f"its second line gives units: {first.strip()}"
    return replace(text, body="".join(rest), notes=(*text.notes, told)), units


def _without_part(text: Text, delimiter: str) -> Text:
    """Without a last row that was cut off, as a logger that was stopped leaves it."""
    rows, end, last = text.body.rpartition("\n")
    if not end or not last.strip() or last.count(delimiter) >= text.header.count(delimiter):
        return text
    return replace(text, body=rows + end, notes=(*text.notes, "the last row is cut off and left out"))


def _cells(body: str, columns: list[str], delimiter: str, name: str) -> pa.Table:
    ragged: list = []

    def note(row):
        ragged.append(row)
        return "error"

    if not body.strip():
        raise InputError(f"{name}: has a header and no samples")
    try:
        return pa.csv.read_csv(
            io.BytesIO(body.encode()),
            read_options=pa.csv.ReadOptions(column_names=columns, use_threads=False),
            parse_options=pa.csv.ParseOptions(delimiter=delimiter, invalid_row_handler=note),
            convert_options=pa.csv.ConvertOptions(column_types=dict.fromkeys(columns, pa.string())),
        )
    except pa.ArrowException as error:
        raise InputError(f"{name}: {_told_ragged(ragged, error)}") from None


def _told_ragged(ragged: list, error: Exception) -> str:
    if not ragged:
        return f"is not a readable CSV file ({reason(error)})"
    row = ragged[0]
    return f"data row {row.number} has {row.actual_columns} cells, the header has {row.expected_columns}"
