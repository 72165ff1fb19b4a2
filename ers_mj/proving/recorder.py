"""Records a servo in MuJoCo: its mechanics are MuJoCo's, its electrics, sensor, controller and remaining laws a
compiled function's.
 MuJoCo's step v += h a, q += h v is second order if q is read as the angle half a step later. So the laws take q as the
middle of the coming step, and what is observed is q - h v / 2. The winding's current and every other state of the laws
is stepped by Heun's rule at 15 us or less, with the speed running on as in the last step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np
from numba import njit

from ers_mj.plants.mjcf import unlogged
from ers_mj.proving.catalogue import put_effects, samples_of
from ers_mj.proving.laws import (
    APP,
    BRI,
    BUS,
    CONTROLLER,
    CUR,
    LAG,
    STATES,
    TABLE_1,
    TH,
    THM,
    WM,
    W,
    bristle_rate,
    current_rate,
    dry,
    free_torques,
    friction_level,
    inertia,
    motor_torque,
    plant_of,
    slow_rates,
)
from ers_mj.proving.mechanism import LIGHT, mechanism
from ers_mj.proving.quick import STAND_S, Run, take

FINEST = 1.5e-5  # [s] the longest step of current and sensor
TOUCH = 1e-7  # [rad] from theta_0 within which the rudder stands on it
N = TABLE_1["n"]


def record(
    params: Mapping[str, float],
    effects: Sequence[Mapping],
    t: np.ndarray,
    u: np.ndarray | None,
    *,
    number: int = 0,
    step: float = 5e-5,
    linkage: str = "constant",
    noise: np.ndarray | None = None,
    adc_step: float = 0.0,
    controller: Mapping[str, float] | None = None,
    theta_ref: np.ndarray | None = None,
    decimals: int | None = None,
) -> Run:
    """A `Run` at the uniform times t (samples,) [s], as `quick.simulate` gives one, from MuJoCo.

    Args:
        effects: mappings with label, strength, shape.
        u: [V], held between samples; or a controller following theta_ref [rad].
        number: of the recording within its case, from 0.
        step: longest step of MuJoCo [s].
        decimals: of the voltage.
    """
    samples, dt = len(t), (t[-1] - t[0]) / (len(t) - 1)
    plant = plant_of(params)
    plant["adc_step"] = adc_step
    put_effects(plant, effects, number)
    substeps = max(1, int(np.ceil(dt / step - 1e-9)))
    h = dt / substeps
    parts = max(1, int(np.ceil(h / FINEST - 1e-9)))
    m = mechanism(plant, linkage, h)
    model, data = m.model, mujoco.MjData(m.model)
    for k in range(model.njnt):
        data.qpos[k] = m.start.get(model.joint(k).name, 0.0)
    stuck, spike, gain = samples_of(effects, number, samples, dt)
    c = np.array([controller[name] for name in CONTROLLER]) if controller is not None else np.zeros(len(CONTROLLER))
    target = np.asarray(theta_ref, float) if controller is not None else np.zeros(samples)
    u_in = np.zeros(samples) if controller is not None else np.asarray(u, float)
    noise = np.zeros(samples) if noise is None else np.asarray(noise, float)
    printed = 0.0 if decimals is None else 10.0**decimals

    laws, e = m.laws, h / parts
    y, work, speeds, memory, out = (
        _relaxed(laws),
        np.zeros((4, STATES)),
        np.zeros(2),
        np.zeros(3),
        np.zeros((5, samples)),
    )
    delay, late = round(float(laws["delay_s"][0]) / e), round(float(laws["lag_s"][0]) / e)
    ring = np.full(max(2 * late, 1) if laws["lag_form"][0] == 3 else late + 1, float(laws["theta_0"][0]))
    views = (
        data.qpos,
        data.qvel,
        data.ctrl,
        model.tendon_frictionloss,
        model.dof_frictionloss,
        model.dof_armature,
        m.places,
    )
    stood = -round(STAND_S / h)
    with unlogged():
        for count in range(stood, 0):
            push(laws, y, work, speeds, count, h, parts, out, substeps, delay, 1.0, ring, *views)
            mujoco.mj_step(model, data)
        count = 0
        for k in range(samples):
            observe(y, h, speeds, data.qpos, data.qvel, m.places)
            take(
                laws[0],
                y,
                k,
                out,
                ring,
                count * parts,
                late,
                noise,
                stuck,
                spike,
                c,
                memory,
                target,
                u_in,
                controller is not None,
                dt,
                printed,
            )
            for count in range(k * substeps, (k + 1) * substeps):
                push(laws, y, work, speeds, count, h, parts, out, substeps, delay, gain[k], ring, *views)
                mujoco.mj_step(model, data)
            count += 1
    return Run(*out)


def _relaxed(laws: np.ndarray) -> np.ndarray:
    y = np.zeros(STATES)
    y[[TH, THM, LAG, APP]] = laws["theta_0"][0]
    y[BUS] = laws["sag_V"][0]
    return y


@njit(cache=True)
def observe(y, h, speeds, qpos, qvel, places):
    """Write angle and speed of rudder and motor at this instant into y; (rudder, motor) speeds before it stand in
    `speeds`.
    """
    rocker, gap, rotor = places[0], places[1], places[2]
    y[TH], y[W] = qpos[rocker], qvel[rocker]
    if gap >= 0:
        y[TH] += qpos[gap]
        y[W] += qvel[gap]
    y[THM], y[WM] = qpos[rotor] / N, qvel[rotor] / N
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
def preload(p, x, w, h, drive, level):
    """(torque, dry friction) [N m] of T_LH Sgn(theta - theta_0) in a step that begins at x = theta - theta_0 with speed
    w.

    Where theta_0 is passed the torque is the mean over the step. Where the rudder stops there, under a torque `drive`
    within the band, T_LH is one more dry friction, which MuJoCo solves as a set.
    """
    after = x + h * w
    push_on = p.J * (1.0 - p.two * p.share_J) * w / h + drive
    near = min(abs(x), abs(after)) < TOUCH
    if near or x * after < 0.0:
        if abs(push_on) <= level + p.T_LH:
            return 0.0, p.T_LH
        if near:
            return p.T_LH * np.sign(push_on), 0.0
        return p.T_LH * (x + after) / (abs(x) + abs(after)), 0.0
    return p.T_LH * np.sign(x), 0.0


@njit(cache=True)
def push(
    laws,
    y,
    work,
    speeds,
    count,
    h,
    parts,
    out,
    substeps,
    delay,
    gain,
    ring,
    qpos,
    qvel,
    ctrl,
    frictionloss,
    joint_friction,
    joint_armature,
    places,
):
    """Carry the states of the laws over MuJoCo's coming step number `count`, and set the torques and friction that act
    in it.
    """
    p = laws[0]
    observe(y, h, speeds, qpos, qvel, places)
    pull, pull_m = (y[W] - speeds[0]) / h, (y[WM] - speeds[1]) / h
    speeds[0], speeds[1] = y[W], y[WM]
    rates, ahead, then, start = work[0], work[1], work[2], work[3]
    start[:] = y
    e, mean = h / parts, 0.0
    for part in range(parts):
        told = (count * parts + part - delay) // (parts * substeps)
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
    middle = ahead
    for s in range(STATES):
        middle[s] = 0.5 * (start[s] + y[s])
    middle[CUR] = mean
    tau, tau_m = free_torques(p, middle, (count + 0.5) * h)
    if p.two == 0.0:
        tau_m = motor_torque(p, middle)
        tau -= tau_m
    if p.ratio_form > 0.0:
        j, slope = inertia(p, middle[TH] - p.theta_0)
        joint_armature[places[0]] = j + p.app_J - p.J * (1.0 - p.share_J + LIGHT)
        tau -= 0.5 * slope * middle[W] ** 2
    up, down = dry(p, middle, middle[W], 1.0, False), dry(p, middle, middle[W], -1.0, False)
    tau -= 0.5 * (up - down)
    drive = tau if p.two > 0.0 else tau + tau_m
    pressed, held = preload(p, start[TH] - p.theta_0, start[W], h, drive, 0.5 * (up + down))
    frictionloss[places[5]] = 0.5 * (up + down) + held
    tau -= pressed
    if p.two > 0.0:
        up, down = dry(p, middle, middle[WM], 1.0, True), dry(p, middle, middle[WM], -1.0, True)
        joint_friction[places[0]] = 0.5 * (up + down)
        tau_m -= 0.5 * (up - down)
    ctrl[places[3]], ctrl[places[4]] = tau_m / N, tau
