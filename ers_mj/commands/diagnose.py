"""`ers diagnose`: locate, name, model and show what a simulation of the recordings leaves out."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ers_mj.commands.keeping import Kept, Place, keep, results_folder
from ers_mj.commands.options import add_common, add_out, add_reading, add_recordings
from ers_mj.commands.output import Progress, bold, written
from ers_mj.commands.recordings import reader
from ers_mj.door.saving import as_json

if TYPE_CHECKING:
    from ers_mj.door.known import Known
    from ers_mj.door.reading import Given
    from ers_mj.report.display import Unit

RESULTS = ("diagnosis.json", "report.html", "model.toml", "plant.xml", "next_recording.csv")
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
        "--datasheet",
        "--model",
        metavar="TOML",
        help="what is known of the servo; table1 is the paper's (default: nothing)",
    )
    parser.add_argument(
        "--holdout", nargs="+", action="extend", default=[], metavar="REC", help="recordings to judge on; repeatable"
    )
    add_reading(parser)
    parser.add_argument(
        "--second", metavar="COLUMN", help="explain this column as well, as in u_V beside theta_ref_rad"
    )
    add_quick(parser)
    add_out(parser)
    add_common(parser)
    parser.set_defaults(run=run)


def add_quick(parser: argparse.ArgumentParser) -> None:
    """--quick."""
    parser.add_argument(
        "--quick", action="store_true", help="a first look in a third of the time; it says what it leaves out"
    )


def run(arguments: argparse.Namespace) -> int:
    """Read, diagnose, write, tell; 0 whatever the verdict."""
    place = results_folder(arguments.out, arguments.force, arguments.json, RESULTS)
    take = reader(arguments)
    recordings = [take(spec) for spec in arguments.recordings]
    holdout = [take(spec) for spec in arguments.holdout]
    return diagnose_and_tell(recordings, holdout, arguments.datasheet, place, arguments)


def diagnose_and_tell(
    recordings: Sequence[Given],
    holdout: Sequence[Given],
    datasheet: Known,
    place: Place | None,
    arguments: argparse.Namespace,
) -> int:
    """The part that `diagnose` and `demo` share: from recordings to files and words."""
    from ers_mj.door.diagnosing import diagnose

    with Progress() as progress:
        found = diagnose(
            recordings,
            datasheet,
            holdout,
            seed=arguments.seed,
            jobs=arguments.jobs,
            progress=progress,
            quick=arguments.quick,
        )
        found.made_by = getattr(arguments, "told", "")
        kept = keep(place, lambda folder: found.save(folder, force=True, progress=progress))
    document = found.to_dict()
    print(as_json(document) if arguments.json else "\n".join(_told(document, kept)))
    return kept.code


# -- the diagnosis in lines ---------------------------------------------------------------------------------------


def _told(document: dict, kept: Kept) -> list[str]:
    """What a terminal shows when all is done."""
    verdict = document.get("verdict") or "no verdict"
    lines = ["", f"{bold(verdict.upper())} ({verdict})", str(document.get("sentence") or ""), ""]
    lines += _told_fit(document)
    lines += _told_effects(document)
    lines += _told_parameters(document) if verdict == "parameters_only" else []
    where = [entry.get("sentence") for entry in document.get("where") or [] if entry.get("sentence")]
    lines += _section("where", where[:3])
    state = [entry.get("sentence") for entry in document.get("record_state") or [] if entry.get("sentence")]
    lines += _section("differs between recordings", state)
    lines += _section(
        "problems in the data", [str(problem) for problem in (document.get("data") or {}).get("problems") or []][:6]
    )
    return lines + _told_rest(document) + written(kept)[1:]


def _told_rest(document: dict) -> list[str]:
    """What was left out, and what to record next."""
    lines = _section("left out", [str(part["sentence"]) for part in document.get("left_out") or []])
    following = (document.get("next_recording") or {}).get("sentence")
    return lines + _section("record next", [following] if following else [])


def _section(title: str, sentences: list[str]) -> list[str]:
    return [bold(title), *(f"  {sentence}" for sentence in sentences), ""] if sentences else []


def _told_fit(document: dict) -> list[str]:
    """The three fit numbers, before and after, as a table."""
    from ers_mj.report.display import measured, shown

    fit, unit = document.get("fit") or {}, (document.get("data") or {}).get("output_unit")
    unit = shown(unit, fit.get("heldout_rmse_before_rad"))
    lines = [bold(f"{measured(fit)[0] + ' error [' + unit.label + ']':24}{'before':>12}{'after':>12}")]
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


def _told_parameters(document: dict) -> list[str]:
    """The servo's own parameters that can be told, where they are the answer."""
    from ers_mj.report.display import shown

    lines, seen = [], set()
    for name, entry in (document.get("parameters") or {}).items():
        value = entry.get("value")
        if value is None or value in seen:
            continue
        seen.add(value)
        unit = shown(entry.get("unit"), value)
        sheet = "" if entry.get("datasheet") is None else f"   datasheet {unit.bare(entry['datasheet'])}"
        lines.append(f"  {name:12}{unit(value):>16}{_told_interval(entry, unit)}{sheet}")
    return [bold("parameters"), *lines, ""] if lines else []


def _told_interval(entry: dict, unit: Unit) -> str:
    from ers_mj.report.display import NONE, interval

    told = interval(entry.get("ci95"), unit)
    return "" if told == NONE else f"   (95 %: {told})"
