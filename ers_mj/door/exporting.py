"""A model in a folder, for the tools where it is used."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ers_mj.door.saving import refuse_folder, write_results
from ers_mj.errors import InputError
from ers_mj.export.servo import Servo
from ers_mj.export.targets import TARGETS, exported


@dataclass(frozen=True)
class Exported:
    """What was written.

    Attributes:
        files: paths, LOSSES.md the last.
        losses: what each target cannot carry or does otherwise, a sentence each, by the target's name.
    """

    files: tuple[Path, ...]
    losses: Mapping[str, tuple[str, ...]]

    def to_dict(self) -> dict[str, Any]:
        """The JSON of the command."""
        return {
            "files": [str(file) for file in self.files],
            "losses": {name: list(told) for name, told in self.losses.items()},
        }


def export(servo: Servo, folder: str | os.PathLike[str], to: Sequence[str], force: bool) -> Exported:
    """Write the files of these targets and LOSSES.md, all of them or none.

    Raises:
        InputError: no target, or one that is not there, or the folder holds files and no `force` is given.
    """
    names = [to] if isinstance(to, str) else list(dict.fromkeys(to))
    if not names:
        raise InputError(f"no export target was given; there are {', '.join(TARGETS)}")
    place = Path(folder)
    refuse_folder(place, force)
    contents, losses = exported(servo, names)
    writers = {name: _writer(content) for name, content in contents.items()}
    return Exported(tuple(write_results(place, writers)), losses)


def _writer(content: bytes) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        path.write_bytes(content)

    return write
