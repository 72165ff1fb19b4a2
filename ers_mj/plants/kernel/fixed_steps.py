"""A play or a shaft beside a bristle: two bodies by fixed steps, every force taken in the middle of the step.
 State x = (theta, w, j, theta_m, w_m, z): as in state.py, and the bristle's bend z [output unit], half a step ahead.
Its friction is k z + d exp(-(w / w_d)^2) z', its bend goes the way of Dahl's exactly under a speed that is constant
over the step. What gives like a spring needs no event; what is left of set-valued terms, the motor side's dry friction
and the preload's corner, is solved for with the speeds at the end of the step, as in Moreau's time
stepping: a body that its friction holds stays, a rudder that would not leave the corner's reach within the step ends in
it. So a motion moves smoothly with the plant's numbers. Positions lead the speeds by half a step (leapfrog), which is
of second order where nothing switches; dampers are implicit.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ers_mj.plants.compiling.compiled import inline, kernel, unit
from ers_mj.plants.kernel.bristle import bent, bristle_damping
from ers_mj.plants.kernel.cuts import split_delay
from ers_mj.plants.kernel.falling import faster
from ers_mj.plants.kernel.forces import LEAST_LEVEL, PAIR, motor_level, stop_at
from ers_mj.plants.kernel.laws import drive_torque, friction_level, remember, total_torque
from ers_mj.plants.kernel.state import READ, READ_BOOL, TABLE, VECTOR, C, F, L, N, is_bounded, plant_in, types

LONGEST = 2e-4  # [s] of a step
SPRING_STEP = 0.35  # frequency [rad/s] of the stiffest spring times the step
# steps for one where the rudder may reach the preload's corner: one that comes slower than step times c_1 stays there
FINER = 16
RESTING = 1e-9  # [output unit, and that per second] from the corner, and of speed, within which a rudder rests there
SWEEPS = 3  # over the two set-valued forces, which only the contact's damper couples


class Bent(NamedTuple):
    """Angle and speed of the rudder, drive acceleration, angle and speed of the motor's side, bend of the bristle."""

    theta: float
    w: float
    j: float
    theta_m: float
    w_m: float
    z: float


X6 = types.NamedUniTuple(F, 6, Bent)


@inline
def _step_length(c, refine):
    """[s] of a step at most."""
    rest = 1.0 - c.rho
    stiffest = max(c.k_twist / c.rho, c.k_bristle * (1.0 - c.phi), c.k_stop) / rest
    return (min(LONGEST, SPRING_STEP / math.sqrt(stiffest)) if stiffest > 0.0 else LONGEST) / refine


@inline
def _full_level(c, theta, w, j):
    """Level of friction of the whole train along the motion, per total inertia."""
    level = c.c_2_plus if w > 0.0 else c.c_2_minus
    if c.lawful > 0:
        level = friction_level(c, level, theta, w, j, 1.0 if w > 0.0 else -1.0)
    return max(level, LEAST_LEVEL * 0.5 * (c.c_2_plus + c.c_2_minus))


@inline
def _damping(c, w):
    """Mechanical damping in the direction of a speed."""
    return c.a_mech_plus if w > 0.0 else c.a_mech_minus


@inline
def _contact(c, twist):
    """(force of the spring between the bodies on the rudder per total inertia, damping there) at theta_m - theta; none
    within the play.
    """
    x = twist
    if c.gap > 0.0:
        if abs(twist) <= c.gap:
            return 0.0, 0.0
        x -= math.copysign(c.gap, twist)
    return c.k_twist * x * (1.0 + c.harden * x * x), c.d_twist


@inline
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


@inline
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


@inline
def _charged(c, j, drive, w_m, h):
    """The drive acceleration h later at the speed w_m of the motor."""
    if c.tau_e <= 0.0:
        return drive - c.a_emf * w_m
    rate = (1.0 + (faster(c, j) if c.fall > 0.0 else 0.0)) / c.tau_e
    end = drive - c.a_emf * w_m
    return end + (j - end) * math.exp(-rate * h)


@unit(PAIR(C, F, F, F, F, F, F, F, F, F, F))
def _solved(c, theta, theta_m, w, w_m, push, push_m, own, own_m, holds, h):
    """(w, w_m) at the end of a step, under forces in its middle that do not hang on them, dampings of each body's own,
    and what contact and stop do: neither pulls back what it has pushed.
    """
    half = 0.5 * h
    wall, d_wall = stop_at(c, theta)
    twist, d = _contact(c, theta_m - theta)
    w_1, w_m1 = w, w_m
    for _ in range(2):
        a, e = 1.0 - c.rho + half * (own + d_wall + d), c.rho + half * (own_m + d)
        p = (2.0 * (1.0 - c.rho) - a) * w + half * d * w_m + h * (push + wall + twist)
        p_m = (2.0 * c.rho - e) * w_m + half * d * w + h * (push_m - twist)
        w_1, w_m1 = _speeds(a, e, half * d, p, p_m, (theta - c.theta_0) / h, h * c.c_1, h * holds)
        pulls = c.gap > 0.0 and d > 0.0 and (twist + 0.5 * d * (w_m1 + w_m - w_1 - w)) * twist < 0.0
        sucks = d_wall > 0.0 and (wall - 0.5 * d_wall * (w_1 + w)) * wall < 0.0
        if not (pulls or sucks):
            break
        if pulls:
            twist = d = 0.0
        if sucks:
            wall = d_wall = 0.0
    return w_1, w_m1


@unit(X6(C, F, X6, F, L, F, F))
def _step(c, t, x, drive, closed, load, h):
    """The state h later under a constant drive, or in an open circuit."""
    theta, w, j, theta_m, w_m, z = x
    share, half = 1.0 - c.phi, 0.5 * h
    theta, theta_m = theta + half * w, theta_m + half * w_m
    j = _charged(c, j, drive, w_m, half) if closed else 0.0
    level = _full_level(c, theta, w, j)
    push = c.bias + load + c.a_1 * (c.theta_0 - theta) - share * c.k_bristle * z
    push_m, holds = 0.0, motor_level(c, theta, j, w_m)
    if c.lawful > 0:
        push += total_torque(c, theta, w, j, t + half)
        push_m = drive_torque(c, theta_m, w_m, j, t + half)
    own = share * bristle_damping(c, w, z, level) + (1.0 - c.beta) * _damping(c, w)
    own_m = c.beta * _damping(c, w_m)
    if closed and c.tau_e <= 0.0:  # the back-EMF damps at once
        own_m, j = own_m + c.a_emf, drive
    w_1, w_m1 = _solved(c, theta, theta_m, w, w_m, push, j + push_m, own, own_m, holds, h)
    z = bent(c, z, w_1, level, h)
    j = _charged(c, j, drive, w_m1, half) if closed else 0.0
    return Bent(theta + half * w_1, w_1, j, theta_m + half * w_m1, w_m1, z)


@inline
def _is_near_corner(c, x, h):
    """Whether a rudder that does not rest there may reach the preload's corner within h."""
    away, reach = abs(x.theta - c.theta_0), h * (abs(x.w) + h * c.c_1 / (1.0 - c.rho))
    return c.c_1 > 0.0 and away <= 2.0 * reach and (away > RESTING or abs(x.w) > RESTING)


@unit(X6(C, F, X6, F, L, F, F, F))
def _through(c, t, x, drive, closed, load, span, longest):
    """The state ``span`` later under a constant drive."""
    steps = int(math.ceil(span / longest - 1e-9))
    h = span / steps
    for k in range(steps):
        parts = FINER if _is_near_corner(c, x, h) else 1
        for i in range(parts):
            x = _step(c, t + k * h + i * h / parts, x, drive, closed, load, h / parts)
    return x


@inline
def _bent_start(c, theta, w, j, twist, over):
    """The motor's side ahead by a ``twist`` and turning faster by ``over``, and a bristle bent by as much as a motion
    of this speed would have left it.
    """
    whole = 0.5 * (c.c_2_plus + c.c_2_minus) / c.k_bristle
    return Bent(theta, w, j, theta + twist, w + over, min(max(w / math.sqrt(c.k_bristle), -whole), whole))


@inline
def _moved(c, x, jump):
    """The state after an observer has moved the angle: not in the corner, which holds the rudder."""
    if c.c_1 > 0.0:
        jump *= min(1.0, abs(x.theta - c.theta_0) / max(2.0 * abs(jump), 1e-300))
    return Bent(x.theta + jump, x.w, x.j, x.theta_m + jump, x.w_m, x.z)


@kernel(types.void(READ, READ, READ_BOOL, READ, READ, F, N, VECTOR, N, VECTOR, TABLE))
def simulate(t, u, enable, load, y, gain, every, plant, refine, x0, out):
    """As event_integrator.simulate, of a plant that has both a motor's side and a bristle."""
    c, n, h0 = plant_in(plant), t.size, t[1] - t[0]
    longest, (_, late) = _step_length(c, refine), split_delay(c, h0)
    x = _bent_start(c, x0[0], x0[1], x0[2], x0[3], x0[4])
    for k in range(n):
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = x.theta, x.w, x.j, x.theta_m
        if k == n - 1:
            break
        h = t[k + 1] - t[k]
        remember(c, x.theta, x.w, x.j, x.theta_m, x.w_m, h)
        if gain > 0.0 and k % every == 0 and y[k] == y[k]:
            x = _moved(c, x, gain * (y[k] - x.theta))
        first = min(late * h / h0, h)
        if first > 0.0:
            x = _through(c, t[k], x, c.b * u[k], enable[k], load[k], first, longest)
        x = _through(c, t[k] + first, x, c.b * u[k + 1], enable[k], load[k], h - first, longest)
        if not is_bounded(x):
            out[k + 1 :, :] = np.nan
            return


@kernel(types.void(F, F, F, F, VECTOR, N, VECTOR))
def hold(t, h0, before, now, plant, refine, x):
    """Move x (6,) over one sample of length h0 from t; a delay leaves ``before`` at the terminals at first, ``now``
    afterwards.
    """
    c = plant_in(plant)
    longest, (_, late) = _step_length(c, refine), split_delay(c, h0)
    z = Bent(x[0], x[1], x[2], x[3], x[4], x[5])
    remember(c, z.theta, z.w, z.j, z.theta_m, z.w_m, h0)
    if late > 0.0:
        z = _through(c, t, z, c.b * before, True, 0.0, late, longest)
    z = _through(c, t + late, z, c.b * now, True, 0.0, h0 - late, longest)
    for i in range(6):
        x[i] = z[i] if is_bounded(z) else np.nan


@kernel(types.void(VECTOR, VECTOR))
def begin(plant, x):
    """Fill x (6,) after its first three entries, theta w j: both bodies together."""
    z = _bent_start(plant_in(plant), x[0], x[1], x[2], 0.0, 0.0)
    for i in range(6):
        x[i] = z[i]
