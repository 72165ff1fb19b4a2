"""How a motion of one body changes with anything that its model is made of, to first order, without simulating it
again.
 Along a motion (theta, w, j) that the kernel of events.py has made, the change (a, b, d) of the three obeys the same
equations within each mode, driven by what the changed model adds to the forces there. Where the mode changes inside a
sample:

    slip ends        the speed's change ends with it, the angle's stays
    slip begins      the force balance is zero there: nothing jumps
    w passes zero    b is stretched by the accelerations' ratio, after over before
    theta_0 crossed  the preload's jump strikes earlier or later: b loses 2 c_1 (a - d theta_0) / |w|
    caught at theta_0    the angle follows it, from when the preload can stop the rudder within a sample
 A rudder on a bristle (see events.py) has no such instants: its friction is a force that bends, stiff while it holds,
and its change is one more state, stepped implicitly.
 The instants are taken from the states at the ends of the sample, so a column is good to a few per cent: enough for the
steps of a search, which weighs every step by a simulation. One costs about as much as a simulation of the bare plant,
half of one under a law.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from ers_mj.plants.compiled import compiled_cache, inlined
from ers_mj.plants.events import (
    A_1,
    A_EMF,
    A_MINUS,
    A_PLUS,
    BIAS,
    C_1,
    C_MINUS,
    C_PLUS,
    D_BRISTLE,
    DAHL,
    FADE,
    K_BRISTLE,
    LAWS,
    READ,
    READ_BOOL,
    ROWS,
    TAU,
    THETA_0,
    VECTOR,
    B,
    _derivative,
    _extra,
    _fill_map,
    _has_bristle,
    _level,
)
from ers_mj.plants.laws import remember

NUDGE = 1e-6  # of the motion's largest angle, speed and drive: step of a law's slopes
# times the motion's extent and largest speed by which a unit of change may move it: beyond, stick and slip only fork
# otherwise
MOST = 10.0
CORNER = 1e-12  # [output unit] within which a rudder at rest is held in the corner
# of a sample, at which the forces of a bristle's step are taken: beyond the middle, so that what is stiff dies out
AHEAD = 0.6


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
    """Fill maps (2, 3, 5, 14) for a closed and an open circuit, by slip (see events), and out (N, 3) with the slopes of
    the laws' force by theta, w and j along the motion."""
    h = t[1] - t[0]
    if not _has_bristle(c):
        made = np.empty((5, 17))
        maps[:, 1] = 0.0
        for s in (-1, 1):
            _fill_map(made, c, (s, 0, 0, 0, 0), c[TAU], c[A_EMF], h, False)
            maps[0, s + 1] = made[:, :14]
            _fill_map(made, c, (s, 0, 0, 0, 0), 0.0, 0.0, h, False)
            maps[1, s + 1] = made[:, :14]
    if on[0, 0] + on[1, 0] == 0:
        return
    size = np.zeros(3)
    for k in range(t.size):
        for i in range(3):
            size[i] = max(size[i], abs(path[k, i]))
    for k in range(t.size):
        w = path[k, 1]
        remember(on, p, (path[k, 0], w, path[k, 2], path[k, 0], w), h)
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
def _along(t, u, du, enable, load, y, dy, path, maps, slopes, gain, every, c, on, p, c_2, on_2, p_2, dc, scale, out):
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
        remember(on, p, (theta, w, j, theta, w), h)
        remember(on_2, p_2, (theta, w, j, theta, w), h)
        theta_1, w_1, j_1 = path[k + 1, 0], path[k + 1, 1], path[k + 1, 2]
        side = 0.0 if c[C_1] <= 0 else (1.0 if theta > c[THETA_0] else (-1.0 if theta < c[THETA_0] else 0.0))
        side_1 = 0.0 if c[C_1] <= 0 else (1.0 if theta_1 > c[THETA_0] else (-1.0 if theta_1 < c[THETA_0] else 0.0))
        cornered = w == 0.0 and c[C_1] > 0 and abs(theta - c[THETA_0]) < CORNER
        if gain > 0.0 and k % every == 0 and y[k] == y[k] and not cornered:
            a += gain * (dy[k] - a)
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
            forward = _acceleration(
                c, on, p, lawful, t[k + 1], x_1, s_1, int(side_1), drive, rate_tau, rate_emf, load[k]
            )
            share = min(1.0, 2.0 * w_1 / (forward * h)) if forward * w_1 > 0 else 1.0
        elif s_1 != s:
            before = _acceleration(c, on, p, lawful, t[k], x, s, int(side), drive, rate_tau, rate_emf, load[k])
            share = min(1.0, -w / (before * h)) if before * w < 0 else 1.0
            if s_1 != 0:
                after = _acceleration(
                    c, on, p, lawful, t[k + 1], x_1, s_1, int(side_1), drive, rate_tau, rate_emf, load[k]
                )
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
        a, b, d = (
            min(max(a_1, -MOST * (high - low)), MOST * (high - low)),
            min(max(b_1, -MOST * fastest), MOST * fastest),
            d_1,
        )


@inlined
def _fading(c, w):
    """The damping of a bristle at a speed, per total inertia."""
    return c[D_BRISTLE] * math.exp(-((w / c[FADE]) ** 2))


@inlined
def _unbent(c, left, way):
    """What is left of a bristle's share of its level to bend, which was ``left``, after a way counted in the
    displacement of its whole bend.
    """
    if c[DAHL] == 1.0 or left <= 0.0:
        return left * math.exp(-way)
    power = 1.0 - c[DAHL]
    return max(left**power - power * way, 0.0) ** (1.0 / power)


@inlined
def _along_bristle(t, u, du, enable, load, y, dy, path, slopes, gain, every, c, on, p, c_2, on_2, p_2, dc, scale, out):
    """See ``_tangent``: of a rudder on a bristle, whose bend z along the path and its change bent are integrated
    here.
    """
    n, h = t.size, t[1] - t[0]
    lawful, k = on[0, 0] + on[1, 0] > 0, c[K_BRISTLE]
    lawful_2 = on_2[0, 0] + on_2[1, 0] > 0
    low, high, fastest = path[0, 0], path[0, 0], 0.0
    for i in range(n):
        low, high, fastest = min(low, path[i, 0]), max(high, path[i, 0]), max(fastest, abs(path[i, 1]))
    full = 0.5 * (c[C_PLUS] + c[C_MINUS]) / k
    z = min(max(path[0, 1] / math.sqrt(k), -full), full)
    a = b = d = bent = 0.0
    part = AHEAD * h
    for i in range(n):
        out[i, 0], out[i, 1], out[i, 2] = a, b, d
        if i == n - 1:
            break
        theta, w, j = path[i, 0], path[i, 1], path[i, 2]
        theta_1, w_1, j_1 = path[i + 1, 0], path[i + 1, 1], path[i + 1, 2]
        remember(on, p, (theta, w, j, theta, w), h)
        remember(on_2, p_2, (theta, w, j, theta, w), h)
        side = 0.0 if c[C_1] <= 0 else (1.0 if theta > c[THETA_0] else (-1.0 if theta < c[THETA_0] else 0.0))
        side_1 = 0.0 if c[C_1] <= 0 else (1.0 if theta_1 > c[THETA_0] else (-1.0 if theta_1 < c[THETA_0] else 0.0))
        cornered, jump = w == 0.0 and c[C_1] > 0 and abs(theta - c[THETA_0]) < CORNER, 0.0
        if gain > 0.0 and i % every == 0 and y[i] == y[i] and not cornered:
            jump = gain * (y[i] - theta)
            near = min(abs(theta - c[THETA_0]) / max(2.0 * abs(jump), 1e-300), 1.0) if c[C_1] > 0 else 1.0
            a += gain * near * (dy[i] - a)
            jump *= near
        rate, emf, pull = 0.0, 0.0, 0.0
        if enable[i]:
            rate, emf = c[TAU], c[A_EMF]
            pull = dc[B] * u[i] + c[B] * du[i] - dc[A_EMF] * (theta_1 - theta) / h
            if rate > 0:
                pull -= dc[TAU] * (j_1 - j) / h
        if cornered:
            a, b = dc[THETA_0], 0.0
            if w_1 == 0.0:
                d = pull + (d - pull) * math.exp(-h / rate) if rate > 0 else 0.0
                continue
        way = theta_1 - theta - jump
        s = 1 if way > 0 else -1
        x = (0.5 * (theta + theta_1), 0.5 * (w + w_1), 0.5 * (j + j_1), 0.5 * (theta + theta_1), 0.0)
        level = _level(c, on, p, lawful, x, float(s))
        level_2 = _level(c_2, on_2, p_2, lawful_2, x, float(s))
        unbent = _unbent(c, 1.0 - s * k * z / level, k * abs(way) / level)
        z_1 = s * level / k * (1.0 - unbent)
        bends = (z_1 - z) / way if abs(way) > 0.0 else 1.0
        z_mean = 0.5 * (z + z_1)
        left = 1.0 - s * k * z_mean / level
        lets_go = abs(way) / h * k / level * (1.0 if c[DAHL] == 1.0 else c[DAHL] * abs(left) ** (c[DAHL] - 1.0))
        grows = lets_go * z_mean * ((level_2 - level) * scale / level - dc[K_BRISTLE] / k)
        if dc[DAHL] != 0.0 and left > 0.0:
            grows += dc[DAHL] * way / h * left ** c[DAHL] * math.log(left)
        passed = 1.0
        if side_1 != side and theta_1 != theta:
            passed = min(max((c[THETA_0] - theta) / (theta_1 - theta), 0.0), 1.0)
        viscous, more = (c[A_PLUS], dc[A_PLUS]) if s > 0 else (c[A_MINUS], dc[A_MINUS])
        damping = _fading(c, x[1])
        force = (
            dc[BIAS]
            + dc[A_1] * (c[THETA_0] - x[0])
            + c[A_1] * dc[THETA_0]
            - dc[C_1] * (side * passed + side_1 * (1.0 - passed))
            - more * x[1]
            - dc[K_BRISTLE] * z_mean
            - (_fading(c_2, x[1]) - damping) * scale * (z_1 - z) / h
        )
        if lawful or lawful_2:
            force += (
                _extra(c_2, on_2, p_2, load[i], t[i] + 0.5 * h, x, s) - _extra(c, on, p, load[i], t[i] + 0.5 * h, x, s)
            ) * scale
        bent_0, per_speed = (bent + part * grows) / (1.0 + part * lets_go), part * bends / (1.0 + part * lets_go)
        drawn, back = (
            (pull, -emf)
            if rate <= 0
            else ((d + part / rate * pull) / (1.0 + part / rate), -part / rate * emf / (1.0 + part / rate))
        )
        spring, share = c[A_1] - slopes[i, 0], 1.0 + slopes[i, 2]
        b_m = (b / part + force - spring * a + share * drawn - k * bent_0 - damping * (bent_0 - bent) / part) / (
            1.0 / part
            + spring * part
            + viscous
            - slopes[i, 1]
            - share * back
            + k * per_speed
            + damping * per_speed / part
        )
        a_1, b_1 = a + h * b_m, b + (b_m - b) / AHEAD
        d = drawn + back * b_m if rate <= 0 else d + (drawn + back * b_m - d) / AHEAD
        bent += (bent_0 + per_speed * b_m - bent) / AHEAD
        if side_1 != side and side * side_1 < 0.0:
            passing = 0.5 * abs(w + w_1)
            if passing > 2.0 * c[C_1] * h:
                b_1 -= 2.0 * c[C_1] * (a_1 - dc[THETA_0]) / passing
            else:
                a_1, b_1 = dc[THETA_0], 0.0
        a, b = min(max(a_1, -MOST * (high - low)), MOST * (high - low)), min(max(b_1, -MOST * fastest), MOST * fastest)
        z = z_1


def _tangent(t, u, du, enable, load, y, dy, path, maps, slopes, gain, every, c, on, p, c_2, on_2, p_2, scale, out):
    """Fill out (N, >= 3) with the change of (theta, w, j) per unit of the change that made c_2, on_2, p_2 of c, on, p,
    times ``scale``.

    ``du`` (N,) and ``dy`` (N,) are the changes per unit of the input and of what an observer follows. The rest as in
    simulate_kernel, which has made ``path`` (N, >= 3) of it.
    """
    dc = np.zeros(c.size)
    for i in range(c.size):
        if c[i] != c_2[i]:
            dc[i] = (c_2[i] - c[i]) * scale
    if _has_bristle(c):
        _along_bristle(
            t, u, du, enable, load, y, dy, path, slopes, gain, every, c, on, p, c_2, on_2, p_2, dc, scale, out
        )
    else:
        _along(t, u, du, enable, load, y, dy, path, maps, slopes, gain, every, c, on, p, c_2, on_2, p_2, dc, scale, out)


TABLE, MAPS = types.float64[:, ::1], types.float64[:, :, :, ::1]

with compiled_cache():
    prepare_kernel = njit(types.void(READ, READ, TABLE, VECTOR, ROWS, LAWS, MAPS, TABLE), nogil=True, cache=True)(
        _prepare
    )
    tangent_kernel = njit(
        types.void(
            READ,
            READ,
            READ,
            READ_BOOL,
            READ,
            READ,
            READ,
            TABLE,
            MAPS,
            TABLE,
            types.float64,
            types.int64,
            VECTOR,
            ROWS,
            LAWS,
            VECTOR,
            ROWS,
            LAWS,
            types.float64,
            TABLE,
        ),
        nogil=True,
        cache=True,
    )(_tangent)
