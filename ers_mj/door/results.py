"""What every result can: show itself, become JSON or a data frame, and be saved as the command saves it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ers_mj.door.saving import plain, refuse_folder, write_results
from ers_mj.errors import MissingPackage

if TYPE_CHECKING:
    import pandas as pd

Progress = Callable[[str, float], None]
Writers = Mapping[str, Callable[[Path], None]]


def silent(text: str, fraction: float) -> None:
    """Progress that nobody follows."""


class Result:
    """A result of a job: a document (the JSON of the command), and files."""

    def __init__(self, document: Mapping[str, Any]):
        self._document = plain(document)

    def to_dict(self) -> dict[str, Any]:
        """The document, as the command prints it under `--json`: a copy, in plain Python values."""
        return dict(plain(self._document))

    def to_frame(self) -> pd.DataFrame:
        """The result's table as a pandas DataFrame, one row an entry.

        Raises:
            MissingPackage: pandas is not installed.
        """
        return frame(self._rows())

    def save(self, folder: str | os.PathLike[str], force: bool = False, progress: Progress = silent) -> list[Path]:
        """Write what the command writes.

        Args:
            folder: is made where there is none.
            force: write into a folder that holds files already.
            progress: told (text, share of the work done).

        Returns:
            The files, which appear whole or not at all.

        Raises:
            InputError: the folder is a file, cannot be written, or holds files and no `force` is given.
        """
        folder = Path(folder)
        refuse_folder(folder, force)
        progress("drawing the report", 1.0)
        return write_results(folder, self._writers())

    def _repr_html_(self) -> str:
        """For a notebook: the verdict, the table, the picture, in a frame of their own, so that no style leaks."""
        return framed(self._page())

    def _rows(self) -> Sequence[Mapping[str, Any]]:
        raise NotImplementedError

    def _writers(self) -> Writers:
        raise NotImplementedError

    def _page(self) -> str:
        raise NotImplementedError


def framed(page: str, height: int = 680) -> str:
    """A whole page as an element of another one, so many pixels high."""
    return f'<iframe srcdoc="{escape(page, quote=True)}" style="width:100%;height:{height}px;border:0"></iframe>'


def frame(rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Rows as a pandas DataFrame.

    Raises:
        MissingPackage: pandas is not installed.
    """
    try:
        import pandas
    except ImportError:
        raise MissingPackage("to_frame needs pandas, which is not installed: pip install pandas") from None
    return pandas.DataFrame(list(rows))


def parameter_rows(owner: str, parameters: Mapping[str, Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Parameters of a document as rows of a table."""
    return [
        {
            "owner": owner,
            "parameter": name,
            "value": row.get("value"),
            "unit": row.get("unit"),
            "low": (row.get("ci95") or [None, None])[0],
            "high": (row.get("ci95") or [None, None])[1],
            "datasheet": row.get("datasheet"),
            "identifiable": row.get("identifiable", True),
        }
        for name, row in parameters.items()
    ]
