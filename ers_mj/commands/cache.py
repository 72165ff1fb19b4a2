"""`ers cache`: the compiled code that is kept between calls."""

from __future__ import annotations

import argparse

from ers_mj.commands.output import bold
from ers_mj.door.saving import as_json


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "cache",
        help="what is kept between calls, and its clearing",
        description="Show the simulator's compiled code that is kept between calls; without it the next call compiles.",
        epilog="examples:\n  ers cache\n  ers cache --clear",
    )
    parser.add_argument("--clear", action="store_true", help="delete it; files that are not ours are left alone")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Show or clear; 0."""
    from ers_mj.plants.compiling.kept_code import clear, kept

    found = clear() if arguments.clear else kept()
    document = {
        "folder": str(found.folder),
        "files": found.files,
        "bytes": found.size,
        "functions": found.functions,
        "other_files": found.others,
        "cleared": arguments.clear,
    }
    print(as_json(document) if arguments.json else "\n".join(_told(document)))
    return 0


def _told(document: dict) -> list[str]:
    size = f"{document['files']} files, {document['bytes'] / 1e6:.1f} MB"
    lines = [bold(document["folder"]), f"  {'cleared' if document['cleared'] else 'kept'}: {size} of compiled code"]
    lines += [f"    {room:14}{count:6} functions" for room, count in document["functions"].items()]
    return lines + ([f"  {document['other_files']} files that are not ours"] if document["other_files"] else [])
