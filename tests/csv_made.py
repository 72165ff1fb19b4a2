"""CSV of a swinging servo, as a test changes it; and what a recording tells."""

from pathlib import Path

import numpy as np

N = 400


def csv_text(columns: dict, separator: str = ",", newline: str = "\n") -> str:
    rows = zip(*[map(repr, np.asarray(x).tolist()) for x in columns.values()], strict=True)
    return newline.join([separator.join(columns), *map(separator.join, rows)]) + newline


def put(tmp_path: Path, content: str | bytes, name: str = "rec.csv") -> Path:
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def changed(columns: dict, column: str, rows: object, value: object) -> dict:
    x = columns[column].copy() if not isinstance(value, str) else columns[column].astype(object)
    x[rows] = value
    return columns | {column: x}


def text_cell(columns: dict, column: str, row: int, text: str) -> str:
    return csv_text(changed(columns, column, row, text)).replace(repr(text), text)


def problem(record: object, words: str) -> str:
    """The one problem that has these words."""
    (found,) = [p for p in record.problems if words in p]
    return found
