"""Through the samples in which nothing happens: one body without laws that slips, or rests, from sample to sample.

The same numbers as the segments of event_integrator, in the same order, without what only events, laws, a second body,
a delay or a stop need. At the first sample that may hold an event the way ends, at its beginning.
"""

from __future__ import annotations

import math

from ers_mj.plants.compiling.compiled import inline, unit
from ers_mj.plants.kernel.checks import linear_part, may_turn, turns
from ers_mj.plants.kernel.cuts import CUTS
from ers_mj.plants.kernel.events import direction_from_rest
from ers_mj.plants.kernel.forces import stop_force
from ers_mj.plants.kernel.maps import CONSTANT, DRIVE, MAPS, ON_RUDDER, SIDE, map_of
from ers_mj.plants.kernel.state import (
    READ,
    READ_BOOL,
    TABLE,
    C,
    L,
    M,
    N,
    State,
    X,
    has_bristle,
    is_bounded,
    types,
    with_drive,
)


@inline
def is_plain(c, cuts):
    """Whether samples can be gone through so: a sample is one segment of a motion without laws of one body."""
    return c.lawful == 0 and c.memories == 0 and c.two_body <= 0 and cuts.ends.size == 1 and c.fall <= 0


@inline
def _is_usual(t, enable, cuts, k):
    return enable[k] and abs(t[k + 1] - t[k] - cuts.h0) < 1e-6 * cuts.h0


@inline
def written(out, k, c, x):
    """Fill in row k of what is told of a motion."""
    out[k, 0], out[k, 1], out[k, 2], out[k, 3] = x.theta, x.w, x.j, x.theta if has_bristle(c) else x.theta_m


@unit(types.Tuple((N, X))(READ, READ, READ_BOOL, READ, C, CUTS, MAPS, N, N, X, M, L, TABLE))
def slips_on(t, u, enable, load, c, cuts, maps, k, last, x, m, slips, out):
    """(sample, state at its beginning) to which a body goes on slipping from sample k, ``last`` at most; the states at
    the samples between go into ``out`` (N, 4).
    """
    n = map_of(maps, c, m, cuts.h0)
    a_t, a_w, a_j = maps[n, 0, 0], maps[n, 0, 1], maps[n, 0, 2]
    b_t, b_w, b_j = maps[n, 1, 0], maps[n, 1, 1], maps[n, 1, 2]
    e_t, e_w, e_j = maps[n, 2, 0], maps[n, 2, 1], maps[n, 2, 2]
    tau, a_emf, s, side = c.tau_e, c.a_emf, m.s, m.side
    constant, stiffness, damping = linear_part(c, m)
    while k < last and _is_usual(t, enable, cuts, k):
        drive, pull = c.b * u[k + 1], load[k]
        x = with_drive(c, x, drive, tau, a_emf)
        theta = a_t * x.theta + a_w * x.w + a_j * x.j + maps[n, 0, CONSTANT] + maps[n, 0, DRIVE] * drive
        theta += maps[n, 0, SIDE] * side + maps[n, 0, ON_RUDDER] * pull
        w = b_t * x.theta + b_w * x.w + b_j * x.j + maps[n, 1, CONSTANT] + maps[n, 1, DRIVE] * drive
        w += maps[n, 1, SIDE] * side + maps[n, 1, ON_RUDDER] * pull
        if tau > 0:
            j = e_t * x.theta + e_w * x.w + e_j * x.j + maps[n, 2, CONSTANT] + maps[n, 2, DRIVE] * drive
            j += maps[n, 2, SIDE] * side + maps[n, 2, ON_RUDDER] * pull
        else:
            j = drive - a_emf * w
        z = State(theta, w, j, x.theta_m, x.w_m)
        within = (slips or w * s > 0) and (theta - c.theta_0) * side >= 0 and theta <= c.upper and theta >= c.lower
        if not within or not is_bounded(z):
            break
        a = x.j + pull + constant - stiffness * x.theta - damping * x.w
        if may_turn(x, z, s, a, cuts.h0) and turns(c, t[k], x, z, m, drive, tau, a_emf, cuts.h0):
            break
        k, x = k + 1, z
        written(out, k, c, x)
    return k, x


@inline
def _is_held(c, j, push, up, down):
    """Whether friction holds a body at rest under the drive acceleration j, ``push`` beside it."""
    return direction_from_rest(push + j, up, down) == 0


@unit(types.Tuple((N, X))(READ, READ, READ_BOOL, READ, C, CUTS, N, N, X, M, TABLE))
def rests_on(t, u, enable, load, c, cuts, k, last, x, m, out):
    """The same of a body at rest, be it against a stop."""
    tau, up, down = c.tau_e, c.c_2_plus, c.c_2_minus
    if m.side == 0:
        up, down = up + c.c_1, down + c.c_1
    kept = math.exp(-cuts.h0 / tau) if tau > 0 else 0.0
    spring = c.a_1 * (c.theta_0 - x.theta) + stop_force(c, m.stop, x.theta, 0.0)
    while k < last and _is_usual(t, enable, cuts, k):
        drive, push = c.b * u[k + 1], c.bias + load[k] + spring - c.c_1 * m.side
        j = x.j if tau > 0 else drive
        later = drive + (x.j - drive) * kept if tau > 0 else drive
        if not (_is_held(c, j, push, up, down) and _is_held(c, later, push, up, down)):
            break
        k, x = k + 1, State(x.theta, 0.0, later, x.theta_m, x.w_m)
        written(out, k, c, x)
    return k, x
