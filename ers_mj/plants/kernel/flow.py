"""The smooth flow between two events. Within a mode the plant itself is linear: a Taylor series to machine precision,
under forces that are parabolas in time as well. What laws add to one body, what a bristle does that bends and a shaft
that hardens take fourth-order Runge-Kutta steps; for laws on two bodies see series.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ers_mj.plants.compiling.compiled import inline, unit
from ers_mj.plants.kernel.forces import TRIPLE, derivative, motor_friction, viscous
from ers_mj.plants.kernel.state import C, F, M, State, X, bends, has_bristle, is_parted, with_drive

# rate [1/s] times step of a Runge-Kutta step: local error RATE_STEP^5 / 120 = 1e-4 of the fast transient
RATE_STEP = 0.4
LEAST_LEFT = 0.2  # of its level that a bristle is taken to have left to bend beyond what it has, where that sets a step
NONE = (0.0, 0.0, 0.0)  # a force that is not there
MOST_STEPS = 1e5  # Runge-Kutta steps of a segment, beyond which it is given up (NaN)


class Linear(NamedTuple):
    """The linear balance of a mode: stiffness, damping and constant force of the rudder, damping and constant force of
    the motor's side, stiffness and damping of the contact between the two; 0 of what does not move. What a force on
    either body accelerates it by, and the rate [1/s] of the winding, 0 without one.
    """

    a_1: float
    a_2: float
    force: float
    a_2m: float
    force_m: float
    k: float
    d: float
    per_force: float
    per_force_m: float
    rate: float


@inline
def _of_rudder(c, m, k):
    """(stiffness, damping, constant force) of a rudder that slips."""
    a_1, a_2 = c.a_1, c.a_mech_plus if m.s > 0 else c.a_mech_minus
    level = c.c_2_plus if m.s > 0 else c.c_2_minus
    if is_parted(c):
        a_2, level = a_2 * (1.0 - c.beta), level * (1.0 - c.phi)
    elif has_bristle(c):
        a_2, level = viscous(c, m.s_m, 0.0), 0.0
    force = c.bias + c.a_1 * c.theta_0 - c.c_1 * m.side - level * m.s - k * m.twist * c.gap
    if m.stop != 0:
        a_1, a_2 = a_1 + c.k_stop, a_2 + c.d_stop
        force += c.k_stop * (c.upper if m.stop > 0 else c.lower)
    if has_bristle(c):
        force -= (c.c_2_plus if m.s_m > 0 else c.c_2_minus) * m.s_m
    return a_1, a_2, force


@inline
def balance(c, m, tau):
    """The linear balance of a mode."""
    a_1 = a_2 = force = a_2m = force_m = k = d = 0.0
    per_force = per_force_m = 1.0
    if c.two_body > 0 and m.twist != 0:
        k, d = c.k_twist, c.d_twist
    if m.s != 0:
        a_1, a_2, force = _of_rudder(c, m, k)
    if is_parted(c):
        per_force, per_force_m = 1.0 / (1.0 - c.rho), 1.0 / c.rho
        if m.s_m != 0:
            a_2m = c.beta * 0.5 * (c.a_mech_plus + c.a_mech_minus)
            force_m = k * m.twist * c.gap - motor_friction(c) * m.s_m
    rate = 1.0 / tau if tau > 0 else 0.0
    return Linear(a_1, a_2, force, a_2m, force_m, k, d, per_force, per_force_m, rate)


@inline
def steps_of(c, b, tau, a_emf, dt):
    """Steps of about one time constant that dt takes."""
    rate = abs(b.a_2) + math.sqrt(abs(b.a_1)) + (math.sqrt(abs(a_emf) / tau) if tau > 0 else a_emf)
    if is_parted(c):
        rate = (rate + math.sqrt(b.k) + b.d) / min(c.rho, 1.0 - c.rho)
    return int(0.7 * (rate + b.rate) * dt) + 1


@inline
def parabola(begin, middle, end):
    """(3,) of a force over a span, a parabola of its share, from its values at begin, middle and end."""
    return begin, 4.0 * middle - 3.0 * begin - end, 2.0 * (end - 2.0 * middle + begin)


@inline
def of_term(f, i, n, k):
    """What a force f (3,), a parabola of the share of a span, gives term k of the series in its piece i of n."""
    at = i / n
    if k == 1:
        return f[0] + at * (f[1] + at * f[2])
    if k == 2:
        return (f[1] + 2.0 * at * f[2]) / n
    return f[2] / (n * n) if k == 3 else 0.0


@inline
def next_term(c, m, b, v, q, a_emf, drive, force, force_m):
    """The term of a Taylor series after v, over a step of which q is the share, with what the drive and the forces on
    both bodies give that term.
    """
    two, bristle = is_parted(c), has_bristle(c)
    speed = v.w_m if two else v.w
    if b.rate > 0:
        e_j = q * b.rate * (drive - a_emf * speed - v.j)
        pull = v.j
    else:
        e_j = 0.0
        pull = drive - a_emf * speed
    e_theta = e_w = e_theta_m = e_w_m = 0.0
    if m.s != 0:
        e_theta = q * v.w
        e_w = force - b.a_1 * v.theta - b.a_2 * v.w
        if two:
            e_w = q * b.per_force * (e_w + b.k * (v.theta_m - v.theta) + b.d * (v.w_m - v.w))
        else:
            e_w = q * (e_w + pull)
    if bristle:
        e_theta_m = e_theta
    elif c.two_body > 0 and m.s_m != 0:
        e_theta_m = q * v.w_m
        twist = force_m + pull - b.a_2m * v.w_m - b.k * (v.theta_m - v.theta) - b.d * (v.w_m - v.w)
        e_w_m = q * b.per_force_m * twist
    return State(e_theta, e_w, e_j, e_theta_m, e_w_m)


@inline
def term_after(c, m, b, v, h, k, i, n, a_emf, drive, scale, f, r):
    """Term k after v of the series in piece i of n, of length h, under the drive, ``scale`` times the constant forces,
    and the forces f (3,) on the rudder and r (3,) on the motor, parabolas of the share of the span.
    """
    if k > 3:
        return next_term(c, m, b, v, h / k, a_emf, 0.0, 0.0, 0.0)
    force, force_m = of_term(f, i, n, k), of_term(r, i, n, k)
    if k == 1:
        force, force_m, drive = force + scale * b.force, force_m + scale * b.force_m, scale * drive
    else:
        drive = 0.0
    return next_term(c, m, b, v, h / k, a_emf, drive, force, force_m)


@inline
def is_small(v, x):
    """Whether a term no longer moves a sum."""
    return abs(v.w) <= 1e-15 * abs(x.w) and abs(v.j) <= 1e-15 * abs(x.j) and abs(v.w_m) <= 1e-15 * abs(x.w_m)


@unit(X(C, X, M, F, F, F, F, F, TRIPLE, TRIPLE))
def linear(c, x, m, drive, tau, a_emf, dt, scale, f, r):
    """The flow within a mode without laws, exact: Taylor series in steps of about one time constant.

    ``scale`` 1 includes the constant forces, 0 leaves them and the drive out (the homogeneous flow); f (3,) is a force
    on the rudder beside them, r (3,) one on the motor, parabolas of the share of dt.
    """
    b = balance(c, m, tau)
    n = steps_of(c, b, tau, a_emf, dt)
    h = dt / n
    for i in range(n):
        v = x
        for k in range(1, 40):
            v = term_after(c, m, b, v, h, k, i, n, a_emf, drive, scale, f, r)
            x = State(x.theta + v.theta, x.w + v.w, x.j + v.j, x.theta_m + v.theta_m, x.w_m + v.w_m)
            if k > 3 and is_small(v, x):
                break
    if tau <= 0:
        return State(x.theta, x.w, scale * drive - a_emf * (x.w_m if is_parted(c) else x.w), x.theta_m, x.w_m)
    return x


@inline
def _plus(x, h, d):
    return State(x.theta + h * d.theta, x.w + h * d.w, x.j + h * d.j, x.theta_m + h * d.theta_m, x.w_m + h * d.w_m)


@unit(X(C, F, X, M, F, F, F, F))
def runge_kutta(c, t, x, m, drive, tau, a_emf, dt):
    """One classical fourth-order step of length dt."""
    a = derivative(c, t, x, m, drive, tau, a_emf)
    b = derivative(c, t + 0.5 * dt, _plus(x, 0.5 * dt, a), m, drive, tau, a_emf)
    e = derivative(c, t + 0.5 * dt, _plus(x, 0.5 * dt, b), m, drive, tau, a_emf)
    f = derivative(c, t + dt, _plus(x, dt, e), m, drive, tau, a_emf)
    mean = State(
        a.theta + 2 * (b.theta + e.theta) + f.theta,
        a.w + 2 * (b.w + e.w) + f.w,
        a.j + 2 * (b.j + e.j) + f.j,
        a.theta_m + 2 * (b.theta_m + e.theta_m) + f.theta_m,
        a.w_m + 2 * (b.w_m + e.w_m) + f.w_m,
    )
    return with_drive(c, _plus(x, dt / 6.0, mean), drive, tau, a_emf)


@inline
def _bristle_rate(c, x):
    """The rate at which a bristle that bends pulls: what is left to bend, over the level, slows it for exponents above
    1 as it gets less.
    """
    most, levels = 2.0, c.c_2_plus + c.c_2_minus
    if c.dahl > 1.0:
        left = abs(1.0 - math.copysign(2.0, x.w) * c.k_bristle * (x.theta - x.theta_m) / levels)
        most = min(left + LEAST_LEFT, 2.0)
    lets_go = 2.0 * c.dahl * most ** (c.dahl - 1.0) * c.k_bristle * abs(x.w) / levels
    return math.sqrt(c.k_bristle) + c.d_bristle + lets_go


@inline
def _fastest_rate(c, m, x, tau, a_emf):
    """An upper bound [1/s] of the fastest rate in a mode, at the state x."""
    rate = max(abs(c.a_mech_plus), abs(c.a_mech_minus)) + math.sqrt(abs(c.a_1)) + a_emf
    winding = 1.0 / tau if tau > 0 else 0.0
    if tau > 0:  # the light one of two bodies is quicker, and no winding is
        rate = max(rate, 0.0 if is_parted(c) else winding) + math.sqrt(a_emf / tau)
    if m.stop != 0:
        rate = max(rate, math.sqrt(c.k_stop) + c.d_stop)
    if bends(c, m):
        rate += _bristle_rate(c, x)
    elif is_parted(c):
        rate = max(rate / min(c.rho, 1.0 - c.rho), winding)
        if m.twist != 0:
            share = c.rho * (1.0 - c.rho)
            stiffer = 1.0 + 3.0 * c.harden * (x.theta_m - x.theta) ** 2
            rate = max(rate, math.sqrt(c.k_twist * stiffer / share) + c.d_twist / share)
    return rate


@inline
def is_linear(c, m):
    """Whether neither laws nor what bends or hardens act within the mode."""
    return not bends(c, m) and c.harden <= 0 and (c.lawful == 0 or (m.s == 0 and c.two_body <= 0))


@unit(X(C, F, X, M, F, F, F, F))
def flow(c, t, x, m, drive, tau, a_emf, dt):
    """The state dt later within the mode; NaN of a motion that runs away, since a shaft that hardens gets the stiffer
    the further it is twisted.
    """
    if is_linear(c, m):
        return linear(c, x, m, drive, tau, a_emf, dt, 1.0, NONE, NONE)
    steps = _fastest_rate(c, m, x, tau, a_emf) * dt / RATE_STEP
    if not steps < MOST_STEPS:
        return State(np.nan, np.nan, np.nan, np.nan, np.nan)
    n = int(steps) + 1
    for k in range(n):
        x = runge_kutta(c, t + k * dt / n, x, m, drive, tau, a_emf, dt / n)
    return x
