"""Events: where a mode's inequality fails. The instant is found on the flow itself, every switch of a Sgn exactly."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ers_mj.plants.compiling.compiled import inline, unit
from ers_mj.plants.kernel.flow import flow
from ers_mj.plants.kernel.forces import bristle_level, held_motor, held_rudder, motor_friction
from ers_mj.plants.kernel.series import expanded
from ers_mj.plants.kernel.state import C, F, M, Mode, N, State, X, has_bristle, never_sticks, types

# events, speeds first: between their zeros angles are monotone, so that later events have one root
REVERSAL, CROSSING, STOP, BREAKAWAY, MOTOR_REVERSAL, CONTACT, MOTOR_BREAKAWAY = range(7)
ORDER = (REVERSAL, MOTOR_REVERSAL, CROSSING, STOP, BREAKAWAY, CONTACT, MOTOR_BREAKAWAY)
CREPT = 1e-12  # share of its friction by which a motor that has crept to rest may be pulled further
FULL = 1.0 - 1e-4  # share of its friction's level at which a bristle counts as bent to the full


@inline
def _push(depth, rate, stiffness, damping):
    """A contact's force over its stiffness: the contact pushes where this is positive, and never pulls."""
    return depth + damping / stiffness * rate if stiffness > 0 else depth


@inline
def _touch(depth, rate, stiffness, damping):
    """Positive where two bodies that are apart touch: one is inside the other and does not leave it faster than the
    spring follows.
    """
    return min(depth, _push(depth, rate, stiffness, damping))


@inline
def _stop_violation(c, x, m):
    """Positive where a stop is touched, or lets go."""
    if m.stop == 0:
        above = _touch(x.theta - c.upper, x.w, c.k_stop, c.d_stop)
        return max(above, _touch(c.lower - x.theta, -x.w, c.k_stop, c.d_stop))
    depth = x.theta - c.upper if m.stop > 0 else c.lower - x.theta
    return -_push(depth, m.stop * x.w, c.k_stop, c.d_stop)


@inline
def breakaway(c, t, x, m):
    """Positive where more than its friction pulls at a rudder at rest."""
    if m.s != 0:
        return -1.0
    a, up, down = held_rudder(c, t, x, m)
    return max(a - up, -a - down)


@inline
def _contact_violation(c, x, m):
    """Positive where the two bodies meet within the play, or part."""
    if c.gap <= 0:
        return -1.0
    side = m.twist if m.twist != 0 else (1 if x.theta_m > x.theta else -1)
    depth, rate = side * (x.theta_m - x.theta) - c.gap, side * (x.w_m - x.w)
    if m.twist == 0:
        return _touch(depth, rate, c.k_twist, c.d_twist)
    return -_push(depth, rate, c.k_twist, c.d_twist)


@inline
def _bristle_violation(e, c, x, m):
    """Event function of the bristle: a reversal ends its slip; bent to the full, which is the motor's breakaway here,
    begins it.
    """
    if e == CONTACT or (e == MOTOR_REVERSAL) != (m.s_m != 0):
        return -1.0
    if e == MOTOR_REVERSAL:
        return -m.s_m * x.w
    pull = c.k_bristle * (x.theta - x.theta_m)
    if pull * x.w <= 0.0 or c.frictions > 0:
        return -1.0
    return abs(pull) - FULL * bristle_level(c, x, 1.0 if x.w > 0 else -1.0)


@inline
def _motor_violation(e, c, t, x, m):
    """Event function of the motor's side."""
    if c.rho <= 0:
        return _bristle_violation(e, c, x, m)
    if e == MOTOR_REVERSAL:
        return -m.s_m * x.w_m if m.s_m != 0 and motor_friction(c) > 0 else -1.0
    if e == CONTACT:
        return _contact_violation(c, x, m)
    if m.s_m != 0:
        return -1.0
    a, level = held_motor(c, t, x, m)
    return abs(a) - level * (1.0 + CREPT)


@inline
def violation(e, c, t, x, m):
    """Event function e: positive where the mode's inequality fails."""
    if e == REVERSAL:
        return -m.s * x.w if m.s != 0 and not has_bristle(c) and not never_sticks(c) else -1.0
    if e == CROSSING:
        return -m.side * (x.theta - c.theta_0) if m.s != 0 else -1.0
    if e == STOP:
        return _stop_violation(c, x, m)
    if e == BREAKAWAY:
        return breakaway(c, t, x, m)
    return _motor_violation(e, c, t, x, m) if c.two_body > 0 else -1.0


@inline
def direction_from_rest(a, up, down):
    """Slip direction of a body at rest: 0 within its friction."""
    if a > up:
        return 1
    return -1 if a < -down else 0


@inline
def _after_rest(e, c, t, x, m):
    """State and mode of a rudder just after it has come to rest, or broken away."""
    x = State(x.theta, 0.0, x.j, x.theta_m, x.w_m)
    side = 0 if c.c_1 > 0 and abs(x.theta - c.theta_0) < 1e-12 else m.side
    a, up, down = held_rudder(c, t, x, Mode(0, side, m.stop, m.s_m, m.twist))
    s = direction_from_rest(a, up, down) if e == REVERSAL else (1 if a - up > -a - down else -1)
    if side == 0 and c.c_1 > 0 and s != 0:
        side = s
    return x, Mode(1 if has_bristle(c) else s, side, m.stop, m.s_m, m.twist)


@inline
def _after_crossing(c, t, x, m, corner):
    """The same after it has reached theta_0: slower than ``corner`` it is caught there where its friction holds it."""
    x = State(c.theta_0, x.w, x.j, x.theta_m, x.w_m)
    if abs(x.w) < corner:
        a, up, down = held_rudder(c, t, x, Mode(0, 0, m.stop, m.s_m, m.twist))
        if direction_from_rest(a, up, down) == 0:
            return State(c.theta_0, 0.0, x.j, x.theta_m, x.w_m), Mode(0, 0, m.stop, m.s_m, m.twist)
    return x, Mode(m.s, 1 if x.w > 0 else -1, m.stop, m.s_m, m.twist)


@inline
def _stop_met(c, theta):
    """Which stop a rudder has just touched."""
    if c.upper == np.inf:
        return -1
    return 1 if theta > 0.5 * (c.upper + c.lower) or c.lower == -np.inf else -1


@inline
def _after_motor(e, c, t, x, m):
    """State and mode after the motor's side, or a bristle, has come to rest or broken away."""
    if has_bristle(c):
        if e == MOTOR_REVERSAL:
            foot = x.theta - m.s_m * bristle_level(c, x, float(m.s_m)) / c.k_bristle
            return State(x.theta, x.w, x.j, foot, x.w_m), Mode(m.s, m.side, m.stop, 0, m.twist)
        return x, Mode(m.s, m.side, m.stop, 1 if x.w > 0 else -1, m.twist)
    x = State(x.theta, x.w, x.j, x.theta_m, 0.0)
    a, level = held_motor(c, t, x, m)
    s_m = direction_from_rest(a, level, level) if e == MOTOR_REVERSAL else (1 if a > 0 else -1)
    return x, Mode(m.s, m.side, m.stop, s_m, m.twist)


@unit(types.Tuple((X, M))(N, C, F, X, M, F))
def switch(e, c, t, x, m, corner):
    """State and mode just after event e."""
    if e == REVERSAL or e == BREAKAWAY:
        return _after_rest(e, c, t, x, m)
    if e == CROSSING:
        return _after_crossing(c, t, x, m, corner)
    if e == STOP:
        return x, Mode(m.s, m.side, _stop_met(c, x.theta) if m.stop == 0 else 0, m.s_m, m.twist)
    if e == MOTOR_REVERSAL or e == MOTOR_BREAKAWAY:
        return _after_motor(e, c, t, x, m)
    side = 1 if x.theta_m > x.theta else -1
    return x, Mode(m.s, m.side, m.stop, m.s_m, side if m.twist == 0 else 0)


class Along(NamedTuple):
    """An expansion of the flow: its span [s], 0 where there is none, and how far into it a state lies."""

    span: float
    begun: float


ALONG = types.NamedUniTuple(F, 2, Along)


@inline
def state_after(c, t, x, m, drive, tau, a_emf, along, h):
    """The state h after x, which lies along an expansion where there is one."""
    if along.span > 0.0:
        return expanded(c, drive, tau, a_emf, (along.begun + h) / along.span)
    return flow(c, t, x, m, drive, tau, a_emf, h)


@inline
def _narrow(e, c, t, x, m, drive, tau, a_emf, along, dt):
    """(where event function e is negative within dt, its value there), 0 and one not below 0 where it is nowhere.

    A body that has just been released starts on the root that it left; the search then begins where it moves.
    """
    low, g_low = 0.0, violation(e, c, t, x, m)
    while g_low >= 0.0:
        low = 0.5 * dt if low == 0.0 else 0.5 * low
        is_speed = e == REVERSAL or e == MOTOR_REVERSAL
        of_bristle = has_bristle(c) and (e == CROSSING or e == MOTOR_BREAKAWAY)
        if not (is_speed or of_bristle) or low < dt / 200:
            return 0.0, g_low
        z = state_after(c, t, x, m, drive, tau, a_emf, along, low)
        g_low = violation(e, c, t + low, z, m)
    return low, g_low


@inline
def _kept(ratio):
    """Share of the value at an end of a bracket to go on with where the other end has moved twice (Anderson and Bjorck,
    BIT 13, 1973).
    """
    return 1.0 - ratio if ratio < 1.0 else 0.5


@unit(types.Tuple((F, X))(N, C, F, X, M, F, F, F, ALONG, F, F))
def locate(e, c, t, x, m, drive, tau, a_emf, along, dt, g_end):
    """First instant in (0, dt] where event function e vanishes (the method of Anderson and Bjorck on the flow), and the
    state there, just beyond: short of it a contact would be lost again as soon as it is made.
    """
    low, g_low = _narrow(e, c, t, x, m, drive, tau, a_emf, along, dt)
    if g_low >= 0.0:
        return 0.0, x
    high, g_high, side = dt, g_end, 0
    for _ in range(60):
        at = high - g_high * (high - low) / (g_high - g_low)
        z = state_after(c, t, x, m, drive, tau, a_emf, along, at)
        g = violation(e, c, t + at, z, m)
        if 0.0 <= g <= 1e-11 * g_end:
            return at, z
        if g > 0:
            if side == 1:
                g_low *= _kept(g / g_high)
            high, g_high, side = at, g, 1
        else:
            if side == -1:
                g_high *= _kept(g / g_low)
            low, g_low, side = at, g, -1
        if high - low < 1e-14:
            break
    return high, state_after(c, t, x, m, drive, tau, a_emf, along, high)
