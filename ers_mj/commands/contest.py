"""What `ers prove` does for others: cases to be handed out, and scores of whoever answers them."""

from __future__ import annotations

import argparse
import secrets
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ers_mj.commands.keeping import Kept, Place, results_folder
from ers_mj.commands.options import crew_of
from ers_mj.commands.output import Progress, bold, tell, written
from ers_mj.door.saving import as_json, plain
from ers_mj.errors import InputError

if TYPE_CHECKING:
    from ers_mj.workers.base import Task

Made = Callable[[argparse.Namespace], tuple[list["Task"], dict[str, Any]]]
RESULTS = ("results.json", "report.html", "summary.txt")
Told = Callable[[Place | None, dict, list[dict]], tuple[list[str], Kept]]


def add_contest(parser: argparse.ArgumentParser) -> None:
    """--export, --score and --truth."""
    parser.add_argument("--export", metavar="DIR", help="write cases for others to diagnose, without their truth")
    parser.add_argument("--score", metavar="ANSWERS", help="score others' DIR/case-NNN/diagnosis.json, with --truth")
    parser.add_argument(
        "--truth", metavar="SEALED", help="the sealed truth of exported cases (default beside DIR: DIR.truth.json)"
    )


def wanted(arguments: argparse.Namespace) -> bool:
    """Whether cases are exported or answers scored.

    Raises:
        InputError: the options do not go together.
    """
    if arguments.export is not None and arguments.score is not None:
        raise InputError("--export and --score were given, one of them was expected")
    if arguments.score is not None and arguments.truth is None:
        raise InputError("--score needs the truth, give --truth SEALED as prove --export wrote it")
    if arguments.truth is not None and arguments.score is None and arguments.export is None:
        raise InputError("--truth is for --score or --export, neither was given")
    return arguments.export is not None or arguments.score is not None


def exported(arguments: argparse.Namespace, tasks_of: Made) -> int:
    """Write the cases and the truth, tell; 0. Without --seed nobody can draw the same cases again."""
    from ers_mj.proving.contest import export, refuse_places
    from ers_mj.workers.held import held

    if not arguments.export:
        raise InputError("--export is empty, a folder was expected")
    folder = Path(arguments.export)
    sealed = Path(arguments.truth or f"{folder}.truth.json")
    refuse_places(folder, sealed, arguments.force)
    if arguments.seed is None:
        arguments.seed = secrets.randbits(48)
    tasks, settings = tasks_of(arguments)
    with held(folder, "ers prove --export"), closing(crew_of(arguments)) as hired, Progress() as progress:
        digest = export(folder, sealed, tasks, settings, hired, progress)
    found = {"cases": len(tasks), "folder": str(folder), "truth": str(sealed), "truth_sha256": digest}
    lines = ["", bold(f"{len(tasks)} cases, their truth sealed with sha256 {digest}"), *written(Kept((folder, sealed)))]
    print(as_json(found) if arguments.json else "\n".join(lines))
    return 0


def scored(arguments: argparse.Namespace, told_of: Told) -> int:
    """Score, write, tell; 1 where an answer rests on altered files."""
    place = results_folder(arguments.out, arguments.force, arguments.json, RESULTS)
    from ers_mj import __version__
    from ers_mj.proving import scoring
    from ers_mj.proving.contest import answered
    from ers_mj.proving.real import scored_real

    found = answered(Path(arguments.score), Path(arguments.truth))
    scores = scored_real(found.rows) if found.sealed.get("kind") == "real" else scoring.scored(found.rows)
    results = plain(
        {
            **scores,
            "seed": found.sealed.get("seed"),
            "truth_sha256": found.sealed["truth_sha256"],
            "problems": found.told,
            "rows": found.rows,
            "versions": {"ers-mj": __version__},
        }
    )
    for line in found.told:
        tell(f"ers: {line}")
    lines, kept = told_of(place, results, found.rows)
    print(as_json(results) if arguments.json else "\n".join([*lines, *written(kept)]))
    return kept.code or (1 if found.altered else 0)
