"""Whether a step from x to z, made as if nothing happened on the way, holds an event that its ends do not show."""

from __future__ import annotations

import math

from ers_mj.plants.compiling.compiled import inline, unit
from ers_mj.plants.kernel.events import STOP, breakaway, violation
from ers_mj.plants.kernel.forces import derivative
from ers_mj.plants.kernel.state import C, F, L, M, X, has_bristle, never_sticks

STILL = 5e-5  # share of a bristle's friction within which its rudder rests
# share of a speed, or of a twist's distance to the ends of the play, that a leap over a whole sample must leave
CALM = 0.2


@inline
def _grazes(c, x, z, m, h):
    """True where a rudder on a bristle may have crossed theta_0 and come back between x and z."""
    inwards, outwards = -m.side * x.w, m.side * z.w
    if c.c_1 <= 0 or m.s == 0 or inwards <= 0 or outwards <= 0:
        return False
    return m.side * (x.theta - c.theta_0) < inwards * h * inwards / (inwards + outwards)


@inline
def is_still(c, t, x, m, drive, tau, a_emf):
    """Whether a rudder on a bent bristle rests: in the corner, or within STILL of the bristle's whole bend from where
    it would.
    """
    if m.s == 0:
        return x.w == 0.0 and breakaway(c, t, x, m) <= 0
    small = STILL * (c.c_2_plus + c.c_2_minus)
    return abs(x.w) * math.sqrt(c.k_bristle) < small and abs(derivative(c, t, x, m, drive, tau, a_emf).w) < small


@inline
def linear_part(c, m):
    """(constant, stiffness, damping) of a slipping body's acceleration beside that of its drive and of laws."""
    a_mech, level = (c.a_mech_plus, c.c_2_plus) if m.s > 0 else (c.a_mech_minus, c.c_2_minus)
    return c.bias + c.a_1 * c.theta_0 - c.c_1 * m.side - level * m.s, c.a_1, a_mech


@inline
def may_turn(x, z, s, a, h):
    """Whether ``turns`` is to be asked of a step from x to z: where the speed comes down to a fifth, or is braked so
    much at first, by the acceleration ``a``, that a straight fall would end within h.
    """
    return abs(z.w) < CALM * abs(x.w) or abs(x.w) < -a * s * h


@unit(L(C, F, X, X, M, F, F, F, F))
def turns(c, t, x, z, m, drive, tau, a_emf, h):
    """True where a slipping body may have stopped and gone on within the step from x to z: it brakes first, speeds up
    last.
    """
    if has_bristle(c):
        return _grazes(c, x, z, m, h)
    if m.s == 0 or never_sticks(c):
        return False
    brakes = derivative(c, t, x, m, drive, tau, a_emf).w * m.s
    if not (brakes < 0.0 and abs(z.w) < -brakes * h):
        return False
    return derivative(c, t + h, z, m, drive, tau, a_emf).w * m.s > 0.0


@unit(L(C, F, X, X, M, F, F, F))
def is_clean(c, t, x, z, m, tau, load, h):
    """Whether the state z, h after x, lies within the mode of two bodies."""
    bias = c.bias
    c.bias = bias + load
    clean = not (has_bristle(c) and _grazes(c, x, z, m, h))
    for event in range(7):
        clean = clean and violation(event, c, t + h, z, m) <= 0
    if tau <= 0:
        clean = clean and breakaway(c, t, x, m) <= 0
    c.bias = bias
    return clean


@inline
def is_free(c, t, x, m):
    """Whether no stop moves: none is touched, or one body at rest leans on it."""
    return m.stop == 0 or (m.s == 0 and c.two_body <= 0 and violation(STOP, c, t, x, m) <= 0.0)


@inline
def is_calm(c, x, h):
    """Whether the twist of two bodies is further from the ends of the play than it moves within h."""
    return c.gap <= 0 or abs(x.w_m - x.w) * h <= CALM * abs(abs(x.theta_m - x.theta) - c.gap)


@inline
def is_steady(x, z):
    """Whether neither body comes near rest between the states x and z."""
    return abs(z.w) >= CALM * abs(x.w) and abs(z.w_m) >= CALM * abs(x.w_m)
