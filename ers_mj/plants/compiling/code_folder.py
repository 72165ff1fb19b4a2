"""Where compiled code is kept: a folder of the user's own, since whoever may write there decides what is run."""

from __future__ import annotations

import atexit
import logging
import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from ers_mj.errors import InputError
from ers_mj.processes.passing import pass_with_process, remove

try:
    import fcntl
except ImportError:  # not on Windows
    fcntl = None

OTHERS = stat.S_IWGRP | stat.S_IWOTH


def code_folder() -> Path:
    """Where code is written: `ers_mj/code` in the user's cache; where that cannot be, a folder of the user's own among
    the temporary ones, which lasts from call to call; where that is not safe either, a fresh one of this process.

    Raises:
        InputError: none of them can be made.
    """
    return _written(place()).folder


def shelves() -> tuple[Path, ...]:
    """Where code is looked for: where it is written, and the user's cache, which may be read where it cannot be
    written.
    """
    folder = place()
    written = _written(folder).folder
    return (written,) if written == folder or _distrust(folder) else (written, folder)


def complaint() -> str:
    """Why code is not kept in the user's cache, and where it is instead; empty where it is."""
    return _written(place()).complaint


def place() -> Path:
    """`ers_mj/code` in the user's cache, whether it is there or not."""
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ers_mj" / "code"
    except RuntimeError:  # nobody knows this user's home
        return _passing_place() / "code"


def _passing_place() -> Path:
    user = os.getuid() if hasattr(os, "getuid") else "user"
    return Path(tempfile.gettempdir()) / f"ers_mj-{user}"


@dataclass(frozen=True)
class Written:
    """The folder that code is written to, and why it is not the user's cache."""

    folder: Path
    complaint: str = ""


@lru_cache
def _written(folder: Path) -> Written:
    refused = refusal(folder)
    if not refused:
        return Written(folder)
    lasting = _passing_place() / "code"
    if not refusal(lasting):
        return Written(lasting, f"{refused}; compiled code is kept in {lasting}")
    try:
        fresh = Path(tempfile.mkdtemp(prefix="ers_mj-"))
    except OSError as error:
        raise InputError(
            f"{refused}, and no other folder can be made ({error.strerror}): give one as XDG_CACHE_HOME"
        ) from None
    pass_with_process(fresh)
    atexit.register(remove, fresh)
    told = f"{refused}; compiled code is kept in {fresh} until this command ends"
    logging.getLogger(__name__).warning(f"ers-mj: {told}")
    return Written(fresh, told)


def refusal(folder: Path) -> str:
    """Why code is not written in `folder`, which is made where there is none; empty where it may be."""
    try:
        folder.parent.parent.mkdir(parents=True, exist_ok=True)
        for level in (folder.parent, folder):
            level.mkdir(mode=0o700, exist_ok=True)
        if distrusted := _distrust(folder):
            return distrusted
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        return f"{folder} cannot be used ({error.strerror})"
    return ""


def _distrust(folder: Path) -> str:
    """Why code that lies in `folder` is not run; empty where nobody but this user and the system's own may have put it
    there.
    """
    if not hasattr(os, "getuid"):
        return ""
    trusted = {os.getuid(), 0}
    try:
        for level in (folder, folder.parent):
            owners = {level.lstat().st_uid, level.stat().st_uid}
            if not owners <= trusted or level.stat().st_mode & OTHERS:
                return f"{level} belongs to another user or is open to others' writing"
        for level in folder.parent.resolve().parents:  # who may rename what is within
            status = level.stat()
            if status.st_uid not in trusted or status.st_mode & stat.S_IWOTH and not status.st_mode & stat.S_ISVTX:
                return f"{level} belongs to another user or is open to others' writing"
        strange = next((file for file in folder.iterdir() if file.lstat().st_uid not in trusted), None)
    except OSError as error:
        return f"{folder} cannot be used ({error.strerror})"
    return f"{strange} belongs to another user" if strange else ""


@contextmanager
def one_at_a_time() -> Iterator[None]:
    """Of processes that share the folder one compiles, the others wait for what it makes."""
    with open(code_folder() / "lock", "w") as lock:
        if fcntl is not None:
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield
