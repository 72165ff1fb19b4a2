"""`ers excite`: the input that pins wanted parameters best on a rig, and by how much."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from ers_mj.commands.keeping import keep_file, table_file
from ers_mj.commands.options import add_model, number, one_of, several
from ers_mj.commands.output import Progress, bold
from ers_mj.door.saving import as_json, make_room
from ers_mj.errors import InputError

if TYPE_CHECKING:
    from ers_mj.experiment_design.question import Plan, Question

CRITERIA = ("A", "D")


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "excite",
        help="design the input that pins a servo's parameters best, within a rig's limits",
        description=(
            "Design an input (multisines, chirps, squares, steps, pushes, or several in turn) within a rig's voltage"
            " and travel that leaves the\nnarrowest intervals, by the Fisher information of the event-exact model, and"
            " say by how much they shrink against a named input."
        ),
        epilog=(
            "examples:\n  ers excite table1 --umax-V 24 --travel-deg 60 --current-noise-A 0.02 --for B --out next.csv\n"
            "  ers excite model.toml --umax-V 12 --duration-s 5 --out next.csv && ers simulate model.toml --input"
            " next.csv --out rec.csv"
        ),
    )
    _add_rig(parser)
    _add_question(parser)
    parser.add_argument("--out", required=True, metavar="FILE", help="the CSV file to write: t_s,u_V")
    parser.add_argument("--force", action="store_true", help="overwrite FILE")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.set_defaults(run=run)


def _add_rig(parser: argparse.ArgumentParser) -> None:
    """The servo, what may be done to it, and how it is measured."""
    add_model(parser, "datasheet or model.toml (default table1)")
    parser.add_argument(
        "--umax-V",
        dest="umax",
        type=number(above=0),
        default=24.0,
        metavar="X",
        help="largest voltage, either way (default 24)",
    )
    parser.add_argument(
        "--travel-deg",
        type=number(above=0),
        default=60.0,
        metavar="X",
        help="how far the output may leave theta_0, either way (default 60)",
    )
    parser.add_argument(
        "--duration-s", type=number(above=0), default=10.0, metavar="S", help="of the recording (default 10)"
    )
    parser.add_argument(
        "--rate-hz", type=number(above=0), default=1000.0, metavar="N", help="sample rate (default 1000)"
    )
    parser.add_argument(
        "--noise-deg",
        type=number(above=0),
        default=0.01,
        metavar="X",
        help="noise of the sensor, standard deviation (default 0.01)",
    )
    parser.add_argument(
        "--current-noise-A",
        dest="current",
        type=number(above=0),
        metavar="X",
        help="the current is measured, with this noise (default: it is not)",
    )
    parser.add_argument(
        "--inductance", choices=("on", "off"), default="on", help="whether the datasheet's L acts (default on)"
    )


def _add_question(parser: argparse.ArgumentParser) -> None:
    """Which parameters are wanted, and against what the design is judged."""
    parser.add_argument(
        "--for",
        dest="wanted",
        type=several(str, "name"),
        default=[],
        metavar="NAME,...",
        help="a_1 a_2 b c_1 c_2 theta_0 tau_e, or B K_e K_t R per inertia where they can be told (default all)",
    )
    parser.add_argument(
        "--criterion",
        type=one_of(CRITERIA),
        default="A",
        metavar="A|D",
        help="least mean square of the intervals over those of --against, or least determinant (default A)",
    )
    parser.add_argument(
        "--against",
        default="multisine",
        metavar="NAME",
        help="named input to compare with, cut off at --umax-V (default multisine)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Design, write, tell; 0."""
    out = table_file(arguments.out, arguments.force)
    from ers_mj.data.recording import FEWEST_SAMPLES
    from ers_mj.experiment_design.optimal_input import planned, reference
    from ers_mj.experiment_design.question import Question, Rig
    from ers_mj.plants.inputs import INPUTS
    from ers_mj.servo.datasheet import read_plant

    if arguments.against not in INPUTS:
        raise InputError(f"--against: there is no input {arguments.against[:40]!r}; there are {', '.join(INPUTS)}")
    samples, most = arguments.duration_s * arguments.rate_hz, 200_000
    if not FEWEST_SAMPLES <= samples <= most:
        raise InputError(
            f"{arguments.duration_s:g} s at {arguments.rate_hz:g} Hz are {samples:.3g} samples, {FEWEST_SAMPLES} to"
            f" {most} were expected"
        )
    datasheet = read_plant(arguments.model)
    rig = Rig.of(
        datasheet.to_lumped().get("theta_0", 0.0),
        arguments.umax,
        math.radians(arguments.travel_deg),
        arguments.duration_s,
        arguments.rate_hz,
        math.radians(arguments.noise_deg),
        arguments.current,
    )
    question = Question.of(datasheet, rig, arguments.wanted, arguments.criterion, arguments.inductance == "on")
    with Progress() as progress:
        before = reference(question, arguments.against)
        plan = planned(question, before, progress)
    kept = keep_file(out, lambda file: _write(file, {"t_s": rig.t, "u_V": plan.u}))
    document = {"out": kept.told(arguments.out), **_document(arguments, question, before, plan)}
    print(as_json(document) if arguments.json else "\n".join(_told(document)))
    return kept.code


def _write(file: Path, columns: dict) -> None:
    from ers_mj.data.recording import write_recording

    make_room(file)
    write_recording(file, columns)


def _half_width(sigma: float) -> float:
    """Of a 95 % interval, from its standard deviation."""
    return 1.96 * sigma


def _document(arguments: argparse.Namespace, question: Question, before: Plan, plan: Plan) -> dict:
    from ers_mj.experiment_design.question import TOLD

    rows = {
        name: {
            "meaning": TOLD[name][0],
            "relative": name != "theta_0",
            "against": _half_width(before.spread[name]),
            "designed": _half_width(plan.spread[name]),
            "ratio": plan.spread[name] / before.spread[name],
            "refits_against": _half_width(before.found[name]),
            "refits_designed": _half_width(plan.found[name]),
            "refits_ratio": plan.found[name] / before.found[name],
        }
        for name in question.wanted
    }
    return {
        "against": arguments.against,
        "current": arguments.current is not None,
        "criterion": arguments.criterion,
        "parts": list(plan.parts),
        "half_width_95": rows,
        "duration_s": question.rig.limits.duration,
        "rate_hz": question.rig.limits.rate_hz,
    }


def _told(document: dict) -> list[str]:
    from ers_mj.experiment_design.optimal_input import UNSEEN
    from ers_mj.experiment_design.wording import asked

    parts = [
        (
            f"Record the named {p['name']}, up to {p['amplitude']:.3g} V, for {p['duration_s']:.3g} s at"
            f" {p['rate_hz']:.4g} Hz."
            if p["kind"] == "named"
            else asked({**p, "input_unit": "V"})
        )
        for p in document["parts"]
    ]
    lines = [
        "",
        bold(" Then: ".join(parts)),
        "",
        bold(f"  {'95 % interval, +-':28}{document['against']:>14}{'this input':>14}{'ratio':>9}{'promised':>11}"),
    ]
    for name, row in document["half_width_95"].items():
        scale, unit = (100.0, " %") if row["relative"] else (math.degrees(1.0), "°")
        widths = [
            f"{scale * row[key]:.3g}{unit}" if row[key] < _half_width(UNSEEN) or not row["relative"] else "not seen"
            for key in ("refits_against", "refits_designed")
        ]
        ratios = f"{row['refits_ratio']:>9.2f}{row['ratio']:>11.2f}"
        lines.append(f"  {name:8}{row['meaning']:20}{widths[0]:>14}{widths[1]:>14}{ratios}")
    lines += [
        "",
        "Widths and ratio are what refits to simulated recordings find; promised is the ratio by Fisher's information"
        + (
            "."
            if document["current"]
            else ", whose own\nwidths were 2 to 14 times too narrow where only the angle is measured."
        ),
    ]
    return [*lines, "", bold("written"), f"  {document['out']}"]
