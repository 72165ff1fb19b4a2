"""Pictures of a replay without a window: frames (H, W, 3), and what they become in a file or a page."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import mujoco
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from ers_mj.errors import InputError
from ers_mj.plants.mujoco.staging import CAMERAS
from ers_mj.view.replay import Replay

MEASURED = (1.0, 0.72, 0.10, 0.50)  # of the ghost, translucent: what was measured lies over what was simulated
INK, AMBER = (31, 42, 55), (140, 84, 0)  # of the words: simulated, measured
INSTALL = "install EGL (Debian, Ubuntu: apt install libegl1 libgl1-mesa-dri), or libosmesa6 and set MUJOCO_GL=osmesa"


class Painter:
    """Draws one model off screen, for use in a `with`; ``plain``: without shadows and reflections, in half the time.

    Raises:
        InputError: this machine cannot draw without a window; the sentence says what to install.
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int, plain: bool = False):
        self.model, self.width, self.height = model, width, height
        self.data, self.other = mujoco.MjData(model), mujoco.MjData(model)
        self.option, self.scene = mujoco.MjvOption(), mujoco.MjvScene(model, 2000)
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        model.vis.quality.shadowsize *= not plain
        try:
            self.context = _context_class()(width, height)
            self.context.make_current()
            self.target = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_150.value)
        except Exception as error:  # PyOpenGL and the drivers raise anything where a library is missing
            raise InputError(
                f"pictures cannot be drawn here ({' '.join(str(error).split())[:100]}): {INSTALL}"
            ) from None
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION) if plain else ():
            self.scene.flags[flag.value] = 0
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self.target)

    def __enter__(self) -> Painter:
        return self

    def __exit__(self, *_: object) -> None:
        self.target.free()
        self.context.free()

    def draw(self, qpos: np.ndarray, measured: float | None = None) -> np.ndarray:
        """The model with its joints at qpos (nq,) and a ghost of its rudder at the measured output -> (H, W, 3)
        uint8.
        """
        self.data.qpos = qpos
        mujoco.mj_forward(self.model, self.data)
        mujoco.mjv_updateScene(
            self.model, self.data, self.option, None, default_camera(self.model), mujoco.mjtCatBit.mjCAT_ALL, self.scene
        )
        if measured is not None:
            add_ghost(self.model, self.other, self.scene, measured)
        image, whole = np.empty((self.height, self.width, 3), np.uint8), mujoco.MjrRect(0, 0, self.width, self.height)
        mujoco.mjr_render(whole, self.scene, self.target)
        mujoco.mjr_readPixels(image, None, whole, self.target)
        return np.ascontiguousarray(image[::-1])


def _context_class() -> Callable[[int, int], Any]:
    """What MuJoCo draws with: the user's MUJOCO_GL, else EGL on Linux, which needs no window, else the system's own."""
    wanted = os.environ.get("MUJOCO_GL", "").lower().strip()
    if sys.platform == "linux" and wanted in ("", "egl"):
        from mujoco.egl import GLContext
    elif sys.platform == "linux" and wanted == "osmesa":
        from mujoco.osmesa import GLContext
    else:
        from mujoco.gl_context import GLContext
    return GLContext


def default_camera(model: mujoco.MjModel) -> mujoco.MjvCamera:
    """The stage's camera, else one that sees all of the model."""
    camera = mujoco.MjvCamera()
    mujoco.mjv_defaultFreeCamera(model, camera)
    fixed = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA, name) for name in CAMERAS]
    if max(fixed) >= 0:
        camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, max(fixed)
    return camera


def add_ghost(model: mujoco.MjModel, data: mujoco.MjData, scene: mujoco.MjvScene, measured: float) -> None:
    """Put the shapes of the rudder, at the measured output, into a scene; `data` is scratch. A NaN puts nothing."""
    if not np.isfinite(measured):
        return
    data.qpos = 0.0
    data.qpos[model.joint("rocker").qposadr[0]] = measured
    mujoco.mj_kinematics(model, data)
    first, count = model.body("rudder").geomadr[0], model.body("rudder").geomnum[0]
    for k in range(first, first + count):
        shape = scene.geoms[scene.ngeom]
        # thicker than the rudder [m], so that both are seen where they coincide
        size = model.geom_size[k] + 6e-4 * (model.geom_size[k] > 0)
        mujoco.mjv_initGeom(
            shape, model.geom_type[k], size, data.geom_xpos[k], data.geom_xmat[k], np.array(MEASURED, np.float32)
        )
        scene.ngeom += 1


def replay_frames(replay: Replay, width: int, height: int) -> Iterator[np.ndarray]:
    """Every moment of a replay as (H, W, 3) uint8, labelled where there is something to tell; the ghost is what was
    measured.

    Raises:
        InputError: this machine cannot draw without a window.
    """
    tells = replay.t.size > 1 or replay.measured is not None
    with Painter(replay.model, width, height) as painter:
        for k in range(replay.t.size):
            image = painter.draw(replay.qpos[k], None if replay.measured is None else float(replay.measured[k]))
            yield _labelled(image, replay, k) if tells else image


def _labelled(image: np.ndarray, replay: Replay, k: int) -> np.ndarray:
    """Time and outputs written into the upper left corner."""
    lines = [(f"{replay.t[k]:.2f} s", INK)]
    if np.isfinite(replay.theta[k]):
        lines.append((f"simulated {told_output(replay.theta[k], replay.output_unit)}", INK))
    if replay.measured is not None:
        lines.append((f"measured {told_output(replay.measured[k], replay.output_unit)}", AMBER))
    size = max(10, image.shape[0] // 22)
    picture = Image.fromarray(image)
    for row, (text, colour) in enumerate(lines):
        ImageDraw.Draw(picture).text(
            (size * 0.8, size * (0.6 + 1.3 * row)), text, fill=colour, font=ImageFont.load_default(size)
        )
    return np.asarray(picture)


def told_output(x: float, unit: str) -> str:
    """An output for a picture: radians as degrees to a tenth."""
    if not np.isfinite(x):
        return "missing"
    return f"{np.degrees(x):.1f}°" if unit == "rad" else f"{x:.3g} {unit}"


# -- files ---------------------------------------------------------------------------------------------------------


def png_bytes(image: np.ndarray) -> bytes:
    """(H, W, 3) uint8 as PNG."""
    return _encoded(image, "PNG", optimize=True)


def jpeg_bytes(image: np.ndarray) -> bytes:
    """(H, W, 3) uint8 as JPEG, for a page."""
    return _encoded(image, "JPEG", quality=88, subsampling=0)


def _encoded(image: np.ndarray, form: str, **settings) -> bytes:
    out = io.BytesIO()
    Image.fromarray(image).save(out, form, **settings)
    return out.getvalue()


def gif_bytes(images: Sequence[np.ndarray], fps: float) -> bytes:
    """(H, W, 3) uint8 each as an endless GIF at `fps`, all in one palette so that nothing flickers."""
    samples = images[:: max(1, len(images) // 8)]
    palette = Image.fromarray(np.concatenate(samples, axis=0)).quantize(256, method=Image.Quantize.MEDIANCUT, kmeans=2)
    frames = [Image.fromarray(image).quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    out = io.BytesIO()
    ends = np.round(100.0 * np.arange(len(frames) + 1) / fps).astype(int) * 10  # [ms], in GIF's steps of 10
    frames[0].save(
        out, "GIF", save_all=True, append_images=frames[1:], duration=np.diff(ends).tolist(), loop=0, disposal=1
    )
    return out.getvalue()
