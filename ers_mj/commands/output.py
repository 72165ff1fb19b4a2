"""What commands write: result files whole or not at all, JSON, a progress bar, and lines for a terminal."""

from __future__ import annotations

import json
import math
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from ers_mj.errors import InputError


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


class Progress:
    """A bar on standard error where that is a terminal, silence elsewhere: `progress(text, fraction)`."""

    def __init__(self):
        self.shown = sys.stderr.isatty()

    def __call__(self, text: str, fraction: float) -> None:
        if not self.shown:
            return
        share, bar = min(max(float(fraction), 0.0), 1.0), 24  # characters
        full = round(bar * share)
        width = max(shutil.get_terminal_size().columns - 1, 20)
        line = f"  {'━' * full}{'╌' * (bar - full)} {share:4.0%}  {text}"
        sys.stderr.write(f"\r\x1b[2K{line[:width]}")
        sys.stderr.flush()

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self.shown:
            sys.stderr.write("\r\x1b[2K")
            sys.stderr.flush()


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


def written(files: Sequence[Path]) -> list[str]:
    """The lines that tell which files were written, none where there are none."""
    return ["", bold("written"), *(f"  {path}" for path in files)] if files else []


def bold(text: str) -> str:
    """Text in bold on a terminal."""
    return f"\x1b[1m{text}\x1b[0m" if sys.stdout.isatty() and "NO_COLOR" not in os.environ else text
