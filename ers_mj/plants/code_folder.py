"""Where compiled code is kept: a folder of the user's own, since whoever may write there decides what is run."""

from __future__ import annotations

import atexit
import logging
import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path

from ers_mj.passing import pass_with_process, remove

try:
    import fcntl
except ImportError:  # not on Windows
    fcntl = None

OTHERS = stat.S_IWGRP | stat.S_IWOTH


def code_folder() -> Path:
    """`ers_mj/code` in the user's cache, or a fresh private one of this process where that is not safe."""
    return _folder(place())


def place() -> Path:
    """`ers_mj/code` in the user's cache, whether it is there or not."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ers_mj" / "code"


@lru_cache
def _folder(folder: Path) -> Path:
    refused = refusal(folder)
    if not refused:
        return folder
    fresh = Path(tempfile.mkdtemp(prefix="ers_mj-"))
    pass_with_process(fresh)
    atexit.register(remove, fresh)
    logging.getLogger(__name__).warning(f"ers-mj: {refused}; compiled code is kept in {fresh} until this command ends")
    return fresh


def refusal(folder: Path) -> str:
    """Why code is not kept in `folder`, which is made where there is none; empty where it may be."""
    try:
        folder.parent.parent.mkdir(parents=True, exist_ok=True)
        for level in (folder.parent, folder):
            level.mkdir(mode=0o700, exist_ok=True)
            if _is_foreign(level):
                return f"{level} belongs to another user or is open to others' writing"
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        return f"{folder} cannot be used ({error.strerror})"
    return ""


def _is_foreign(folder: Path) -> bool:
    """Whether another user owns a folder, or the link to it, or may write in it."""
    if not hasattr(os, "getuid"):
        return False
    owners = {folder.lstat().st_uid, folder.stat().st_uid}
    return owners != {os.getuid()} or bool(folder.stat().st_mode & OTHERS)


@contextmanager
def one_at_a_time() -> Iterator[None]:
    """Of processes that share the folder one compiles, the others wait for what it makes."""
    with open(code_folder() / "lock", "w") as lock:
        if fcntl is not None:
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield
