"""`ers view`: the plant in MuJoCo's viewer, or in a picture."""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ers_mj.commands.keeping import Kept, keep_file
from ers_mj.commands.options import add_model, mapping, number, pair, whole
from ers_mj.commands.output import Progress
from ers_mj.door.saving import as_json, refuse_file, write_file
from ers_mj.errors import InputError

if TYPE_CHECKING:
    from ers_mj.data.recording import Recording
    from ers_mj.view.replay import Replay

LINKAGES = ("constant", "rod")
WIDTHS = {".png": 960, ".gif": 480}  # what can be rendered, and how wide [pixels]
INPUT = "square"  # what a .gif without input or recording shows: out, home, and the other way


@dataclass(frozen=True)
class Film:
    """How a motion is shown: pictures a second, its duration and the longest there is [s], the widest picture there is
    [pixels], and height over width.
    """

    fps: float = 20.0
    duration: float = 4.0
    longest: float = 100.0
    widest: int = 4096
    shape: float = 3 / 4


FILM = Film()


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "view",
        help="show the plant in three dimensions",
        description=(
            "The plant in MuJoCo's viewer, or in a picture. A recording is replayed: what was measured is the"
            " translucent ghost. A model is drawn as what it is: the rudder, an arm under gravity, a slide, a"
            " joint;\none with a position loop follows the shape of --input within +-0.5 rad (+-20 mm)."
        ),
        epilog=(
            "examples:\n  ers view --linkage rod\n  ers view model.toml --replay run1.csv --render replay.gif\n"
            "  ers view plant.xml --input steps --render steps.gif"
        ),
    )
    add_model(parser, "datasheet, model.toml or plant.xml (default table1)")
    parser.add_argument("--linkage", choices=LINKAGES, help="of the rudder (default constant)")
    parser.add_argument("--gap", type=number(least=0), metavar="DEG", help="play of +-DEG (default 0)")
    shown = parser.add_mutually_exclusive_group()
    shown.add_argument("--replay", metavar="REC", help="replay this recording: measured and simulated")
    shown.add_argument(
        "--input", metavar="NAME", help=f"simulate multisine, chirp, ramp, steps or square (a .gif's default: {INPUT})"
    )
    parser.add_argument(
        "--map",
        type=pair,
        action="append",
        default=[],
        metavar="name=column",
        help="of the recording, as in t_s=Time; repeatable",
    )
    parser.add_argument(
        "--duration",
        type=number(above=0),
        default=FILM.duration,
        metavar="S",
        help=f"shown of the motion [s] (default {FILM.duration:g})",
    )
    parser.add_argument(
        "--render",
        metavar="FILE",
        help=(
            "a picture, .png or .gif, instead of the window; a .png shows the rest position, "
            "the end of an input, or where a recording and its simulation differ most"
        ),
    )
    parser.add_argument("--width", type=whole(16), metavar="N", help="of the picture [pixels] (default 960, .gif 480)")
    parser.add_argument("--force", action="store_true", help="overwrite FILE")
    parser.add_argument("--json", action="store_true", help="print a summary as one JSON object")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Show or render; 0."""
    out = _checked_out(arguments)
    _refuse_contradictions(arguments)
    if out is None:
        return _show(arguments)
    replay = _replay(arguments, is_film=out.suffix.lower() == ".gif")
    rendered, kept = _render(replay, out, arguments.width)
    summary = _summary(arguments, replay) | rendered
    print(as_json(summary) if arguments.json else _told(summary))
    return kept.code


def _show(arguments: argparse.Namespace) -> int:
    from ers_mj.view.window import open_window, refuse_no_display

    refuse_no_display()
    replay = _replay(arguments, is_film=True)
    open_window(replay)
    print(as_json(_summary(arguments, replay)) if arguments.json else f"{arguments.model}: shown")
    return 0


# -- what cannot be meant ----------------------------------------------------------------------------------------


def _checked_out(arguments: argparse.Namespace) -> Path | None:
    """The picture's file, checked before any work starts; None for a window."""
    if arguments.render is None:
        return None
    out = Path(arguments.render)
    if not arguments.render or out.is_dir() or out.suffix.lower() not in WIDTHS:
        raise InputError(f"--render {arguments.render or 'is empty'}: a file that ends in .png or .gif was expected")
    refuse_file(out, arguments.force)
    return out


def _refuse_contradictions(arguments: argparse.Namespace) -> None:
    from ers_mj.plants.inputs import INPUTS

    if arguments.input is not None and arguments.input not in INPUTS:
        raise InputError(f"--input {arguments.input}: there is no input of that name; there are {', '.join(INPUTS)}")
    if arguments.map and arguments.replay is None:
        raise InputError("--map is for a recording, give one as --replay REC")
    for option, value in (("--linkage", arguments.linkage), ("--gap", arguments.gap)):
        if value is not None and _is_mjcf(arguments.model):
            raise InputError(f"{option} is for a datasheet or a model.toml, {arguments.model} is built already")
    for option, value, most in (
        ("--duration", arguments.duration, FILM.longest),
        ("--width", arguments.width or 0, FILM.widest),
    ):
        if value > most:
            raise InputError(f"{option} {value:g}: at most {most:g} was expected")


def _is_mjcf(model: str) -> bool:
    return Path(model).suffix.lower() in (".xml", ".mjcf")


# -- what is shown ---------------------------------------------------------------------------------------------------


def _replay(arguments: argparse.Namespace, is_film: bool) -> Replay:
    """The moments to show: a film, or the single one of a still."""
    from ers_mj.data.recording import read_recording

    if arguments.replay is not None:
        replay = _recorded(arguments, read_recording(arguments.replay, mapping(arguments.map)))
    else:
        replay = _simulated(arguments, arguments.input or (INPUT if is_film and arguments.render else None))
    return replay if is_film else replay.still()


def _simulated(arguments: argparse.Namespace, name: str | None) -> Replay:
    """The plant under a named input, at rest without one."""
    import numpy as np

    from ers_mj.plants.inputs import INPUTS, RATE_HZ
    from ers_mj.servo.datasheet import read_datasheet
    from ers_mj.servo.units import output_unit_of
    from ers_mj.view import looped, model_file, replay

    t = np.arange(1 if name is None else max(2, round(arguments.duration * RATE_HZ) + 1)) / RATE_HZ
    u = np.zeros(1) if name is None else INPUTS[name](t)
    moments = replay.moments_of(t, FILM.fps, arguments.duration)
    if _is_mjcf(arguments.model):
        return model_file.simulated_file(model_file.read_plant(Path(arguments.model)), t, u, moments)
    sheet = read_datasheet(arguments.model)
    unit = output_unit_of(sheet.output_unit)
    if sheet.loop:
        looped.refuse_built_on(sheet, arguments.linkage, arguments.gap)
        return looped.commanded(sheet, t, u, moments, unit)
    plant = replay.plant_of(sheet, arguments.linkage or "constant", math.radians(arguments.gap or 0.0), unit)
    return replay.simulated(plant, t, u, moments)


def _recorded(arguments: argparse.Namespace, recording: Recording) -> Replay:
    from ers_mj.data.prepared import trace_of
    from ers_mj.servo.datasheet import read_datasheet
    from ers_mj.view import looped, model_file, replay

    moments, unit = replay.moments_of(recording.t, FILM.fps, arguments.duration), recording.output_unit
    if _is_mjcf(arguments.model):
        return model_file.recorded_file(
            model_file.read_plant(Path(arguments.model)), trace_of(recording, None), moments, unit
        )
    sheet = read_datasheet(arguments.model)
    if sheet.loop:
        looped.refuse_built_on(sheet, arguments.linkage, arguments.gap)
        return looped.replayed(sheet, recording, moments)
    plant = replay.plant_of(sheet, arguments.linkage or "constant", math.radians(arguments.gap or 0.0), unit)
    return replay.recorded(plant, trace_of(recording, sheet.parameters.get("J")), moments, unit)


# -- a picture -----------------------------------------------------------------------------------------------------


def _render(replay: Replay, out: Path, width: int | None) -> tuple[dict, Kept]:
    from ers_mj.view.rendering import gif_bytes, png_bytes, replay_frames

    kind = out.suffix.lower()
    width = width or WIDTHS[kind]
    height, images = round(FILM.shape * width), []
    with Progress() as progress:
        for image in replay_frames(replay, width, height):
            images.append(image)
            progress("rendering", len(images) / replay.t.size)
    content = png_bytes(images[0]) if kind == ".png" else gif_bytes(images, FILM.fps)
    kept = keep_file(out, lambda file: write_file(file, content))
    return {"render": kept.told(str(out)), "width": width, "height": height, "bytes": len(content)}, kept


def _summary(arguments: argparse.Namespace, replay: Replay) -> dict:
    return {
        "model": arguments.model,
        "replay": arguments.replay,
        "frames": int(replay.t.size),
        "fps": FILM.fps,
        "from_s": float(replay.t[0]),
        "to_s": float(replay.t[-1]),
        "output_unit": replay.output_unit,
        "theta": [float(x) for x in (replay.theta[0], replay.theta[-1])],
    }


def _told(summary: dict) -> str:
    frames = (
        "one picture"
        if summary["frames"] == 1
        else f"{summary['frames']} pictures, {summary['to_s'] - summary['from_s']:.3g} s"
    )
    return (
        f"{summary['render']}: {frames}, {summary['width']} x {summary['height']} pixels,"
        f" {summary['bytes'] / 1e3:.0f} kB"
    )
