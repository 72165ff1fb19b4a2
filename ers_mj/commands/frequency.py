"""`ers frequency`: models, loops and recordings over frequency."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from ers_mj.commands.keeping import Kept, keep, results_folder
from ers_mj.commands.loop import add_laws, add_plant, chosen_controllers, conditions_of, plant_and_design
from ers_mj.commands.options import (
    add_out,
    add_reading,
    angle_deg,
    number,
    one_of,
    several,
    swing_deg,
)
from ers_mj.commands.output import Progress, bold, written
from ers_mj.commands.recordings import reader
from ers_mj.door.saving import as_json, plain, report_writers, versions, write_results

if TYPE_CHECKING:
    from ers_mj.control.frequency.study import Study
    from ers_mj.control.trial import Conditions
    from ers_mj.servo.datasheet import Datasheet

AHEAD = ("gain_margin_db", "phase_margin_deg", "sensitivity_peak", "bandwidth_hz")
COLUMNS = (
    ("gain margin [dB]", "gain_margin_db", ".1f"),
    ("phase margin [°]", "phase_margin_deg", ".1f"),
    ("crossover [Hz]", "gain_crossover_hz", ".1f"),
    ("disk margin", "disk_margin", ".2f"),
    ("peak |S|", "sensitivity_peak", ".2f"),
    ("bandwidth [Hz]", "bandwidth_hz", ".1f"),
)

RESULTS = ("frequency.json", "report.html")


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "frequency",
        help="models, loops and recordings over frequency",
        description=(
            "Margins, sensitivity and limit cycles of controllers around a plant, and the frequency response of"
            " recordings beside the models."
        ),
        epilog=(
            "examples:\n  ers frequency --controller ftrc,pid --plant reduced,mujoco\n  ers frequency run1.csv"
            " --datasheet servo.toml --controller pid\n  ers frequency --controller pid --pid P=2,D=0.05 --rate-hz 2000"
            " --effect backlash:gap=0.0087,rho=0.64,f_contact=40,zeta=0.2 --json"
        ),
    )
    _add_what(parser)
    _add_how(parser)
    add_plant(parser)
    add_laws(parser)
    add_reading(parser)
    add_out(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object; without --out write no file")
    parser.set_defaults(run=run)


def _add_what(parser: argparse.ArgumentParser) -> None:
    """Which laws, on which plants, beside which recordings."""
    parser.add_argument(
        "recordings", nargs="*", metavar="REC", help="recordings whose frequency response is set beside the models'"
    )
    parser.add_argument(
        "--datasheet",
        "--model",
        default="table1",
        metavar="TOML",
        help="the plant: datasheet or model.toml with its effects (default table1)",
    )
    parser.add_argument(
        "--design", metavar="TOML", help="what the controllers know of the plant (default the datasheet itself)"
    )
    parser.add_argument(
        "--controller",
        type=several(str, "controller"),
        metavar="NAME,...",
        help="as of ers trial (default all; of a model with a [loop] its own firmware)",
    )
    parser.add_argument(
        "--plant",
        type=several(one_of(("reduced", "mujoco")), "plant"),
        default=["reduced"],
        metavar="reduced,mujoco",
        help="default reduced",
    )


def _add_how(parser: argparse.ArgumentParser) -> None:
    """At which amplitude, about which angle, how fast, with what voltage."""
    parser.add_argument(
        "--amplitude-deg",
        type=swing_deg,
        default=1.0,
        metavar="X",
        help="of the rudder's sine at which what is not linear is described (default 1)",
    )
    parser.add_argument(
        "--at-deg",
        type=angle_deg,
        metavar="X",
        help="angle about which the loops are linearised (default 10 beyond theta_0, 0 of a model with a [loop])",
    )
    parser.add_argument(
        "--rate-hz", type=number(above=0), default=10_000.0, metavar="N", help="sample rate of the loop (default 10000)"
    )
    parser.add_argument(
        "--umax-V",
        dest="umax",
        type=number(above=0),
        default=24.0,
        metavar="X",
        help="largest voltage, for limit cycles (default 24)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Analyse, write, tell; 0."""
    place = results_folder(arguments.out, arguments.force, arguments.json, RESULTS)
    from ers_mj.control.frequency.firmware import study_firmware
    from ers_mj.control.frequency.study import study
    from ers_mj.control.trial import sentence_of

    datasheet, design = plant_and_design(arguments.datasheet, arguments.design)
    controllers = chosen_controllers(arguments, datasheet)
    conditions = _conditions(arguments, datasheet)
    read = reader(arguments)
    recordings = [read(spec) for spec in arguments.recordings]
    with Progress() as progress:
        asked = arguments.plant, conditions, recordings
        if datasheet.loop:
            found = study_firmware(datasheet, *asked, progress=progress)
        else:
            found = study(datasheet, controllers, *asked, design=design, progress=progress)
        document = plain(
            _document(found, conditions)
            | {
                "controllers": {name: sentence_of(name, datasheet) for name in controllers},
                "datasheet": datasheet.name or arguments.datasheet,
                "design": design.name or arguments.design,
                "problems": {r.name: list(r.problems) for r in recordings},
                "versions": versions(),
            }
        )
        kept = keep(place, lambda folder: _write(folder, document, found, progress))
    print(as_json(document) if arguments.json else "\n".join(_told(document, kept)))
    return kept.code


def _conditions(arguments: argparse.Namespace, datasheet: Datasheet) -> Conditions:
    rest = datasheet.to_lumped().get("theta_0", 0.0)
    start = (
        rest + math.radians(0.0 if datasheet.loop else 10.0)
        if arguments.at_deg is None
        else math.radians(arguments.at_deg)
    )
    return conditions_of(arguments, start=start, rate_hz=arguments.rate_hz)


def _document(found: Study, conditions: Conditions) -> dict:
    """What `--json` prints; the contract's four keys are those of the first loop."""
    from ers_mj.control.frequency.telling import as_document, headline

    first = found.loops[0].as_document()
    return {
        **{key: first[key] for key in AHEAD},
        "sentence": headline(found),
        **as_document(found),
        "conditions": conditions.as_document(),
    }


def _write(folder: Path, document: dict, found: Study, progress: Progress) -> list[Path]:
    from ers_mj.report.frequency_report import frequency_page

    progress("drawing the report", 1.0)
    page = frequency_page(document, found)
    return write_results(folder, report_writers("frequency.json", document, page))


# -- in lines ---------------------------------------------------------------------------------------------------------


def _told(document: dict, kept: Kept) -> list[str]:
    """What a terminal shows when all is done."""
    lines = ["", bold(document["sentence"]), "", bold(f"{'loop':26}" + "".join(f"{head:>18}" for head, *_ in COLUMNS))]
    for loop in document["loops"]:
        cells = "".join(f"{_cell(loop[key], form):>18}" for _, key, form in COLUMNS)
        lines.append(
            f"  {loop['controller'] + ', ' + loop['plant']:24}{cells}{'' if loop['stable'] else '   unstable'}"
        )
    lines += ["", bold("limit cycles"), *(f"  {sentence}" for sentence in document["cycle_sentences"])]
    if document["recordings"]:
        lines += [
            "",
            bold("recordings"),
            *(f"  {sentence}" for r in document["recordings"] for sentence in r["sentences"]),
        ]
    lines += ["", *document["notes"]] if document["notes"] else []
    return lines + written(kept)


def _cell(x: float | None, form: str) -> str:
    return "-" if x is None else f"{x:{form}}"
