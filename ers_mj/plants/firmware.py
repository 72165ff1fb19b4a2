"""A servo with the loop of its own firmware between the commanded position and the motor: reference in, motion out.

    r_R   the reference tau late, its speed within +-R
    v     = K e + xi - D s,  e = r_R - theta (of the body that the loop's sensor sees),  xi' = I e,  lag s' = w - s
    drive = v within +-L less what of it lies within +-idle, ``dead_time`` late, its current within +-most
    theta'' = drive - a_emf w + Eq. (6)'s forces and the laws of effects, friction set-valued

Fixed steps of second order (leapfrog, dampers by the trapezium), friction and limits solved for with the speed at the
end of a step. A step is parted where the reference switches by more than friction holds, since friction and limits bend
what the drive makes of it; a smaller switch enters by the reference's mean: a motion moves smoothly with tau.
All accelerations are per total inertia, in output unit / s^2.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ers_mj.plants.compiling.compiled import inline, kernel, unit
from ers_mj.plants.kernel.before import twist_at_rest
from ers_mj.plants.kernel.bristle import bent, bristle_damping
from ers_mj.plants.kernel.forces import stop_at
from ers_mj.plants.kernel.held_reference import mean_reference, switched
from ers_mj.plants.kernel.laws import friction_level, remember, total_torque
from ers_mj.plants.kernel.state import (
    READ,
    READ_BOOL,
    RUNAWAY,
    TABLE,
    VECTOR,
    C,
    F,
    N,
    has_bristle,
    is_parted,
    plant_in,
    types,
)
from ers_mj.plants.loop_numbers import Q, loop_in

LONGEST = 1e-3  # [s] of a step
STIFF = 0.6  # frequency [rad/s] of the stiffest spring times the step
PAST = 2048  # steps of the drive that are kept: the longest dead time


class Moving(NamedTuple):
    """Angle and speed of the load and of the motor's side, the loop's integral, the speed that it has, the limited
    reference, the drive, the torque that the gear carried last, the bend of a bristle that carries friction.
    """

    theta: float
    w: float
    theta_m: float
    w_m: float
    xi: float
    slow: float
    r: float
    drive: float
    carried: float
    z: float


M10 = types.NamedUniTuple(F, 10, Moving)
PAIR = types.UniTuple(F, 2)


@inline
def _pushed(q, e):
    """The error that the drive answers to."""
    size = abs(e)
    if q.band > 0.0:
        if size <= q.band:
            return 0.0
        size = min(size - q.lost, 30.0 * (size - q.band))
    if q.least > 0.0 and size > 0.0:
        size = max(size, q.least / q.K)
    return math.copysign(size, e)


@inline
def _slipped(gain, push, a, level, creep, heavy, w, h):
    """Speed after h of gain w' = push - a w - friction, dampers by the trapezium; friction turns where the speed does
    within the step.

    Friction that creeps is creep w below its level, and (heavy - 1) gain w' of a body that it slows.
    """
    if creep < np.inf:
        soft, mass = 0.5 * h * (a + creep), heavy * gain
        end = ((mass - soft) * w + h * push) / (mass + soft)
        holds = push - 0.5 * a * (end + w) - gain * (end - w) / h
        if abs(holds) <= level:
            return end
        way = math.copysign(1.0, holds)
        return ((gain - 0.5 * h * a) * w + h * (push - way * level)) / (gain + 0.5 * h * a)
    if w != 0.0:
        end = ((gain - 0.5 * h * a) * w + h * (push - math.copysign(level, w))) / (gain + 0.5 * h * a)
        if end * w >= 0.0:
            return end
        h *= end / (end - w)
    if abs(push) <= level:
        return 0.0
    return h * (push - math.copysign(level, push)) / (gain + 0.5 * h * a)


@inline
def _level(c, theta, w, carried):
    """Friction of the whole train along the motion, per total inertia."""
    up = w > 0.0 or (w == 0.0 and carried > 0.0)
    level = c.c_2_plus if up else c.c_2_minus
    if c.frictions > 0:
        level = friction_level(c, level, theta, w, carried, 1.0 if up else -1.0)
    return max(level, 0.0)


@inline
def _carried(c, q, drive, w_m, push):
    """The torque on the gear: the motor's, back-EMF and all, and what the load holds, each by the other's inertia."""
    motor = min(max(drive - c.a_emf * w_m, -q.most), q.most)
    return (1.0 - q.share) * motor - q.share * push


@inline
def _held(c, theta, w, drive, t):
    """What springs and laws of effects make of a load there."""
    hold = c.bias + c.a_1 * (c.theta_0 - theta)
    if c.torques > 0:
        hold += total_torque(c, theta, w, drive, t)
    return hold


@inline
def _touched(c, q, twist, over):
    """(force of the contact on the load at theta_m - theta, damping there) where the motor's side turns faster by
    ``over``; within the play only grease drags, and a contact does not pull back.
    """
    if abs(twist) <= c.gap:
        return 0.0, q.grease
    x = twist - math.copysign(c.gap, twist)
    touch, d = c.k_twist * x * (1.0 + c.harden * x * x), c.d_twist + q.grease
    if (touch + d * over) * touch < 0.0:
        d = -touch / over
    return touch, d


@inline
def _most(q):
    """The largest drive that the bridge passes."""
    return max(q.L - q.idle, 0.0)


@inline
def _limited(q, v):
    return min(max(v, -_most(q)), _most(q))


@inline
def _damped(q, slow, w, h):
    """(D that acts on the speed itself, the late speed in the middle of a step that begins at the speed w)."""
    if q.lag > 0.0:
        return 0.0, w + (slow - w) * math.exp(-0.5 * h / q.lag)
    return q.D, w


@inline
def _ignored(q, v):
    """What the bridge loses of a drive v."""
    return min(max(v, -q.idle), q.idle)


@inline
def _integrated(q, xi, v, e, h):
    """The loop's integral h later, of an error e at the drive v; at its limit it is not pushed on."""
    if q.I > 0.0 and (abs(v) < _most(q) or v * e < 0.0):
        return min(max(xi + h * q.I * e, -q.L), q.L)
    return xi


@unit(M10(C, Q, F, M10, F, F, F, F))
def _one_body(c, q, t, x, r, fresh, late, h):
    """The state h later under the mean reference r, where of the drive the share ``fresh`` is the present one and the
    rest ``late``.
    """
    theta = x.theta + 0.5 * h * x.w
    e = r - theta
    hold = _held(c, theta, x.w, x.drive, t)
    wall, d_wall = stop_at(c, theta)
    a = (c.a_mech_plus if x.w > 0.0 else c.a_mech_minus) + d_wall
    level = _level(c, theta, x.w, x.carried)
    firm, z = max(level, 0.1 * (c.c_2_plus + c.c_2_minus)), x.z
    D, slow = _damped(q, x.slow, x.w, h)
    push, asked = hold + wall, q.K * _pushed(q, e) + x.xi - (q.D - D) * slow
    ahead = asked - _ignored(q, asked - D * x.w)
    mass = q.buried if wall != 0.0 else 1.0
    if has_bristle(c):
        push, a, level = push - c.k_bristle * z, a + bristle_damping(c, x.w, z, firm), 0.0
    w = _slipped(mass, push + fresh * ahead + late, a + fresh * D + c.a_emf, level, q.creep, q.heavy, x.w, h)
    if q.idle > 0.0:
        ahead = asked - _ignored(q, asked - 0.5 * D * (x.w + w))
        w = _slipped(mass, push + fresh * ahead + late, a + fresh * D + c.a_emf, level, q.creep, q.heavy, x.w, h)
    v = ahead - 0.5 * D * (x.w + w)
    if abs(v) > _most(q):
        drive = fresh * _limited(q, v) + late
        w = _slipped(mass, push + drive, a + c.a_emf, level, q.creep, q.heavy, x.w, h)
    else:
        drive = fresh * v + late
    current = drive - 0.5 * c.a_emf * (x.w + w)
    if abs(current) > q.most:
        w = _slipped(mass, push + math.copysign(q.most, current), a, level, q.creep, q.heavy, x.w, h)
    held = wall - 0.5 * d_wall * (x.w + w) - (mass - 1.0) * (w - x.w) / h
    if wall != 0.0 and held * wall < 0.0:
        w = _slipped(1.0, push - wall + drive, a - d_wall + c.a_emf, level, q.creep, q.heavy, x.w, h)
    xi = _integrated(q, x.xi, v, e, h)
    carried = _carried(c, q, drive, 0.5 * (x.w + w), push)
    theta += 0.5 * h * w
    z = bent(c, z, w, firm, h) if has_bristle(c) else z
    return Moving(theta, w, theta, w, xi, _damped(q, slow, w, h)[1], x.r, _limited(q, v), carried, z)


@unit(M10(C, Q, F, M10, F, F, F, F))
def _two_bodies(c, q, t, x, r, fresh, late, h):
    """As ``_one_body``, of a motor and a load with a play or a shaft between them."""
    theta, theta_m = x.theta + 0.5 * h * x.w, x.theta_m + 0.5 * h * x.w_m
    e = r - (theta_m if q.at_motor > 0.0 else theta)
    seen = x.w_m if q.at_motor > 0.0 else x.w
    push = _held(c, theta, x.w, x.drive, t)
    wall, d_wall = stop_at(c, theta)
    touch, d = _touched(c, q, theta_m - theta, x.w_m - x.w)
    a = (1.0 - c.beta) * (c.a_mech_plus if x.w > 0.0 else c.a_mech_minus) + d_wall
    a_m = c.beta * (c.a_mech_plus if x.w_m > 0.0 else c.a_mech_minus) + c.a_emf
    level, level_m = (1.0 - c.phi) * _level(c, theta, x.w, x.carried), c.phi * _level(c, theta, x.w_m, x.carried)
    D, slow = _damped(q, x.slow, seen, h)
    asked = q.K * _pushed(q, e) + x.xi - (q.D - D) * slow
    w, w_m = x.w, x.w_m
    v = asked - D * seen
    ahead = asked - _ignored(q, v)
    for _ in range(3):
        drag = 0.5 * d * (x.w_m + w_m)
        w = _slipped(1.0 - c.rho, push + wall + touch + drag, a + d, level, q.creep, q.heavy, x.w, h)
        between = -touch + 0.5 * d * (x.w + w)
        if q.at_motor > 0.0:
            asks = fresh * ahead + late + between
            w_m = _slipped(c.rho, asks, a_m + fresh * D + d, level_m, q.creep, q.heavy, x.w_m, h)
            v = asked - 0.5 * D * (x.w_m + w_m)
        else:
            v = asked - 0.5 * D * (x.w + w)
        lost = _ignored(q, v)
        ahead, v = asked - lost, v - lost
        if q.at_motor == 0.0 or abs(v) > _most(q):
            asks = fresh * _limited(q, v) + late + between
            w_m = _slipped(c.rho, asks, a_m + d, level_m, q.creep, q.heavy, x.w_m, h)
    xi = _integrated(q, x.xi, v, e, h)
    carried = _carried(c, q, fresh * _limited(q, v) + late, 0.5 * (x.w_m + w_m), push + wall)
    slow = _damped(q, slow, w_m if q.at_motor > 0.0 else w, h)[1]
    theta, theta_m = theta + 0.5 * h * w, theta_m + 0.5 * h * w_m
    return Moving(theta, w, theta_m, w_m, xi, slow, x.r, _limited(q, v), carried, x.z)


@inline
def _step_length(c):
    """[s] of a step at most."""
    stiffest = max(c.k_stop, c.k_twist / max(min(c.rho, 1.0 - c.rho), 1e-3) if is_parted(c) else c.k_bristle)
    return min(LONGEST, STIFF / math.sqrt(stiffest)) if stiffest > 0.0 else LONGEST


@inline
def _late_drive(q, past, k, h):
    """(share of the drive that is the present one, the rest of it) at step k, of drives that were a step h apart."""
    if q.dead_time <= 0.0:
        return 1.0, 0.0
    back = min(q.dead_time / h, PAST - 2.0)
    whole = int(back)
    part = back - whole
    older = past[(k - whole - 1) % PAST]
    if whole == 0:
        return 1.0 - part, part * older
    return 0.0, (1.0 - part) * past[(k - whole) % PAST] + part * older


@inline
def _followed(q, x, seen, rate, h):
    """The state drawn to what the log shows, both bodies alike, at a rate [1/s]: a critically damped observer of angle
    and speed, its log h apart.
    """
    kept = math.exp(-rate * h)
    missed = seen - (x.theta_m if q.log_at_motor > 0.0 else x.theta)
    by, faster = (1.0 - kept * kept) * missed, (1.0 - kept) ** 2 / h * missed
    theta, w, theta_m, w_m = x.theta + by, x.w + faster, x.theta_m + by, x.w_m + faster
    return Moving(theta, w, theta_m, w_m, x.xi, x.slow, x.r, x.drive, x.carried, x.z)


@inline
def _placed(c, q, seen):
    """(load's angle, motor side's) of a servo at rest whose log shows ``seen``."""
    twist = twist_at_rest(c, 0.0, seen) if is_parted(c) else 0.0
    return (seen - twist, seen) if q.log_at_motor > 0.0 else (seen, seen + twist)


@kernel(PAIR(F, VECTOR, VECTOR))
def placed(seen, plant, loop):
    """(load's angle, motor side's) [output unit] of a servo at rest whose log shows ``seen``; ``plant`` and ``loop`` as
    for :func:`simulate`.
    """
    return _placed(plant_in(plant), loop_in(loop), seen)


@inline
def _started(c, q, seen, w, r):
    """The state where the log shows ``seen`` at the beginning: both bodies at one speed and placed as at rest; an
    integral that holds them there, or a ``fresh`` one.
    """
    theta, theta_m = _placed(c, q, seen)
    v = q.K * (r - (theta_m if q.at_motor > 0.0 else theta))
    xi = _limited(q, -_held(c, theta, 0.0, 0.0, 0.0)) - v if q.I > 0.0 and q.fresh == 0.0 else 0.0
    return Moving(theta, w, theta_m, w, xi, w, r, _limited(q, v + xi - q.D * w), 0.0, 0.0)


@kernel(types.void(READ, READ, READ_BOOL, VECTOR, VECTOR, F, F, F, N, READ, F, TABLE))
def simulate(t, r, enable, plant, loop, theta, w, before, refine, seen, rate, out):
    """Fill out (N, 4) with the load's angle and speed, the motor side's angle and the drive at the times t (N,), from
    (theta, w) and under the reference r (N,), which was ``before`` until t[0].

    ``plant`` as laws.laid_out makes it, ``loop`` the numbers of LoopNumbers; a motion that runs away becomes NaN. At a
    ``rate`` [1/s] above 0 the motion follows what was ``seen`` (N,), NaN where nothing was, from each row on.
    """
    c, q = plant_in(plant), loop_in(loop)
    longest, n = _step_length(c) / refine, t.size
    x = _started(c, q, theta, w, before)
    past = np.full(PAST, x.drive)
    least = max(c.c_2_plus, c.c_2_minus) / q.K  # of a switch that parts a step
    k, step = 0, 0
    for i in range(n):
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = x.theta, x.w, x.theta_m, x.drive
        if i == n - 1:
            break
        if rate > 0.0 and math.isfinite(seen[i]):
            x = _followed(q, x, seen[i], rate, t[i + 1] - t[i])
        steps = int(math.ceil((t[i + 1] - t[i]) / longest - 1e-9))
        h = (t[i + 1] - t[i]) / steps
        remember(c, x.theta, x.w, x.drive, x.theta_m, x.w_m, t[i + 1] - t[i])
        for s in range(steps):
            at, end = t[i] + s * h, t[i] + (s + 1) * h
            fresh, late = _late_drive(q, past, step, h) if enable[i] else (0.0, 0.0)
            mean_drive = 0.0
            while at < end:
                until = switched(t, r, before, k, q.tau, at, end, least)
                part = until - at
                asked, k = mean_reference(t, r, before, k, at - q.tau, until - q.tau)
                now = x.r + min(max(asked - x.r, -q.R * part), q.R * part)
                mean = 0.5 * (x.r + now) if q.R < np.inf else asked
                x = Moving(x.theta, x.w, x.theta_m, x.w_m, x.xi, x.slow, now, x.drive, x.carried, x.z)
                if is_parted(c):
                    x = _two_bodies(c, q, at, x, mean, fresh, late, part)
                else:
                    x = _one_body(c, q, at, x, mean, fresh, late, part)
                mean_drive += part / h * x.drive
                at = until
            past[step % PAST] = mean_drive
            step += 1
        if not (abs(x.theta) < RUNAWAY and abs(x.w) < RUNAWAY):
            out[i + 1 :, :] = np.nan
            return
