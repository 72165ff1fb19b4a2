"""The compiled code that is kept between calls: what there is, and its clearing. What else lies there is left alone."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ers_mj.errors import InputError
from ers_mj.plants.compiling.code_folder import one_at_a_time, place, refusal

# what compiled.py names a function's index and code: module.function-digest.py311[.n].nbi or .nbc, and its parts while
# they are written
OURS = re.compile(r"(?P<function>[\w.<>]+)-[0-9a-f]{20}\.py\d+(\.\d+)?\.nb[ic](\.tmp\..+)?")


@dataclass(frozen=True)
class Kept:
    """What is kept.

    Attributes:
        folder: where.
        files, size: of ours, and their [bytes].
        functions: compiled functions by room of the package; one counts for every state of its code.
        others: files that are not ours.
    """

    folder: Path
    files: int
    size: int
    functions: dict[str, int]
    others: int


def kept() -> Kept:
    """What there is now; nothing is made."""
    ours, others = [], 0
    for file in _files():
        if OURS.fullmatch(file.name):
            ours.append(file)
        else:
            others += file.name != "lock"
    rooms = Counter(_room(file.name) for file in ours if file.suffix == ".nbi")
    return Kept(place(), len(ours), sum(map(_size, ours)), dict(sorted(rooms.items())), others)


def clear() -> Kept:
    """Delete what is ours, as no other process compiles; what there was.

    Raises:
        InputError: the folder belongs to another user, or cannot be changed.
    """
    before = kept()
    if not place().is_dir():
        return before
    if refused := refusal(place()):
        raise InputError(f"{refused}: nothing was cleared")
    with one_at_a_time():
        for file in _files():
            if OURS.fullmatch(file.name):
                try:
                    file.unlink(missing_ok=True)
                except OSError as error:
                    raise InputError(f"{file}: cannot be deleted ({error.strerror})") from None
    return before


def _files() -> Iterator[Path]:
    folder = place()
    return (file for file in (sorted(folder.iterdir()) if folder.is_dir() else ()) if file.is_file())


def _size(file: Path) -> int:
    try:
        return file.stat().st_size
    except FileNotFoundError:  # another process has cleared it
        return 0


def _room(name: str) -> str:
    parts = name.split("-")[0].split(".")
    return parts[1] if parts[0] == "ers_mj" and len(parts) > 1 else "others' own"
