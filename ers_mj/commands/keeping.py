"""Where a command's results go: checked before the work, and kept somewhere whatever happens to that place.

results_folder, table_file (before) -> keep (after) -> Kept: what was written, and the command's exit code
"""

from __future__ import annotations

import hashlib
import json
import sys
import tempfile
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from ers_mj.door.saving import refuse_folder, refuse_table, write_results, write_text
from ers_mj.errors import InputError, Unwritable

DEFAULT_OUT = "ers-out"
RECORD = ".ers-written.json"  # in the default folder: which files ers wrote there, and their hashes


@dataclass(frozen=True)
class Place:
    """A folder for results; of the default one it is kept which files are ours."""

    folder: Path
    is_default: bool = False


@dataclass(frozen=True)
class Kept:
    """What was written: its files, whether some took the place of earlier ones, and the exit code that tells."""

    files: tuple[Path, ...] = ()
    replaced: bool = False
    code: int = 0

    def told(self, asked: str) -> str | None:
        """Where one file lies that was asked for under this name; None where it could be written nowhere."""
        return asked if self.code == 0 else str(self.files[0]) if self.files else None


NOTHING = Kept()


def results_folder(out: str | None, force: bool, as_json: bool, names: Collection[str]) -> Place | None:
    """The folder that results of these names will go to, checked before any work starts; None where no file is to be
    written.

    Raises:
        InputError: as `folder_for`.
    """
    return None if out is None and as_json else folder_for(out, force, names)


def folder_for(out: str | None, force: bool, names: Collection[str], may_hold: bool = False) -> Place:
    """As :func:`results_folder`, where files are to be written; ``may_hold`` is for a job that resumes what it finds.

    Raises:
        InputError: the folder is a file, cannot be written, was named and holds files, or is the default one and holds
            a file of such a name that ers did not write.
    """
    if out == "":
        raise InputError("--out is empty, a folder was expected")
    place = Place(Path(DEFAULT_OUT if out is None else out), out is None)
    refuse_folder(place.folder, force or out is None or may_hold)
    if place.is_default and not force:
        refuse_foreign(place.folder, names)
    return place


def refuse_foreign(folder: Path, names: Collection[str]) -> None:
    """Raise InputError where the default folder holds a file of one of these names that ers did not write."""
    ours = _record(folder)
    for name in names:
        file = folder / name
        if file.is_dir() or (file.exists() and ours.get(name) != _digest(file)):
            raise InputError(
                f"{file}: was not written by ers or was changed since, move it, name another folder with --out, or give"
                " --force to replace it"
            )


def _record(folder: Path) -> dict[str, str]:
    try:
        found = json.loads((folder / RECORD).read_text("utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _digest(file: Path) -> str:
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError:
        return ""


def table_file(out: str, force: bool) -> Path:
    """The CSV file that a recording or an input will go to, checked before any work starts.

    Raises:
        InputError: it is a folder, is of another format, exists already, or cannot be written.
    """
    file = Path(out)
    if not out or file.is_dir():
        raise InputError(f"--out {out or 'is empty'}: a file was expected, as in --out rec.csv")
    refuse_table(file, force)
    return file


def keep(place: Place | None, save: Callable[[Path], Sequence[Path]]) -> Kept:
    """Save results into a place. Where it fails meanwhile they go to another, and standard error says where: the answer
    is not lost, and the exit code is that of a place that was no good.
    """
    if place is None:
        return NOTHING
    before = {file.name for file in place.folder.iterdir()} if place.folder.is_dir() else set()
    try:
        files = tuple(save(place.folder))
        _note(place, files)
    except Unwritable as error:
        return _rescued(error, save)
    return Kept(files, any(file.name in before for file in files))


def keep_file(file: Path, save: Callable[[Path], object]) -> Kept:
    """As :func:`keep`, of one file."""

    def save_in(folder: Path) -> list[Path]:
        save(folder / file.name)
        return [folder / file.name]

    try:
        save(file)
    except Unwritable as error:
        return _rescued(error, save_in)
    return Kept((file,))


def _note(place: Place, files: Sequence[Path]) -> None:
    if not place.is_default and not (place.folder / RECORD).exists():
        return
    known = _record(place.folder) | {file.name: _digest(file) for file in files}
    write_results(place.folder, {RECORD: lambda path: write_text(path, json.dumps(known, indent=1) + "\n")})


def _rescued(error: Unwritable, save: Callable[[Path], Sequence[Path]]) -> Kept:
    for folder in _elsewhere():
        try:
            files = tuple(save(folder))
        except Unwritable:
            folder.rmdir()
            continue
        print(f"ers: {error}; the results are in {folder}", file=sys.stderr)
        return Kept(files, code=2)
    print(f"ers: {error}; nor could {tempfile.gettempdir()} or the home folder: no file was written", file=sys.stderr)
    return Kept(code=2)


def _elsewhere() -> Iterator[Path]:
    """Fresh folders, each made when it is asked for."""
    for parent in (tempfile.gettempdir, Path.home, Path.cwd):
        try:
            yield Path(tempfile.mkdtemp(prefix="ers-out-", dir=parent()))
        except (OSError, RuntimeError):
            continue
