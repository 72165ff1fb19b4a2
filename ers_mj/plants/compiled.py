"""Where compiled code is kept: one folder for each state of the sources, so that an edited law is never run stale."""

from __future__ import annotations

import hashlib
import logging
import os
import subprocess
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path

import numba

COMPILING = "ERS_MJ_COMPILING"  # in the environment of the process that compiles
EVERY_MODULE = (
    "import importlib, pkgutil, ers_mj.plants as plants\n"
    "for module in pkgutil.iter_modules(plants.__path__):\n    importlib.import_module(f'ers_mj.plants.{module.name}')"
)


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

    Numba counts who holds an array at every call, in atomic additions that cost more than the arithmetic of a small
    function: a simulation without them takes a half to a third of the time.
    """
    return numba.njit(nogil=True, _nrt=False)(function)


def inlined(function):
    """As ``part``, put into its callers: for what is small or called in one place."""
    return numba.njit(nogil=True, _nrt=False, forceinline=True)(function)


def _compile_once() -> None:
    """Have another process compile all of plants/, once for each state and place of the sources: what a compiler has
    taken of memory it does not give back.

    Where that fails each module compiles for itself when it is imported.
    """
    package = Path(__file__).resolve().parent.parent
    done = cache_folder() / f"done-{hashlib.sha256(str(package).encode()).hexdigest()[:16]}"
    if COMPILING in os.environ or not sys.executable or done.exists():
        return
    logging.getLogger(__name__).warning("ers-mj: compiling the simulator for this machine, once: one to three minutes")
    path = os.pathsep.join([str(package.parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    compiled = subprocess.run(
        [sys.executable, "-c", EVERY_MODULE],
        env={**os.environ, COMPILING: "1", "PYTHONPATH": path},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    if compiled.returncode == 0:
        done.touch()


@contextmanager
def compiled_cache():
    """Numba keeps what is decorated inside this block in :func:`cache_folder`, where it has been compiled before."""
    _compile_once()
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(cache_folder())
    try:
        yield
    finally:
        numba.config.CACHE_DIR = before
