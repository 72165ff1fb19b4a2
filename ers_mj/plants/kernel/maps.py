"""The flow over a whole segment of a sample as one precomputed map. What laws add enters it as a force that is a
parabola in time, through three evaluations (an exponential integrator); what a shaft that hardens adds goes the same
way.
"""

from __future__ import annotations

import numpy as np

from ers_mj.plants.compiling.compiled import compiled, inline, inline_as, unit
from ers_mj.plants.kernel.flow import NONE, flow, linear, parabola
from ers_mj.plants.kernel.forces import TRIPLE, beside, extra
from ers_mj.plants.kernel.state import C, F, L, M, Mode, N, State, X, bends, has_bristle, types

# columns of a map: x, a constant, the drive, the side, then a force as a parabola 1, s, s^2 on the rudder, between the
# bodies, on the motor
CONSTANT, DRIVE, SIDE = range(5, 8)
ON_RUDDER, BETWEEN, ON_MOTOR, COLUMNS = range(8, 18, 3)
MODES_APART = 27  # of s, s_m and twist
MAPS = F[:, :, ::1]  # (54, 5, 17), see no_maps


@inline
def _add_parabola(e, n, column, c, m, tau, a_emf, h, of_rudder, of_motor):
    """Fill in what a force as 1, s, s^2 (s = t/h) does over h, so much of it on the rudder and on the motor."""
    zero = State(0.0, 0.0, 0.0, 0.0, 0.0)
    for k in range(3):
        f = (1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0)
        r = (of_motor * f[0], of_motor * f[1], of_motor * f[2])
        f = (of_rudder * f[0], of_rudder * f[1], of_rudder * f[2])
        z = linear(c, zero, m, 0.0, tau, a_emf, h, 0.0, f, r)
        for i in range(5):
            e[n, i, column + k] = z[i]


@inline
def _one(k):
    """1 in entry k of a state."""
    return State(
        1.0 if k == 0 else 0.0,
        1.0 if k == 1 else 0.0,
        1.0 if k == 2 else 0.0,
        1.0 if k == 3 else 0.0,
        1.0 if k == 4 else 0.0,
    )


@unit(types.void(MAPS, N, C, M, F, F, F, L))
def fill_map(e, n, c, m, tau, a_emf, h, driven):
    """The exact map over h in a mode with side 0: e[n] (5, 17), columns x (5), constant, drive, side, force on the
    rudder 1, s, s^2 (s = t/h), the same of a force between the two bodies where their shaft hardens, and of one on the
    motor where it is ``driven`` by laws.
    """
    zero = State(0.0, 0.0, 0.0, 0.0, 0.0)
    base = linear(c, zero, m, 0.0, tau, a_emf, h, 1.0, NONE, NONE)
    pull = linear(c, zero, m, 1.0, tau, a_emf, h, 1.0, NONE, NONE)
    for k in range(5):
        z = linear(c, _one(k), m, 0.0, tau, a_emf, h, 0.0, NONE, NONE)
        for i in range(5):
            e[n, i, k] = z[i]
    for i in range(5):
        e[n, i, CONSTANT], e[n, i, DRIVE] = base[i], pull[i] - base[i]
        for k in range(ON_RUDDER, COLUMNS):
            e[n, i, k] = 0.0
    if m.s != 0:
        _add_parabola(e, n, ON_RUDDER, c, m, tau, a_emf, h, 1.0, 0.0)
    if c.harden > 0:
        _add_parabola(e, n, BETWEEN, c, m, tau, a_emf, h, 1.0, -1.0)
    if driven and m.s_m != 0:
        _add_parabola(e, n, ON_MOTOR, c, m, tau, a_emf, h, 0.0, 1.0)
    for i in range(5):
        e[n, i, SIDE] = -c.c_1 * e[n, i, ON_RUDDER]


@compiled
def no_maps():
    """Room (54, 5, 17) for the maps over a step and over half of it in every mode away from the stops. NaN: not made
    yet, since most modes are never met, and half steps only under laws.
    """
    e = np.empty((2 * MODES_APART, 5, COLUMNS))
    for n in range(2 * MODES_APART):
        e[n, 0, 0] = np.nan
    return e


@inline
def number(m):
    """Of the map over a step in the mode m; that over half of it lies MODES_APART further."""
    return 9 * (m.s + 1) + 3 * (m.s_m + 1) + m.twist + 1


@inline
def made(e, n, c, m, tau, a_emf, step, driven):
    """Fill in the map n over a step in the mode m, where it was not made before."""
    if e[n, 0, 0] != e[n, 0, 0]:
        fill_map(e, n, c, Mode(m.s, 0, 0, m.s_m, m.twist), tau, a_emf, step, driven)


@inline
def map_of(e, c, m, step):
    """Number of the map over a step of one body in the mode m, made where it was not before."""
    n = number(m)
    made(e, n, c, m, c.tau_e, c.a_emf, step, False)
    return n


@inline_as(F(MAPS, N, N, X, F, N, TRIPLE))
def _row(e, n, i, x, drive, side, f):
    return (
        e[n, i, 0] * x.theta
        + e[n, i, 1] * x.w
        + e[n, i, 2] * x.j
        + e[n, i, CONSTANT]
        + e[n, i, DRIVE] * drive
        + e[n, i, SIDE] * side
        + e[n, i, ON_RUDDER] * f[0]
        + e[n, i, ON_RUDDER + 1] * f[1]
        + e[n, i, ON_RUDDER + 2] * f[2]
    )


@inline
def _mapped_one(e, n, x, drive, side, f):
    """The state of one body after a map, under the force f (3,), a parabola of s from 0 to 1."""
    return State(
        _row(e, n, 0, x, drive, side, f),
        _row(e, n, 1, x, drive, side, f),
        _row(e, n, 2, x, drive, side, f),
        x.theta_m,
        x.w_m,
    )


@inline_as(F(MAPS, N, N, X, F, N, TRIPLE))
def _row_of_two(e, n, i, x, drive, side, f):
    return _row(e, n, i, x, drive, side, f) + e[n, i, 3] * x.theta_m + e[n, i, 4] * x.w_m


@inline
def _mapped_two(e, n, x, drive, side, f):
    """The same of two bodies."""
    return State(
        _row_of_two(e, n, 0, x, drive, side, f),
        _row_of_two(e, n, 1, x, drive, side, f),
        _row_of_two(e, n, 2, x, drive, side, f),
        _row_of_two(e, n, 3, x, drive, side, f),
        _row_of_two(e, n, 4, x, drive, side, f),
    )


@inline_as(types.UniTuple(F, 2)(MAPS, N, N, TRIPLE, TRIPLE))
def _pushed(e, n, i, q, r):
    """What a force q (3,) between the bodies and then one r (3,) on the motor add to x_i."""
    between = e[n, i, BETWEEN] * q[0] + e[n, i, BETWEEN + 1] * q[1] + e[n, i, BETWEEN + 2] * q[2]
    return between, e[n, i, ON_MOTOR] * r[0] + e[n, i, ON_MOTOR + 1] * r[1] + e[n, i, ON_MOTOR + 2] * r[2]


@unit(X(MAPS, N, X, F, N, TRIPLE, TRIPLE, TRIPLE))
def _mapped_parted(e, n, x, drive, side, f, q, r):
    """The same of two bodies under the force f on the rudder, q between the two, of a shaft that hardens, and r on the
    motor.
    """
    z = _mapped_two(e, n, x, drive, side, f)
    (t_q, t_r), (w_q, w_r), (j_q, j_r) = _pushed(e, n, 0, q, r), _pushed(e, n, 1, q, r), _pushed(e, n, 2, q, r)
    (tm_q, tm_r), (wm_q, wm_r) = _pushed(e, n, 3, q, r), _pushed(e, n, 4, q, r)
    return State(z.theta + t_q + t_r, z.w + w_q + w_r, z.j + j_q + j_r, z.theta_m + tm_q + tm_r, z.w_m + wm_q + wm_r)


@inline
def _rising(begin, middle):
    """(3,) of a force that goes on as it began."""
    return begin, 2.0 * (middle - begin), 0.0


@inline
def _constant(force):
    return force, 0.0, 0.0


@inline
def one_body_segment(e, step, c, t, x, m, drive, tau, a_emf, load, h, extra_now):
    """The state of one body that slips a whole segment later if no event falls into it, and what the laws add there;
    ``extra_now`` is what they add at its beginning (NaN: unknown). ``e`` holds maps over a ``step`` (see no_maps).
    """
    n = number(m)
    made(e, n, c, m, tau, a_emf, step, False)
    if c.lawful == 0:
        return _mapped_one(e, n, x, drive, m.side, _constant(load)), np.nan
    made(e, n + MODES_APART, c, m, tau, a_emf, step / 2, False)
    begin = load + (extra_now if extra_now == extra_now else extra(c, load, t, x, m.s))
    z = _mapped_one(e, n + MODES_APART, x, drive, m.side, _constant(begin))
    middle = load + extra(c, load, t + 0.5 * h, z, m.s)
    end = extra(c, load, t + h, _mapped_one(e, n, x, drive, m.side, _rising(begin, middle)), m.s)
    return _mapped_one(e, n, x, drive, m.side, parabola(begin, middle, load + end)), end


@unit(X(MAPS, N, C, F, X, M, F, F, F))
def _parted_segment(e, n, c, t, x, m, drive, load, h):
    """The same of motor and rudder under laws, or on a shaft that hardens."""
    f, q, r = beside(c, load, t, x, m)
    z = _mapped_parted(e, n + MODES_APART, x, drive, m.side, _constant(f), _constant(q), _constant(r))
    f_a, q_a, r_a = beside(c, load, t + 0.5 * h, z, m)
    z = _mapped_parted(e, n, x, drive, m.side, _rising(f, f_a), _rising(q, q_a), _rising(r, r_a))
    f_b, q_b, r_b = beside(c, load, t + h, z, m)
    f, q, r = parabola(f, f_a, f_b), parabola(q, q_a, q_b), parabola(r, r_a, r_b)
    return _mapped_parted(e, n, x, drive, m.side, f, q, r)


@unit(X(MAPS, N, C, F, X, M, F, F, F))
def _bristle_segment(e, n, c, t, x, m, drive, load, h):
    """The same on a bristle bent to the full that slips under laws."""
    begin = load + extra(c, load, t, x, m.s)
    middle = load + extra(
        c, load, t + 0.5 * h, _mapped_two(e, n + MODES_APART, x, drive, m.side, _constant(begin)), m.s
    )
    z = _mapped_two(e, n, x, drive, m.side, _rising(begin, middle))
    end = load + extra(c, load, t + h, z, m.s)
    return _mapped_two(e, n, x, drive, m.side, parabola(begin, middle, end))


@unit(X(MAPS, F, C, F, X, M, F, F, F, F, F))
def two_body_segment(e, step, c, t, x, m, drive, tau, a_emf, load, h):
    """As ``one_body_segment``, of two bodies or a rudder on a bristle."""
    if bends(c, m):
        bias = c.bias
        c.bias = bias + load
        z = flow(c, t, x, m, drive, tau, a_emf, h)
        c.bias = bias
        return z
    driven = c.lawful > 0 and not has_bristle(c)
    n = number(m)
    made(e, n, c, m, tau, a_emf, step, driven)
    if (c.lawful == 0 and (has_bristle(c) or c.harden <= 0)) or (has_bristle(c) and m.s == 0):
        return _mapped_two(e, n, x, drive, m.side, _constant(load))
    made(e, n + MODES_APART, c, m, tau, a_emf, step / 2, driven)
    if has_bristle(c):
        return _bristle_segment(e, n, c, t, x, m, drive, load, h)
    return _parted_segment(e, n, c, t, x, m, drive, load, h)
