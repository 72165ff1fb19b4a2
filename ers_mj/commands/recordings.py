"""How commands read the recordings that they are given."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from ers_mj.commands.options import mapping

if TYPE_CHECKING:
    from ers_mj.data.recording import Recording


def reader(arguments: argparse.Namespace) -> Callable[[str], Recording]:
    """Reads a recording as the options say; what --map says goes before the file of --map-file."""
    from ers_mj.data.mapping import read_map_file
    from ers_mj.data.recording import read_recording

    kept = read_map_file(arguments.map_file) if arguments.map_file is not None else {}
    first = lambda option: getattr(arguments, option, None) or kept.get(option)
    return partial(
        read_recording,
        mapping={**kept.get("map", {}), **mapping(arguments.map)},
        input_column=first("input"),
        second=first("second"),
        episode=first("episode"),
        dbc=first("dbc"),
    )
