"""`ers identify`: parameters from recordings, with intervals, and what cannot be told."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ers_mj.commands.options import (
    add_common,
    add_input,
    add_map,
    add_out,
    add_recordings,
    mapping,
    number,
    one_of,
    pair,
    results_folder,
    several,
    whole,
)
from ers_mj.commands.output import Progress, as_json, bold, plain, report_writers, versions, write_results, written
from ers_mj.commands.recordings import refuse_mixed_inputs, refuse_twice
from ers_mj.errors import InputError

if TYPE_CHECKING:
    from ers_mj.data.recording import Recording
    from ers_mj.identification.answer import Identified


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "identify",
        help="parameters with intervals, and which the recordings can tell",
        description=(
            "Identify a servo's parameters from recordings: values, intervals, and which the recordings cannot tell."
        ),
        epilog=(
            "examples:\n  ers identify run1.csv --datasheet servo.toml\n"
            "  ers identify run1.csv run2.csv --datasheet servo.toml --fix J=0.0031 --method iga --polish\n"
            "  ers identify run1.csv --datasheet servo.toml --plant mujoco --json"
        ),
    )
    add_recordings(parser)
    _add_way(parser)
    _add_search(parser)
    add_map(parser)
    add_input(parser)
    add_out(parser)
    add_common(parser)
    parser.set_defaults(run=run)


def _add_way(parser: argparse.ArgumentParser) -> None:
    """By which method, on which plant, from what."""
    parser.add_argument(
        "--method",
        default="ls",
        metavar="NAME",
        help="ls, iga, iga-rotated, ga, pso, cma or de (default ls, trust-region least squares)",
    )
    parser.add_argument(
        "--plant",
        type=one_of(("reduced", "mujoco")),
        default="reduced",
        metavar="reduced|mujoco",
        help="what is simulated (default reduced)",
    )
    parser.add_argument(
        "--datasheet",
        metavar="TOML",
        help=(
            "what is known of the servo: where the search begins; table1 is the paper's (default: nothing, Eq. 6 from"
            " scratch)"
        ),
    )


def _add_search(parser: argparse.ArgumentParser) -> None:
    """What is held, where the rest is searched, and for how long."""
    parser.add_argument(
        "--fix",
        type=pair,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="hold a parameter, as in J=0.0031; repeatable",
    )
    parser.add_argument(
        "--bounds",
        type=pair,
        action="append",
        default=[],
        metavar="NAME=LOW:HIGH",
        help="search a parameter here; repeatable",
    )
    parser.add_argument(
        "--within",
        type=several(number(above=0), "factor"),
        default=[0.2, 3.0],
        metavar="LOW,HIGH",
        help="search the others between these factors of what is known (default 0.2,3)",
    )
    parser.add_argument(
        "--evaluations", type=whole(1), metavar="N", help="simulations at most (default 10000, in MuJoCo 400)"
    )
    parser.add_argument("--timestep", type=number(above=0), metavar="S", help="MuJoCo's step [s] (default 5e-5)")
    parser.add_argument("--polish", action="store_true", help="let ls go on where another method ends")


def run(arguments: argparse.Namespace) -> int:
    """Identify, write, tell; 0 whatever comes out."""
    folder = results_folder(arguments.out, arguments.force, arguments.json)
    names = mapping(arguments.map)
    fixed, bounds = _values(arguments.fix, "--fix", _value), _values(arguments.bounds, "--bounds", _ends)
    if len(arguments.within) != 2 or not arguments.within[0] < 1 < arguments.within[1]:
        raise InputError(
            f"--within gives {', '.join(f'{x:g}' for x in arguments.within)}, a factor below one and one above it were"
            " expected"
        )
    from ers_mj.data.recording import read_recording
    from ers_mj.identification.estimate import identify
    from ers_mj.identification.finding import Settings
    from ers_mj.servo.datasheet import read_datasheet

    settings = Settings(
        arguments.method,
        arguments.plant,
        fixed,
        bounds,
        tuple(arguments.within),
        arguments.evaluations,
        arguments.polish,
        arguments.seed,
        arguments.jobs,
        **({"timestep": arguments.timestep} if arguments.timestep else {}),
    )
    datasheet = read_datasheet(arguments.datasheet) if arguments.datasheet is not None else None
    recordings = [read_recording(spec, names, input_column=arguments.input) for spec in arguments.recordings]
    refuse_twice(recordings, [])
    refuse_mixed_inputs(recordings)
    if recordings[0].input_kind == "position":
        return _loop(arguments, recordings, folder)
    with Progress() as progress:
        found = identify(recordings, datasheet, settings, progress)
        document = plain(_document(found, recordings))
        files = _write(folder, document, found, progress) if folder is not None else []
    print(as_json(document) if arguments.json else "\n".join(_told(document, files)))
    return 0


def _loop(arguments: argparse.Namespace, recordings: list[Recording], folder: Path | None) -> int:
    """Identify a servo that is told a position."""
    from ers_mj.diagnosis.loop_rows import improved, parameters
    from ers_mj.position_loop.identified import identify_loop
    from ers_mj.servo.datasheet import write_model

    asked = {"--method": arguments.method != "ls", "--plant": arguments.plant != "reduced", "--fix": arguments.fix}
    asked |= {"--bounds": arguments.bounds, "--datasheet": arguments.datasheet}
    for option, is_given in asked.items():
        if is_given:
            raise InputError(f"{option} does not go with a position command, which least squares fit without it")
    with Progress() as progress:
        found = identify_loop(recordings, arguments.jobs or 1, progress)
    rows = parameters(found.intervals, recordings[0].output_unit)
    words = "explains the recordings" if found.explains else "leaves more than noise: ask ers diagnose what is missing"
    document = plain(
        {
            "method": "ls",
            "plant": "reduced",
            "sentence": f"A {found.fit.model.kind} position loop {words}.",
            "parameters": {name: row | {"fixed": False} for name, row in rows.items()},
            "fitness": found.fitness,
            "evaluations": found.evaluations,
            "wall_s": found.wall_s,
            "explains": found.explains,
            "misfit_sigma2": found.fit.misfit,
            "warnings": [],
            "data": _data(recordings),
            "seed": arguments.seed,
            "versions": versions(),
        }
    )
    files = []
    if folder is not None:
        from ers_mj.report.identify_report import loop_page

        writers = report_writers("identify.json", document, loop_page(document))
        model = improved(found.fit.model)
        files = write_results(folder, writers | {"model.toml": lambda path: write_model(path, model)})
    print(as_json(document) if arguments.json else "\n".join(_told(document, files)))
    return 0


def _data(recordings: list[Recording]) -> dict:
    return {
        "files": [r.name for r in recordings],
        "sha256": [r.sha256 for r in recordings],
        "output_unit": recordings[0].output_unit,
        "input_unit": recordings[0].input_unit,
        "input_kind": recordings[0].input_kind,
        "problems": [f"{r.name}: {p}" for r in recordings for p in r.problems],
        "faults": [fault.as_document(r.name) for r in recordings for fault in r.faults],
    }


def _values(pairs: list[tuple[str, str]], option: str, read) -> dict:
    out = {}
    for name, text in pairs:
        if name in out:
            raise InputError(f"{option} gives {name} twice, one value was expected")
        out[name] = read(name, text, option)
    return out


def _value(name: str, text: str, option: str) -> float:
    try:
        return number()(text)
    except argparse.ArgumentTypeError as error:
        raise InputError(f"{option} {name}={text}: {error}") from None


def _ends(name: str, text: str, option: str) -> tuple[float, float]:
    low, mark, high = text.partition(":")
    if not mark:
        raise InputError(f"{option} {name}={text}: LOW:HIGH was expected, as in {name}=0.001:0.01")
    return _value(name, low, option), _value(name, high, option)


def _document(found: Identified, recordings: list[Recording]) -> dict:
    return {
        "method": found.settings.method,
        "plant": found.settings.plant,
        "sentence": found.sentence,
        "parameters": {row.name: row.as_document() for row in found.rows},
        "fitness": found.fitness,
        "evaluations": found.evaluations,
        "wall_s": found.wall_s,
        "explains": found.explains,
        "misfit_sigma2": found.misfit,
        "warnings": list(found.warnings),
        "structure": {
            "letters": list(found.structure.names),
            "rank": found.structure.rank,
            "null_space": found.structure.null,
            "singular_values": found.structure.singular,
        },
        "data": _data(recordings),
        "seed": found.settings.seed,
        "versions": versions(),
    }


def _write(folder: Path, document: dict, found: Identified, progress: Progress) -> list[Path]:
    from ers_mj.report.identify_report import identify_page
    from ers_mj.servo.datasheet import write_model

    progress("drawing the report", 1.0)
    page = identify_page(document, found)
    return write_results(
        folder,
        report_writers("identify.json", document, page) | {"model.toml": lambda path: write_model(path, found.model)},
    )


def _told(document: dict, files: list[Path]) -> list[str]:
    """What a terminal shows when all is done."""
    lines = [
        "",
        bold(document["sentence"]),
        "",
        bold(f"  {'parameter':14}{'value':>14}{'95 % interval':>30}{'datasheet':>14}"),
    ]
    for name, row in document["parameters"].items():
        value = "not told" if row["value"] is None else f"{row['value']:.5g}"
        low, high = row["ci95"]
        ends = "held" if row["fixed"] else "" if low is None else f"{low:.5g} .. {high:.5g}"
        sheet = "" if row["datasheet"] is None else f"{row['datasheet']:.5g}"
        lines.append(f"  {name:14}{value:>14}{ends:>30}{sheet:>14}  {row['unit']}")
    lines += [
        "",
        (
            f"{document['method']} on the {document['plant']} plant: fitness {document['fitness']:.3g},"
            f" {document['evaluations']} simulations, {document['wall_s']:.2f} s"
        ),
    ]
    lines += (
        ["", bold("be careful"), *(f"  {warning}" for warning in document["warnings"])] if document["warnings"] else []
    )
    return lines + written(files)
