"""What results are written with: values for JSON, files whole or not at all, and the checks before any work starts."""

from __future__ import annotations

import errno
import json
import math
import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from ers_mj.data.whole import final, write_whole
from ers_mj.errors import InputError, Unwritable
from ers_mj.processes.passing import part_name, passing, sweep

OTHER_FORMATS = (".parquet", ".mat", ".h5", ".hdf5", ".npz", ".json", ".toml")
ROOM = 2 << 20  # [bytes] that results may take up, at least


def plain(x: object) -> Any:
    """x for JSON: numpy to Python, what is not finite to null."""
    if isinstance(x, Mapping):
        return {str(key): plain(value) for key, value in x.items()}
    if isinstance(x, list | tuple | set | frozenset):
        return [plain(value) for value in x]
    if hasattr(x, "tolist"):
        return plain(x.tolist())
    if isinstance(x, float) and not math.isfinite(x):
        return None
    return x


def as_json(document: object) -> str:
    """One JSON object as text, with no NaN in it."""
    return json.dumps(plain(document), indent=1, ensure_ascii=False, allow_nan=False)


def write_text(path: Path, text: str) -> None:
    """Write text with plain line ends; of a file name that is no text something like it."""
    path.write_text(text, encoding="utf-8", errors="replace", newline="\n")


def write_results(folder: Path, writers: Mapping[str, Callable[[Path], None]]) -> list[Path]:
    """Let each writer write its file within `folder`, out of sight, then put all of them in their places; the paths.

    Raises:
        Unwritable: the folder cannot be written. It is left as it was, not there where it was not.
    """
    try:
        inside = Path(os.path.realpath(folder))  # a link is followed, so that files move within one file system
        made = _made(inside)
        try:
            sweep(inside)
            with passing(inside / part_name()) as part:
                part.mkdir()
                for name, write in writers.items():
                    write(part / name)
                for name in writers:  # a folder in a file's place is found before the first file moves
                    final(folder / name)
                for name in writers:
                    os.replace(part / name, inside / name)
        except BaseException:
            _unmake(made)
            raise
    except Unwritable:
        raise
    except (OSError, ValueError) as error:
        raise Unwritable.at(folder, error) from None
    return [folder / name for name in writers]


def _made(folder: Path) -> list[Path]:
    """Make a folder and those above it; those that were not there, from above."""
    missing = [level for level in (folder, *folder.parents) if not level.exists()]
    made: list[Path] = []
    try:
        for level in reversed(missing):
            level.mkdir(exist_ok=True)
            made.append(level)
    except OSError:
        _unmake(made)
        raise
    return made


def _unmake(folders: Sequence[Path]) -> None:
    """Remove folders that were made in vain."""
    for level in reversed(folders):
        with suppress(OSError):
            level.rmdir()


def report_writers(name: str, document: object, page: str) -> dict[str, Callable[[Path], None]]:
    """For :func:`write_results`: the document under this name, and the page."""
    return {
        name: lambda path: write_text(path, as_json(document) + "\n"),
        "report.html": lambda path: write_text(path, page),
    }


def make_room(path: Path) -> None:
    """Make the folder that a file is to lie in.

    Raises:
        Unwritable: it cannot be made.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise Unwritable.at(path, error) from None


def write_file(path: Path, content: str | bytes) -> None:
    """One file, whole or not at all, in a folder that is made where there is none.

    Raises:
        Unwritable: it cannot be written.
    """
    make_room(path)
    write_whole(path, content)


def today() -> str:
    """The day as a page tells it; SOURCE_DATE_EPOCH [s] fixes it where pages are to be equal."""
    fixed = os.environ.get("SOURCE_DATE_EPOCH", "")
    now = datetime.fromtimestamp(int(fixed), UTC) if fixed.isdigit() else datetime.now().astimezone()
    return f"{now.day} {now:%B %Y}"


def versions() -> dict[str, str]:
    """Of this package and MuJoCo."""
    import mujoco

    from ers_mj import __version__

    return {"ers-mj": __version__, "mujoco": mujoco.__version__}


def refuse_folder(folder: Path, force: bool) -> None:
    """Raise InputError where results cannot go to a folder: it is a file, cannot be written, or holds files and no
    ``force`` is given.
    """
    refuse_unwritable(folder)
    if not force and folder.is_dir() and any(folder.iterdir()):
        raise InputError(f"{folder}: holds files already, give --force to write into it or name another folder")


def refuse_table(file: Path, force: bool) -> None:
    """Raise InputError where columns cannot be written to a file: it is of another format, exists and no ``force`` is
    given, or cannot be written.
    """
    if file.suffix.lower() in OTHER_FORMATS:
        raise InputError(f"{file}: the file name ends in {file.suffix!r}, simulate writes .csv")
    refuse_file(file, force)


def refuse_file(file: Path, force: bool) -> None:
    """Raise InputError where a file cannot be written, or exists and no ``force`` is given."""
    try:
        if os.path.lexists(file) and not force:
            raise InputError(f"{file}: exists already, give --force to overwrite it")
        whole = final(file)
    except OSError as error:
        raise Unwritable.at(file, error) from None
    refuse_unwritable(whole.parent, str(file))


def refuse_unwritable(folder: Path, told: str = "") -> None:
    """Raise InputError where files cannot be put into a folder, which is found out by doing so; ``told`` is what the
    sentence calls it. Nothing stays.
    """
    told = told or str(folder)
    try:
        inside = Path(os.path.realpath(folder))
        if (above := next(level for level in (inside, *inside.parents) if level.exists())) and not above.is_dir():
            is_it = above == inside and told == str(folder)
            raise InputError(f"{told}: {'is a file, a folder was expected' if is_it else f'{above} is a file'}")
        made = _made(inside)
        try:
            with tempfile.TemporaryFile(dir=inside) as probe:
                _fill(probe.fileno(), ROOM)
        finally:
            _unmake(made)
    except InputError:
        raise
    except (OSError, ValueError) as error:
        raise Unwritable.at(told, error, f", name another place, as in {tempfile.gettempdir()}") from None


def _fill(handle: int, size: int) -> None:
    """Take room on the disk; a file system that does not know how is taken to have it."""
    if not hasattr(os, "posix_fallocate"):
        return
    try:
        os.posix_fallocate(handle, 0, size)
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
            raise
