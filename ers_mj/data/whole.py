"""Files that appear whole or not at all: written within the folder that they are to lie in, then moved."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from ers_mj.errors import Unwritable
from ers_mj.processes.passing import part_name, passing


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file to a neighbour of path, then put it in path's place: a reader never sees half of it.

    Raises:
        Unwritable: the path cannot be written, or is no ordinary file.
    """
    data = content if isinstance(content, bytes) else content.encode("utf-8", "replace")
    try:
        file = final(path)
        with passing(file.parent / part_name()) as part:
            part.write_bytes(data)
            os.replace(part, file)
    except Unwritable:
        raise
    except (OSError, ValueError) as error:  # a path that holds a null is a ValueError
        raise Unwritable.at(path, error) from None


def final(path: Path) -> Path:
    """The file that a path leads to, links followed.

    Raises:
        Unwritable: there is something else than an ordinary file.
        OSError: there is no way to it.
    """
    file = Path(os.path.realpath(path))
    try:
        mode = file.stat().st_mode
    except FileNotFoundError:
        return file
    if not stat.S_ISREG(mode):
        raise Unwritable.at(path, "is a folder" if stat.S_ISDIR(mode) else "is no ordinary file")
    return file
