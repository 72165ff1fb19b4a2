"""The smooth flow between two events. Within a mode the plant itself is linear: a Taylor series to machine precision.
What laws add is a force, which takes a fourth-order Runge-Kutta step, or in the middle of an exponential one of two
bodies; what a shaft that hardens adds to its spring's force goes the same way.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ers_mj.plants.compiled import inline, unit
from ers_mj.plants.forces import beside, derivative, motor_friction, viscous
from ers_mj.plants.state import C, F, M, State, X, bends, has_bristle, is_parted, with_drive

# rate [1/s] times step of a Runge-Kutta step: local error RATE_STEP^5 / 120 = 1e-4 of the fast transient
RATE_STEP = 0.4
LEAST_LEFT = 0.2  # of its level that a bristle is taken to have left to bend beyond what it has, where that sets a step
MOST_STEPS = 1e5  # Runge-Kutta steps of a segment, beyond which it is given up (NaN)


class Linear(NamedTuple):
    """The linear balance of a mode: stiffness, damping and constant force of the rudder, damping and constant force of
    the motor's side, stiffness and damping of the contact between the two; 0 of what does not move.
    """

    a_1: float
    a_2: float
    force: float
    a_2m: float
    force_m: float
    k: float
    d: float


@inline
def _of_rudder(c, m, f, k):
    """(stiffness, damping, constant force) of a rudder that slips, f among the forces."""
    a_1, a_2 = c.a_1, c.a_mech_plus if m.s > 0 else c.a_mech_minus
    level = c.c_2_plus if m.s > 0 else c.c_2_minus
    if is_parted(c):
        a_2, level = a_2 * (1.0 - c.beta), level * (1.0 - c.phi)
    elif has_bristle(c):
        a_2, level = viscous(c, m.s_m, 0.0), 0.0
    force = f + c.bias + c.a_1 * c.theta_0 - c.c_1 * m.side - level * m.s - k * m.twist * c.gap
    if m.stop != 0:
        a_1, a_2 = a_1 + c.k_stop, a_2 + c.d_stop
        force += c.k_stop * (c.upper if m.stop > 0 else c.lower)
    if has_bristle(c):
        force -= (c.c_2_plus if m.s_m > 0 else c.c_2_minus) * m.s_m
    return a_1, a_2, force


@inline
def balance(c, m, f, r):
    """The linear balance of a mode under constant forces f on the rudder and r on the motor beside its own."""
    a_1 = a_2 = force = a_2m = force_m = k = d = 0.0
    if c.two_body > 0 and m.twist != 0:
        k, d = c.k_twist, c.d_twist
    if m.s != 0:
        a_1, a_2, force = _of_rudder(c, m, f, k)
    if is_parted(c) and m.s_m != 0:
        a_2m = c.beta * 0.5 * (c.a_mech_plus + c.a_mech_minus)
        force_m = r + k * m.twist * c.gap - motor_friction(c) * m.s_m
    return Linear(a_1, a_2, force, a_2m, force_m, k, d)


@inline
def steps_of(c, b, tau, a_emf, dt):
    """Steps of about one time constant that dt takes."""
    rate = abs(b.a_2) + math.sqrt(abs(b.a_1)) + (math.sqrt(abs(a_emf) / tau) if tau > 0 else a_emf)
    if is_parted(c):
        rate = (rate + math.sqrt(b.k) + b.d) / min(c.rho, 1.0 - c.rho)
    if tau > 0:
        rate += 1.0 / tau
    return int(0.7 * rate * dt) + 1


@inline
def next_term(c, m, b, v, drive, tau, a_emf, q, first):
    """The term of a Taylor series after v, over a step of which q is the share; ``first`` weighs what is constant."""
    two, bristle = is_parted(c), has_bristle(c)
    speed = v.w_m if two else v.w
    if tau > 0:
        e_j = q * (first * drive - a_emf * speed - v.j) / tau
        pull = v.j
    else:
        e_j = 0.0
        pull = first * drive - a_emf * speed
    e_theta = e_w = e_theta_m = e_w_m = 0.0
    if m.s != 0:
        e_theta = q * v.w
        e_w = first * b.force - b.a_1 * v.theta - b.a_2 * v.w
        if two:
            e_w = q * (e_w + b.k * (v.theta_m - v.theta) + b.d * (v.w_m - v.w)) / (1.0 - c.rho)
        else:
            e_w = q * (e_w + pull)
    if bristle:
        e_theta_m = e_theta
    elif c.two_body > 0 and m.s_m != 0:
        e_theta_m = q * v.w_m
        twist = first * b.force_m + pull - b.a_2m * v.w_m - b.k * (v.theta_m - v.theta) - b.d * (v.w_m - v.w)
        e_w_m = q * twist / c.rho
    return State(e_theta, e_w, e_j, e_theta_m, e_w_m)


@inline
def is_small(v, x):
    """Whether a term no longer moves a sum."""
    return abs(v.w) <= 1e-15 * abs(x.w) and abs(v.j) <= 1e-15 * abs(x.j) and abs(v.w_m) <= 1e-15 * abs(x.w_m)


@unit(X(C, X, M, F, F, F, F, F, F, F))
def linear(c, x, m, drive, tau, a_emf, dt, scale, f, r):
    """The flow within a mode without laws, exact: Taylor series in steps of about one time constant.

    ``scale`` 1 includes the constant forces, f on the rudder and r on the motor among them, 0 leaves them and the drive
    out (the homogeneous flow).
    """
    b = balance(c, m, f, r)
    n = steps_of(c, b, tau, a_emf, dt)
    h = dt / n
    for _ in range(n):
        v = x
        for k in range(1, 40):
            v = next_term(c, m, b, v, drive, tau, a_emf, h / k, scale if k == 1 else 0.0)
            x = State(x.theta + v.theta, x.w + v.w, x.j + v.j, x.theta_m + v.theta_m, x.w_m + v.w_m)
            if k > 2 and is_small(v, x):
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


@unit(X(C, F, X, M, F, F, F, F))
def _driven(c, t, x, m, drive, tau, a_emf, dt):
    """The flow of two bodies under laws, by the exponential midpoint rule: the linear one under the forces of the
    middle, whose change is slow.
    """
    f, _, r = beside(c, 0.0, t, x, m)
    f, _, r = beside(c, 0.0, t + 0.5 * dt, linear(c, x, m, drive, tau, a_emf, 0.5 * dt, 1.0, f, r), m)
    return linear(c, x, m, drive, tau, a_emf, dt, 1.0, f, r)


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
        return linear(c, x, m, drive, tau, a_emf, dt, 1.0, 0.0, 0.0)
    if is_parted(c) and c.harden <= 0:
        return _driven(c, t, x, m, drive, tau, a_emf, dt)
    steps = _fastest_rate(c, m, x, tau, a_emf) * dt / RATE_STEP
    if not steps < MOST_STEPS:
        return State(np.nan, np.nan, np.nan, np.nan, np.nan)
    n = int(steps) + 1
    for k in range(n):
        x = runge_kutta(c, t + k * dt / n, x, m, drive, tau, a_emf, dt / n)
    return x
