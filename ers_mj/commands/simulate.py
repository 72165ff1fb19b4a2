"""`ers simulate`: a recording with known truth."""

from __future__ import annotations

import argparse
import math

from ers_mj.commands.keeping import keep_file, table_file
from ers_mj.commands.options import add_model, number, whole
from ers_mj.door.saving import as_json
from ers_mj.errors import InputError

PLANTS, LINKAGES, PLAYS = ("reduced", "mujoco"), ("constant", "rod"), ("gap", "printed")


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "simulate",
        help="write a recording with known truth",
        description="Simulate a servo: a recording with known truth.",
        epilog=(
            "examples:\n  ers simulate --plant reduced --input steps --effect stribeck:dF_s=0.1,v_s=0.2 --noise-deg"
            " 0.01 --out rec.csv\n  ers simulate --plant mujoco --linkage rod --gap 0.5 --inductance on --input chirp"
            " --out rec.csv\n  ers simulate model.toml --plant reduced --input volts.csv --out rec.csv"
        ),
    )
    add_model(parser, "datasheet or model.toml (default table1)")
    parser.add_argument("--plant", choices=PLANTS, default="reduced", help="what to simulate (default reduced)")
    parser.add_argument(
        "--input",
        required=True,
        metavar="CSV|NAME",
        help="columns t_s,u_V (or what the model is told), or multisine, chirp, ramp, steps, square",
    )
    parser.add_argument("--gap", type=number(least=0), default=0.0, metavar="DEG", help="play of +-DEG (default 0)")
    parser.add_argument(
        "--play",
        choices=PLAYS,
        default="gap",
        help="a gap between two bodies, or the paper's Eq. (4) as printed (default gap)",
    )
    parser.add_argument(
        "--linkage", choices=LINKAGES, default="constant", help="of the rudder; rod in mujoco only (default constant)"
    )
    parser.add_argument("--inductance", choices=("on", "off"), default="off", help="whether L acts (default off)")
    parser.add_argument(
        "--effect", action="append", default=[], metavar="NAME:key=value,...", help="physics to add, SI; repeatable"
    )
    parser.add_argument(
        "--noise-deg", type=number(least=0), default=0.0, metavar="X", help="sensor noise, standard deviation [deg]"
    )
    parser.add_argument(
        "--rate-hz", type=number(above=0), metavar="N", help="sample rate of a named input (default 1000)"
    )
    parser.add_argument("--duration", type=number(above=0), metavar="S", help="of a named input [s] (default 10)")
    parser.add_argument("--seed", type=whole(0), default=0, metavar="N", help="seed of the noise (default 0)")
    parser.add_argument("--out", required=True, metavar="FILE", help="the CSV file to write")
    parser.add_argument("--force", action="store_true", help="overwrite FILE")
    parser.add_argument("--json", action="store_true", help="print a summary as one JSON object")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Simulate and write; 0."""
    out = table_file(arguments.out, arguments.force)
    from ers_mj.door.simulating import simulate

    found = simulate(
        arguments.model,
        arguments.input,
        effects=arguments.effect,
        noise=math.radians(arguments.noise_deg),
        seed=arguments.seed,
        rate_hz=arguments.rate_hz,
        duration=arguments.duration,
        plant=arguments.plant,
        gap=math.radians(arguments.gap),
        linkage=arguments.linkage,
        play=arguments.play,
        inductance=arguments.inductance == "on",
    )
    for option, x in (("--noise-deg", arguments.noise_deg), ("--gap", arguments.gap)):
        if x and found.output_unit != "rad":
            raise InputError(f"{option} is an angle, the output of this model is in {found.output_unit}")
    kept = keep_file(out, lambda file: found.save(file, arguments.force))
    summary = {"out": kept.told(arguments.out), **found.to_dict()}
    print(as_json(summary) if arguments.json else _told(summary, found.course))
    return kept.code


def _told(summary: dict, course: str) -> str:
    added = [effect["name"] for effect in summary["effects"]]
    added += [f"a play of +-{math.degrees(summary['gap_rad']):.4g} deg"] if summary["gap_rad"] else []
    return (
        f"{summary['out']}: {summary['samples']} samples over {summary['duration_s']:.4g} s, "
        f"{course}, {summary['plant']} plant, {', '.join(added) or 'no effect'}"
    )
