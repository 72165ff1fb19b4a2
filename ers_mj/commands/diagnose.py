"""`ers diagnose`: locate, name, model and show what a simulation of the recordings leaves out."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ers_mj.commands.options import add_common, add_input, add_map, add_out, add_recordings, mapping, results_folder
from ers_mj.commands.output import Progress, as_json, bold, plain, report_writers, write_results, write_text
from ers_mj.commands.recordings import refuse_mixed_inputs, refuse_twice

if TYPE_CHECKING:
    from ers_mj.data.recording import Recording
    from ers_mj.diagnosis.pipeline import Diagnosis
    from ers_mj.report.display import Unit
    from ers_mj.servo.datasheet import Datasheet

FITS = (("training", "train"), ("held out", "heldout"), ("recalibrated", "recalibrated"))


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "diagnose",
        help="find, name and model the missing physics",
        description="Diagnose a servo from recordings: what did its simulation leave out?",
        epilog="examples:\n  ers diagnose run1.csv run2.csv --datasheet servo.toml --holdout run3.csv\n"
        "  ers diagnose runs.parquet#run=17 --map t_s=Time --map theta_deg=Angle --json",
    )
    add_recordings(parser)
    parser.add_argument(
        "--datasheet", metavar="TOML", help="what is known of the servo; table1 is the paper's (default: nothing)"
    )
    parser.add_argument(
        "--holdout", nargs="+", action="extend", default=[], metavar="REC", help="recordings to judge on; repeatable"
    )
    add_map(parser)
    add_input(parser)
    parser.add_argument(
        "--second", metavar="COLUMN", help="explain this column as well, as in u_V beside theta_ref_rad"
    )
    add_out(parser)
    add_common(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Read, diagnose, write, tell; 0 whatever the verdict."""
    folder = results_folder(arguments.out, arguments.force, arguments.json)
    names = mapping(arguments.map)
    from ers_mj.data.recording import read_recording
    from ers_mj.servo.datasheet import read_datasheet

    datasheet = read_datasheet(arguments.datasheet) if arguments.datasheet is not None else None
    read = partial(read_recording, mapping=names, input_column=arguments.input, second=arguments.second)
    recordings = [read(spec) for spec in arguments.recordings]
    holdout = [read(spec) for spec in arguments.holdout]
    return diagnose_and_tell(recordings, holdout, datasheet, folder, arguments)


def diagnose_and_tell(
    recordings: list[Recording],
    holdout: list[Recording],
    datasheet: Datasheet | None,
    folder: Path | None,
    arguments: argparse.Namespace,
) -> int:
    """The part that `diagnose` and `demo` share: from recordings to files and words."""
    refuse_twice(recordings, holdout)
    refuse_mixed_inputs([*recordings, *holdout])
    from ers_mj.diagnosis import pipeline as diagnosis

    with Progress() as progress:
        found = diagnosis.diagnose(
            recordings, datasheet, holdout, seed=arguments.seed, jobs=arguments.jobs, progress=progress
        )
        document = plain(found.document)
        files = _write(folder, document, found, progress) if folder is not None else []
    print(as_json(document) if arguments.json else "\n".join(_told(document, files)))
    return 0


def _write(folder: Path, document: dict, found: Diagnosis, progress: Progress) -> list[Path]:
    from ers_mj.report.diagnosis_report import report_page
    from ers_mj.servo.datasheet import write_model
    from ers_mj.view.frames import frames_of

    progress("drawing the report", 1.0)
    page = report_page(document, found.evidence, frames_of(found.plant, found.evidence))
    following = (document.get("next_recording") or {}).get("excitation")
    return write_results(
        folder,
        report_writers("diagnosis.json", document, page)
        | {
            "model.toml": lambda path: write_model(path, found.model),
            "plant.xml": lambda path: write_text(path, found.plant.xml()),
        }
        | ({"next_recording.csv": lambda path: write_text(path, input_table(following))} if following else {}),
    )


def input_table(excitation: dict) -> str:
    """The input to record next, as `ers simulate --input` takes it."""
    from ers_mj.data.columns import input_name
    from ers_mj.data.excitation import signal

    column = input_name(excitation["input_unit"])
    return "\n".join([f"t_s,{column}", *(f"{t:.9g},{u:.6g}" for t, u in zip(*signal(excitation), strict=True))]) + "\n"


# -- the diagnosis in lines ---------------------------------------------------------------------------------------


def _told(document: dict, files: list[Path]) -> list[str]:
    """What a terminal shows when all is done."""
    verdict = document.get("verdict") or "no verdict"
    lines = ["", f"{bold(verdict.upper())} ({verdict})", str(document.get("sentence") or ""), ""]
    lines += _told_fit(document)
    lines += _told_effects(document)
    where = [entry.get("sentence") for entry in document.get("where") or [] if entry.get("sentence")]
    lines += _section("where", where[:3])
    state = [entry.get("sentence") for entry in document.get("record_state") or [] if entry.get("sentence")]
    lines += _section("differs between recordings", state)
    lines += _section(
        "problems in the data", [str(problem) for problem in (document.get("data") or {}).get("problems") or []][:6]
    )
    following = (document.get("next_recording") or {}).get("sentence")
    lines += _section("record next", [following] if following else [])
    return lines + _section("written", [str(path) for path in files])


def _section(title: str, sentences: list[str]) -> list[str]:
    return [bold(title), *(f"  {sentence}" for sentence in sentences), ""] if sentences else []


def _told_fit(document: dict) -> list[str]:
    """The three fit numbers, before and after, as a table."""
    from ers_mj.report.display import shown

    fit, unit = document.get("fit") or {}, (document.get("data") or {}).get("output_unit")
    unit = shown(unit, fit.get("heldout_rmse_before_rad"))
    lines = [bold(f"{'free-run error [' + unit.label + ']':24}{'before':>12}{'after':>12}")]
    for title, key in FITS:
        before, after = (unit.bare(fit.get(f"{key}_rmse_{when}_rad")) for when in ("before", "after"))
        lines.append(f"  {title:22}{before:>12}{after:>12}")
    return [*lines, f"  {'noise floor':22}{unit.bare(fit.get('noise_floor_rad')):>12}", ""]


def _told_effects(document: dict) -> list[str]:
    from ers_mj.report.display import shown

    lines = []
    for effect in document.get("missing") or []:
        lines.append(f"  {bold(str(effect.get('effect')))} ({effect.get('subsystem')}): {effect.get('sentence')}")
        for name, entry in (effect.get("parameters") or {}).items():
            unit = shown(entry.get("unit"), entry.get("value"))
            lines.append(f"    {name:10}{unit(entry.get('value')):>16}{_told_interval(entry, unit)}")
        if others := [str(other.get("effect")) for other in effect.get("alternatives") or []]:
            lines.append(f"    not excluded: {', '.join(others)}")
    return [bold("missing physics"), *lines, ""] if lines else []


def _told_interval(entry: dict, unit: Unit) -> str:
    from ers_mj.report.display import NONE, interval

    told = interval(entry.get("ci95"), unit)
    return "" if told == NONE else f"   (95 %: {told})"
