"""What `ers trial` and `ers frequency` share: options of the plant and of the laws, and the conditions from them."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING

from ers_mj.commands.options import number, refuse_unknown, small_deg
from ers_mj.errors import InputError

if TYPE_CHECKING:
    from ers_mj.control.trial import Conditions
    from ers_mj.servo.datasheet import Datasheet


def add_plant(parser: argparse.ArgumentParser) -> None:
    """--gap, --linkage, --inductance and --effect: what the plant has beyond its datasheet."""
    parser.add_argument("--gap", type=small_deg, default=0.0, metavar="DEG", help="play of +-DEG (default 0)")
    parser.add_argument(
        "--linkage", choices=("constant", "rod"), default="constant", help="of MuJoCo's rudder (default constant)"
    )
    parser.add_argument("--inductance", choices=("on", "off"), default="off", help="whether L acts (default off)")
    parser.add_argument(
        "--effect",
        action="append",
        default=[],
        metavar="NAME:key=value,...",
        help="physics to add to the plant, SI; repeatable",
    )


def add_laws(parser: argparse.ArgumentParser) -> None:
    """--delay-ms, --filter-ms, --gains and --pid: what stands between the plant and the laws, and their gains."""
    parser.add_argument(
        "--delay-ms", type=number(least=0), default=0.0, metavar="X", help="dead time of the command (default 0)"
    )
    parser.add_argument(
        "--filter-ms",
        type=number(least=0),
        default=0.5,
        metavar="X",
        help="time constant of the speed's filter (default 0.5)",
    )
    parser.add_argument(
        "--gains", default="", metavar="NAME=X,...", help="of the finite-time laws, as `ers gains` takes them"
    )
    parser.add_argument(
        "--pid", default="", metavar="P=X,I=X,D=X", help="of pid and pid-ff, in V/deg (default P=5,I=1.2,D=0.1)"
    )


def refuse_beside_a_loop(arguments: argparse.Namespace, datasheet: Datasheet) -> None:
    """Raise InputError for an option that a servo with a loop of its own has no place for."""
    from ers_mj.control.firmware import NAME

    plain = {"umax": 24.0, "gap": 0.0, "linkage": "constant", "inductance": "off", "effect": [], "design": None}
    laws = {"delay_ms": 0.0, "filter_ms": 0.5, "gains": "", "pid": ""}
    alone = {"noise_deg": 0.0, "quantum_deg": 0.0, "plants": 0}
    given = [name for name, x in (plain | laws | alone).items() if getattr(arguments, name, x) != x]
    given += ["controller"] if set(arguments.controller or ()) - {NAME} else []
    if given:
        option = {"umax": "umax-V"}.get(given[0], given[0]).replace("_", "-")
        raise InputError(
            f"--{option}: {datasheet.name} closes a position loop of its own ([loop]), which is the controller"
            f" ({NAME}) and stands in the file with the plant"
        )


def chosen_controllers(arguments: argparse.Namespace, datasheet: Datasheet) -> list[str]:
    """The names of --controller, all where none is given; of a servo with a loop of its own its firmware.

    Raises:
        InputError: there is no controller of that name, or a Python file that is none.
    """
    from ers_mj.control.firmware import NAME

    if datasheet.loop:
        refuse_beside_a_loop(arguments, datasheet)
        return [NAME]
    from ers_mj.control.controllers import CONTROLLERS
    from ers_mj.control.own_law import is_own, law_of

    chosen = arguments.controller or list(CONTROLLERS)
    refuse_unknown("--controller", [name for name in chosen if not is_own(name)], CONTROLLERS)
    for name in chosen:
        law_of(name)
    return chosen


def plant_and_design(model: str, design: str | None) -> tuple[Datasheet, Datasheet]:
    """The plant's datasheet, its firmware's loop in it where it has one, and what the controllers know of it."""
    from ers_mj.servo.datasheet import read_datasheet, read_plant

    datasheet = read_datasheet(model)
    return datasheet, datasheet if design is None else read_plant(design)


def conditions_of(arguments: argparse.Namespace, **others) -> Conditions:
    """The conditions of the options above, of --amplitude-deg and of --umax-V; `others` are fields of their own, added
    effects among them.
    """
    from ers_mj.control.controllers import parse_gains, parse_pid
    from ers_mj.control.trial import Conditions
    from ers_mj.servo.simulation import delayed, parse_effect

    effects = [parse_effect(text) for text in arguments.effect]
    effects += [delayed(1e-3 * arguments.delay_ms)] if arguments.delay_ms else []
    return Conditions(
        amplitude=math.radians(arguments.amplitude_deg),
        u_max=arguments.umax,
        gap=math.radians(arguments.gap),
        linkage=arguments.linkage,
        inductance=arguments.inductance == "on",
        filter_s=1e-3 * arguments.filter_ms,
        gains=parse_gains(arguments.gains),
        pid=parse_pid(arguments.pid),
        effects=(*effects, *others.pop("effects", ())),
        **others,
    )
