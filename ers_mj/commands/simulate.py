"""`ers simulate`: a recording with known truth."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from ers_mj.commands.options import number, table_file, whole
from ers_mj.commands.output import as_json, make_room
from ers_mj.errors import InputError

if TYPE_CHECKING:
    import numpy as np

    from ers_mj.servo.datasheet import Datasheet

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
    parser.add_argument(
        "model", nargs="?", default="table1", metavar="MODEL", help="datasheet or model.toml (default table1)"
    )
    parser.add_argument("--plant", choices=PLANTS, default="reduced", help="what to simulate (default reduced)")
    parser.add_argument(
        "--input", required=True, metavar="CSV|NAME", help="columns t_s,u_V, or multisine, chirp, ramp, steps, square"
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
    from ers_mj.data.recording import write_recording
    from ers_mj.servo.datasheet import read_datasheet
    from ers_mj.servo.simulation import parse_effect, simulate_recording

    datasheet = read_datasheet(arguments.model)
    if datasheet.loop:
        return _loop(arguments, datasheet, out)
    effects = [parse_effect(text) for text in arguments.effect]
    t, u = _input(arguments)
    columns = simulate_recording(
        datasheet,
        t,
        u,
        effects=effects,
        noise=math.radians(arguments.noise_deg),
        seed=arguments.seed,
        plant=arguments.plant,
        gap=math.radians(arguments.gap),
        linkage=arguments.linkage,
        play=arguments.play,
        inductance=arguments.inductance == "on",
    )
    make_room(out)
    write_recording(out, columns)
    summary = _summary(arguments, columns, [*datasheet.effects, *effects])
    print(as_json(summary) if arguments.json else _told(summary))
    return 0


def _loop(arguments: argparse.Namespace, datasheet: Datasheet, out: Path) -> int:
    """Simulate a servo that is told a position."""
    from ers_mj.data.recording import read_input, write_recording
    from ers_mj.plants.inputs import INPUTS
    from ers_mj.position_loop.saved import simulate_loop

    if arguments.input in INPUTS:
        raise InputError(f"--input {arguments.input} is a voltage; a model with a [loop] takes a CSV t_s,theta_ref_rad")
    for option, value in (("--effect", arguments.effect), ("--gap", arguments.gap)):
        if value:
            raise InputError(f"{option} is for models without a [loop], this one's effects stand in its file")
    t, r = read_input(arguments.input, "theta_ref_rad")
    noise = math.radians(arguments.noise_deg)
    columns = simulate_loop(datasheet, t, r, plant=arguments.plant, noise=noise, seed=arguments.seed)
    make_room(out)
    write_recording(out, columns)
    summary = _summary(arguments, columns, list(datasheet.effects))
    print(as_json(summary) if arguments.json else _told(summary))
    return 0


def _input(arguments: argparse.Namespace) -> tuple[np.ndarray, np.ndarray]:
    """Time and voltage, of a name or of a file."""
    import numpy as np

    from ers_mj.data.recording import read_input
    from ers_mj.plants.inputs import DURATION, INPUTS, RATE_HZ

    if arguments.input not in INPUTS:
        for option, value in (("--rate-hz", arguments.rate_hz), ("--duration", arguments.duration)):
            if value is not None and Path(arguments.input).exists():
                raise InputError(f"{option} is for named inputs ({', '.join(INPUTS)}), the file brings its own times")
        file = Path(arguments.input)
        if not file.exists() and not file.suffix:
            raise InputError(
                f"--input {file}: there is no such file and no input of that name; there are {', '.join(INPUTS)}"
            )
        return read_input(file)
    rate, duration, most = arguments.rate_hz or RATE_HZ, arguments.duration or DURATION, 20_000_000
    if not 2 <= rate * duration <= most:
        raise InputError(
            f"{duration:g} s at {rate:g} Hz are {rate * duration:.3g} samples, 2 to {most:.0e} were expected"
        )
    t = np.arange(round(rate * duration)) / rate
    return t, INPUTS[arguments.input](t)


def _summary(arguments: argparse.Namespace, columns: dict, effects: list) -> dict:
    t, theta = columns["t_s"], columns["theta_rad"]
    return {
        "out": arguments.out,
        "plant": arguments.plant,
        "linkage": arguments.linkage,
        "input": arguments.input,
        "inductance": arguments.inductance == "on",
        "gap_rad": math.radians(arguments.gap),
        "play": arguments.play,
        "samples": int(t.size),
        "duration_s": float(t[-1] - t[0]),
        "noise_rad": math.radians(arguments.noise_deg),
        "seed": arguments.seed,
        "effects": [{"name": name, "parameters": dict(values)} for name, values in effects],
        "theta_rms_rad": float(theta.std()),
        "theta_min_rad": float(theta.min()),
        "theta_max_rad": float(theta.max()),
    }


def _told(summary: dict) -> str:
    added = [effect["name"] for effect in summary["effects"]]
    added += [f"a play of +-{math.degrees(summary['gap_rad']):.4g} deg"] if summary["gap_rad"] else []
    low, high = math.degrees(summary["theta_min_rad"]), math.degrees(summary["theta_max_rad"])
    return (
        f"{summary['out']}: {summary['samples']} samples over {summary['duration_s']:.4g} s, "
        f"{low:.1f} to {high:.1f} deg, {summary['plant']} plant, {', '.join(added) or 'no effect'}"
    )
