"""Records a servo in MuJoCo: its mechanics are MuJoCo's, its electrics, sensor, controller and remaining laws a
compiled function's.

MuJoCo's step v += h a, q += h v is second order if q is read as the angle half a step later. So the laws take q as the
middle of the coming step, and what is observed is q - h v / 2. The winding's current and every other state of the laws
is stepped by Heun's rule at 15 us or less, with the speed running on as in the last step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from numba import njit

from ers_mj.plants.mujoco.mjcf_folder import unlogged
from ers_mj.proving.catalogue import put_effects
from ers_mj.proving.laws import (
    bristle_rate,
    current_rate,
    dry,
    free_torques,
    friction_level,
    inertia,
    motor_torque,
    slow_rates,
)
from ers_mj.proving.mechanism import LIGHT, Mechanism, mechanism
from ers_mj.proving.plant import APP, BRI, BUS, CUR, LAG, STATES, TABLE_1, TH, THM, WM, W, plant_of
from ers_mj.proving.quick import STAND_S
from ers_mj.proving.sampling import ALONE, Run, Setup, take

N = TABLE_1["n"]


class Grid(NamedTuple):
    """How time is cut: MuJoCo's step h [s], of which `substeps` make a sample; each is done by the laws in `parts`, and
    the command acts `delay` parts late.
    """

    h: float
    parts: int
    substeps: int
    delay: int


class States(NamedTuple):
    """What the laws remember: their states y (STATES,), work (4, STATES), (rudder, motor) speeds at the step before,
    and a ring of angles for a late sensor.
    """

    y: np.ndarray
    work: np.ndarray
    speeds: np.ndarray
    ring: np.ndarray


class Views(NamedTuple):
    """MuJoCo's own arrays, read and written step by step, and `Mechanism.places` in them."""

    qpos: np.ndarray
    qvel: np.ndarray
    ctrl: np.ndarray
    frictionloss: np.ndarray
    joint_friction: np.ndarray
    joint_armature: np.ndarray
    places: np.ndarray


def record(
    params: Mapping[str, float],
    effects: Sequence[Mapping],
    t: np.ndarray,
    u: np.ndarray | None,
    *,
    setup: Setup = ALONE,
    step: float = 5e-5,
    linkage: str = "constant",
) -> Run:
    """A `Run` at the uniform times t (samples,) [s], as `quick.simulate` gives one, from MuJoCo.

    Args:
        effects: mappings with label, strength, shape.
        u: [V], held between samples; or the setup's controller.
        step: longest step of MuJoCo [s].
    """
    samples, dt = len(t), (t[-1] - t[0]) / (len(t) - 1)
    plant = plant_of(params)
    plant["adc_step"] = setup.adc_step
    put_effects(plant, effects, setup.number)
    substeps = max(1, int(np.ceil(dt / step - 1e-9)))
    h = dt / substeps
    m = mechanism(plant, linkage, h)
    laws, data = m.laws, _begun(m)
    grid, late = _grid(laws[0], h, substeps)
    given, states = setup.given(effects, u, samples, dt), _relaxed(laws[0], late)
    views, memory, out = _views(m, data), np.zeros(3), np.zeros((6, samples))
    with unlogged():
        for count in range(-round(STAND_S / h), 0):
            push(laws, count, grid, states, out, 1.0, views)
            mujoco.mj_step(m.model, data)
        count = 0
        for k in range(samples):
            observe(states, h, views)
            take(laws[0], states.y, k, out, states.ring, count * grid.parts, late, given, memory)
            for count in range(k * substeps, (k + 1) * substeps):
                push(laws, count, grid, states, out, given.gain[k], views)
                mujoco.mj_step(m.model, data)
            count += 1
    return Run(*out)


def _begun(m: Mechanism) -> mujoco.MjData:
    """MuJoCo's state with the joints where they start."""
    data = mujoco.MjData(m.model)
    for k in range(m.model.njnt):
        data.qpos[k] = m.start.get(m.model.joint(k).name, 0.0)
    return data


def _grid(p: np.void, h: float, substeps: int) -> tuple[Grid, int]:
    """The grid, and how many of its parts the sensor is late."""
    parts = max(1, int(np.ceil(h / 1.5e-5 - 1e-9)))  # [s] the longest step of current and sensor
    e = h / parts
    return Grid(h, parts, substeps, round(float(p["delay_s"]) / e)), round(float(p["lag_s"]) / e)


def _relaxed(p: np.void, late: int) -> States:
    """States at rest on theta_0."""
    y = np.zeros(STATES)
    y[[TH, THM, LAG, APP]] = p["theta_0"]
    y[BUS] = p["sag_V"]
    ring = np.full(max(2 * late, 1) if p["lag_form"] == 3 else late + 1, float(p["theta_0"]))
    return States(y, np.zeros((4, STATES)), np.zeros(2), ring)


def _views(m: Mechanism, data: mujoco.MjData) -> Views:
    model = m.model
    return Views(
        data.qpos,
        data.qvel,
        data.ctrl,
        model.tendon_frictionloss,
        model.dof_frictionloss,
        model.dof_armature,
        m.places,
    )


@njit(cache=True)
def observe(states, h, views):
    """Write angle and speed of rudder and motor at this instant into the states."""
    y, rocker, gap, rotor = states.y, views.places[0], views.places[1], views.places[2]
    y[TH], y[W] = views.qpos[rocker], views.qvel[rocker]
    if gap >= 0:
        y[TH] += views.qpos[gap]
        y[W] += views.qvel[gap]
    y[THM], y[WM] = views.qpos[rotor] / N, views.qvel[rotor] / N
    y[TH] -= 0.5 * h * y[W]
    y[THM] -= 0.5 * h * y[WM]


@njit(cache=True)
def fast_rates(p, y, u, gain, dy):
    """Rates of current, bristle and slow states; the mechanics are MuJoCo's."""
    dy[CUR] = current_rate(p, y, u, gain)
    if p.pre_s0 > 0.0:
        dy[BRI] = bristle_rate(p, y, friction_level(p, y, y[W], np.sign(y[W])) * (1.0 - p.two * p.share_F))
    slow_rates(p, y, u, gain, dy)


@njit(cache=True)
def carry(p, count, grid, states, out, gain):
    """Carry the states of the laws over MuJoCo's coming step number `count`; the mean current [A] in it."""
    y, work, ring = states.y, states.work, states.ring
    speed, speed_m = states.speeds[0], states.speeds[1]
    pull, pull_m = (y[W] - speed) / grid.h, (y[WM] - speed_m) / grid.h
    states.speeds[0], states.speeds[1] = y[W], y[WM]
    rates, ahead, then = work[0], work[1], work[2]
    parts = grid.parts
    e, mean = grid.h / parts, 0.0
    for part in range(parts):
        told = (count * parts + part - grid.delay) // (parts * grid.substeps)
        u = out[3, told] if told >= 0 else 0.0
        rates[:] = 0.0
        fast_rates(p, y, u, gain, rates)
        rates[TH], rates[W], rates[THM], rates[WM] = y[W], pull, y[WM], pull_m
        for s in range(STATES):
            ahead[s] = y[s] + e * rates[s]
        then[:] = 0.0
        fast_rates(p, ahead, u, gain, then)
        then[TH], then[W], then[THM], then[WM] = ahead[W], pull, ahead[WM], pull_m
        before = y[CUR]
        for s in range(STATES):
            y[s] += 0.5 * e * (rates[s] + then[s])
        if p.lim_A > 0.0 and p.lim_form == 0.0:
            y[CUR] = min(max(y[CUR], -p.lim_A), p.lim_A)
        mean += 0.5 * (before + y[CUR]) / parts
        ring[(count * parts + part + 1) % ring.size] = y[TH]
    return mean


@njit(cache=True)
def preload(p, x, w, h, drive, level):
    """(torque, dry friction) [N m] of T_LH Sgn(theta - theta_0) in a step that begins at x = theta - theta_0 with speed
    w.

    Where theta_0 is passed the torque is the mean over the step. Where the rudder stops there, under a torque `drive`
    within the band, T_LH is one more dry friction, which MuJoCo solves as a set.
    """
    after = x + h * w
    push_on = p.J * (1.0 - p.two * p.share_J) * w / h + drive
    near = min(abs(x), abs(after)) < 1e-7  # [rad] within which the rudder stands on theta_0
    if near or x * after < 0.0:
        if abs(push_on) <= level + p.T_LH:
            return 0.0, p.T_LH
        if near:
            return p.T_LH * np.sign(push_on), 0.0
        return p.T_LH * (x + after) / (abs(x) + abs(after)), 0.0
    return p.T_LH * np.sign(x), 0.0


@njit(cache=True)
def push(laws, count, grid, states, out, gain, views):
    """Carry the states of the laws over MuJoCo's coming step number `count`, and set the torques and friction that act
    in it.
    """
    p, h, places = laws[0], grid.h, views.places
    observe(states, h, views)
    start = states.work[3]
    start[:] = states.y
    mean = carry(p, count, grid, states, out, gain)
    middle = states.work[1]
    for s in range(STATES):
        middle[s] = 0.5 * (start[s] + states.y[s])
    middle[CUR] = mean
    tau, tau_m = free_torques(p, middle, (count + 0.5) * h)
    if p.two == 0.0:
        tau_m = motor_torque(p, middle)
        tau -= tau_m
    if p.ratio_form > 0.0:
        j, slope = inertia(p, middle[TH] - p.theta_0)
        views.joint_armature[places[0]] = j + p.app_J - p.J * (1.0 - p.share_J + LIGHT)
        tau -= 0.5 * slope * middle[W] ** 2
    up, down = dry(p, middle, middle[W], 1.0, False), dry(p, middle, middle[W], -1.0, False)
    tau -= 0.5 * (up - down)
    drive = tau if p.two > 0.0 else tau + tau_m
    pressed, held = preload(p, start[TH] - p.theta_0, start[W], h, drive, 0.5 * (up + down))
    views.frictionloss[places[5]] = 0.5 * (up + down) + held
    tau -= pressed
    if p.two > 0.0:
        up, down = dry(p, middle, middle[WM], 1.0, True), dry(p, middle, middle[WM], -1.0, True)
        views.joint_friction[places[0]] = 0.5 * (up + down)
        tau_m -= 0.5 * (up - down)
    views.ctrl[places[3]], views.ctrl[places[4]] = tau_m / N, tau
