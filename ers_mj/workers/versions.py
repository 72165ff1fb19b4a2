"""Which code a worker runs: two of the same give the same answers."""

from __future__ import annotations

import platform
from functools import cache
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path

import ers_mj

PACKAGES = ("numba", "numpy", "scipy", "mujoco")  # what an answer depends on, beside Python and this package


@cache
def versions() -> dict[str, str]:
    """Of Python, this package and what it depends on, by name."""
    return {"python": platform.python_version(), "ers_mj": ers_mj.__version__} | {p: version(p) for p in PACKAGES}


@cache
def sources() -> str:
    """Hash of the sources of this package."""
    root = Path(__file__).resolve().parents[1]
    parts = (str(p.relative_to(root)).encode() + p.read_bytes() for p in sorted(root.rglob("*.py")))
    return sha256(b"".join(parts)).hexdigest()


def code() -> tuple[dict[str, str], str]:
    """Versions and sources, as a worker is asked for them."""
    return versions(), sources()
