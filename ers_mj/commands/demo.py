"""`ers demo`: the main job on recordings that ship inside the package."""

from __future__ import annotations

import argparse
from importlib.resources import as_file, files
from pathlib import Path

from ers_mj.commands.diagnose import RESULTS, add_quick, diagnose_and_tell
from ers_mj.commands.keeping import results_folder
from ers_mj.commands.options import add_common, add_out
from ers_mj.errors import InputError

SHIPPED = "demo_data"


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "demo",
        help="diagnose the recordings inside the package",
        description="Diagnose the recordings that ship inside the package: a rudder servo with a concealed effect.",
        epilog="example: ers demo --out demo-results",
    )
    add_quick(parser)
    add_out(parser)
    add_common(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """As `ers diagnose` on the shipped recordings."""
    place = results_folder(arguments.out, arguments.force, arguments.json, RESULTS)
    with as_file(files("ers_mj") / SHIPPED) as shipped:
        recordings, holdout = _shipped(shipped, "rec*.csv"), _shipped(shipped, "holdout*.csv")
        return diagnose_and_tell(recordings, holdout, shipped / "datasheet.toml", place, arguments)


def _shipped(folder: Path, pattern: str) -> list[Path]:
    found = sorted(folder.glob(pattern))
    if not found:
        raise InputError(f"this installation lacks {SHIPPED}/{pattern}, install the package whole")
    return found
