"""`ers inspect`: what was read, before anything is fitted."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ers_mj.commands.keeping import Kept, keep, results_folder
from ers_mj.commands.options import add_out, add_reading, add_recordings
from ers_mj.commands.output import bold, written
from ers_mj.commands.recordings import reader
from ers_mj.door.saving import as_json, plain, report_writers, write_results

if TYPE_CHECKING:
    from ers_mj.data.inspection import Inspection

HEADS = ("channel", "refresh [s]", "lowest", "highest", "noise", "quantum", "at an end", "blank")

RESULTS = ("inspect.json", "report.html")


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "inspect",
        help="what was read, and what it can tell, before anything is fitted",
        description=(
            "Channels, units, rate, refresh, noise, quantum, faults, coverage and spectrum of recordings, and what they"
            " could tell. Nothing is fitted."
        ),
        epilog='examples:\n  ers inspect run1.csv\n  ers inspect log.parquet#run=17 --map "t_s=Time [ms]" --json',
    )
    add_recordings(parser)
    add_reading(parser)
    parser.add_argument("--second", metavar="COLUMN", help="a further signal to explain, as in `ers diagnose`")
    add_out(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object; without --out write no file")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Read, tell, write; 0."""
    place = results_folder(arguments.out, arguments.force, arguments.json, RESULTS)
    read = reader(arguments)
    found = [read(spec).inspect() for spec in arguments.recordings]
    document = plain(_document(found))
    kept = keep(place, lambda folder: _write(folder, document, found))
    print(as_json(document) if arguments.json else "\n".join(_told(found, kept)))
    return kept.code


def _document(found: list[Inspection]) -> dict:
    """What `--json` prints: the channels and faults of all recordings, and each recording by itself."""
    each = [inspection.to_dict() for inspection in found]
    return {
        "input_kind": each[0]["input_kind"],
        "channels": [{"file": one["file"], **channel} for one in each for channel in one["channels"]],
        "faults": [fault for one in each for fault in one["faults"]],
        "recordings": each,
    }


def _write(folder: Path, document: dict, found: list[Inspection]) -> list[Path]:
    from ers_mj.report.inspect_report import inspect_page

    return write_results(folder, report_writers("inspect.json", document, inspect_page(document, found)))


# -- in lines ---------------------------------------------------------------------------------------------------------


def _told(found: list[Inspection], kept: Kept) -> list[str]:
    """What a terminal shows."""
    lines: list[str] = []
    for inspection in found:
        lines += _told_one(inspection)
    return lines + written(kept)


def _told_one(inspection: Inspection) -> list[str]:
    one = inspection.to_dict()
    lines = [
        "",
        bold(one["file"]),
        f"  {one['samples']} samples, {one['duration_s']:.4g} s at {one['rate_hz']:.5g} Hz, steps of time to"
        f" {one['jitter']:.1%} rms",
        f"  input: a {one['input_kind']} [{one['input_unit']}], 95 % of its power below {one['input_band_hz']:.3g} Hz",
        "",
        bold(f"  {HEADS[0]:16}" + "".join(f"{head:>13}" for head in HEADS[1:])),
    ]
    for c in one["channels"]:
        numbers = (c["refresh_s"], c["low"], c["high"], c["noise"], c["quantum"])
        cells = "".join(f"{x:>13.4g}" for x in numbers) + f"{c['at_ends']:>13.1%}{c['blanks']:>13}"
        lines.append(f"  {c['name']:16}{cells}")
    lines += ["", bold("  told of the data"), *(f"    {problem}" for problem in one["problems"] or ["nothing"])]
    for title, can in (("could tell", True), ("cannot tell", False)):
        told = [f"    {t['what']}: {t['why']}" for t in one["tells"] if t["can"] is can]
        lines += ["", bold(f"  {title}"), *told] if told else []
    return lines
