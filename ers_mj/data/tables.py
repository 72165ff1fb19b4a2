"""Files and columns: CSV or Parquet to a table of named columns, cells to numbers, and text to a file that appears
whole.

What cannot be read is refused with one sentence (`InputError`).
"""

import io
import os
import re
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv

from ers_mj.errors import InputError

BLANK = ("", "nan", "na", "n/a", "null", "none")  # a missing value in CSV, in any case


def split_spec(spec: str) -> tuple[Path, str | None]:
    """Path and run of "FILE#run=17"; a file that is really called so comes first."""
    path, mark, run = spec.rpartition("#run=")
    return (Path(path), run) if mark and not Path(spec).is_file() else (Path(spec), None)


def read_content(path: Path) -> bytes:
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read ({reason(error)})") from None
    if not content.strip():
        raise InputError(f"{path}: the file is empty")
    return content


def parse_table(content: bytes, suffix: str, name: str) -> pa.Table:
    readers = {".csv": _csv, ".parquet": _parquet}
    if suffix not in readers:
        raise InputError(f"{name}: the file name ends in {suffix!r}, recordings end in {listed(readers)}")
    return readers[suffix](content, name)


def _parquet(content: bytes, name: str) -> pa.Table:
    from pyarrow import parquet  # here alone: it takes long to import

    try:
        table = parquet.read_table(pa.BufferReader(content))
    except (pa.ArrowException, OSError) as error:
        raise InputError(f"{name}: is not a readable Parquet file ({reason(error)})") from None
    _refuse_twice(table.column_names, name)
    return table


def _csv(content: bytes, name: str) -> pa.Table:
    """The cells as text, under the names of the first line; semicolons bring decimal commas."""
    header, body = _header_and_body(content, name)
    delimiter = max(",;\t", key=header.count)
    columns = [column.strip(' \t"') for column in header.split(delimiter)]
    _refuse_twice(columns, name)
    table = _cells(body, columns, delimiter, name)
    if delimiter == ",":
        return table
    return pa.table([pc.replace_substring(cells, ",", ".") for cells in table.columns], names=columns)


def _header_and_body(content: bytes, name: str) -> tuple[str, str]:
    try:
        text = content.decode("utf-8-sig").lstrip()
    except UnicodeDecodeError as error:
        raise InputError(f"{name}: is not a text file in UTF-8 (byte {error.start} is no character)") from None
    if "\0" in text:
        raise InputError(f"{name}: is a binary file, CSV was expected")
    header, *body = re.split(r"\r\n|\n|\r", text, maxsplit=1)
    return header, "".join(body)


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


def _refuse_twice(columns: list[str], name: str) -> None:
    if twice := [column for column, count in Counter(columns).items() if count > 1]:
        raise InputError(f"{name}: the column {listed(twice)} stands there more than once")


def select_run(table: pa.Table, run: str | None, name: str) -> pa.Table:
    """The rows of one run; the whole table where it holds one and none is asked for."""
    if "run" not in table.column_names:
        if run is None:
            return table
        raise InputError(f"{name}: the file has no column run, its columns are {listed(table.column_names)}")
    labels = _texts(table["run"])
    runs = labels.unique().to_pylist()
    if run is None and len(runs) > 1:
        raise InputError(f"{name}: the file holds the runs {listed(runs)}, choose one as in {name}#run={runs[0]}")
    if run is not None and run not in runs:
        raise InputError(f"{name}: there is no run {run!r}, the runs are {listed(runs)}")
    return table if run is None else table.filter(pc.equal(labels, run))


def _texts(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """The cells as text without surrounding spaces."""
    return pc.utf8_trim_whitespace(column.cast(pa.string()))


def numbers(column: pa.ChunkedArray, label: str, name: str) -> np.ndarray:
    """The cells as floats (N,), NaN where they are blank."""
    try:
        if pa.types.is_string(column.type) or pa.types.is_large_string(column.type):
            column = pc.replace_substring_regex(_texts(column), r"^\+", "")
            column = pc.if_else(pc.is_in(pc.utf8_lower(column), pa.array(BLANK)), None, column)
        return np.array(column.cast(pa.float64(), safe=False).to_numpy(), float)
    except pa.ArrowException:
        raise InputError(f"{name}: the column {label} {_told_text(column)}") from None


def _told_text(column: pa.ChunkedArray) -> str:
    if not pa.types.is_string(column.type):
        return f"holds {column.type}, numbers were expected"
    for row, text in enumerate(column, start=1):
        try:
            text.cast(pa.float64())
        except pa.ArrowException:
            return f"has the text {text.as_py()[:40]!r} in data row {row}, a number was expected"
    return "holds text, numbers were expected"


# -- writing and words ------------------------------------------------------------------------------------


def cell_of(x: float) -> str:
    return "" if x != x else repr(x)


def write_whole(path: Path, text: str) -> None:
    """Write text to a neighbour of path, then put it in path's place: a reader never sees half of it.

    Raises:
        InputError: the path cannot be written.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_text(text, encoding="utf-8", newline="\n")
        os.replace(part, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({reason(error)})") from None
    finally:
        part.unlink(missing_ok=True)


def listed(names: Iterable, most: int = 24) -> str:
    """Names with commas; of many, the first ones, the last, and how many there are."""
    words = [str(name)[:40] for name in names]
    return ", ".join(words) if len(words) <= most else f"{', '.join(words[:8])} ... {words[-1]} ({len(words)} in all)"


def reason(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:120]
