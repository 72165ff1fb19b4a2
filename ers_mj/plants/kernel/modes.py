"""The mode that fits a state: of a start, and after an observer has moved the angle."""

from __future__ import annotations

import math

from ers_mj.plants.compiling.compiled import inline, unit
from ers_mj.plants.kernel.forces import held_rudder, motor_friction
from ers_mj.plants.kernel.state import C, F, M, Mode, State, X, has_bristle, is_parted, never_sticks, types


@inline
def sign(x):
    """-1, 0 or 1."""
    return 1 if x > 0 else (-1 if x < 0 else 0)


@inline
def _stop_touched(c, theta):
    return 1 if theta > c.upper else (-1 if theta < c.lower else 0)


@inline
def _twist_of(c, x):
    """Contact of the two bodies."""
    if c.two_body <= 0:
        return 0
    if c.gap <= 0:
        return 1
    return sign(x.theta_m - x.theta) if abs(x.theta_m - x.theta) > c.gap else 0


@unit(M(C, X))
def start_mode(c, x):
    """The mode that fits an initial state."""
    side = 0
    if c.c_1 > 0:
        side = sign(x.theta - c.theta_0)
        if side == 0:
            side = sign(x.w)
    stop = _stop_touched(c, x.theta)
    if has_bristle(c):
        return Mode(0 if c.c_1 > 0 and side == 0 else 1, side, stop, 0, 1)
    s = 1 if never_sticks(c) else sign(x.w)
    s_m = 1 if c.two_body > 0 and motor_friction(c) <= 0 else sign(x.w_m)
    return Mode(s, side, stop, s_m, _twist_of(c, x))


@inline
def start_state(c, theta, w, j, twist, over, friction):
    """The motor's side ahead by a ``twist`` and turning faster by ``over``; a bristle bent by as much as a motion of
    this speed would have left it, at most by what its ``friction`` bends it.
    """
    if has_bristle(c):
        slip = friction / c.k_bristle
        return State(theta, w, j, theta - min(max(w / math.sqrt(c.k_bristle), -slip), slip), 0.0)
    if is_parted(c):
        return State(theta, w, j, theta + twist, w + over)
    return State(theta, w, j, theta, 0.0)


@unit(types.Tuple((X, M))(C, F, X, M, F))
def corrected(c, t, x, m, jump):
    """The state after the observer has moved the angle by ``jump`` (both bodies), unless the corner holds it.

    On a bristle a rudder bounces in the corner, out of sight, before it rests: there it is moved the less the nearer it
    is, so that nothing hangs on where in its bounce a sample finds it.
    """
    if c.c_1 > 0 and has_bristle(c):
        jump *= min(1.0, abs(x.theta - c.theta_0) / max(2.0 * abs(jump), 1e-300))
    theta = x.theta + jump
    side = 0
    if c.c_1 > 0:
        side = 1 if theta > c.theta_0 else -1
        if m.s == 0 and m.side * side < 0:  # a rudder at rest is not pushed through the corner, which throws it back
            theta, side = c.theta_0, 0
            jump = theta - x.theta
    z = State(theta, x.w, x.j, x.theta_m + jump, x.w_m)
    m_z = Mode(m.s, side, _stop_touched(c, theta), m.s_m, m.twist)
    if m.s == 0 and m.side == 0 and c.c_1 > 0:
        a, up, down = held_rudder(c, t, z, m_z)
        if a > up or a < -down:
            return x, m
    return z, m_z
