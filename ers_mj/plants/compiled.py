"""Where compiled code is kept: one folder for each state of the sources, so that an edited law is never run stale."""

from __future__ import annotations

import hashlib
import os
import tempfile
from contextlib import contextmanager
from pathlib import Path

import numba


def cache_folder() -> Path:
    """A writable folder named after the sources that are compiled (effects and plants)."""
    package = Path(__file__).resolve().parent.parent
    digest = hashlib.sha256()
    for source in sorted([*package.glob("effects/*.py"), *package.glob("plants/*.py")]):
        digest.update(source.name.encode() + source.read_bytes())
    root = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ers_mj"
    folder = root / digest.hexdigest()[:16]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        folder = Path(tempfile.gettempdir()) / f"ers_mj-{digest.hexdigest()[:16]}"
        folder.mkdir(parents=True, exist_ok=True)
    return folder


def part(function):
    """Compile a function that compiled ones call, and that makes no arrays of its own.

    Numba counts who holds an array at every call, in atomic additions that cost more than the arithmetic of a small function: a simulation
    without them takes a half to a third of the time.
    """
    return numba.njit(nogil=True, _nrt=False)(function)


def inlined(function):
    """As ``part``, put into its callers: for what is small or called in one place."""
    return numba.njit(nogil=True, _nrt=False, forceinline=True)(function)


@contextmanager
def compiled_cache():
    """Numba keeps what is decorated inside this block in :func:`cache_folder`."""
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(cache_folder())
    try:
        yield
    finally:
        numba.config.CACHE_DIR = before
