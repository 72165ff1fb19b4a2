"""A plant on its stage: the floor, the lights and the camera of mjcf/scene.xml around it, and a shape for a lumped
joint.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from ers_mj.plants.mujoco.mjcf_folder import read_mjcf

PREFIX = "stage_"
MASS = "imbalance"  # body off the shaft on which gravity pulls, written by its effect
CAMERAS = (f"{PREFIX}side", "side")  # put here, or the model's own
ARM_FLOOR = -0.09  # [m] by which the floor lies lower under an arm, which may hang down
REACH = 0.11  # [m] to either side of the shaft: what the camera of scene.xml sees, with room for a carriage
STOP_RADIUS, STOP_OFFSET = 0.0328, 0.027  # [m] of the levers' stop about the shaft, and along it
STEEL, WHITE, BLUE, RED = (0.45, 0.47, 0.50, 1), (0.82, 0.83, 0.82, 1), (0.17, 0.38, 0.68, 1), (0.80, 0.18, 0.14, 1)
LARGEST = 4096  # [pixels] of a picture, either way


def staged(spec: mujoco.MjSpec, reach: float = 1.0) -> mujoco.MjModel:
    """Compile a plant with its surroundings; a model that is no plant of this package stays as it is.

    Args:
        spec: a model; it is written on.
        reach: the furthest that a sliding output goes [output unit]: the stage grows with it.
    """
    spec.visual.global_.offwidth = spec.visual.global_.offheight = LARGEST
    names = {body.name for body in spec.bodies}
    if not {"rocker", "rudder"} <= names:
        return spec.compile()
    is_slide = spec.joint("rocker").type == mujoco.mjtJoint.mjJNT_SLIDE
    scale = reach / REACH if is_slide else 1.0
    if all(geom.type != mujoco.mjtGeom.mjGEOM_PLANE for geom in spec.geoms):
        _surround(spec, scale)
    rig = rig_of(spec)
    if rig == "rudder":
        _place_stop(spec, "lever_up" in names)
    elif rig == "slide":
        _shape_slide(spec, scale)
    elif rig == "arm":
        _shape_arm(spec)
    else:
        _shape_blade(spec)
    return spec.compile()


def rig_of(spec: mujoco.MjSpec) -> str:
    """What a plant is drawn as: the rudder system, an arm under gravity, a slide, else a joint."""
    names = {body.name for body in spec.bodies}
    if "motor" in names:
        return "rudder"
    if spec.joint("rocker").type == mujoco.mjtJoint.mjJNT_SLIDE:
        return "slide"
    return "arm" if MASS in names else "joint"


def _surround(spec: mujoco.MjSpec, scale: float) -> None:
    """Floor, lights and camera of scene.xml, `scale` times as large."""
    texts = read_mjcf()
    scene = mujoco.MjSpec.from_string(texts["scene.xml"], include={"rudder_rod.xml": b"<mujoco><worldbody/></mujoco>"})
    for part in [*scene.geoms, *scene.lights, *scene.cameras]:
        part.pos = scale * part.pos
    for geom in scene.geoms:
        geom.size = scale * geom.size
    spec.attach(scene, frame=spec.worldbody.add_frame(), prefix=PREFIX)
    spec.visual.headlight.ambient = spec.visual.headlight.diffuse = [0.35, 0.35, 0.35]
    spec.visual.headlight.specular = [0.1, 0.1, 0.1]
    spec.visual.quality.shadowsize = 2048
    spec.visual.map.znear = 0.1
    spec.visual.global_.azimuth, spec.visual.global_.elevation = 62, -22
    spec.stat.center, spec.stat.extent = [0.0, 0.06 * scale, 0.0], 0.34 * scale


def _place_stop(spec: mujoco.MjSpec, has_levers: bool) -> None:
    """The levers' stop at this plant's theta_0; none where there is no preload."""
    stop = next((geom for geom in spec.geoms if geom.name == "lever_stop"), None)
    if stop is None:
        return
    if not has_levers:
        spec.delete(stop)
        return
    theta_0 = spec.joint("lever_up").range[0]
    stop.pos = [-STOP_RADIUS * math.sin(theta_0), STOP_OFFSET, STOP_RADIUS * math.cos(theta_0)]
    stop.quat = [math.cos(theta_0 / 2), 0.0, -math.sin(theta_0 / 2), 0.0]
    stop.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT


def _shape_blade(spec: mujoco.MjSpec) -> None:
    """A lumped angle: a blade on a shaft between two bearings, as large as the rudder."""
    box, rod = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER
    along = [math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0]  # z onto the shaft
    world, rudder = spec.worldbody, _bare(spec, "rudder")
    _add(world, box, (0.04, 0.04, 0.004), (0, 0.02, -0.047), WHITE)
    for y in (0.0, 0.04):
        _add(world, box, (0.009, 0.0035, 0.022), (0, y, -0.022), WHITE)
        _add(world, rod, (0.013, 0.0035, 0), (0, y, 0), WHITE, along)
    _add(rudder, rod, (0.005, 0.045, 0), (0, 0.03, 0), STEEL, along)
    _add(rudder, box, (0.030, 0.004, 0.0075), (0, 0.066, 0), BLUE)
    _add(rudder, box, (0.075, 0.090, 0.003), (0.035, 0.160, 0), WHITE)
    _add(rudder, box, (0.010, 0.090, 0.0014), (0.118, 0.160, 0), RED)


def _shape_arm(spec: mujoco.MjSpec) -> None:
    """A lumped angle under gravity: an arm on a servo's shaft, a weight at its end, on the side of the mass."""
    box, rod = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER
    along = [math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0]  # z onto the shaft
    x, _, z = spec.body(MASS).pos
    length = math.hypot(x, z)
    x, z = (x / length, z / length) if length > 0 else (1.0, 0.0)
    turned = [math.cos(0.5 * math.atan2(-z, x)), 0.0, math.sin(0.5 * math.atan2(-z, x)), 0.0]  # x onto the arm
    for floor in spec.geoms:
        if floor.type == mujoco.mjtGeom.mjGEOM_PLANE:
            floor.pos = floor.pos + np.array([0.0, 0.0, ARM_FLOOR])
    rudder = _bare(spec, "rudder")
    _add(spec.worldbody, box, (0.024, 0.020, 0.014), (0, 0.034, 0), BLUE)
    _add(spec.worldbody, box, (0.010, 0.010, 0.065), (0, 0.034, -0.078), WHITE)
    _add(rudder, rod, (0.006, 0.016, 0), (0, 0.002, 0), STEEL, along)
    _add(rudder, box, (0.046, 0.004, 0.006), (0.040 * x, -0.010, 0.040 * z), WHITE, turned)
    _add(rudder, rod, (0.015, 0.010, 0), (0.086 * x, -0.010, 0.086 * z), RED, along)


def _shape_slide(spec: mujoco.MjSpec, scale: float) -> None:
    """A lumped position: a carriage on a rail."""
    box = mujoco.mjtGeom.mjGEOM_BOX
    for size, pos, rgba in (
        ((0.15, 0.012, 0.006), (0, 0.03, -0.045), WHITE),
        ((0.15, 0.004, 0.006), (0, 0.03, -0.033), STEEL),
    ):
        _add(spec.worldbody, box, _times(scale, size), _times(scale, pos), rgba)
    rudder = _bare(spec, "rudder")
    for size, pos, rgba in (
        ((0.030, 0.025, 0.010), (0, 0.03, -0.017), BLUE),
        ((0.004, 0.025, 0.004), (0, 0.03, -0.003), RED),
    ):
        _add(rudder, box, _times(scale, size), _times(scale, pos), rgba)


def _bare(spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
    """A body without its shapes; the inertia of a lumped one is explicit."""
    body = spec.body(name)
    for geom in list(body.geoms):
        spec.delete(geom)
    return body


def _times(scale: float, x: tuple[float, ...]) -> list[float]:
    return [scale * entry for entry in x]


def _add(body: mujoco.MjsBody, kind: int, size, pos, rgba, quat=(1.0, 0.0, 0.0, 0.0)) -> None:
    body.add_geom(type=kind, size=size, pos=pos, quat=quat, rgba=rgba, mass=0, contype=0, conaffinity=0)
