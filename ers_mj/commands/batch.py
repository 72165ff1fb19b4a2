"""`ers batch`: many servos, one row each, here or on a Dask cluster; what is there already is kept."""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from ers_mj.commands.diagnose import add_quick
from ers_mj.commands.keeping import DEFAULT_OUT, Kept, Place, keep, refuse_foreign
from ers_mj.commands.options import add_cluster, add_common, add_out, crew_of
from ers_mj.commands.output import Progress, bold, tell, written
from ers_mj.door.saving import as_json, report_writers, write_results, write_text
from ers_mj.errors import InputError
from ers_mj.processes import stopping
from ers_mj.processes.passing import passing

if TYPE_CHECKING:
    from ers_mj.fleet.batch import Batch
    from ers_mj.fleet.manifest import Servo

RESULTS = ("batch.csv", "batch.json", "report.html")


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "batch",
        help="diagnose many servos, resumable, here or on a cluster",
        description=(
            "Diagnose every servo of a list: a CSV with columns name, recordings (paths or globs, ; between) and, where"
            " wanted,\ndatasheet, holdout and map. Stopped, the same command goes on where it was; the table does not"
            " depend on what ran it."
        ),
        epilog=(
            "examples:\n  ers batch servos.csv --out fleet\n"
            "  ers batch servos.csv --out fleet --cluster tcp://10.0.0.7:8786"
        ),
    )
    parser.add_argument("manifest", metavar="MANIFEST", help="CSV: name,recordings[,datasheet,holdout,map]")
    add_quick(parser)
    add_cluster(parser)
    add_out(parser)
    add_common(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Check, diagnose, write, tell; 1 where a servo has no answer, 130 where it was stopped."""
    if arguments.out == "":
        raise InputError("--out is empty, a folder was expected")
    from ers_mj.fleet.manifest import read_manifest

    servos = read_manifest(arguments.manifest)
    if arguments.out is None and arguments.json:
        with passing(Path(tempfile.mkdtemp(prefix="ers-batch-"))) as folder:
            return _run(folder, servos, arguments, None)
    place = Place(Path(arguments.out or DEFAULT_OUT), arguments.out is None)
    if place.is_default and not arguments.force:
        refuse_foreign(place.folder, RESULTS)
    return _run(place.folder, servos, arguments, place)


def _run(folder: Path, servos: list[Servo], arguments: argparse.Namespace, place: Place | None) -> int:
    from ers_mj.fleet.batch import conduct, refuse_out
    from ers_mj.fleet.diagnosing import Settings

    refuse_out(folder, arguments.force or arguments.out is None)
    threads = 1 if arguments.cluster else max(arguments.jobs // len(servos), 1)
    settings = Settings(arguments.seed, arguments.quick, threads, f"ers batch {Path(arguments.manifest).name}")
    hired = crew_of(arguments)
    try:
        with Progress() as progress:
            batch = conduct(folder, servos, settings, hired, tell=tell, progress=progress)
    except KeyboardInterrupt:
        state = f"{folder} keeps what was done, the same command goes on from there" if place else "nothing was kept"
        stopping.tell(f"; {state}")
        return stopping.STOPPED
    finally:
        hired.close()
    rows = [batch.rows[servo.name] for servo in servos]
    errors = sum(bool(row["error"]) for row in rows)
    kept = keep(place, lambda folder: _write(folder, batch))
    print(as_json({"servos": rows, "errors": errors}) if arguments.json else "\n".join(_told(rows, kept)))
    return kept.code or (1 if errors else 0)


def _write(folder: Path, batch: Batch) -> list[Path]:
    from ers_mj.report.batch_report import batch_page

    rows = [batch.rows[servo.name] for servo in batch.servos]
    page = batch_page(rows, batch.documents(), batch.settings.made_by, batch.settings.made_on)
    table = {"batch.csv": lambda path: write_text(path, batch.table())}
    return write_results(folder, table | report_writers("batch.json", {"servos": rows}, page))


# -- in lines ---------------------------------------------------------------------------------------------------------


def _told(rows: list[dict], kept: Kept) -> list[str]:
    """What a terminal shows: a line a servo."""
    from ers_mj.report.batch_report import headline

    wide = max(len(row["name"]) for row in rows)
    lines = ["", bold(headline(rows)), "", bold(f"{'servo':{wide}}  {'verdict':17}  {'error / floor':>13}  effects")]
    for row in rows:
        after, floor = row["heldout_after"], row["noise_floor"]
        over = f"{after / floor:.3g}" if after is not None and floor else ""
        rest = row["error"] or row["effects"].replace(";", ", ")
        lines.append(f"{row['name']:{wide}}  {row['verdict'] or 'no answer':17}  {over:>13}  {rest}".rstrip())
    return lines + written(kept)
