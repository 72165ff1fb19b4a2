"""The MJCF folder, wherever the package lies, inside an installed wheel or beside the source; and MuJoCo kept
silent.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

import mujoco

from ers_mj.errors import InputError


def mjcf_folder() -> Traversable:
    """The folder of the hand-written models.

    Raises:
        InputError: it is in neither of its two places.
    """
    for folder in (files("ers_mj") / "mjcf", Path(__file__).resolve().parents[3] / "mjcf"):
        if folder.joinpath("common.xml").is_file():
            return folder
    raise InputError("the folder mjcf with the rudder's MuJoCo model is missing, reinstall ers-mj")


def read_mjcf() -> dict[str, str]:
    """Name -> text of every XML file in the folder."""
    return {item.name: item.read_text("utf-8") for item in mjcf_folder().iterdir() if item.name.endswith(".xml")}


@contextmanager
def unlogged() -> Iterator[None]:
    """Keep MuJoCo from printing and from writing MUJOCO_LOG.TXT where a motion runs away: NaN says it."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
