"""A replay in MuJoCo's viewer."""

from __future__ import annotations

import math
import os
import sys
import time
import warnings

from ers_mj.errors import InputError
from ers_mj.view.model_file import at_home
from ers_mj.view.rendering import add_ghost
from ers_mj.view.replay import Replay

INSTEAD = "give --render FILE.png or FILE.gif for a picture"


def refuse_no_display() -> None:
    """Raise InputError where no window can open; MuJoCo's viewer would end the program."""
    if sys.platform != "linux":
        return
    display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if not display:
        raise InputError(f"there is no display to open a window on (DISPLAY is not set), {INSTEAD}")
    import glfw

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if not glfw.init():
            raise InputError(f"no window opens on the display {display}, {INSTEAD}")


def open_window(replay: Replay) -> None:
    """The plant, to be driven by hand, or a motion that repeats until the window is closed.

    Raises:
        InputError: the viewer cannot open a window here.
    """
    try:
        import mujoco.viewer

        if replay.t.size == 1:
            mujoco.viewer.launch(replay.model, at_home(replay.model))
        else:
            _repeat(replay)
    except (ImportError, mujoco.FatalError, RuntimeError) as error:
        raise InputError(
            f"MuJoCo's viewer cannot open a window here ({' '.join(str(error).split())[:100]}), {INSTEAD}"
        ) from None


def _repeat(replay: Replay, pause: float = 0.5) -> None:
    """The motion over and over, with a pause [s] after its end."""
    import mujoco.viewer

    data, scratch, begin = at_home(replay.model), mujoco.MjData(replay.model), time.perf_counter()
    with mujoco.viewer.launch_passive(replay.model, data) as window:
        while window.is_running():
            now = math.fmod(time.perf_counter() - begin, float(replay.t[-1]) + pause)
            k = min(int(replay.t.searchsorted(now)), replay.t.size - 1)
            with window.lock():
                data.qpos = replay.qpos[k]
                mujoco.mj_forward(replay.model, data)
                window.user_scn.ngeom = 0
                if replay.measured is not None:
                    add_ghost(replay.model, scratch, window.user_scn, float(replay.measured[k]))
            window.sync()
            time.sleep(1 / 60)
