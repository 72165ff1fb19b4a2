"""What must not outlive this process: folders that are cleared, and children that end with it."""

from __future__ import annotations

import os
import platform
import re
import shutil
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_FOLDERS: set[Path] = set()
_COUNT = iter(range(2**62)).__next__
HOST = re.sub(r"[^A-Za-z0-9]", "", platform.node())[:20]
PART = re.compile(r"\.ers-(?P<host>[A-Za-z0-9]*)-(?P<process>\d+)-\d+\.part")


def part_name() -> str:
    """A name for what is written beside the place that it is moved to, of this process alone; short whatever the
    place is called.
    """
    return f".ers-{HOST}-{os.getpid()}-{_COUNT()}.part"


def sweep(folder: Path) -> None:
    """Remove the parts in a folder whose process on this machine was ended before it could."""
    for path in folder.glob(".ers-*.part"):
        found = PART.fullmatch(path.name)
        if found and found["host"] == HOST and not _is_alive(int(found["process"])):
            remove(path)


def _is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # another user's
        return True
    return True


def remove(path: Path) -> None:
    """Remove a file or a folder with all in it, as far as that can be done."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
        return
    with suppress(OSError):
        path.unlink(missing_ok=True)


@contextmanager
def passing(path: Path) -> Iterator[Path]:
    """A file or folder that is removed at the end of the `with`, or of the process, whichever comes first."""
    _FOLDERS.add(path)
    try:
        yield path
    finally:
        remove(path)
        _FOLDERS.discard(path)


def pass_with_process(path: str | Path) -> None:
    """Have a file or folder removed by :func:`clear`."""
    _FOLDERS.add(Path(path))


def clear() -> None:
    """Remove all that passes, and end the children: those that multiprocessing knows, and on Linux those that were
    forked in the moment before it did.
    """
    for child in _forked():
        with suppress(OSError):
            os.kill(child, signal.SIGTERM)
    if (started := sys.modules.get("multiprocessing")) is not None:
        for child in started.active_children():
            child.terminate()
    for path in list(_FOLDERS):
        remove(path)


def _forked() -> list[int]:
    """The children of this process, as far as the system tells."""
    found: list[int] = []
    for path in Path("/proc/self/task").glob("*/children"):
        with suppress(OSError):  # a thread that has ended
            found += map(int, path.read_text().split())
    return found


def end_with_parent() -> None:
    """Have this process terminated when the one that started it ends, however it ends; on Linux alone."""
    if sys.platform != "linux" or threading.current_thread() is not threading.main_thread():
        return
    import ctypes

    set_death_signal = 1  # prctl(2), PR_SET_PDEATHSIG
    ctypes.CDLL(None).prctl(set_death_signal, signal.SIGTERM)
