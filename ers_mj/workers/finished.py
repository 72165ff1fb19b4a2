"""What of a job is finished: a file a piece in a folder, so that a job that was ended goes on where it was."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ers_mj.data.whole import write_whole
from ers_mj.errors import Unwritable


@dataclass(frozen=True)
class Finished:
    """The pieces in a folder, plain values each; every one holds for what was asked then alone (a hash)."""

    folder: Path

    def value(self, name: str, asked: str) -> Any:
        """The piece of this name, None where there is none or something else was asked."""
        try:
            kept = json.loads(self._path(name).read_text("utf-8"))
        except (OSError, ValueError, RecursionError):
            return None
        return kept.get("value") if asked and isinstance(kept, dict) and kept.get("asked") == asked else None

    def keep(self, name: str, asked: str, value: object) -> None:
        """Write a piece, whole or not at all.

        Raises:
            Unwritable: it cannot be written.
        """
        path = self._path(name)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise Unwritable.at(path, error) from None
        write_whole(path, json.dumps({"asked": asked, "value": value}))

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}.json"
