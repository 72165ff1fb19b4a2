"""`ers trial`: controllers on plants over references."""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ers_mj.commands.keeping import DEFAULT_OUT, Place, keep, results_folder
from ers_mj.commands.loop import add_laws, add_plant, chosen_controllers, conditions_of, plant_and_design
from ers_mj.commands.options import (
    add_cluster,
    add_common,
    add_model,
    add_out,
    angle_deg,
    crew_of,
    number,
    refuse_unknown,
    several,
    small_deg,
    swing_deg,
    whole,
)
from ers_mj.commands.output import Progress, tell
from ers_mj.commands.trial_lines import trial_lines
from ers_mj.door.saving import as_json, plain, report_writers, versions, write_results
from ers_mj.errors import InputError
from ers_mj.processes import stopping
from ers_mj.processes.passing import remove
from ers_mj.workers.finished import Finished
from ers_mj.workers.held import held

if TYPE_CHECKING:
    from ers_mj.control.monte_carlo import Spread
    from ers_mj.control.trial import Conditions, Trial
    from ers_mj.servo.datasheet import Datasheet
    from ers_mj.workers.base import Crew

RESULTS = ("trials.json", "report.html")
KEPT = ".trial"  # in the folder of the results: the scattered servos that are finished


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "trial",
        help="controllers in a closed loop, on either plant",
        description=(
            "Run controllers in a closed loop and measure them. Lists with commas run every combination. Stopped, the"
            " same command goes on\nwith the servos of --plants where it was."
        ),
        epilog=(
            "examples:\n  ers trial\n  ers trial --controller ftrc,pid-ff,time-optimal --plant reduced,mujoco --case"
            " square,ramp,chirp --rate-hz 1000 --noise-deg 0.01\n  ers trial model.toml --design datasheet.toml --case"
            " my_reference.csv --umax-V 12 --delay-ms 1 --out mine\n  ers trial --plants 50 --scatter 1.25 --case"
            " step,chirp --rate-hz 1000\n  ers trial --plant mujoco --gap 0.5 --inductance on --effect"
            " stribeck:dF_s=0.1,v_s=0.2 --json"
        ),
    )
    _add_what(parser)
    _add_how(parser)
    add_plant(parser)
    _add_sensor(parser)
    add_laws(parser)
    _add_scatter(parser)
    add_cluster(parser)
    parser.add_argument(
        "--save-traces", action="store_true", help="write every trial as a CSV too, in a recording's columns"
    )
    add_out(parser)
    add_common(parser)
    parser.set_defaults(run=run)


def _add_what(parser: argparse.ArgumentParser) -> None:
    """Which laws, on which plants, over which references."""
    add_model(parser, "the plant: datasheet or model.toml with its effects (default table1)")
    parser.add_argument(
        "--design", metavar="MODEL", help="what the controllers know of the plant (default the MODEL itself)"
    )
    parser.add_argument(
        "--controller",
        type=several(str, "controller"),
        metavar="NAME|FILE.py,...",
        help=(
            "ftrc, ftrc-literal, pid, pid-ff, hinf, time-optimal, or a Python file with a class derived from"
            " ers_mj.control.controllers.Controller (default all of ours); a model with a [loop] runs its own firmware"
        ),
    )
    parser.add_argument(
        "--plant", type=several(str, "plant"), default=["reduced"], metavar="reduced,mujoco", help="default reduced"
    )
    parser.add_argument(
        "--case",
        type=several(str, "case"),
        default=["step"],
        metavar="NAME|CSV,...",
        help="step, square, ramp, chirp, or a file with t_s and theta_ref_rad or theta_ref_deg (default step)",
    )


def _add_how(parser: argparse.ArgumentParser) -> None:
    """How far, from where, how fast, with what voltage."""
    parser.add_argument("--amplitude-deg", type=swing_deg, default=10.0, metavar="X", help="of the cases (default 10)")
    parser.add_argument(
        "--start-deg",
        type=angle_deg,
        default=15.0,
        metavar="X",
        help="where the rudder rests at first (default 15)",
    )
    parser.add_argument(
        "--rate-hz",
        type=number(above=0),
        metavar="N",
        help="sample rate of the loop (default 10000); a file brings its own",
    )
    parser.add_argument(
        "--umax-V", dest="umax", type=number(above=0), default=24.0, metavar="X", help="largest voltage (default 24)"
    )


def _add_sensor(parser: argparse.ArgumentParser) -> None:
    """What the angle is read with."""
    parser.add_argument(
        "--noise-deg",
        type=small_deg,
        default=0.0,
        metavar="X",
        help="sensor noise, standard deviation (default 0)",
    )
    parser.add_argument(
        "--quantum-deg",
        type=small_deg,
        default=0.0,
        metavar="X",
        help="one count of the sensor (default 0)",
    )


def _add_scatter(parser: argparse.ArgumentParser) -> None:
    """More servos than one."""
    parser.add_argument(
        "--plants",
        type=whole(1),
        default=0,
        metavar="N",
        help="try N more servos too, their parameters and effects scattered, unknown to the controllers (default 0)",
    )
    parser.add_argument(
        "--scatter",
        type=number(least=1),
        default=1.2,
        metavar="X",
        help="largest factor, up or down, of that (default 1.2)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Run every combination, write, tell; 0, or 130 where it was stopped."""
    place = _place(arguments)
    try:
        with _carried_on(arguments, place) as finished:
            return _run(arguments, place, finished)
    except KeyboardInterrupt:
        kept = place is not None and (place.folder / KEPT).is_dir() and place.folder
        stopping.tell(f"; {kept} keeps what was done, the same command goes on from there" if kept else "")
        return stopping.STOPPED


def _place(arguments: argparse.Namespace) -> Place | None:
    """Where the results go; a folder that a trial of many servos was begun in may hold files."""
    begun = arguments.plants > 0 and (Path(arguments.out or DEFAULT_OUT) / KEPT).is_dir()
    return results_folder(arguments.out, arguments.force or begun, arguments.json, RESULTS)


@contextmanager
def _carried_on(arguments: argparse.Namespace, place: Place | None) -> Iterator[Finished | None]:
    """The scattered servos that are finished, kept in the folder of the results until these are written; None where
    there are no such servos, or no folder.
    """
    if place is None or not arguments.plants:
        yield None
        return
    new = not place.folder.exists()
    finished = Finished(place.folder / KEPT)
    try:
        with held(place.folder, "ers trial"):
            if finished.folder.is_dir():
                tell(f"{place.folder}: goes on where it was left")
            yield finished
    finally:
        with suppress(OSError):
            if new:
                place.folder.rmdir()  # which it is not where anything is in it


def _run(arguments: argparse.Namespace, place: Place | None, finished: Finished | None) -> int:
    from ers_mj.control.firmware import refuse_other_than_angle
    from ers_mj.control.paper_claims import headline, is_papers
    from ers_mj.control.trial import gains_of, sentence_of, try_out

    _refuse_cases(arguments)
    datasheet, design = plant_and_design(arguments.model, arguments.design)
    controllers = chosen_controllers(arguments, datasheet)
    refuse_other_than_angle(datasheet)
    conditions = _conditions(arguments)
    with closing(_crew(arguments)) as hired, Progress() as progress:
        trials = try_out(
            datasheet, controllers, arguments.plant, arguments.case, conditions, design=design, progress=progress
        )
        spreads = _spreads(arguments, datasheet, controllers, conditions, design, hired, finished, progress)
        document = plain(
            {
                "trials": [t.as_document() for t in trials],
                "sentence": headline(trials),
                "notes": _notes(trials, design, conditions),
                "robustness": [x.as_document() for x in spreads],
                "scatter": arguments.scatter,
                "conditions": conditions.as_document(),
                "controllers": {name: sentence_of(name, datasheet) for name in controllers},
                "gains": {name: gains_of(name, design, conditions) for name in controllers},
                "papers_settings": is_papers(datasheet, design, conditions),
                "datasheet": datasheet.name or arguments.model,
                "design": design.name or arguments.design,
                "versions": versions(),
            }
        )
        traces = trials if arguments.save_traces else []
        kept = keep(place, lambda folder: _write(folder, document, trials, spreads, progress, traces))
    if finished is not None and not kept.code:
        remove(finished.folder)
    print(as_json(document) if arguments.json else "\n".join(trial_lines(document, kept)))
    return kept.code


def _crew(arguments: argparse.Namespace) -> Crew:
    """Whoever tries the scattered servos.

    Raises:
        InputError: a cluster is asked for and there is nothing to share out, or it cannot be used.
    """
    from ers_mj.control.own_law import is_own

    if arguments.cluster is not None and not arguments.plants:
        raise InputError("--cluster shares out the servos of --plants, none are asked for; give --plants N with it")
    own = next((name for name in arguments.controller or () if is_own(name)), None)
    if arguments.cluster is not None and own is not None:
        raise InputError(f"--cluster: workers have no {own}, a law of one's own runs on this machine alone")
    return crew_of(arguments)


def _spreads(
    arguments: argparse.Namespace,
    datasheet: Datasheet,
    controllers: list[str],
    conditions: Conditions,
    design: Datasheet,
    hired: Crew,
    finished: Finished | None,
    progress: Progress,
) -> list[Spread]:
    """The same on scattered servos, none where none are asked for."""
    from ers_mj.control.monte_carlo import Fleet, scatter

    if not arguments.plants:
        return []
    fleet = Fleet(datasheet, arguments.plants, arguments.scatter, design)
    asked = controllers, arguments.plant, arguments.case
    return scatter(fleet, *asked, conditions, crew=hired, finished=finished, progress=progress)


def _refuse_cases(arguments: argparse.Namespace) -> None:
    """Raise InputError for a plant or a case that does not exist, or a rate that no case takes."""
    from ers_mj.control.references import CASES
    from ers_mj.control.trial import PLANTS

    refuse_unknown("--plant", arguments.plant, PLANTS)
    files = [case for case in arguments.case if case not in CASES]
    for case in files:
        if not Path(case).exists() and not Path(case).suffix:
            raise InputError(
                f"--case: there is no {case[:40]!r}; there are {', '.join(CASES)}, or a file, as in --case"
                " reference.csv"
            )
    if files and len(files) == len(arguments.case) and arguments.rate_hz is not None:
        raise InputError(f"--rate-hz is for {', '.join(CASES)}, the file brings its own times")


def _conditions(arguments: argparse.Namespace) -> Conditions:
    from ers_mj.servo.simulation import counting

    quantum = math.radians(arguments.quantum_deg)
    return conditions_of(
        arguments,
        start=math.radians(arguments.start_deg),
        rate_hz=arguments.rate_hz or 10_000.0,
        noise=math.radians(arguments.noise_deg),
        seed=arguments.seed,
        effects=[counting(quantum)] if quantum else [],
    )


def _notes(trials: list[Trial], design: Datasheet, conditions: Conditions) -> list[str]:
    """What a reader should know of the references."""
    from ers_mj.control.controllers import Servo
    from ers_mj.control.trial import needed

    if design.loop:
        return [
            "What the servo is told is a position: its drive is known as an acceleration, no voltage and no energy."
        ]
    known, notes = Servo.of(design), []
    if design.input_unit not in ("", "V"):
        unit = {"pct": "%"}.get(design.input_unit, design.input_unit)
        notes.append(f"This model is told {unit}: what is called V here is in {unit}, --umax-V too.")
    for aim in {t.case: t.run.reference for t in trials}.values():
        volts = needed(aim, known)
        if volts > conditions.u_max:
            notes.append(
                f"The {aim.name} asks for up to {volts:.3g} V, {conditions.u_max:g} V are there: no law can follow it"
                " throughout."
            )
    return notes


def _write(
    folder: Path, document: dict, trials: list[Trial], spreads: list[Spread], progress: Progress, traces: list[Trial]
) -> list[Path]:
    from ers_mj.report.trial_report import trial_page

    progress("drawing the report", 1.0)
    page = trial_page(document, trials, spreads)
    beside = {_trace_name(t): partial(_write_trace, t) for t in traces}
    return write_results(folder, report_writers("trials.json", document, page) | beside)


def _trace_name(trial: Trial) -> str:
    return re.sub(r"[^\w.-]+", "-", f"trace-{trial.case}-{trial.plant}-{trial.controller}") + ".csv"


def _write_trace(trial: Trial, file: Path) -> None:
    """What a recording of this trial would be, up to where it was given up."""
    import numpy as np

    from ers_mj.data.recording import write_recording

    run, ran = trial.run, np.isfinite(trial.run.measured)
    columns = {"t_s": run.reference.t, "theta_ref_rad": run.reference.theta}
    columns |= ({"u_V": run.u} if run.has_volts else {}) | {"theta_rad": run.measured}
    write_recording(file, {name: x[ran] for name, x in columns.items()})
