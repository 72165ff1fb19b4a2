"""`ers validate`: the reduced model against the MuJoCo plant under the same voltages."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING

from ers_mj.commands.keeping import Kept, keep, results_folder
from ers_mj.commands.options import add_jobs_and_json, add_out, number, one_of, several
from ers_mj.commands.output import Progress, bold, written
from ers_mj.door.saving import as_json

if TYPE_CHECKING:
    from ers_mj.validation.cases import Validation

LINKAGES, SWITCH = ("constant", "rod"), ("off", "on")

RESULTS = ("validation.json", "report.html")


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "validate",
        help="the reduced model against the MuJoCo plant",
        description=(
            "Say where and why the reduced model, Eq. (6), stops being valid: MuJoCo has the play, the rod, the"
            " inductance, it has not.\nWith none of --gap, --linkage, --inductance every combination of 0 and 0.5 deg,"
            " both linkages, off and on."
        ),
        epilog=(
            "examples:\n  ers validate\n  ers validate --gap 0.1,0.5,1 --inductance off,on --out play\n"
            "  ers validate --gap 0 --linkage constant --json"
        ),
    )
    parser.add_argument(
        "--datasheet",
        "--model",
        default="table1",
        metavar="TOML",
        help="datasheet or model.toml (default table1, the paper's)",
    )
    parser.add_argument(
        "--gap", type=several(number(least=0), "gap"), metavar="DEG,...", help="play of +-DEG (default 0)"
    )
    parser.add_argument(
        "--linkage",
        type=several(one_of(LINKAGES), "linkage"),
        metavar="constant,rod",
        help="of MuJoCo's rudder (default constant)",
    )
    parser.add_argument(
        "--inductance",
        type=several(one_of(SWITCH), "switch"),
        metavar="off,on",
        help="whether L acts, in both plants (default off)",
    )
    parser.add_argument("--no-maps", action="store_true", help="leave the validity maps out, a third of the time")
    add_out(parser)
    add_jobs_and_json(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Simulate both, compare, write, tell; 0."""
    place = results_folder(arguments.out, arguments.force, arguments.json, RESULTS)
    from ers_mj.door.validating import validate

    with Progress() as progress:
        found = validate(
            arguments.datasheet,
            gap=arguments.gap and [math.radians(x) for x in arguments.gap],
            linkage=arguments.linkage,
            inductance=arguments.inductance and [x == "on" for x in arguments.inductance],
            maps=not arguments.no_maps,
            jobs=arguments.jobs,
            progress=progress,
        )
        kept = keep(place, lambda folder: found.save(folder, force=True, progress=progress))
    document = found.to_dict()
    print(as_json(document) if arguments.json else "\n".join(_told(found.validation, document, kept)))
    return kept.code


# -- the validation in lines ----------------------------------------------------------------------------------------


def _told(found: Validation, document: dict, kept: Kept) -> list[str]:
    """What a terminal shows when all is done."""
    lines = ["", bold(document["sentence"]), "", *_told_table(found), ""]
    for key in dict.fromkeys((e["gap_rad"], e["linkage"], e["inductance"]) for e in document["where"]):
        entries = [e for e in document["where"] if (e["gap_rad"], e["linkage"], e["inductance"]) == key]
        lines += [f"  {e['axis']:10} {e['sentence']}" for e in entries] + [""]
    lines += [f"left out: {sentence}" for sentence in document["left_out"]]
    return lines + written(kept)[1:]


def _told_table(found: Validation) -> list[str]:
    """RMS deviations, one condition a line."""
    from ers_mj.report.validity import VALID, degrees
    from ers_mj.validation.cases import spoken

    inputs, wide = list(dict.fromkeys(case.input for case in found.cases)), 38  # characters of a row's name
    lines = [bold(f"{'RMS deviation; MuJoCo has':{wide}}" + "".join(f"{name:>11}" for name in inputs))]
    for condition in dict.fromkeys(case.condition for case in found.cases):
        cases = {case.input: case for case in found.cases if case.condition == condition}
        cells = [f"{degrees(cases[x].rms)}{'*' if cases[x].rms > VALID * cases[x].motion else ' '}" for x in inputs]
        lines.append(f"  {spoken(condition):{wide - 2}}" + "".join(f"{cell:>11}" for cell in cells))
    return [
        *lines,
        (
            f"  * more than {100 * VALID:.0f} % of the motion; the reduced model is Eq. (6), or Eq. (1) where the"
            " inductance is on"
        ),
    ]
