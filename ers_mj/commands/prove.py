"""`ers prove`: conceals effects in recordings made in MuJoCo, or in real ones, diagnoses them blind, and opens the
truth.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping
from contextlib import closing
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from ers_mj.commands.contest import add_contest, exported, scored, wanted
from ers_mj.commands.keeping import Kept, Place, folder_for, keep
from ers_mj.commands.options import add_cluster, add_common, add_out, crew_of, number, whole
from ers_mj.commands.output import Progress, bold, tell, written
from ers_mj.door.saving import as_json, plain, report_writers, write_results, write_text
from ers_mj.processes import stopping
from ers_mj.processes.passing import passing

if TYPE_CHECKING:
    from ers_mj.proving.conduct import Proof
    from ers_mj.workers.base import Task

CASES = 20  # of a proof that names no number
REAL = "../shared/data"  # where the real records lie that no folder is named for


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "prove",
        help="conceal effects, diagnose them blind, score",
        description=(
            "Measure what the diagnosis can do. Servos of several families are drawn, effects concealed in them,"
            " recorded in MuJoCo\nor by an integrator of the proof's own; the truth is sealed and its hash printed;"
            " each case is diagnosed by a process\nthat gets its files only; the truth is opened, the answers scored."
            " A quarter of the cases hides nothing, half one effect,\n15 % several, 10 % one that the library does not"
            " have. Stopped with Ctrl-C, the same command goes on where it was."
        ),
        epilog=(
            "examples:\n  ers prove --cases 40 --seed 7 --out proof\n"
            "  ers prove --families screw,position --cases 8 --seed 7\n"
            "  ers prove --real ../shared/data --cases 15 --out proof-real\n"
            "  ers prove --cases 20 --export cases\n  ers prove --score answers --truth cases.truth.json"
        ),
    )
    parser.add_argument("--cases", type=whole(1), metavar="N", help=f"how many (default {CASES})")
    parser.add_argument(
        "--families",
        metavar="NAME,...",
        help="kinds of servos, in turn (default all): rudder, hobby, direct, screw, throttle, strain_wave, gimbal,"
        " position",
    )
    parser.add_argument(
        "--real",
        nargs="?",
        const=REAL,
        metavar="FOLDER",
        help=f"conceal in real recordings: the folder that holds emps/, throttle/ and sts3215/ (default {REAL})",
    )
    parser.add_argument(
        "--limit", type=number(above=1), default=300.0, metavar="S", help="processor time of a diagnosis (default 300)"
    )
    add_contest(parser)
    add_cluster(parser)
    add_out(parser)
    add_common(parser)
    parser.set_defaults(run=run, seed=None)  # cases for others are drawn by chance


def run(arguments: argparse.Namespace) -> int:
    """Conduct, write, tell; 0 whatever comes out, 130 where it was stopped. Or what others are handed, and scored."""
    if wanted(arguments):
        return exported(arguments, _tasks) if arguments.export is not None else scored(arguments, _shown)
    arguments.seed = arguments.seed or 0
    if arguments.out is None and arguments.json:
        with passing(Path(tempfile.mkdtemp(prefix="ers-prove-"))) as folder:
            return _run(folder, arguments, None)
    from ers_mj.proving.sealing import WRITTEN, refuse_foreign

    place = folder_for(arguments.out, arguments.force, WRITTEN, may_hold=True)
    if place.is_default and not arguments.force:
        refuse_foreign(place.folder)
    return _run(place.folder, arguments, place)


def _run(folder: Path, arguments: argparse.Namespace, place: Place | None) -> int:
    tasks, settings = _tasks(arguments)
    from ers_mj.proving.conduct import conduct
    from ers_mj.proving.real import scored_real
    from ers_mj.proving.scoring import row_of
    from ers_mj.proving.scoring import scored as scored_simulated

    try:
        with closing(crew_of(arguments)) as hired, Progress() as progress:
            proof = conduct(
                folder,
                tasks,
                settings,
                force=arguments.force or arguments.out is None,
                crew=hired,
                limit=arguments.limit,
                tell=tell,
                progress=progress,
            )
    except KeyboardInterrupt:
        state = (
            f"{folder} keeps what was done, the same command goes on from there"
            if place is not None
            else "nothing was kept, --out DIR would keep it"
        )
        stopping.tell(f"; {state}")
        return stopping.STOPPED
    rows = [row_of(truth, proof.answers[name]) for name, truth in proof.truths.items()]
    scores = scored_simulated(rows) if arguments.real is None else scored_real(rows)
    results = plain(
        {**scores, "seed": arguments.seed, "truth_sha256": proof.sha256, "rows": rows, "versions": _versions(proof)}
    )
    told, kept = _shown(place, results, rows)
    print(as_json(results) if arguments.json else "\n".join([*told, *written(kept)]))
    return kept.code


def _tasks(arguments: argparse.Namespace) -> tuple[list[Task], dict]:
    """The cases to be made, and what names this proof."""
    from ers_mj.workers.base import Task

    if arguments.real is not None:
        from ers_mj.door.own_answer import OwnAnswer
        from ers_mj.proving import real

        folder, seed = Path(arguments.real).absolute(), arguments.seed
        plans = real.plans(arguments.cases or len(real.COVERAGE), seed)
        real.refuse_missing(folder, plans)
        own = cache(lambda rig: OwnAnswer(real.files_of(rig, folder, seed)))
        tasks = [Task(plan.name, real.make, (plan, folder, seed, own)) for plan in plans]
        return tasks, {"kind": "real", "seed": seed, "cases": len(plans), "folder": str(folder)}
    from ers_mj.proving import world

    families = world.chosen(arguments.families and [name.strip() for name in arguments.families.split(",")])
    cases = world.plans(arguments.cases or CASES, arguments.seed, families)
    tasks = [Task(f"case-{plan.index + 1:03d}", world.make, (plan, arguments.seed)) for plan in cases]
    settings = {"kind": "simulated", "seed": arguments.seed, "cases": len(cases), "families": ",".join(families)}
    return tasks, settings


def _versions(proof: Proof) -> dict[str, str]:
    from ers_mj import __version__

    answers = (answer.get("document") or {} for answer in proof.answers.values())
    return {"ers-mj": __version__, **next((a["versions"] for a in answers if a.get("versions")), {})}


def _shown(place: Place | None, results: dict, rows: list[dict]) -> tuple[list[str], Kept]:
    """The lines of a terminal, and what was written of them."""
    told = _told(results)
    return told, keep(place, lambda folder: _write(folder, results, rows, told))


def _write(folder: Path, results: dict, rows: list[dict], told: list[str]) -> list[Path]:
    from ers_mj.report.proof_report import proof_page

    about = {"seed": results["seed"], "truth sealed as sha256": results["truth_sha256"], **results["versions"]}
    page = proof_page(results, rows, about)
    return write_results(
        folder,
        report_writers("results.json", results, page)
        | {"summary.txt": lambda path: write_text(path, "\n".join(told) + "\n")},
    )


# -- the proof in lines ---------------------------------------------------------------------------------------------


def _told(results: dict) -> list[str]:
    """What a terminal shows when all is done."""
    from ers_mj.report.proof_families import told_families
    from ers_mj.report.proof_report import headline, table_of

    counts = ", ".join(f"{n} {kind}" for kind, n in results["counts"].items() if n)
    lines = ["", bold(headline(results)), f"{results['cases']} cases ({counts}), seed {results['seed']}", ""]
    lines += [f"  {told:58}{count:>11}   {share}" for told, count, share in table_of(results)]
    if results["accuracy"]:
        lines += ["", bold("named right by class, against what the refit leaves [sigma]")]
    for b in results["accuracy"]:
        top = f"{b['to_sigma']:g}" if b["to_sigma"] else "more"
        lines.append(
            f"  {b['from_sigma']:g} to {top:14}{b['right']:>4} of {b['of']:<4} [{b['ci95'][0]:.2f}, {b['ci95'][1]:.2f}]"
        )
    lines += told_families(results)
    lines += _told_real(results) if "concealed_in_real" in results else _told_confusion(results["confusion"])
    over, cpu, pair, wall = (results[name] for name in ("error_over_floor", "cpu_s", "cpu_s_of_a_pair", "wall_s"))
    lines += (
        ["", f"held-out error over noise floor: median {over['median']:.3g}, 90 % below {over['p90']:.3g}"]
        if over.get("median")
        else [""]
    )
    if cpu:
        lines.append(
            f"time a case: median {cpu['median']:.1f} s of one processor, at most {cpu['max']:.1f} s (by the clock"
            f" {wall['median']:.1f} and {wall['max']:.1f} s)"
        )
    if pair:
        lines.append(f"a pair of effects: median {pair['median']:.1f} s, at most {pair['max']:.1f} s")
    if results["peak_MiB"]:
        lines.append(f"memory of a case: at most {results['peak_MiB']:.0f} MiB")
    return lines + [f"no answer: {failure}" for failure in results["failures"]]


def _told_confusion(confusion: dict) -> list[str]:
    """What was named first of each that was concealed."""
    lines = ["", bold("concealed -> named first")]
    return lines + [
        f"  {truth:58} {', '.join(f'{k} x {name}' if k > 1 else name for name, k in named.items())}"
        for truth, named in confusion.items()
    ]


def _told_real(results: dict) -> list[str]:
    """What was concealed in real records and found again beside what the rigs have of their own."""

    lines = ["", bold("the rigs as they are")]
    lines += [f"  {rig:12} {', '.join(names) or 'nothing'}" for rig, names in results["own"].items()]
    lines += ["", bold("concealed in them")]
    lines += [_told_again(x) for x in results["concealed_in_real"]]
    lines += ["", bold("half simulated: put into them by the rig's own best model")]
    lines += [_told_again(x) for x in results["half_simulated"]]
    for told, key in (("in real records", "foremost_visible"), ("half simulated", "foremost_visible_half_simulated")):
        k, n = results[key]
        lines.append(f"first or second beside the rig's own, of those that leave 3 times its error, {told}: {k} of {n}")
    return lines


def _told_again(x: Mapping) -> str:
    from ers_mj.report.proof_report import again

    left = f"{x['visibility']:.3g} x"
    return (
        f"  {x['rig']:12} {x['concealed']:24} {x['strength']:<10.3g} leaves {left:9} {again(x):7}"
        f" {', '.join(x['named']) or 'nothing'}"
    )
