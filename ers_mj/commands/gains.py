"""`ers gains`: the finite-time law's gains, checked, bounded, searched."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING, cast

from ers_mj.commands.options import add_model, angle_deg, number, swing_deg, whole
from ers_mj.commands.output import Progress, bold
from ers_mj.door.saving import as_json

if TYPE_CHECKING:
    from ers_mj.control.controllers import Gains
    from ers_mj.servo.datasheet import Datasheet


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "gains",
        help="gains of the finite-time law: conditions, bound, search",
        description=(
            "Check the finite-time law's gains against the conditions (33)-(35) of its proof, or search some for a"
            " wished settling time.\nExit code 1 where the conditions fail."
        ),
        epilog=(
            "examples:\n  ers gains\n  ers gains --gains q=96/97\n  ers gains --gains k_2=60,k_3=630,gamma_3=30\n  ers"
            " gains model.toml --settling-ms 60"
        ),
    )
    add_model(parser, "datasheet or model.toml (default table1)")
    parser.add_argument(
        "--gains",
        default="",
        metavar="NAME=X,...",
        help="q k_1 k_2 k_3 l gamma_1..gamma_7 (default Eq. (40) with q=97/99)",
    )
    parser.add_argument(
        "--settling-ms",
        type=number(above=0),
        metavar="T",
        help="search k_2, k_3, l and gamma that settle within T, others kept",
    )
    parser.add_argument(
        "--amplitude-deg",
        type=swing_deg,
        default=10.0,
        metavar="X",
        help="step that settling and bound belong to (default 10)",
    )
    parser.add_argument(
        "--start-deg",
        type=angle_deg,
        default=15.0,
        metavar="X",
        help="where it starts (default 15)",
    )
    parser.add_argument(
        "--rate-hz", type=number(above=0), default=10_000.0, metavar="N", help="sample rate (default 10000)"
    )
    parser.add_argument(
        "--umax-V", dest="umax", type=number(above=0), default=24.0, metavar="X", help="largest voltage (default 24)"
    )
    parser.add_argument("--seed", type=whole(0), default=0, metavar="N", help="seed of the search's starts (default 0)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Check or search, and tell; 0, or 1 where the conditions fail."""
    from ers_mj.control.controllers import parse_gains
    from ers_mj.control.gains import REMARK, conditions, search, settling_bound
    from ers_mj.servo.datasheet import read_plant

    datasheet, gains = read_plant(arguments.model), parse_gains(arguments.gains)
    settle = _settle(datasheet, arguments)
    if arguments.settling_ms is None:
        settling = settle(gains)
    else:
        with Progress() as progress:
            progress("searching gains", 0.3)
            found = search(1e-3 * arguments.settling_ms, settle, gains, arguments.seed)
        gains, settling = found.gains, found.settling
    m, bound = conditions(gains), settling_bound(gains, math.radians(arguments.amplitude_deg))
    document = {
        "gains": gains.as_document(),
        "m": list(m),
        "feasible": min(m) > 0,
        "settling_time_s": settling,
        "bound_s": bound,
        "remark": REMARK,
        "wished_s": None if arguments.settling_ms is None else 1e-3 * arguments.settling_ms,
    }
    print(as_json(document) if arguments.json else "\n".join(_told(document, arguments)))
    return 0 if document["feasible"] else 1


def _settle(datasheet: Datasheet, arguments: argparse.Namespace):
    """gains -> settling time [s] of a step on the reduced model."""
    from ers_mj.control.controllers import Servo
    from ers_mj.control.metrics import settling_time
    from ers_mj.control.references import named
    from ers_mj.control.trial import Conditions, run_once
    from ers_mj.plants.reduced import ReducedModel
    from ers_mj.servo.simulation import build_plant

    amplitude, start = math.radians(arguments.amplitude_deg), math.radians(arguments.start_deg)
    known, plant = Servo.of(datasheet), cast(ReducedModel, build_plant(datasheet))
    aim = named("step", amplitude, start, arguments.rate_hz)

    def settle(gains: Gains) -> float | None:
        ran = run_once(
            plant, "ftrc", known, aim, Conditions(amplitude, start, arguments.rate_hz, arguments.umax, gains=gains)
        )
        return None if ran.lost else settling_time(ran)

    return settle


def _told(document: dict, arguments: argparse.Namespace) -> list[str]:
    gains = document["gains"]
    gamma = ", ".join(f"{gains[f'gamma_{k}']:.4g}" for k in range(1, 8))
    settles = (
        "it does not settle"
        if document["settling_time_s"] is None
        else f"settles in {1e3 * document['settling_time_s']:.1f} ms"
    )
    lines = [
        "",
        bold(
            "the conditions (33)-(35) hold"
            if document["feasible"]
            else "the conditions (33)-(35) do not hold: the proof says nothing of these gains"
        ),
        "",
        (
            f"  q = {gains['q']}, k_1 = {gains['k_1']:.4g}, k_2 = {gains['k_2']:.4g}, k_3 = {gains['k_3']:.4g}, l ="
            f" {gains['l']:.4g}"
        ),
        f"  gamma = {gamma}",
        *(f"  m_{k} = {x:.6g}{'' if x > 0 else '   not above zero'}" for k, x in enumerate(document["m"], start=1)),
        f"  a step of {arguments.amplitude_deg:g}° on the reduced model: {settles} (2 %)",
    ]
    if document["bound_s"] is not None:
        lines.append(f"  bound of (37): {document['bound_s']:.3g} s, {document['remark']}")
    return lines
