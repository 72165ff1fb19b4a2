"""`ers compare`: two diagnoses beside each other, and what differs beyond chance."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from ers_mj.commands.keeping import Kept, keep, results_folder
from ers_mj.commands.options import add_out
from ers_mj.commands.output import bold, written
from ers_mj.door.saving import as_json, plain, report_writers, write_results

RESULTS = ("compare.json", "report.html")


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "compare",
        help="two diagnoses beside each other: what differs beyond chance",
        description=(
            "Compare two diagnoses: two days, two units, before and after a repair. All differences stand under one"
            " chance of 5 %."
        ),
        epilog=(
            "examples:\n  ers compare before/ after/\n  ers compare unit1/diagnosis.json unit2/diagnosis.json --json"
        ),
    )
    for name in ("a", "b"):
        parser.add_argument(name, metavar=name.upper(), help="folder of a diagnosis, or its diagnosis.json")
    add_out(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object; without --out write no file")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Read, compare, write, tell; 0 whatever differs."""
    place = results_folder(arguments.out, arguments.force, arguments.json, RESULTS)
    from ers_mj.comparing.differences import compare
    from ers_mj.comparing.documents import read_told

    document = plain(compare(read_told(arguments.a), read_told(arguments.b)))
    kept = keep(place, lambda folder: _write(folder, document))
    print(as_json(document) if arguments.json else "\n".join(_told(document, kept)))
    return kept.code


def _write(folder: Path, document: dict) -> list[Path]:
    from ers_mj.report.compare_report import compare_page

    return write_results(folder, report_writers("compare.json", document, compare_page(document)))


# -- in lines ---------------------------------------------------------------------------------------------------------


def _told(document: Mapping, kept: Kept) -> list[str]:
    """What a terminal shows: one table, what is beyond chance marked."""
    from ers_mj.report.compare_report import HEADS, cells

    rows = [cells(line) for line in document["differences"]]
    widths = [max(map(len, column)) for column in zip(HEADS, *rows, strict=True)]
    heads = [f"{side}: {document[side]['name']} ({document[side]['verdict']})" for side in ("a", "b")]
    lines = ["", bold(document["sentence"]), *(head[0].upper() + head[1:] for head in heads), ""]
    lines.append(bold("  ".join(text.ljust(n) for text, n in zip(HEADS, widths, strict=True)).rstrip()))
    for line, row in zip(document["differences"], rows, strict=True):
        told = "  ".join(text.ljust(n) for text, n in zip(row, widths, strict=True)).rstrip()
        lines.append(bold(told) if line["significant"] else told)
    notes = [document["chance"]["sentence"], *document["notes"]]
    return [*lines, "", *notes, *written(kept)]
