"""Tasks for tests of workers: workers import them, so they stand in a module of their own."""

import os
import signal
import time
from pathlib import Path

from ers_mj.errors import InputError


def squared(x, folder=None, wait=0.0):
    """x squared; leaves a file a call in the folder."""
    time.sleep(wait)
    if folder is not None:
        (Path(folder) / f"{x}-{os.getpid()}-{time.monotonic_ns()}").touch()
    return x * x


def refused(x):
    """Raises what bad input raises."""
    raise InputError(f"{x}: cannot be used")


def ended_once(folder):
    """Kills its own process, the first time that it runs."""
    mark = Path(folder) / "ended"
    if not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return "done"


def ended_always():
    """Kills its own process."""
    os.kill(os.getpid(), signal.SIGKILL)


def made_case(name, seed):
    """The files of a case that cannot be diagnosed, and its truth."""
    files = {"rec1.csv": f"t_s,u_V\n{seed},0\n", "datasheet.toml": ""}
    return files, {"case": name, "kind": "null", "labels": [], "effects": [], "visibility_after_refit_sigma": 0.0}
