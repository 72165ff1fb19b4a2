"""`ers identify`: parameters from recordings, with intervals, and what cannot be told."""

from __future__ import annotations

import argparse

from ers_mj.commands.keeping import Kept, keep, results_folder
from ers_mj.commands.options import (
    add_common,
    add_out,
    add_reading,
    add_recordings,
    number,
    one_of,
    pair,
    several,
    whole,
)
from ers_mj.commands.output import Progress, bold, written
from ers_mj.commands.recordings import reader
from ers_mj.door.saving import as_json
from ers_mj.errors import InputError

RESULTS = ("identify.json", "report.html", "model.toml")


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
    add_reading(parser)
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
        "--model",
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
    place = results_folder(arguments.out, arguments.force, arguments.json, RESULTS)
    read = reader(arguments)
    fixed, bounds = _values(arguments.fix, "--fix", _value), _values(arguments.bounds, "--bounds", _ends)
    from ers_mj.door.identifying import identify

    with Progress() as progress:
        found = identify(
            [read(spec) for spec in arguments.recordings],
            arguments.datasheet,
            method=arguments.method,
            plant=arguments.plant,
            fix=fixed,
            progress=progress,
            bounds=bounds,
            within=tuple(arguments.within),
            evaluations=arguments.evaluations,
            polish=arguments.polish,
            timestep=arguments.timestep,
            seed=arguments.seed,
            jobs=arguments.jobs,
        )
        kept = keep(place, lambda folder: found.save(folder, force=True, progress=progress))
    document = found.to_dict()
    print(as_json(document) if arguments.json else "\n".join(_told(document, kept)))
    return kept.code


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


def _told(document: dict, kept: Kept) -> list[str]:
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
    return lines + written(kept)
