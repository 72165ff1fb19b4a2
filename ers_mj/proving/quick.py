"""An independent simulator of the electric rudder servo: quick enough to size what is concealed, and a check on
MuJoCo's.

It shares no line and no method with the package. Eq. (1) of the paper, all on the rudder side of the gear:

    L i' = v(u) - R i - K_e n w
    J w' = n K_t i - B w - F_c Sgn(w) - k_s (theta - theta_0) - T_LH Sgn(theta - theta_0) + effects

is stepped with Heun's rule at 5-10 us; Sgn is set-valued. Within a step the instants at which w or theta - theta_0
pass zero are located and the step is cut there; at rest the inclusion is solved in closed form (the servo stays where
the torque lies inside the stick band, whose width is F_c + T_LH on theta = theta_0 and F_c elsewhere), so nothing
creeps. Backlash and shaft compliance split J, B and F_c into a motor side and a rudder side joined by a spring with an
optional gap.

Angles rad, torques N m, voltages V, currents A, times s. What each effect means stands in `catalogue.py`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ers_mj.proving.catalogue import put_effects
from ers_mj.proving.laws import (
    bristle_rate,
    current_rate,
    dry,
    free_torques,
    friction_level,
    inertia,
    settled_current,
    slow_rates,
)
from ers_mj.proving.plant import APP, BRI, BUS, CUR, LAG, STATES, TH, THM, WM, W, plant_of
from ers_mj.proving.sampling import ALONE, Run, Setup, take

STAND_S = 0.25
"""[s] how long the servo stands with u = 0 before t = 0."""
COARSE, FINE, ROUGH = 4e-5, 1e-5, 1e-4
"""[s] steps for sizing, for the recordings, and for what holds no stiff joint (error 2e-5, 1e-6, 1e-4 deg)."""


@njit(cache=True)
def hold_current(p, y, u, gain):
    """Put the current where it settles, of a winding without inductance."""
    if p.quasi > 0.0:
        y[CUR] = settled_current(p, y, u, gain)


@njit(cache=True)
def rates(p, y, t, u, gain, rudder, motor, side, dy):
    """y' with friction directions `rudder`, `motor` (+-1, 0 at rest) and preload side `side` (+-1) held."""
    hold_current(p, y, u, gain)
    tau, tau_m = free_torques(p, y, t)
    dy[TH] = dy[W] = 0.0
    if rudder != 0.0:
        j, slope = inertia(p, y[TH] - p.theta_0)
        dy[TH] = y[W]
        dy[W] = (tau - rudder * dry(p, y, y[W], rudder, False) - side * p.T_LH - 0.5 * slope * y[W] ** 2) / j
    if p.two > 0.0:
        dy[THM] = dy[WM] = 0.0
        if motor != 0.0:
            dy[THM] = y[WM]
            dy[WM] = (tau_m - motor * dry(p, y, y[WM], motor, True)) / (p.share_J * p.J)
    dy[CUR] = 0.0 if p.quasi > 0.0 else current_rate(p, y, u, gain)
    if p.pre_s0 > 0.0:
        level = friction_level(p, y, y[W], np.sign(y[W])) * (1.0 - p.two * p.share_F)
        dy[BRI] = bristle_rate(p, y, level) if rudder != 0.0 else 0.0
    slow_rates(p, y, u, gain, dy)


@njit(cache=True)
def directions(p, y, t):
    """(rudder, motor, side): who moves which way; at rest 0 where the torque lies inside the stick band."""
    x = y[TH] - p.theta_0
    rudder, motor, side = np.sign(y[W]), np.sign(y[WM]), np.sign(x)
    if rudder == 0.0 or (p.two > 0.0 and motor == 0.0):
        tau, tau_m = free_torques(p, y, t)
        if rudder == 0.0:
            tau -= side * p.T_LH
            rudder = np.sign(tau)
            band = dry(p, y, 0.0, rudder, False) + (p.T_LH if side == 0.0 else 0.0)
            rudder = 0.0 if abs(tau) <= band else rudder
        if p.two > 0.0 and motor == 0.0:
            motor = np.sign(tau_m)
            motor = 0.0 if abs(tau_m) <= dry(p, y, 0.0, motor, True) else motor
    return rudder, motor, (rudder if side == 0.0 else side)


@njit(cache=True)
def heun(p, y, t, u, gain, h, rudder, motor, side, work, out):
    """One step of Heun's rule from y into out."""
    k1, k2, mid = work[0], work[1], work[2]
    rates(p, y, t, u, gain, rudder, motor, side, k1)
    for j in range(STATES):
        mid[j] = y[j] + h * k1[j]
    rates(p, mid, t + h, u, gain, rudder, motor, side, k2)
    for j in range(STATES):
        out[j] = y[j] + 0.5 * h * (k1[j] + k2[j])
    if p.lim_A > 0.0 and p.lim_form == 0.0:
        out[CUR] = min(max(out[CUR], -p.lim_A), p.lim_A)


@njit(cache=True)
def first_event(p, y, end, rudder, motor, side):
    """(share of the step, which) of the first of: 1 w, 2 theta - theta_0, 3 motor speed through zero; which 0: none."""
    share, which = 1.0, 0
    if end[W] * rudder < 0.0:
        share, which = abs(y[W]) / (abs(y[W]) + abs(end[W])), 1
    x, x_end = y[TH] - p.theta_0, end[TH] - p.theta_0
    if rudder != 0.0 and x != 0.0 and x_end * side < 0.0:
        s = abs(x) / (abs(x) + abs(x_end))
        if s < share:
            share, which = s, 2
    if p.two > 0.0 and end[WM] * motor < 0.0:
        s = abs(y[WM]) / (abs(y[WM]) + abs(end[WM]))
        if s < share:
            share, which = s, 3
    return share, which


@njit(cache=True)
def advance(p, y, t, u, gain, h, work):
    """One step of length h, cut at every reversal and at every pass of theta_0."""
    out, left, hold, hold_m = work[3], h, False, False
    for count in range(10):
        hold_current(p, y, u, gain)
        rudder, motor, side = directions(p, y, t)
        rudder = 0.0 if hold and y[W] == 0.0 else rudder
        motor = 0.0 if hold_m and y[WM] == 0.0 else motor
        heun(p, y, t, u, gain, left, rudder, motor, side, work, out)
        share, which = first_event(p, y, out, rudder, motor, side)
        if which == 0:
            y[:] = out
            return
        hold = hold or (which == 1 and y[W] == 0.0)
        hold_m = hold_m or (which == 3 and y[WM] == 0.0)
        heun(p, y, t, u, gain, left * share, rudder, motor, side, work, out)
        y[:] = out
        put_there(p, y, which)
        t, left = t + left * share, left * (1.0 - share)
        if count > 5 and which != 3:
            settle(p, y, t)


@njit(cache=True)
def put_there(p, y, which):
    """Put what passes zero at an event of `first_event` exactly there."""
    if which == 1:
        y[W] = 0.0
    elif which == 2:
        y[TH] = p.theta_0
    else:
        y[WM] = 0.0


@njit(cache=True)
def settle(p, y, t):
    """Many passes within one step are the end of a bounce on theta_0: come to rest there if the band allows it."""
    tau, _ = free_torques(p, y, t)
    if abs(tau) <= dry(p, y, 0.0, np.sign(tau), False) + p.T_LH and abs(y[TH] - p.theta_0) < 1e-6:
        y[TH], y[W] = p.theta_0, 0.0


@njit(cache=True)
def march(plant, given, substeps, stand):
    """(6, samples): measured, clean, true angle, u, current and speed at the sample times."""
    p = plant[0]
    h, samples = given.dt / substeps, given.u.size
    out, y, work, memory = np.zeros((6, samples)), np.zeros(STATES), np.zeros((4, STATES)), np.zeros(3)
    y[TH] = y[THM] = y[LAG] = y[APP] = p.theta_0
    y[BUS] = p.sag_V
    delay, late = int(round(p.delay_s / h)), int(round(p.lag_s / h))
    window = max(2 * late, 1) if p.lag_form == 3.0 else late + 1
    ring = np.full(window, p.theta_0)
    before = int(round(stand / h))
    step = -before
    for _ in range(before):
        advance(p, y, step * h, 0.0, 1.0, h, work)
        step += 1
        ring[step % window] = y[TH]
    for k in range(samples):
        take(p, y, k, out, ring, step, late, given, memory)
        for _ in range(substeps):
            told = (step - delay) // substeps
            advance(p, y, step * h, out[3, told] if told >= 0 else 0.0, given.gain[k], h, work)
            step += 1
            ring[step % window] = y[TH]
    return out


# -- the way in ------------------------------------------------------------------------------------------------------


def simulate(params, effects, t, u, *, setup=ALONE, step=1e-5, stand=STAND_S):
    """A `Run` at the times t [s] (uniform) under u [V] held between samples, or under the controller of ``setup``.

    ``effects``: mappings with label, strength, shape as the truth files have them; ``step`` [s] is the longest step.
    """
    t, samples = np.asarray(t, float), len(t)
    dt = (t[-1] - t[0]) / (samples - 1)
    plant = plant_of(params)
    plant["adc_step"] = setup.adc_step
    put_effects(plant, effects, setup.number)
    given = setup.given(effects, u, samples, dt)
    return Run(*march(plant, given, max(1, int(np.ceil(dt / step - 1e-9))), stand))


def run(servo, record, number, effects, step):
    """The recording with the effects, as the servo's sensor and controller make it."""
    return simulate(servo["params"], effects, record["t"], record["u"], setup=Setup.of(servo, number), step=step)
