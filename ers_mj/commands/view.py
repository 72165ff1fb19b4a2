"""`ers view`: the plant in MuJoCo's viewer, or in a picture."""

from __future__ import annotations

import argparse
import math
import os
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from ers_mj.commands.options import mapping, number, pair, refuse_unwritable, whole
from ers_mj.commands.output import Progress, as_json
from ers_mj.errors import InputError

if TYPE_CHECKING:
    import numpy as np

    from ers_mj.recording import Recording
    from ers_mj.replay import Replay

LINKAGES = ("constant", "rod")
KINDS = {".png": (960, 720), ".gif": (480, 360)}  # what can be rendered, and its width and height [pixels]
FPS, DURATION = 20.0, 4.0  # [1/s], [s] of a replay
MOST_FRAMES, MOST_PIXELS = 2000, 4096
INSTEAD = "give --render FILE.png or FILE.gif for a picture"
INPUT = "square"  # what a .gif without input or recording shows: out, home, and the other way


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Add this command to the command line."""
    parser = commands.add_parser(
        "view", help="show the plant in three dimensions",
        description="The plant in MuJoCo's viewer, or in a picture. A recording is replayed: what was measured is the translucent rudder.",
        epilog="examples:\n  ers view --linkage rod\n  ers view model.toml --recording run1.csv --render replay.gif\n"
               "  ers view plant.xml --input steps --render steps.gif")
    parser.add_argument("model", nargs="?", default="table1", metavar="MODEL", help="datasheet, model.toml or plant.xml (default table1)")
    parser.add_argument("--linkage", choices=LINKAGES, help="of the rudder (default constant)")
    parser.add_argument("--gap", type=number(least=0), metavar="DEG", help="play of +-DEG (default 0)")
    shown = parser.add_mutually_exclusive_group()
    shown.add_argument("--recording", metavar="REC", help="replay this: measured and simulated")
    shown.add_argument("--input", metavar="NAME", help=f"simulate multisine, chirp, ramp, steps or square (a .gif's default: {INPUT})")
    parser.add_argument("--map", type=pair, action="append", default=[], metavar="name=column", help="of the recording, as in t_s=Time; repeatable")
    parser.add_argument("--render", metavar="FILE", help="a picture, .png or .gif, instead of the window; a .png shows the rest position, "
                        "the end of an input, or where a recording and its simulation differ most")
    parser.add_argument("--width", type=whole(16), metavar="N", help="of the picture [pixels] (default 960, .gif 480)")
    parser.add_argument("--height", type=whole(16), metavar="N", help="of the picture [pixels] (default 720, .gif 360)")
    parser.add_argument("--fps", type=number(above=0), default=FPS, metavar="N", help=f"frames a second (default {FPS:g})")
    parser.add_argument("--duration", type=number(above=0), default=DURATION, metavar="S", help=f"shown of the motion [s] (default {DURATION:g})")
    parser.add_argument("--force", action="store_true", help="overwrite FILE")
    parser.add_argument("--json", action="store_true", help="print a summary as one JSON object")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Show or render; 0."""
    out = _checked_out(arguments)
    _refuse_contradictions(arguments)
    if out is None:
        _refuse_no_display()
    _refuse_no_mujoco()
    replay = _replay(arguments, is_film=out is None or out.suffix.lower() == ".gif")
    summary = _summary(arguments, replay)
    if out is None:
        _open_window(replay)
    else:
        summary |= _render(replay, out, arguments)
    print(as_json(summary) if arguments.json else _told(summary))
    return 0


# -- what cannot be meant ----------------------------------------------------------------------------------------


def _checked_out(arguments: argparse.Namespace) -> Path | None:
    """The picture's file, checked before any work starts; None for a window."""
    if arguments.render is None:
        return None
    out = Path(arguments.render)
    if not arguments.render or out.is_dir() or out.suffix.lower() not in KINDS:
        raise InputError(f"--render {arguments.render or 'is empty'}: a file that ends in .png or .gif was expected")
    if out.exists() and not arguments.force:
        raise InputError(f"{out}: exists already, give --force to overwrite it")
    refuse_unwritable(out)
    return out


def _refuse_contradictions(arguments: argparse.Namespace) -> None:
    from ers_mj.plants.inputs import INPUTS

    if arguments.input is not None and arguments.input not in INPUTS:
        raise InputError(f"--input {arguments.input}: there is no input of that name; there are {', '.join(INPUTS)}")
    if _is_mjcf(arguments):
        for option, value in (("--linkage", arguments.linkage), ("--gap", arguments.gap)):
            if value is not None:
                raise InputError(f"{option} is for a datasheet or a model.toml, {arguments.model} is built already")
    if arguments.duration * arguments.fps > MOST_FRAMES:
        raise InputError(f"{arguments.duration:g} s at {arguments.fps:g} frames a second are more than {MOST_FRAMES} frames, "
                         "give a smaller --duration or --fps")
    for option, value in (("--width", arguments.width), ("--height", arguments.height)):
        if value is not None and value > MOST_PIXELS:
            raise InputError(f"{option} {value}: at most {MOST_PIXELS} pixels were expected")


def _refuse_no_display() -> None:
    if sys.platform != "linux":
        return
    if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise InputError(f"there is no display to open a window on (DISPLAY is not set), {INSTEAD}")
    import glfw

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if not glfw.init():  # the viewer would end the program
            raise InputError(f"no window opens on the display {os.environ.get('DISPLAY') or os.environ['WAYLAND_DISPLAY']}, {INSTEAD}")


def _refuse_no_mujoco() -> None:
    """MuJoCo looks for MUJOCO_GL's libraries when it is imported, and fails in as many ways as they have."""
    try:
        import mujoco  # noqa: F401
    except Exception as error:
        raise InputError(f"MuJoCo does not start with MUJOCO_GL={os.environ.get('MUJOCO_GL', '')} "
                         f"({' '.join(str(error).split())[:100]}): unset it or install what it needs (Debian, Ubuntu: "
                         "egl libegl1 libgl1-mesa-dri, osmesa libosmesa6)") from None


def _is_mjcf(arguments: argparse.Namespace) -> bool:
    return Path(arguments.model).suffix.lower() in (".xml", ".mjcf")


# -- what is shown ---------------------------------------------------------------------------------------------------


def _replay(arguments: argparse.Namespace, is_film: bool) -> Replay:
    """The moments to show: a film, or a single one for a still or a window without motion."""
    recording = _recording(arguments)
    if recording is not None:
        t, u = recording.t, recording.u
    else:
        t, u = _input(arguments, is_film)
    from ers_mj.replay import moments_of

    moments = moments_of(t, arguments.fps, arguments.duration)
    replay = _moved(arguments, recording, t, u, moments)
    return replay if is_film else _still(replay)


def _recording(arguments: argparse.Namespace) -> Recording | None:
    from ers_mj.recording import read_recording

    if arguments.recording is None:
        if arguments.map:
            raise InputError("--map is for a --recording, none was given")
        return None
    return read_recording(arguments.recording, mapping(arguments.map))


def _input(arguments: argparse.Namespace, is_film: bool) -> tuple[np.ndarray, np.ndarray]:
    """Time (N,) [s] and input (N,); a single sample where nothing is to move."""
    import numpy as np

    from ers_mj.plants.inputs import INPUTS, RATE_HZ

    name = arguments.input or (INPUT if is_film and arguments.render else None)
    if name is None:
        return np.zeros(1), np.zeros(1)
    t = np.arange(max(2, round(arguments.duration * RATE_HZ) + 1)) / RATE_HZ
    return t, INPUTS[name](t)


def _moved(arguments: argparse.Namespace, recording: Recording | None, t: np.ndarray, u: np.ndarray, moments: np.ndarray) -> Replay:
    from ers_mj import replay
    from ers_mj.datasheet import read_datasheet

    unit = "rad" if recording is None else recording.output_unit
    if _is_mjcf(arguments):
        model = replay.read_plant(Path(arguments.model))
        if recording is not None and not replay.has_rudder(model):
            raise InputError(f"{arguments.model}: has no body rudder on a joint rocker, a recording cannot be shown beside it")
        return replay.file_simulated(model, t, u, moments, None if recording is None else recording.y, unit)
    plant = replay.plant_of(read_datasheet(arguments.model), arguments.linkage or "constant", math.radians(arguments.gap or 0.0), unit)
    if recording is not None:
        return replay.recorded(plant, recording, moments)
    return replay.simulated(plant, t, u, moments)


def _still(film: Replay) -> Replay:
    """The one moment that a still shows: the largest difference of a recording, else the last."""
    import numpy as np

    from ers_mj.replay import only

    if film.measured is None or not np.isfinite(film.measured - film.theta).any():
        return only(film, film.t.size - 1)
    return only(film, int(np.nanargmax(np.abs(film.measured - film.theta))))


# -- a picture -----------------------------------------------------------------------------------------------------


def _render(replay: Replay, out: Path, arguments: argparse.Namespace) -> dict:
    from ers_mj.rendering import gif_bytes, png_bytes, replay_frames

    width, height = (given or usual for given, usual in zip((arguments.width, arguments.height), KINDS[out.suffix.lower()], strict=True))
    images = []
    with Progress() as progress:
        for image in replay_frames(replay, width, height, labelled=replay.t.size > 1 or replay.measured is not None):
            images.append(image)
            progress("rendering", len(images) / replay.t.size)
    content = png_bytes(images[0]) if out.suffix.lower() == ".png" else gif_bytes(images, arguments.fps)
    _write(out, content)
    return {"render": str(out), "width": width, "height": height, "bytes": len(content)}


def _write(out: Path, content: bytes) -> None:
    """The file whole or not at all."""
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        handle, part = tempfile.mkstemp(prefix=f".{out.name}.", suffix=".part", dir=out.parent)
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.chmod(part, 0o644)
        os.replace(part, out)
    except OSError as error:
        raise InputError(f"{out}: cannot be written ({error.strerror})") from None


def _summary(arguments: argparse.Namespace, replay: Replay) -> dict:
    return {"model": arguments.model, "recording": arguments.recording, "frames": int(replay.t.size), "fps": arguments.fps,
            "from_s": float(replay.t[0]), "to_s": float(replay.t[-1]), "output_unit": replay.output_unit,
            "theta": [float(x) for x in (replay.theta[0], replay.theta[-1])]}


def _told(summary: dict) -> str:
    if "render" not in summary:
        return f"{summary['model']}: shown"
    frames = "one picture" if summary["frames"] == 1 else f"{summary['frames']} pictures, {summary['to_s'] - summary['from_s']:.3g} s"
    return f"{summary['render']}: {frames}, {summary['width']} x {summary['height']} pixels, {summary['bytes'] / 1e3:.0f} kB"


# -- a window ------------------------------------------------------------------------------------------------------


def _open_window(replay: Replay) -> None:
    """MuJoCo's viewer: a plant that can be driven by hand, or a replay that repeats until the window is closed."""
    import mujoco

    from ers_mj.replay import at_home

    try:
        import mujoco.viewer

        if replay.t.size == 1:
            mujoco.viewer.launch(replay.model, at_home(replay.model))
        else:
            _repeat(replay, at_home(replay.model))
    except (ImportError, mujoco.FatalError, RuntimeError) as error:
        raise InputError(f"MuJoCo's viewer cannot open a window here ({' '.join(str(error).split())[:100]}), {INSTEAD}") from None


def _repeat(replay: Replay, data: object) -> None:
    import mujoco
    import mujoco.viewer

    from ers_mj.rendering import Ghost, add_ghost

    scratch, begin = mujoco.MjData(replay.model), time.perf_counter()
    with mujoco.viewer.launch_passive(replay.model, data) as window:
        while window.is_running():
            now = math.fmod(time.perf_counter() - begin, float(replay.t[-1]) + 0.5)
            k = min(int(replay.t.searchsorted(now)), replay.t.size - 1)
            with window.lock():
                data.qpos = replay.qpos[k]
                mujoco.mj_forward(replay.model, data)
                window.user_scn.ngeom = 0
                if replay.measured is not None:
                    add_ghost(replay.model, scratch, window.user_scn, Ghost(float(replay.measured[k])))
            window.sync()
            time.sleep(1 / 60)
