"""How a motion of one body changes with anything that its model is made of, to first order, without simulating it again.

Along a motion (theta, w, j) that the kernel of events.py has made, the change (a, b, d) of the three obeys the same equations within
each mode, driven by what the changed model adds to the forces there. Where the mode changes inside a sample:

    slip ends        the speed's change ends with it, the angle's stays
    slip begins      the force balance is zero there: nothing jumps
    w passes zero    b is stretched by the accelerations' ratio, after over before
    theta_0 crossed  the preload's jump strikes earlier or later: b loses 2 c_1 (a - d theta_0) / |w|
    caught at theta_0    the angle follows it, from when the preload can stop the rudder within a sample

The instants are taken from the states at the ends of the sample, so a column is good to a few per cent: enough for the steps of a
search, which weighs every step by a simulation. One costs about as much as a simulation of the bare plant, half of one under a law.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from ers_mj.plants.compiled import compiled_cache, inlined
from ers_mj.plants.events import (A_1, A_EMF, A_MINUS, A_PLUS, B, BIAS, C_1, C_MINUS, C_PLUS, READ, READ_BOOL, ROWS, LAWS, TAU, THETA_0, VECTOR,
                                  _derivative, _extra, _maps)
from ers_mj.plants.laws import remember

NUDGE = 1e-6  # of the motion's largest angle, speed and drive: step of a law's slopes
MOST = 10.0  # times the motion's extent and largest speed by which a unit of change may move it: beyond, stick and slip only fork otherwise
CORNER = 1e-12  # [output unit] within which a rudder at rest is held in the corner


@inlined
def _acceleration(c, on, p, lawful, t, x, s, side, drive, tau, a_emf, load):
    """Acceleration of a slipping rudder in the state x."""
    bias = c[BIAS]
    c[BIAS] = bias + load
    a = _derivative(c, on, p, lawful, t, x, (s, side, 0, 0, 0), drive, tau, a_emf)[1]
    c[BIAS] = bias
    return a


@inlined
def _direct(c, dc, on, p, on_2, p_2, c_2, laws, scale, load, t, x, s, side):
    """What the changed model adds to the force on a rudder that slips in direction s, per unit of the change."""
    a_mech, level = (dc[A_PLUS], dc[C_PLUS]) if s > 0 else (dc[A_MINUS], dc[C_MINUS])
    force = dc[BIAS] + dc[A_1] * (c[THETA_0] - x[0]) + c[A_1] * dc[THETA_0] - dc[C_1] * side - a_mech * x[1] - s * level
    if laws:
        force += (_extra(c_2, on_2, p_2, load, t, x, s) - _extra(c, on, p, load, t, x, s)) * scale
    return force


def _prepare(t, load, path, c, on, p, maps, out):
    """Fill maps (2, 3, 5, 14) for a closed and an open circuit, by slip (see events), and out (N, 3) with the slopes of the laws' force
    by theta, w and j along the motion."""
    h = t[1] - t[0]
    closed, opened = _maps(c, c[TAU], c[A_EMF], h)[0], _maps(c, 0.0, 0.0, h)[0]
    for s in range(3):
        maps[0, s], maps[1, s] = closed[s, 1, 1], opened[s, 1, 1]
    if on[0, 0] + on[1, 0] == 0:
        return
    size = np.zeros(3)
    for k in range(t.size):
        for i in range(3):
            size[i] = max(size[i], abs(path[k, i]))
    for k in range(t.size):
        w = path[k, 1]
        remember(on, p, path[k, 0], w, path[k, 2], h)
        if w == 0.0:
            out[k, 0] = out[k, 1] = out[k, 2] = 0.0
            continue
        s = 1 if w > 0 else -1
        x = (path[k, 0], w, path[k, 2], path[k, 0], 0.0)
        here = _extra(c, on, p, load[k], t[k], x, s)
        step = NUDGE * size[0]
        out[k, 0] = (_extra(c, on, p, load[k], t[k], (x[0] + step, x[1], x[2], x[3], 0.0), s) - here) / step
        step = NUDGE * size[1]
        out[k, 1] = (_extra(c, on, p, load[k], t[k], (x[0], x[1] + s * step, x[2], x[3], 0.0), s) - here) / (s * step)
        step = NUDGE * max(size[2], 1e-9)
        out[k, 2] = (_extra(c, on, p, load[k], t[k], (x[0], x[1], x[2] + step, x[3], 0.0), s) - here) / step


@inlined
def _along(t, u, du, enable, load, y, path, maps, slopes, gain, every, c, on, p, c_2, on_2, p_2, dc, scale, out):
    """See ``_tangent``; ``dc`` is the change of c per unit."""
    h = t[1] - t[0]
    tau, a_emf = c[TAU], c[A_EMF]
    lawful = on[0, 0] + on[1, 0] > 0
    laws = on[2, 0] > 0 or on[1, 0] > 0 and (dc[C_PLUS] != 0.0 or dc[C_MINUS] != 0.0)
    for i in range(p.shape[0]):
        for k in range(p.shape[1]):
            laws = laws or p[i, k] != p_2[i, k]
    for i in range(on.shape[0]):
        for k in range(on.shape[1]):
            laws = laws or on[i, k] != on_2[i, k]
    known, at, towards = 0.0, -1, 0  # the force at the end of the last sample, that sample, and its slip
    low = high = path[0, 0]
    fastest = 0.0
    for k in range(t.size):
        low, high, fastest = min(low, path[k, 0]), max(high, path[k, 0]), max(fastest, abs(path[k, 1]))
    a = b = d = 0.0
    for k in range(t.size):
        out[k, 0], out[k, 1], out[k, 2] = a, b, d
        if k == t.size - 1:
            break
        theta, w, j = path[k, 0], path[k, 1], path[k, 2]
        remember(on, p, theta, w, j, h)
        remember(on_2, p_2, theta, w, j, h)
        theta_1, w_1, j_1 = path[k + 1, 0], path[k + 1, 1], path[k + 1, 2]
        side = 0.0 if c[C_1] <= 0 else (1.0 if theta > c[THETA_0] else (-1.0 if theta < c[THETA_0] else 0.0))
        side_1 = 0.0 if c[C_1] <= 0 else (1.0 if theta_1 > c[THETA_0] else (-1.0 if theta_1 < c[THETA_0] else 0.0))
        cornered = w == 0.0 and c[C_1] > 0 and abs(theta - c[THETA_0]) < CORNER
        if gain > 0.0 and k % every == 0 and y[k] == y[k] and not cornered:
            a *= 1.0 - gain
        if cornered:
            a = dc[THETA_0]
        circuit = 0 if enable[k] else 1
        if enable[k]:
            drive = c[B] * u[k]
            pull = dc[B] * u[k] + c[B] * du[k] - dc[A_EMF] * (theta_1 - theta) / h
            if tau > 0:
                pull -= dc[TAU] * (j_1 - j) / h
        else:
            drive = pull = d = 0.0
        rate_tau, rate_emf = (tau, a_emf) if enable[k] else (0.0, 0.0)
        if w == 0.0 and w_1 == 0.0:
            b = 0.0
            d = pull + (d - pull) * math.exp(-h / rate_tau) if rate_tau > 0 else 0.0
            continue
        s, s_1 = 1 if w > 0 else (-1 if w < 0 else 0), 1 if w_1 > 0 else (-1 if w_1 < 0 else 0)
        x, x_1 = (theta, w, j, theta, 0.0), (theta_1, w_1, j_1, theta_1, 0.0)
        share, ratio, m = 1.0, 1.0, s
        if s == 0:
            m = s_1
            forward = _acceleration(c, on, p, lawful, t[k + 1], x_1, s_1, int(side_1), drive, rate_tau, rate_emf, load[k])
            share = min(1.0, 2.0 * w_1 / (forward * h)) if forward * w_1 > 0 else 1.0
        elif s_1 != s:
            before = _acceleration(c, on, p, lawful, t[k], x, s, int(side), drive, rate_tau, rate_emf, load[k])
            share = min(1.0, -w / (before * h)) if before * w < 0 else 1.0
            if s_1 != 0:
                after = _acceleration(c, on, p, lawful, t[k + 1], x_1, s_1, int(side_1), drive, rate_tau, rate_emf, load[k])
                ratio = min(max(after / before, 0.0), 1.0) if before != 0.0 else 1.0
                m = s if share > 0.5 else s_1
                share = 1.0
        passed = 1.0
        if side_1 != side and theta_1 != theta:
            passed = min(max((c[THETA_0] - theta) / (theta_1 - theta), 0.0), 1.0)
        mean_side = side * passed + side_1 * (1.0 - passed)
        if at == k and towards == m and mean_side == side:
            force = known
        else:
            force = _direct(c, dc, on, p, on_2, p_2, c_2, laws, scale, load[k], t[k], x, m, mean_side)
        force_1 = _direct(c, dc, on, p, on_2, p_2, c_2, laws, scale, load[k], t[k + 1], x_1, m, mean_side)
        if mean_side == side_1:
            known, at, towards = force_1, k + 1, m
        e = maps[circuit, m + 1]
        back = slopes[k, 0] * a + slopes[k, 1] * b + slopes[k, 2] * d
        back_1 = back
        a_1, b_1, d_1 = a, b, d
        for _ in range(2 if lawful else 1):
            f_0, f_1 = force + back, force_1 + back_1 - force - back
            a_1 = e[0, 0] * a + e[0, 1] * b + e[0, 2] * d + e[0, 6] * pull + e[0, 8] * f_0 + e[0, 9] * f_1
            b_1 = e[1, 0] * a + e[1, 1] * b + e[1, 2] * d + e[1, 6] * pull + e[1, 8] * f_0 + e[1, 9] * f_1
            d_1 = e[2, 0] * a + e[2, 1] * b + e[2, 2] * d + e[2, 6] * pull + e[2, 8] * f_0 + e[2, 9] * f_1
            back_1 = slopes[k + 1, 0] * a_1 + slopes[k + 1, 1] * b_1 + slopes[k + 1, 2] * d_1 if s_1 == m else back
        if share < 1.0:
            a_1, b_1 = a + share * (a_1 - a), b + share * (b_1 - b)
        b_1 *= ratio
        if s_1 == 0:
            b_1 = 0.0
        if side_1 != side and side * side_1 < 0.0 and s == s_1:
            passing = 0.5 * abs(w + w_1)
            if passing > 2.0 * c[C_1] * h:
                b_1 -= 2.0 * c[C_1] * (a_1 - dc[THETA_0]) / passing
            else:
                a_1, b_1 = dc[THETA_0], 0.0
        a, b, d = min(max(a_1, -MOST * (high - low)), MOST * (high - low)), min(max(b_1, -MOST * fastest), MOST * fastest), d_1


def _tangent(t, u, du, enable, load, y, path, maps, slopes, gain, every, c, on, p, c_2, on_2, p_2, scale, out):
    """Fill out (N, 3) with the change of (theta, w, j) per unit of the change that made c_2, on_2, p_2 of c, on, p, times ``scale``.

    ``du`` (N,) is the change of the input per unit. The rest as in simulate_kernel, which has made ``path`` (N, >= 3) of it.
    """
    dc = np.zeros(c.size)
    for i in range(c.size):
        if c[i] != c_2[i]:
            dc[i] = (c_2[i] - c[i]) * scale
    _along(t, u, du, enable, load, y, path, maps, slopes, gain, every, c, on, p, c_2, on_2, p_2, dc, scale, out)


TABLE, MAPS = types.float64[:, ::1], types.float64[:, :, :, ::1]

with compiled_cache():
    prepare_kernel = njit(types.void(READ, READ, TABLE, VECTOR, ROWS, LAWS, MAPS, TABLE), nogil=True, cache=True)(_prepare)
    tangent_kernel = njit(types.void(READ, READ, READ, READ_BOOL, READ, READ, TABLE, MAPS, TABLE, types.float64, types.int64, VECTOR, ROWS, LAWS,
                                     VECTOR, ROWS, LAWS, types.float64, TABLE), nogil=True, cache=True)(_tangent)
