"""What a simulated servo is told, from a file: time and input, nothing measured beside them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa

from ers_mj.data.checks import refuse_time
from ers_mj.data.formats import load
from ers_mj.data.tables import listed, numbers
from ers_mj.errors import InputError, brief


@brief
def read_input(path: str | os.PathLike[str], names: Sequence[str] = ("u_V",)) -> tuple[np.ndarray, np.ndarray]:
    """Time [s] and input, each (N,), of a CSV or Parquet file with the columns t_s and the first of these ``names``
    that it has; one that is never negative takes the sign of a column ``direction``, as a recording's does.

    Raises:
        InputError: the file is no such thing, or has holes, in one sentence.
    """
    file = Path(path)
    table = load(file, file.name)[0].table
    t = _column(table, "t_s", file.name)
    u = _column(table, next((name for name in names if name in table.column_names), names[0]), file.name)
    if t.size < 2:
        raise InputError(f"{file.name}: has {t.size} samples, at least 2 are needed")
    refuse_time(t, "t_s", file.name)
    if "direction" not in table.column_names or u.min() < 0.0:
        return t, u
    direction = _column(table, "direction", file.name)
    return t, np.where(direction <= 0.0 if direction.min() >= 0.0 else direction < 0.0, -u, u)


def _column(table: pa.Table, label: str, name: str) -> np.ndarray:
    """One of a table's columns (N,), without holes."""
    if label not in table.column_names:
        raise InputError(f"{name}: there is no column {label}, the columns are {listed(table.column_names)}")
    x = numbers(table[label], label, name)
    if not np.isfinite(x).all():
        row = 1 + int(np.argmax(~np.isfinite(x)))
        raise InputError(f"{name}: {label} is missing or infinite in data row {row}, an input has no holes")
    return x
