"""What results are written with: values for JSON, files whole or not at all, and the checks before any work starts."""

from __future__ import annotations

import json
import math
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from ers_mj.errors import InputError

OTHER_FORMATS = (".parquet", ".mat", ".h5", ".hdf5", ".npz", ".json", ".toml")


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
    """Write text with plain line ends."""
    path.write_text(text, encoding="utf-8", newline="\n")


def write_results(folder: Path, writers: Mapping[str, Callable[[Path], None]]) -> list[Path]:
    """Let each writer write its file in a neighbour of `folder`, then move all of them in; the paths.

    Raises:
        InputError: the folder cannot be written.
    """
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        part = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", suffix=".part", dir=folder.parent))
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror})") from None
    try:
        for name, write in writers.items():
            write(part / name)
        folder.mkdir(exist_ok=True)
        for name in writers:
            os.replace(part / name, folder / name)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror})") from None
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return [folder / name for name in writers]


def report_writers(name: str, document: object, page: str) -> dict[str, Callable[[Path], None]]:
    """For :func:`write_results`: the document under this name, and the page."""
    return {
        name: lambda path: write_text(path, as_json(document) + "\n"),
        "report.html": lambda path: write_text(path, page),
    }


def make_room(path: Path) -> None:
    """Make the folder that a file is to lie in.

    Raises:
        InputError: it cannot be made.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from None


def write_whole(path: Path, content: bytes) -> None:
    """One file, whole or not at all.

    Raises:
        InputError: it cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, part = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.chmod(part, 0o644)
        os.replace(part, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from None


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
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file, --out needs a folder")
    refuse_unwritable(folder)
    if not force and folder.is_dir() and any(folder.iterdir()):
        raise InputError(f"{folder}: holds files already, give --force to write into it or name another folder")


def refuse_table(file: Path, force: bool) -> None:
    """Raise InputError where columns cannot be written to a file: it is of another format, exists and no ``force`` is
    given, or cannot be written.
    """
    if file.suffix.lower() in OTHER_FORMATS:
        raise InputError(f"{file}: the file name ends in {file.suffix!r}, simulate writes .csv")
    if file.exists() and not force:
        raise InputError(f"{file}: exists already, give --force to overwrite it")
    refuse_unwritable(file)


def refuse_unwritable(path: Path) -> None:
    """Raise InputError where `path` cannot be made: its nearest existing parent is a file or is locked."""
    parent = path.absolute()
    while not parent.exists():
        parent = parent.parent
    if not parent.is_dir() and parent != path.absolute():
        raise InputError(f"{path}: cannot be made, {parent} is a file")
    if not os.access(parent, os.W_OK):
        raise InputError(f"{path}: cannot be written, {parent} is read-only")
