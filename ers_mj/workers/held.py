"""A folder that one run at a time works in."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ers_mj.errors import InputError


@contextmanager
def held(folder: Path, who: str) -> Iterator[None]:
    """Hold a folder, made if need be, so that no other run of the same command writes into it meanwhile; let go of
    however the run ends.

    Raises:
        InputError: it cannot be made, or another run holds it.
    """
    try:
        Path(os.path.realpath(folder)).mkdir(parents=True, exist_ok=True)  # a link may lead to none yet
        handle = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror})") from None
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputError(
                f"{folder}: another `{who}` is at work in it, wait for it or name another folder"
            ) from None
        yield
    finally:
        os.close(handle)
