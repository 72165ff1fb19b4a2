"""Tables of named columns: which rows, and cells to numbers.

What cannot be read is refused with one sentence (`InputError`).
"""

import os
import re
import stat
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from ers_mj.errors import InputError

ISO = re.compile(r"(\d{4}-\d\d-\d\d[T ])?\d\d:\d\d:\d\d")
BLANK = ("", "nan", "na", "n/a", "null", "none")  # a missing value in CSV, in any case


def split_spec(spec: str) -> tuple[Path, str | None]:
    """Path and run of "FILE#run=17"; a file that is really called so comes first."""
    path, mark, run = spec.rpartition("#run=")
    return (Path(path), run) if mark and not os.path.isfile(spec) else (Path(spec), None)


def read_content(path: Path) -> bytes:
    try:
        is_device = stat.S_ISCHR(path.stat().st_mode)  # which may never end
        content = b"" if is_device else path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read ({reason(error)})") from None
    if is_device:
        raise InputError(f"{path}: is a device, a file was expected")
    if not content.strip():
        raise InputError(f"{path}: the file is empty")
    return content


RUNS = ("run", "episode_index", "episode")  # columns that tell the rows of several recordings apart


def chosen_run(run: str | None, episode: str | int | None, name: str) -> str | None:
    """The run that a path names behind #run=, or the episode that is asked for beside it.

    Raises:
        InputError: both are, and are not the same.
    """
    asked = None if episode is None else str(episode)
    if run is not None and asked is not None and run != asked:
        raise InputError(f"{name}: #run={run} and the episode {asked} were both given, one of them was expected")
    return run if run is not None else asked


def select_run(table: pa.Table, run: str | None, name: str) -> pa.Table:
    """The rows of one run; the whole table where it holds one and none is asked for."""
    column = next((c for c in RUNS if c in table.column_names), None)
    if column is None:
        if run is None:
            return table
        raise InputError(
            f"{name}: the file has no column {' or '.join(RUNS)}, its columns are {listed(table.column_names)}"
        )
    labels = _labels(table[column], column, name)
    runs = labels.unique().to_pylist()
    if run is None and len(runs) > 1:
        raise InputError(f"{name}: the file holds the runs {listed(runs)}, choose one as in {name}#run={runs[0]}")
    if run is not None and run not in runs:
        raise InputError(f"{name}: there is no run {run!r}, the runs are {listed(runs)}")
    return table if run is None else table.filter(pc.equal(labels, run))


def _labels(column: pa.ChunkedArray, label: str, name: str) -> pa.ChunkedArray:
    try:
        return _texts(column)
    except pa.ArrowException:
        raise InputError(f"{name}: the column {label} holds {column.type}, names or numbers were expected") from None


def _texts(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """The cells as text without surrounding spaces."""
    return pc.utf8_trim_whitespace(column.cast(pa.string()))


def element(column: pa.ChunkedArray, index: int | None, label: str, name: str) -> pa.ChunkedArray:
    """One element of each cell of a column of lists; the column itself where none is asked for.

    Raises:
        InputError: it holds no lists, or they are shorter.
    """
    is_list = pa.types.is_list(column.type) or pa.types.is_large_list(column.type)
    is_list = is_list or pa.types.is_fixed_size_list(column.type)
    if index is None or not is_list:
        if index is None and is_list:
            raise InputError(f"{name}: the column {label} holds lists, choose an element as in --map NAME={label}[0]")
        if index is not None:
            raise InputError(f"{name}: the column {label} holds {column.type}, {label}[{index}] asks for an element")
        return column
    shortest = pc.min(pc.list_value_length(column)).as_py()
    if shortest is None or index >= shortest:
        raise InputError(f"{name}: the lists in {label} have {shortest or 0} elements, there is no {label}[{index}]")
    return pc.list_element(column, index)


def seconds(column: pa.ChunkedArray) -> np.ndarray | None:
    """Dates and times of day, as ISO text or timestamps, in seconds from the first (N,); None where it holds none."""
    if pa.types.is_timestamp(column.type):
        stamps = column.cast(pa.timestamp("ns"), safe=False).to_numpy()
    elif pa.types.is_string(column.type) and len(column) and ISO.match(_texts(column.slice(0, 1))[0].as_py() or ""):
        texts = [re.sub(r"(Z|[+-]\d\d:?\d\d)$", "", x).replace(" ", "T") for x in _texts(column).to_pylist()]
        try:
            stamps = np.array([x if "T" in x or "-" in x else f"2000-01-01T{x}" for x in texts], "datetime64[ns]")
        except ValueError:
            return None
    else:
        return None
    return (stamps - stamps[0]).astype(np.int64) * 1e-9


def numbers(column: pa.ChunkedArray, label: str, name: str) -> np.ndarray:
    """The cells as floats (N,), NaN where they are blank."""
    try:
        if pa.types.is_string(column.type) or pa.types.is_large_string(column.type):
            column = pc.replace_substring_regex(_texts(column), r"^\+", "")
            column = pc.replace_substring_regex(column, f"(?i)^({'|'.join(BLANK)})$", "nan")
        return _floats(column.cast(pa.float64(), safe=False))
    except pa.ArrowException:
        raise InputError(f"{name}: the column {label} {_told_text(column)}") from None


def _floats(column: pa.ChunkedArray) -> np.ndarray:
    """The numbers (N,), NaN where there is none: by way of DLPack where all are there, since pyarrow's own way imports
    pandas.
    """
    if column.null_count or not len(column):
        return np.array(column.to_numpy(), float)
    return np.concatenate([np.from_dlpack(chunk) for chunk in column.chunks if len(chunk)])


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


LONGEST_LIST = 190  # characters of names within a sentence


def listed(names: Iterable, most: int = 24) -> str:
    """Names with commas; of many, the first ones, the last, and how many there are."""
    words = [str(name)[:40] for name in names]
    if len(words) <= most and len(", ".join(words)) <= LONGEST_LIST:
        return ", ".join(words)
    first = words[:8]
    while len(", ".join(first)) > LONGEST_LIST // 2:
        first.pop()
    return f"{', '.join(first)} ... {words[-1]} ({len(words)} in all)"


def reason(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:120]
