"""`ers export`: a model where it is used."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ers_mj.commands.keeping import folder_for, keep
from ers_mj.commands.options import add_model, add_out, one_of, several
from ers_mj.commands.output import bold, written
from ers_mj.door.saving import as_json

if TYPE_CHECKING:
    from ers_mj.door.exporting import Exported

TARGETS = ("mujoco", "control", "fmu", "mjlab", "newton", "randomisation", "lookup")
RESULTS = (
    *("joint.xml", "model_control.py", "model.fmu", "mjlab_actuator.py", "newton_actuator.py", "randomisation.json"),
    *("lookup.csv", "LOSSES.md"),
)
OUTPUT_UNITS, INPUT_UNITS = ("rad", "m", "V"), ("V", "%", "N m", "A")


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "export",
        help="write a model for the tools where it is used",
        description=(
            "Write a model for other tools: joint.xml (MuJoCo), model_control.py (python-control), model.fmu (FMI 2.0,"
            " C source), mjlab_actuator.py, newton_actuator.py, randomisation.json (ranges and sampled servos) and"
            " lookup.csv (tables for Simulink), with LOSSES.md: what each cannot carry."
        ),
        epilog="example: ers export ers-out/model.toml --to mujoco,fmu --out exported",
    )
    add_model(parser, "datasheet or model.toml (default table1)")
    parser.add_argument(
        "--to",
        type=several(one_of(TARGETS), "target"),
        default=list(TARGETS),
        metavar="NAME,...",
        help=f"{', '.join(TARGETS)} (default all)",
    )
    parser.add_argument("--output-unit", choices=OUTPUT_UNITS, help="of the model (default: as its file tells, or rad)")
    parser.add_argument("--input-unit", choices=INPUT_UNITS, help="of the model (default: as its file tells, or V)")
    add_out(parser)
    parser.add_argument("--json", action="store_true", help="print files and losses as one JSON object")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Write the files; 0."""
    from ers_mj.door.model import load_model

    place = folder_for(arguments.out, arguments.force, RESULTS)

    model = load_model(arguments.model, arguments.output_unit, arguments.input_unit)
    found: dict = {}
    kept = keep(place, lambda folder: _written(model.export(folder, arguments.to, force=True), found))
    if arguments.json:
        print(as_json(found))
        return kept.code
    for name, losses in found.get("losses", {}).items():
        print(bold(name))
        print("\n".join(f"  {sentence}" for sentence in losses) or "  nothing is left out")
    print("\n".join(written(kept)))
    return kept.code


def _written(exported: Exported, found: dict) -> tuple[Path, ...]:
    """The files of an export; what it tells goes into `found`."""
    found.update(exported.to_dict())
    return exported.files
