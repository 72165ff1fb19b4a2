"""A play or a shaft beside a bristle: two bodies by fixed steps, every force taken in the middle of the step.
 State x = (theta, w, j, theta_m, w_m, z): as in events.py, and the bristle's bend z [output unit], half a step ahead.
Its friction is k z + d exp(-(w / w_d)^2) z', its bend goes the way of Dahl's exactly under a speed that is constant
over the step. What gives like a spring needs no event; what is left of set-valued terms, the motor side's dry friction
and the preload's corner, is solved for with the speeds at the end of the step, as in Moreau's time
stepping: a body that its friction holds stays, a rudder that would not leave the corner's reach within the step ends in
it. So a motion moves smoothly with the plant's numbers. Positions lead the speeds by half a step (leapfrog), which is
of second order where nothing switches; dampers are implicit.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from ers_mj.plants.compiled import compiled_cache, inlined, part
from ers_mj.plants.events import (
    A_1,
    A_EMF,
    A_MINUS,
    A_PLUS,
    BETA,
    BIAS,
    C_1,
    C_MINUS,
    C_PLUS,
    D_BRISTLE,
    D_STOP,
    D_TWIST,
    DAHL,
    DELAY,
    FADE,
    FALL,
    GAP,
    HARDEN,
    K_BRISTLE,
    K_STOP,
    K_TWIST,
    LAWS,
    LEAST_LEVEL,
    LOWER,
    PHI,
    READ,
    READ_BOOL,
    RHO,
    ROWS,
    RUNAWAY,
    TAU,
    THETA_0,
    UPPER,
    VECTOR,
    B,
    _faster,
    _motor_level,
)
from ers_mj.plants.laws import drive_torque, friction_level, is_lawful, remember, total_torque

LONGEST = 2e-4  # [s] of a step
SPRING_STEP = 0.35  # frequency [rad/s] of the stiffest spring times the step
# steps for one where the rudder may reach the preload's corner: one that comes slower than step times c_1 stays there
FINER = 16
RESTING = 1e-9  # [output unit, and that per second] from the corner, and of speed, within which a rudder rests there
SWEEPS = 3  # over the two set-valued forces, which only the contact's damper couples


@inlined
def _step_length(c, refine):
    """[s] of a step at most."""
    rest = 1.0 - c[RHO]
    stiffest = max(c[K_TWIST] / c[RHO], c[K_BRISTLE] * (1.0 - c[PHI]), c[K_STOP]) / rest
    return (min(LONGEST, SPRING_STEP / math.sqrt(stiffest)) if stiffest > 0.0 else LONGEST) / refine


@inlined
def _unbent(c, left, way):
    """What is left of a bristle's share of its level to bend, which was ``left``, after a way counted in the
    displacement of its whole bend.
    """
    delta = c[DAHL]
    if delta == 1.0:
        return left * math.exp(-way)
    size = abs(left)
    if size <= 0.0:
        return 0.0
    after = size ** (1.0 - delta) + (delta - 1.0) * way
    return math.copysign(after ** (1.0 / (1.0 - delta)), left) if after > 0.0 else 0.0


@inlined
def _bent(c, z, w, level, h):
    """The bend after h at the speed w under this level of friction."""
    if w == 0.0:
        return z
    end = math.copysign(level / c[K_BRISTLE], w)
    return end * (1.0 - _unbent(c, 1.0 - z / end, abs(w) * h * c[K_BRISTLE] / level))


@inlined
def _full_level(c, on, p, lawful, theta, w, j):
    """Level of friction of the whole train along the motion, per total inertia."""
    level = c[C_PLUS] if w > 0.0 else c[C_MINUS]
    if lawful:
        level = friction_level(on, p, level, theta, w, j, 1.0 if w > 0.0 else -1.0)
    return max(level, LEAST_LEVEL * 0.5 * (c[C_PLUS] + c[C_MINUS]))


@inlined
def _damping(c, w):
    """Mechanical damping in the direction of a speed."""
    return c[A_PLUS] if w > 0.0 else c[A_MINUS]


@inlined
def _contact(c, twist):
    """(force of the spring between the bodies on the rudder per total inertia, damping there) at theta_m - theta; none
    within the play.
    """
    x = twist
    if c[GAP] > 0.0:
        if abs(twist) <= c[GAP]:
            return 0.0, 0.0
        x -= math.copysign(c[GAP], twist)
    return c[K_TWIST] * x * (1.0 + c[HARDEN] * x * x), c[D_TWIST]


@inlined
def _stop(c, theta):
    """(force of the spring of the stop that is touched, damping there)."""
    if theta > c[UPPER]:
        return c[K_STOP] * (c[UPPER] - theta), c[D_STOP]
    if theta < c[LOWER]:
        return c[K_STOP] * (c[LOWER] - theta), c[D_STOP]
    return 0.0, 0.0


@inlined
def _past_corner(a, push, ahead, corner):
    """(w, mean side of the corner over the step's way, 0 in it) of a w = push - corner sgn(ahead + w), sgn set-valued
    at 0.
    """
    reach = push + a * ahead
    if abs(reach) <= corner:
        return -ahead, 0.0
    way = math.copysign(1.0, reach)
    if way * ahead >= 0.0:
        return (push - corner * way) / a, way
    rest = way * push - corner
    w = way * (rest + math.sqrt(rest * rest + 8.0 * a * corner * abs(ahead))) / (2.0 * a)
    return w, way * (1.0 - 2.0 * abs(ahead / w))


@inlined
def _speeds(a, e, d, push, push_m, ahead, corner, holds):
    """(w, w_m) at the end of a step: a w - d w_m = push - corner sgn(ahead + w), e w_m - d w = push_m - holds sgn(w_m),
    sgn set-valued at 0.

    Sweeps find which of the two hold, the rest is linear.
    """
    way = way_m = 0.0
    w, w_m = push / a, push_m / e
    for _ in range(SWEEPS):
        if corner > 0.0:
            w, way = _past_corner(a, push + d * w_m, ahead, corner)
        if holds > 0.0:
            reach = push_m + d * w
            way_m = math.copysign(1.0, reach) if abs(reach) > holds else 0.0
            w_m = (reach - holds * way_m) / e if way_m != 0.0 else 0.0
    push, push_m = push - corner * way, push_m - holds * way_m
    if corner > 0.0 and way == 0.0:
        w = -ahead
        w_m = 0.0 if holds > 0.0 and way_m == 0.0 else (push_m + d * w) / e
    elif holds > 0.0 and way_m == 0.0:
        w, w_m = push / a, 0.0
    else:
        w = (push * e + push_m * d) / (a * e - d * d)
        w_m = (push_m + d * w) / e
    return w, w_m


@inlined
def _charged(c, j, drive, w_m, h):
    """The drive acceleration h later at the speed w_m of the motor."""
    if c[TAU] <= 0.0:
        return drive - c[A_EMF] * w_m
    rate = (1.0 + (_faster(c, j) if c[FALL] > 0.0 else 0.0)) / c[TAU]
    end = drive - c[A_EMF] * w_m
    return end + (j - end) * math.exp(-rate * h)


@inlined
def _bristle_damping(c, w, z, level):
    """Damping of a bristle that a motion bends on at the speed w."""
    if c[D_BRISTLE] <= 0.0:
        return 0.0
    left = max(1.0 - math.copysign(1.0, w) * c[K_BRISTLE] * z / level, 0.0)
    return c[D_BRISTLE] * (left if c[DAHL] == 1.0 else left ** c[DAHL]) * math.exp(-((w / c[FADE]) ** 2))


@part
def _step(c, on, p, lawful, t, x, drive, closed, load, h):
    """The state h later under a constant drive, or in an open circuit."""
    theta, w, j, theta_m, w_m, z = x
    share, half = 1.0 - c[PHI], 0.5 * h
    theta, theta_m = theta + half * w, theta_m + half * w_m
    j = _charged(c, j, drive, w_m, half) if closed else 0.0
    level = _full_level(c, on, p, lawful, theta, w, j)
    force = c[BIAS] + load + c[A_1] * (c[THETA_0] - theta) - share * c[K_BRISTLE] * z
    force_m, holds = 0.0, _motor_level(c, on, p, lawful, (theta, w, j, theta_m, w_m))
    if lawful:
        force += total_torque(on, p, theta, w, j, t + half)
        force_m = drive_torque(on, p, theta_m, w_m, j, t + half)
    wall, d_wall = _stop(c, theta)
    twist, d = _contact(c, theta_m - theta)
    own = share * _bristle_damping(c, w, z, level) + (1.0 - c[BETA]) * _damping(c, w)
    own_m = c[BETA] * _damping(c, w_m)
    if closed and c[TAU] <= 0.0:  # the back-EMF damps at once
        own_m, j = own_m + c[A_EMF], drive
    for _ in range(2):
        a, e = 1.0 - c[RHO] + half * (own + d_wall + d), c[RHO] + half * (own_m + d)
        push = (2.0 * (1.0 - c[RHO]) - a) * w + half * d * w_m + h * (force + wall + twist)
        push_m = (2.0 * c[RHO] - e) * w_m + half * d * w + h * (j + force_m - twist)
        w_1, w_m1 = _speeds(a, e, half * d, push, push_m, (theta - c[THETA_0]) / h, h * c[C_1], h * holds)
        pulls = c[GAP] > 0.0 and d > 0.0 and (twist + 0.5 * d * (w_m1 + w_m - w_1 - w)) * twist < 0.0
        sucks = d_wall > 0.0 and (wall - 0.5 * d_wall * (w_1 + w)) * wall < 0.0
        if not (pulls or sucks):
            break
        if pulls:
            twist = d = 0.0
        if sucks:
            wall = d_wall = 0.0
    z = _bent(c, z, w_1, level, h)
    j = _charged(c, j, drive, w_m1, half) if closed else 0.0
    return theta + half * w_1, w_1, j, theta_m + half * w_m1, w_m1, z


@inlined
def _is_near_corner(c, x, h):
    """Whether a rudder that does not rest there may reach the preload's corner within h."""
    away, reach = abs(x[0] - c[THETA_0]), h * (abs(x[1]) + h * c[C_1] / (1.0 - c[RHO]))
    return c[C_1] > 0.0 and away <= 2.0 * reach and (away > RESTING or abs(x[1]) > RESTING)


@part
def _through(c, on, p, lawful, t, x, drive, closed, load, span, longest):
    """The state ``span`` later under a constant drive."""
    steps = int(math.ceil(span / longest - 1e-9))
    h = span / steps
    for k in range(steps):
        parts = FINER if _is_near_corner(c, x, h) else 1
        for i in range(parts):
            x = _step(c, on, p, lawful, t + k * h + i * h / parts, x, drive, closed, load, h / parts)
    return x


@inlined
def _bent_start(c, theta, w, j):
    """Both bodies together, and a bristle bent by as much as a motion of this speed would have left it."""
    whole = 0.5 * (c[C_PLUS] + c[C_MINUS]) / c[K_BRISTLE]
    return theta, w, j, theta, w, min(max(w / math.sqrt(c[K_BRISTLE]), -whole), whole)


def _simulate(t, u, enable, load, y, gain, every, c, on, p, refine, x0, out):
    """As events.simulate_kernel, of a plant that has both a motor's side and a bristle."""
    n, h0 = t.size, t[1] - t[0]
    lawful, longest = is_lawful(on), _step_length(c, refine)
    skip = int(c[DELAY] / h0 + 1e-9)
    late = c[DELAY] - skip * h0
    if late < 1e-9 * h0:
        late = 0.0
    x = _bent_start(c, x0[0], x0[1], x0[2])
    for k in range(n):
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = x[0], x[1], x[2], x[3]
        if k == n - 1:
            break
        h = t[k + 1] - t[k]
        remember(on, p, x, h)
        if gain > 0.0 and k % every == 0 and y[k] == y[k]:
            jump = gain * (y[k] - x[0])
            if c[C_1] > 0.0:  # none in the corner, which holds the rudder
                jump *= min(1.0, abs(x[0] - c[THETA_0]) / max(2.0 * abs(jump), 1e-300))
            x = (x[0] + jump, x[1], x[2], x[3] + jump, x[4], x[5])
        first = min(late * h / h0, h)
        if first > 0.0:
            x = _through(c, on, p, lawful, t[k], x, c[B] * u[max(k - skip - 1, 0)], enable[k], load[k], first, longest)
        x = _through(
            c, on, p, lawful, t[k] + first, x, c[B] * u[max(k - skip, 0)], enable[k], load[k], h - first, longest
        )
        if not (abs(x[0]) < RUNAWAY and abs(x[1]) < RUNAWAY):
            out[k + 1 :, :] = np.nan
            return


def _sample(t, h0, before, now, c, on, p, refine, x):
    """Move x (6,) over one sample of length h0 from t; a delay leaves ``before`` at the terminals at first, ``now``
    afterwards.
    """
    lawful, longest = is_lawful(on), _step_length(c, refine)
    late = c[DELAY] - int(c[DELAY] / h0 + 1e-9) * h0
    z = (x[0], x[1], x[2], x[3], x[4], x[5])
    remember(on, p, x, h0)
    if late >= 1e-9 * h0:
        z = _through(c, on, p, lawful, t, z, c[B] * before, True, 0.0, late, longest)
    else:
        late = 0.0
    z = _through(c, on, p, lawful, t + late, z, c[B] * now, True, 0.0, h0 - late, longest)
    for i in range(6):
        x[i] = z[i] if abs(z[0]) < RUNAWAY and abs(z[1]) < RUNAWAY else np.nan


def _begin(c, x):
    """Fill x (6,) after its first three entries, theta w j."""
    z = _bent_start(c, x[0], x[1], x[2])
    for i in range(6):
        x[i] = z[i]


NUMBER = types.float64

with compiled_cache():
    simulate_kernel = njit(
        types.void(
            READ, READ, READ_BOOL, READ, READ, types.float64, types.int64, VECTOR, ROWS, LAWS, types.int64, VECTOR, LAWS
        ),
        nogil=True,
        cache=True,
    )(_simulate)
    sample_kernel = njit(
        types.void(NUMBER, NUMBER, NUMBER, NUMBER, VECTOR, ROWS, LAWS, types.int64, VECTOR), cache=True
    )(_sample)
    begin_kernel = njit(types.void(VECTOR, VECTOR), cache=True)(_begin)
