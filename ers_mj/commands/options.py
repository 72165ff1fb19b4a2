"""Options that several commands share, and the checks on them."""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Iterable
from typing import TYPE_CHECKING

from ers_mj.commands.keeping import DEFAULT_OUT
from ers_mj.errors import InputError

if TYPE_CHECKING:
    from ers_mj.workers.base import Crew


def number(least: float | None = None, above: float | None = None, most: float | None = None):
    """A type for argparse: a finite number, not below `least`, above `above`, not beyond `most`."""

    def parse(text: str) -> float:
        try:
            x = float(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
        if not math.isfinite(x):
            raise argparse.ArgumentTypeError(f"{text} is not a finite number")
        if least is not None and x < least:
            raise argparse.ArgumentTypeError(f"{text} is below {least:g}")
        if above is not None and x <= above:
            raise argparse.ArgumentTypeError(f"{text} is not above {above:g}")
        if most is not None and x > most:
            raise argparse.ArgumentTypeError(f"{text} is beyond {most:g}")
        return x

    return parse


swing_deg = number(above=0.0, most=360.0)  # of a rudder's step or sine
angle_deg = number(least=-360.0, most=360.0)  # where a rudder stands
small_deg = number(least=0.0, most=90.0)  # of a play, a noise or a count of the sensor


def whole(least: int):
    """A type for argparse: a whole number of at least `least`."""

    def parse(text: str) -> int:
        try:
            x = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
        if not least <= x < 2**63:
            raise argparse.ArgumentTypeError(f"{text} is not between {least} and 2^63")
        return x

    return parse


def several(parse, noun: str):
    """A type for argparse: values with commas between them, each once, as `parse` reads them."""

    def parse_all(text: str) -> list:
        values = [parse(part.strip()) for part in text.split(",")]
        if len(set(values)) < len(values):
            raise argparse.ArgumentTypeError(f"{text!r} gives a {noun} twice")
        return values

    return parse_all


def one_of(choices: tuple[str, ...]):
    """A type for argparse: one of these words."""

    def parse(text: str) -> str:
        if text not in choices:
            raise argparse.ArgumentTypeError(f"there is no {text[:40]!r}; there are {', '.join(choices)}")
        return text

    return parse


def pair(text: str) -> tuple[str, str]:
    """A type for argparse: name=column."""
    name, mark, column = text.partition("=")
    if not mark or not name or not column:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form name=column, as in t_s=Time")
    return name, column


def add_model(parser: argparse.ArgumentParser, told: str) -> None:
    """MODEL, or --model as every command has it."""
    parser.add_argument("model", nargs="?", default=argparse.SUPPRESS, metavar="MODEL", help=told)
    parser.add_argument("--model", dest="model", default="table1", metavar="MODEL", help="the same, by name")


def add_recordings(parser: argparse.ArgumentParser) -> None:
    """REC, at least one."""
    parser.add_argument(
        "recordings", nargs="+", metavar="REC", help="CSV or Parquet, FILE.parquet#run=17 for one run of several"
    )


def add_map(parser: argparse.ArgumentParser) -> None:
    """--map."""
    parser.add_argument(
        "--map",
        type=pair,
        action="append",
        default=[],
        metavar="name=column",
        help="take a column as this name, also with its unit, a factor or arithmetic, as in t_s=Time,"
        ' "t_s=Time [ms]", theta_rad=enc:counts/4096, "u_V=pwm*24/255", "theta_rad=state[3]"; repeatable',
    )
    parser.add_argument(
        "--map-file", metavar="TOML", help="keeps what --map says in a table [map], and input, second, episode"
    )


def add_reading(parser: argparse.ArgumentParser) -> None:
    """--map, --map-file, --input and --episode: how recordings are read."""
    add_map(parser)
    parser.add_argument("--input", metavar="COLUMN", help="what the servo is told, where several columns could be")
    parser.add_argument("--episode", metavar="N", help="one run of a file that holds several, as FILE#run=N does")
    parser.add_argument("--dbc", metavar="FILE", help="what the messages of a CAN log mean")


def add_out(parser: argparse.ArgumentParser) -> None:
    """--out DIR and --force."""
    parser.add_argument("--out", metavar="DIR", help=f"folder for the results (default {DEFAULT_OUT}/)")
    parser.add_argument("--force", action="store_true", help="write into a named folder that holds files already")


def add_common(parser: argparse.ArgumentParser) -> None:
    """--seed, --jobs and --json."""
    parser.add_argument(
        "--seed", type=whole(0), default=0, metavar="N", help="seed of everything drawn by chance (default 0)"
    )
    add_jobs_and_json(parser)


def add_jobs_and_json(parser: argparse.ArgumentParser) -> None:
    """--jobs and --json."""
    parser.add_argument(
        "--jobs", type=whole(1), default=os.cpu_count() or 1, metavar="N", help="cores to use (default all)"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object; without --out write no file")


def add_cluster(parser: argparse.ArgumentParser) -> None:
    """--cluster."""
    parser.add_argument(
        "--cluster", metavar="ADDRESS", help="work on the Dask cluster of this scheduler, as in tcp://127.0.0.1:8786"
    )


def crew_of(arguments: argparse.Namespace) -> Crew:
    """The workers that --jobs and --cluster ask for.

    Raises:
        InputError: the cluster cannot be used.
    """
    from ers_mj.workers.hiring import crew

    return crew(arguments.jobs, arguments.cluster)


def mapping(pairs: list[tuple[str, str]]) -> dict[str, str]:
    """--map as a dictionary.

    Raises:
        InputError: a name is mapped twice.
    """
    chosen = dict(pairs)
    if len(chosen) < len(pairs):
        twice = next(name for name, _ in pairs if [n for n, _ in pairs].count(name) > 1)
        raise InputError(f"--map gives {twice} twice, one column was expected")
    return chosen


def refuse_unknown(option: str, names: Iterable[str], known: Iterable[str]) -> None:
    """Raise InputError for a name that does not exist."""
    for name in names:
        if name not in known:
            raise InputError(f"{option}: there is no {name[:40]!r}; there are {', '.join(known)}")
