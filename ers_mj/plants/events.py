"""The compiled integrator of Eq. (1)/(5): smooth flow between events, every switch of a Sgn located exactly.
 State x = (theta, w, j, theta_m, w_m): rudder angle and speed, drive acceleration j (the motor torque over J; current
in disguise), and the motor's side where a second body exists. Mode m = (s, side, stop, s_m, twist): the values that the
set-valued terms take until the next event: direction of slip (0 = stuck; 1 throughout without dry friction), side of
theta_0 (0 = held in the corner), stop touched, motor slip, contact of the play (of two bodies without play: 1
throughout, a spring that pushes and pulls). A flow ends where the mode's inequality fails; the instant is found on the
flow itself.
 A second body without inertia (rho = 0) is the foot of LuGre's bristle z = theta - theta_m: z' = w - |w| k z / F, and
the friction is k z + d exp(-(w / w_d)^2) z'. It has no speed of its own (w_m stays 0 in x), and the drive acts on the
rudder, whose slip s is then 1 wherever the preload's corner does not hold it. Its slip s_m is 0 while the bristle
bends, which is stepped as a law is, and the direction of motion once the bristle is bent to the full: from there to the
next reversal friction is Coulomb's and the flow linear. Where a law moves the level F, the bristle lags behind it and
s_m stays 0.
 Within a mode the plant itself is linear: a precomputed map over a whole segment of a sample, a Taylor series to
machine precision over a part of one. What the laws of effects add is a force; over a segment it enters the same maps as
a parabola in time through three evaluations (an exponential integrator), over a part of one by a fourth-order
Runge-Kutta step. What a shaft that hardens adds to its spring's force goes the same ways.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from ers_mj.effects.base import LEAST_IRON, Coefficients
from ers_mj.plants.compiled import compiled_cache, inlined, part
from ers_mj.plants.laws import drive_torque, friction_level, is_lawful, moved, remember, total_torque

INDEX = {name: k for k, name in enumerate(Coefficients._fields)}
(
    A_1,
    A_PLUS,
    A_MINUS,
    A_EMF,
    B,
    C_1,
    C_PLUS,
    C_MINUS,
    THETA_0,
    TAU,
    BIAS,
    LOWER,
    UPPER,
    K_STOP,
    D_STOP,
    DELAY,
    TWO,
    RHO,
    BETA,
    PHI,
    K_TWIST,
    D_TWIST,
    GAP,
    K_BRISTLE,
    D_BRISTLE,
    FADE,
    DAHL,
    HARDEN,
    FALL,
) = range(len(Coefficients._fields))
RATE_STEP = (
    0.4  # rate [1/s] times step of a Runge-Kutta step: local error RATE_STEP^5 / 120 = 1e-4 of the fast transient
)
CORNER = 1e-4  # a crossing of theta_0 slower than this share of (c_1 + c_2) h ends in the corner
RELEASE_LIMIT = 60  # events in one segment after which a body is left stuck
CREPT = 1e-12  # share of its friction by which a motor that has crept to rest may be pulled further
ROUNDING = 1e-14  # [output unit] by which a position may lie beyond its boundary without an event
# events a sample, on average, beyond which a simulation is given up (NaN): a chatter no servo shows; a segment on a
# bristle, which bounces in the corner
EVENT_BUDGET = 4
BRISTLE_CORNER = 0.1  # the same for a rudder that no friction slows: share of c_1 h below which it bounces out of sight
STILL = 5e-5  # share of a bristle's friction within which its rudder rests
LEAST_LEVEL = 0.2  # of the mean friction, which laws cannot lower a bristle's beyond
LEAST_LEFT = 0.2  # of its level that a bristle is taken to have left to bend beyond what it has, where that sets a step
FULL = 1.0 - 1e-4  # share of its friction's level at which a bristle counts as bent to the full
# share of a speed, or of a twist's distance to the ends of the play, that a leap over a whole sample must leave
CALM = 0.2
RUNAWAY = 1e9  # [output unit, and that per second] beyond which a motion is given up (NaN)
MOST_STEPS = 1e5  # Runge-Kutta steps of a segment, beyond which it is given up as well
FALL_STEP = 0.1  # length of a segment over the electrical time constant where the inductance falls with the current
LAW_STEP = 0.12  # mechanical rate [1/s] times segment length under a law
CONTACT_STEP = 0.8  # contact frequency [rad/s] times segment length with a second body or at a stop
ORDER = (
    0,
    4,
    1,
    2,
    3,
    5,
    6,
)  # speeds first: between their zeros angles are monotone, so that later events have one root
GAUSS_X, GAUSS_W = (0.5 * (np.polynomial.legendre.leggauss(10)[0] + 1), 0.5 * np.polynomial.legendre.leggauss(10)[1])


@inlined
def _stop_force(c, stop, theta, w):
    """Acceleration of the touched stop (0 where none is)."""
    if stop == 0:
        return 0.0
    wall = c[UPPER] if stop > 0 else c[LOWER]
    return -c[K_STOP] * (theta - wall) - c[D_STOP] * w


@inlined
def _twist_force(c, twist, theta, w, theta_m, w_m):
    """Acceleration (per total inertia) that the motor's side exerts on the rudder through the contact."""
    if twist == 0:
        return 0.0
    x = theta_m - theta - twist * c[GAP]
    return c[K_TWIST] * x * (1.0 + c[HARDEN] * x * x) + c[D_TWIST] * (w_m - w)


@inlined
def _has_bristle(c):
    """Whether the second body is the foot of a bristle, which has no inertia."""
    return c[TWO] > 0 and c[RHO] <= 0


@inlined
def _bends(c, m):
    """Whether a bristle has not yet let go, which keeps the mode from being linear: it is stepped as a law is."""
    return _has_bristle(c) and m[3] == 0


@inlined
def _hardening(c, x):
    """What a shaft that hardens adds to the force of its spring, per total inertia."""
    return c[K_TWIST] * c[HARDEN] * (x[3] - x[0]) ** 3


@inlined
def _never_sticks(c, on):
    """Whether the rudder has no dry friction, and the same damping both ways: its slip s then stays 1, whichever way it
    moves.
    """
    return (
        c[C_PLUS] <= 0
        and c[C_MINUS] <= 0
        and c[C_1] <= 0
        and on[1, 0] == 0
        and c[A_PLUS] == c[A_MINUS]
        and not _has_bristle(c)
    )


@inlined
def _drive_speed(c, x):
    """Speed of the body that the drive acts on, which makes the back-EMF."""
    return x[4] if c[TWO] > 0 and c[RHO] > 0 else x[1]


@part
def _level(c, on, p, lawful, x, direction):
    """Level of friction on a bristle in one direction, per total inertia."""
    level = c[C_PLUS] if direction > 0 else c[C_MINUS]
    if lawful:
        level = friction_level(on, p, level, x[0], x[1], x[2], direction)
    return max(level, LEAST_LEVEL * 0.5 * (c[C_PLUS] + c[C_MINUS]))


@inlined
def _bending(c, share):
    """Speed at which a bristle bends over the rudder's, under this share of the level along the motion."""
    if c[DAHL] == 1.0:
        return 1.0 - share
    return math.copysign(abs(1.0 - share) ** c[DAHL], 1.0 - share)


@part
def _bristle(c, on, p, lawful, x, s_m):
    """(force of the bristle on the rudder, per total inertia; the speed of its foot)."""
    if s_m != 0:
        return -s_m * _level(c, on, p, lawful, x, float(s_m)), x[1]
    pull, speed = c[K_BRISTLE] * (x[0] - x[3]), 0.0
    if x[1] != 0.0:
        way = 1.0 if x[1] > 0 else -1.0
        speed = x[1] * (1.0 - _bending(c, way * pull / _level(c, on, p, lawful, x, way)))
    return -pull - c[D_BRISTLE] * math.exp(-((x[1] / c[FADE]) ** 2)) * (x[1] - speed), speed


@inlined
def _viscous(c, s_m, w):
    """Mechanical damping of a rudder on a bristle."""
    return c[A_PLUS] if s_m > 0 or (s_m == 0 and w > 0) else c[A_MINUS]


@inlined
def _held(c, on, p, lawful, t, x, m):
    """(net acceleration without friction on the rudder at rest, its friction up, down), per total inertia."""
    theta, w, j, theta_m, w_m = x
    a = c[BIAS] + c[A_1] * (c[THETA_0] - theta) - c[C_1] * m[1] + _stop_force(c, m[2], theta, 0.0)
    share = 1.0
    if _has_bristle(c):
        a += j + _bristle(c, on, p, lawful, (theta, 0.0, j, theta_m, w_m), m[3])[0]
        share = 0.0
    elif c[TWO] > 0:
        a += _twist_force(c, m[4], theta, 0.0, theta_m, w_m)
        share = 1.0 - c[PHI]
    else:
        a += j
    up, down = c[C_PLUS], c[C_MINUS]
    if lawful:
        a += total_torque(on, p, theta, 0.0, j, t)
        up, down = friction_level(on, p, up, theta, 0.0, j, 1.0), friction_level(on, p, down, theta, 0.0, j, -1.0)
    up, down = share * up, share * down
    if m[1] == 0:
        up, down = up + c[C_1], down + c[C_1]
    return a, up, down


@inlined
def _motor_friction(c):
    """Friction of the motor's side, per total inertia. Without any it never sticks: its slip s_m stays 1."""
    return c[PHI] * 0.5 * (c[C_PLUS] + c[C_MINUS])


@inlined
def _motor_level(c, on, p, lawful, x):
    """The same with what laws make of it at the motor's speed, the mean of both directions."""
    up, down = c[C_PLUS], c[C_MINUS]
    if lawful and c[PHI] > 0 and on[1, 0] > 0:
        up, down = friction_level(on, p, up, x[0], x[4], x[2], 1.0), friction_level(on, p, down, x[0], x[4], x[2], -1.0)
    return c[PHI] * 0.5 * (up + down)


@inlined
def _held_motor(c, on, p, lawful, t, x, m):
    """(net acceleration without friction on the motor's side at rest, its friction), per total inertia."""
    theta, w, j, theta_m, w_m = x
    a = j - _twist_force(c, m[4], theta, w, theta_m, 0.0)
    if lawful:
        a += drive_torque(on, p, theta_m, 0.0, j, t)
    return a, _motor_level(c, on, p, lawful, (theta, w, j, theta_m, 0.0))


@inlined
def _derivative(c, on, p, lawful, t, x, m, drive, tau, a_emf):
    """d/dt of (theta, w, j, theta_m, w_m) within a mode."""
    theta, w, j, theta_m, w_m = x
    bristle = _has_bristle(c)
    two = c[TWO] > 0 and not bristle
    speed = w_m if two else w
    if tau > 0:
        dj = (drive - a_emf * speed - j) / tau
    else:
        j = drive - a_emf * speed
        dj = 0.0
    dw = 0.0
    push = 0.0
    if two:
        push = _twist_force(c, m[4], theta, w, theta_m, w_m)
    elif bristle:
        push, w_m = _bristle(c, on, p, lawful, (theta, w, j, theta_m, w_m), m[3])
    if m[0] != 0:
        level = c[C_PLUS] if m[0] > 0 else c[C_MINUS]
        a_mech = c[A_PLUS] if m[0] > 0 else c[A_MINUS]
        force = c[BIAS] + c[A_1] * (c[THETA_0] - theta) - c[C_1] * m[1] + _stop_force(c, m[2], theta, w)
        if lawful:
            force += total_torque(on, p, theta, w, j, t)
            level = friction_level(on, p, level, theta, w, j, float(m[0]))
        if two:
            force += push - (1.0 - c[BETA]) * a_mech * w - (1.0 - c[PHI]) * level * m[0]
            dw = force / (1.0 - c[RHO])
        elif bristle:
            dw = force + j + push - _viscous(c, m[3], w) * w
        else:
            dw = force + j - a_mech * w - level * m[0]
            if lawful:
                dw = moved(on, p, theta, w, dw)
    dw_m = 0.0
    if two and m[3] != 0:
        a_mech = c[A_PLUS] if w_m > 0 else c[A_MINUS]
        force_m = j - push - c[BETA] * a_mech * w_m - m[3] * _motor_level(c, on, p, lawful, (theta, w, j, theta_m, w_m))
        if lawful:
            force_m += drive_torque(on, p, theta_m, w_m, j, t)
        dw_m = force_m / c[RHO]
    return w, dw, dj, w_m, dw_m


@inlined
def _plus(x, h, d):
    return (x[0] + h * d[0], x[1] + h * d[1], x[2] + h * d[2], x[3] + h * d[3], x[4] + h * d[4])


@part
def _runge_kutta(c, on, p, lawful, t, x, m, drive, tau, a_emf, dt):
    """One classical fourth-order step of length dt."""
    k1 = _derivative(c, on, p, lawful, t, x, m, drive, tau, a_emf)
    k2 = _derivative(c, on, p, lawful, t + 0.5 * dt, _plus(x, 0.5 * dt, k1), m, drive, tau, a_emf)
    k3 = _derivative(c, on, p, lawful, t + 0.5 * dt, _plus(x, 0.5 * dt, k2), m, drive, tau, a_emf)
    k4 = _derivative(c, on, p, lawful, t + dt, _plus(x, dt, k3), m, drive, tau, a_emf)
    d = (
        k1[0] + 2 * (k2[0] + k3[0]) + k4[0],
        k1[1] + 2 * (k2[1] + k3[1]) + k4[1],
        k1[2] + 2 * (k2[2] + k3[2]) + k4[2],
        k1[3] + 2 * (k2[3] + k3[3]) + k4[3],
        k1[4] + 2 * (k2[4] + k3[4]) + k4[4],
    )
    x = _plus(x, dt / 6.0, d)
    if tau <= 0:
        return x[0], x[1], drive - a_emf * _drive_speed(c, x), x[3], x[4]
    return x


@part
def _linear(c, x, m, drive, tau, a_emf, dt, scale, f, r):
    """The flow within a mode without laws, exact: Taylor series in steps of about one time constant.

    ``scale`` 1 includes the constant forces, f on the rudder and r on the motor among them, 0 leaves them and the drive
    out (the homogeneous flow).
    """
    theta, w, j, theta_m, w_m = x
    bristle = _has_bristle(c)
    two = c[TWO] > 0 and not bristle
    load_free, motor_free = m[0] != 0, c[TWO] > 0 and m[3] != 0
    a1 = a2 = force = kt = dt_ = force_m = a2_m = 0.0
    rho, rest = c[RHO], 1.0 - c[RHO]
    if c[TWO] > 0 and m[4] != 0:
        kt, dt_ = c[K_TWIST], c[D_TWIST]
    if load_free:
        a1, a2 = c[A_1], c[A_PLUS] if m[0] > 0 else c[A_MINUS]
        level = c[C_PLUS] if m[0] > 0 else c[C_MINUS]
        if two:
            a2, level = a2 * (1.0 - c[BETA]), level * (1.0 - c[PHI])
        elif bristle:
            a2, level = _viscous(c, m[3], 0.0), 0.0
        force = f + c[BIAS] + c[A_1] * c[THETA_0] - c[C_1] * m[1] - level * m[0] - kt * m[4] * c[GAP]
        if m[2] != 0:
            a1, a2 = a1 + c[K_STOP], a2 + c[D_STOP]
            force += c[K_STOP] * (c[UPPER] if m[2] > 0 else c[LOWER])
        if bristle:
            force -= (c[C_PLUS] if m[3] > 0 else c[C_MINUS]) * m[3]
    if motor_free and not bristle:
        a2_m = c[BETA] * 0.5 * (c[A_PLUS] + c[A_MINUS])
        force_m = r + kt * m[4] * c[GAP] - _motor_friction(c) * m[3]
    rate = abs(a2) + math.sqrt(abs(a1)) + (math.sqrt(abs(a_emf) / tau) if tau > 0 else a_emf)
    if two:
        rate = (rate + math.sqrt(kt) + dt_) / min(rho, rest)
    if tau > 0:
        rate += 1.0 / tau
    n = int(0.7 * rate * dt) + 1
    h = dt / n
    for _ in range(n):
        v_t, v_w, v_j, v_tm, v_wm = theta, w, j, theta_m, w_m
        for k in range(1, 40):
            q = h / k
            first = scale if k == 1 else 0.0
            speed = v_wm if two else v_w
            if tau > 0:
                e_j = q * (first * drive - a_emf * speed - v_j) / tau
                pull = v_j
            else:
                e_j = 0.0
                pull = first * drive - a_emf * speed
            e_t = e_w = e_tm = e_wm = 0.0
            if load_free:
                e_t = q * v_w
                e_w = first * force - a1 * v_t - a2 * v_w
                if two:
                    e_w = q * (e_w + kt * (v_tm - v_t) + dt_ * (v_wm - v_w)) / rest
                else:
                    e_w = q * (e_w + pull)
            if bristle:
                e_tm = e_t
            elif motor_free:
                e_tm = q * v_wm
                e_wm = q * (first * force_m + pull - a2_m * v_wm - kt * (v_tm - v_t) - dt_ * (v_wm - v_w)) / rho
            v_t, v_w, v_j, v_tm, v_wm = e_t, e_w, e_j, e_tm, e_wm
            theta, w, j, theta_m, w_m = theta + v_t, w + v_w, j + v_j, theta_m + v_tm, w_m + v_wm
            if k > 2 and abs(v_w) <= 1e-15 * abs(w) and abs(v_j) <= 1e-15 * abs(j) and abs(v_wm) <= 1e-15 * abs(w_m):
                break
    if tau <= 0:
        j = scale * drive - a_emf * (w_m if two else w)
    return theta, w, j, theta_m, w_m


@inlined
def _push(depth, rate, stiffness, damping):
    """A contact's force over its stiffness: the contact pushes where this is positive, and never pulls."""
    return depth + damping / stiffness * rate if stiffness > 0 else depth


@inlined
def _touch(depth, rate, stiffness, damping):
    """Positive where two bodies that are apart touch: one is inside the other and does not leave it faster than the
    spring follows.
    """
    return min(depth, _push(depth, rate, stiffness, damping))


@inlined
def _bristle_violation(e, c, on, p, lawful, x, m):
    """Event function of the bristle: 4, a reversal, ends its slip; 6, bent to the full, begins it."""
    if e == 5 or (e == 4) != (m[3] != 0):
        return -1.0
    if e == 4:
        return -m[3] * x[1]
    pull = c[K_BRISTLE] * (x[0] - x[3])
    if pull * x[1] <= 0.0 or (lawful and on[1, 0] > 0):
        return -1.0
    return abs(pull) - FULL * _level(c, on, p, lawful, x, 1.0 if x[1] > 0 else -1.0)


@inlined
def _violation(e, c, on, p, lawful, t, x, m):
    """Event function e: positive where the mode's inequality fails."""
    theta, w, j, theta_m, w_m = x
    if e == 0:
        return -m[0] * w if m[0] != 0 and not _has_bristle(c) and not _never_sticks(c, on) else -1.0
    if e == 1:
        return -m[1] * (theta - c[THETA_0]) if m[0] != 0 else -1.0
    if e == 2:
        if m[2] == 0:
            return max(
                _touch(theta - c[UPPER], w, c[K_STOP], c[D_STOP]), _touch(c[LOWER] - theta, -w, c[K_STOP], c[D_STOP])
            )
        return -_push(theta - c[UPPER] if m[2] > 0 else c[LOWER] - theta, m[2] * w, c[K_STOP], c[D_STOP])
    if e == 3:
        if m[0] != 0:
            return -1.0
        a, up, down = _held(c, on, p, lawful, t, x, m)
        return max(a - up, -a - down)
    if c[TWO] <= 0:
        return -1.0
    if c[RHO] <= 0:
        return _bristle_violation(e, c, on, p, lawful, x, m)
    if e == 4:
        return -m[3] * w_m if m[3] != 0 and _motor_friction(c) > 0 else -1.0
    if e == 5:
        if c[GAP] <= 0:
            return -1.0
        side = m[4] if m[4] != 0 else (1 if theta_m > theta else -1)
        depth, rate = side * (theta_m - theta) - c[GAP], side * (w_m - w)
        if m[4] == 0:
            return _touch(depth, rate, c[K_TWIST], c[D_TWIST])
        return -_push(depth, rate, c[K_TWIST], c[D_TWIST])
    if m[3] != 0:
        return -1.0
    a, level = _held_motor(c, on, p, lawful, t, x, m)
    return abs(a) - level * (1.0 + CREPT)


@inlined
def _direction(a, up, down):
    """Slip direction of a body at rest: 0 within its friction."""
    if a > up:
        return 1
    return -1 if a < -down else 0


@part
def _switch(e, c, on, p, lawful, t, x, m, corner):
    """State and mode just after event e."""
    theta, w, j, theta_m, w_m = x
    s, side, stop, s_m, twist = m
    if e == 0 or e == 3:
        w = 0.0
        if c[C_1] > 0 and abs(theta - c[THETA_0]) < 1e-12:
            side = 0
        x = (theta, w, j, theta_m, w_m)
        a, up, down = _held(c, on, p, lawful, t, x, (0, side, stop, s_m, twist))
        s = _direction(a, up, down) if e == 0 else (1 if a - up > -a - down else -1)
        if side == 0 and c[C_1] > 0 and s != 0:
            side = s
        if _has_bristle(c):
            s = 1
    elif e == 1:
        theta = c[THETA_0]
        x = (theta, w, j, theta_m, w_m)
        side = 1 if w > 0 else -1
        if abs(w) < corner:
            a, up, down = _held(c, on, p, lawful, t, x, (0, 0, stop, s_m, twist))
            if _direction(a, up, down) == 0:
                s, side = 0, 0
                x = (theta, 0.0, j, theta_m, w_m)
    elif e == 2:
        if stop == 0:
            stop = 1 if theta > 0.5 * (c[UPPER] + c[LOWER]) or c[LOWER] == -np.inf else -1
            if c[UPPER] == np.inf:
                stop = -1
        else:
            stop = 0
    elif (e == 4 or e == 6) and _has_bristle(c):
        if e == 4:
            x = (theta, w, j, theta - s_m * _level(c, on, p, lawful, x, float(s_m)) / c[K_BRISTLE], w_m)
        s_m = 0 if e == 4 else (1 if w > 0 else -1)
    elif e == 4 or e == 6:
        x = (theta, w, j, theta_m, 0.0)
        a, level = _held_motor(c, on, p, lawful, t, x, m)
        s_m = _direction(a, level, level) if e == 4 else (1 if a > 0 else -1)
    elif twist == 0:
        twist = 1 if theta_m > theta else -1
    else:
        twist = 0
    return x, (s, side, stop, s_m, twist)


@part
def _rate(c, m, x, tau, a_emf):
    """An upper bound [1/s] of the fastest rate in a mode, at the state x."""
    rate = max(abs(c[A_PLUS]), abs(c[A_MINUS])) + math.sqrt(abs(c[A_1])) + a_emf
    apart = c[TWO] > 0 and not _has_bristle(c)
    winding = 1.0 / tau if tau > 0 else 0.0
    if tau > 0:  # the light one of two bodies is quicker, and no winding is
        rate = max(rate, 0.0 if apart else winding) + math.sqrt(a_emf / tau)
    if m[2] != 0:
        rate = max(rate, math.sqrt(c[K_STOP]) + c[D_STOP])
    if _has_bristle(c):
        if m[3] == 0:
            # what is left to bend, over the level, which for exponents above 1 slows the bending as it gets less
            most = 2.0
            if c[DAHL] > 1.0:
                most = min(
                    abs(1.0 - math.copysign(2.0, x[1]) * c[K_BRISTLE] * (x[0] - x[3]) / (c[C_PLUS] + c[C_MINUS]))
                    + LEAST_LEFT,
                    2.0,
                )
            rate += (
                math.sqrt(c[K_BRISTLE])
                + c[D_BRISTLE]
                + 2.0 * c[DAHL] * most ** (c[DAHL] - 1.0) * c[K_BRISTLE] * abs(x[1]) / (c[C_PLUS] + c[C_MINUS])
            )
    elif apart:
        rate = max(rate / min(c[RHO], 1.0 - c[RHO]), winding)
        if m[4] != 0:
            share = c[RHO] * (1.0 - c[RHO])
            stiffer = 1.0 + 3.0 * c[HARDEN] * (x[3] - x[0]) ** 2
            rate = max(rate, math.sqrt(c[K_TWIST] * stiffer / share) + c[D_TWIST] / share)
    return rate


@part
def _driven(c, on, p, t, x, m, drive, tau, a_emf, dt):
    """The flow of two bodies under laws, by the exponential midpoint rule: the linear one under the forces of the
    middle, whose change is slow.
    """
    f, _, r = _beside(c, on, p, True, 0.0, t, x, m)
    f, _, r = _beside(c, on, p, True, 0.0, t + 0.5 * dt, _linear(c, x, m, drive, tau, a_emf, 0.5 * dt, 1.0, f, r), m)
    return _linear(c, x, m, drive, tau, a_emf, dt, 1.0, f, r)


@part
def _flow(c, on, p, lawful, t, x, m, drive, tau, a_emf, dt):
    """The state dt later within the mode; NaN of a motion that runs away, since a shaft that hardens gets the stiffer
    the further it is twisted.
    """
    if not _bends(c, m) and c[HARDEN] <= 0 and (not lawful or (m[0] == 0 and c[TWO] <= 0)):
        return _linear(c, x, m, drive, tau, a_emf, dt, 1.0, 0.0, 0.0)
    if c[TWO] > 0 and not _has_bristle(c) and c[HARDEN] <= 0:
        return _driven(c, on, p, t, x, m, drive, tau, a_emf, dt)
    steps = _rate(c, m, x, tau, a_emf) * dt / RATE_STEP
    if not steps < MOST_STEPS:
        return np.nan, np.nan, np.nan, np.nan, np.nan
    n = int(steps) + 1
    for k in range(n):
        x = _runge_kutta(c, on, p, lawful, t + k * dt / n, x, m, drive, tau, a_emf, dt / n)
    return x


@part
def _locate(e, c, on, p, lawful, t, x, m, drive, tau, a_emf, dt, g1):
    """First instant in (0, dt] where event function e vanishes (Illinois method on the flow), and the state there.

    A body that has just been released starts on the root that it left; the search then begins where it moves.
    """
    lo, hi = 0.0, dt
    g_lo, g_hi = _violation(e, c, on, p, lawful, t, x, m), g1
    z = x
    while g_lo >= 0.0:
        lo = 0.5 * hi if lo == 0.0 else 0.5 * lo
        if (e not in (0, 4) and not (_has_bristle(c) and e in (1, 6))) or lo < dt / 200:
            return 0.0, x
        z = _flow(c, on, p, lawful, t, x, m, drive, tau, a_emf, lo)
        g_lo = _violation(e, c, on, p, lawful, t + lo, z, m)
    side = 0
    for _ in range(60):
        te = hi - g_hi * (hi - lo) / (g_hi - g_lo)
        z = _flow(c, on, p, lawful, t, x, m, drive, tau, a_emf, te)
        g = _violation(e, c, on, p, lawful, t + te, z, m)
        if abs(g) <= 1e-11 * abs(g1) or hi - lo < 1e-14:
            return te, z
        if g > 0:
            hi, g_hi = te, g
            if side == 1:
                g_lo *= 0.5
            side = 1
        else:
            lo, g_lo = te, g
            if side == -1:
                g_hi *= 0.5
            side = -1
    return te, z


@inlined
def _bounded(x):
    """Whether the motion has not run away."""
    return abs(x[0]) < RUNAWAY and abs(x[1]) < RUNAWAY


@part
def _advance(c, on, p, lawful, t, x, m, drive, tau, a_emf, dt, h_max, corner):
    """Integrate over dt under a constant drive, through every event on the way. Returns (x, m, number of events)."""
    if tau <= 0:
        x = (x[0], x[1], drive - a_emf * _drive_speed(c, x), x[3], x[4])
        if m[0] == 0 and _violation(3, c, on, p, lawful, t, x, m) > 0:
            x, m = _switch(3, c, on, p, lawful, t, x, m, corner)
    left, events = dt, 0
    while left > 1e-13 * dt:
        h = left if m[0] == 0 and c[TWO] <= 0 else min(left, h_max)
        z = _flow(c, on, p, lawful, t, x, m, drive, tau, a_emf, h)
        while h > dt / 40 and _turns(c, on, p, lawful, t, x, z, m, drive, tau, a_emf, h):
            h *= 0.25
            z = _flow(c, on, p, lawful, t, x, m, drive, tau, a_emf, h)
        first, event = h, -1
        for e in ORDER:
            g = _violation(e, c, on, p, lawful, t + first, z, m)
            if g > (ROUNDING if e in (1, 2, 5) else 0.0):
                first, z = _locate(e, c, on, p, lawful, t, x, m, drive, tau, a_emf, first, g)
                event = e
        if event < 0:
            x = z
        else:
            events += 1
            at_rest = first <= 0.0 and event == 0
            x, m_new = _switch(event, c, on, p, lawful, t + first, z, m, corner)
            if at_rest or (events > RELEASE_LIMIT and event in (0, 3)):
                m = (0, m_new[1], m_new[2], m_new[3], m_new[4])
                j = drive + (x[2] - drive) * math.exp(-h / tau) if tau > 0 else x[2]
                if c[TWO] <= 0:
                    x, first = (x[0], 0.0, j, x[3], x[4]), h
            else:
                m = m_new
            if events > 4 * RELEASE_LIMIT:
                j = drive + (x[2] - drive) * math.exp(-left / tau) if tau > 0 else x[2]
                return (x[0], 0.0, j, x[3], 0.0), (0, m[1], m[2], 0, m[4]), events
        if not _bounded(x):
            return x, m, events
        t += first
        left -= first
    return x, m, events


@part
def _start_mode(c, on, p, lawful, t, x):
    """The mode that fits an initial state."""
    theta, w = x[0], x[1]
    side = 0
    if c[C_1] > 0 and abs(theta - c[THETA_0]) > 0:
        side = 1 if theta > c[THETA_0] else -1
    if c[C_1] > 0 and side == 0 and w != 0:
        side = 1 if w > 0 else -1
    stop = 1 if theta > c[UPPER] else (-1 if theta < c[LOWER] else 0)
    s = 1 if w > 0 or _never_sticks(c, on) else (-1 if w < 0 else 0)
    if _has_bristle(c):
        return 0 if c[C_1] > 0 and side == 0 else 1, side, stop, 0, 1
    s_m = 1 if x[4] > 0 or (c[TWO] > 0 and _motor_friction(c) <= 0) else (-1 if x[4] < 0 else 0)
    twist = 0
    if c[TWO] > 0 and c[GAP] <= 0:
        twist = 1
    elif c[TWO] > 0 and abs(x[3] - theta) > c[GAP]:
        twist = 1 if x[3] > theta else -1
    return s, side, stop, s_m, twist


@inlined
def _corrected(c, on, p, lawful, t, x, m, jump):
    """The state after the observer has moved the angle by ``jump`` (both bodies), unless the corner holds it.

    On a bristle a rudder bounces in the corner, out of sight, before it rests: there it is moved the less the nearer it
    is, so that nothing hangs on where in its bounce a sample finds it.
    """
    if c[C_1] > 0 and _has_bristle(c):
        jump *= min(1.0, abs(x[0] - c[THETA_0]) / max(2.0 * abs(jump), 1e-300))
    theta = x[0] + jump
    side = 0
    if c[C_1] > 0:
        side = 1 if theta > c[THETA_0] else -1
        if (
            m[0] == 0 and m[1] * side < 0
        ):  # a rudder at rest is not pushed through the corner, which would throw it back
            theta, side = c[THETA_0], 0
            jump = theta - x[0]
    stop = 1 if theta > c[UPPER] else (-1 if theta < c[LOWER] else 0)
    z = (theta, x[1], x[2], x[3] + jump, x[4])
    m_new = (m[0], side, stop, m[3], m[4])
    if m[0] == 0 and m[1] == 0 and c[C_1] > 0:
        a, up, down = _held(c, on, p, lawful, t, z, m_new)
        if a > up or a < -down:
            return x, m
    return z, m_new


@inlined
def _unit(k):
    return (
        1.0 if k == 0 else 0.0,
        1.0 if k == 1 else 0.0,
        1.0 if k == 2 else 0.0,
        1.0 if k == 3 else 0.0,
        1.0 if k == 4 else 0.0,
    )


@part
def _fill_map(e, c, m, tau, a_emf, h, driven):
    """The exact map over h in a mode with side 0: e (5, 17), columns x (5), constant, drive, side, force on the rudder
    1, s, s^2 (s = t/h), the same of a force between the two bodies where their shaft hardens, and of one on the motor
    where it is ``driven`` by laws.
    """
    for k in range(5):
        z = _linear(c, _unit(k), m, 0.0, tau, a_emf, h, 0.0, 0.0, 0.0)
        for i in range(5):
            e[i, k] = z[i]
    zero = _unit(9)
    base = _linear(c, zero, m, 0.0, tau, a_emf, h, 1.0, 0.0, 0.0)
    pull = _linear(c, zero, m, 1.0, tau, a_emf, h, 1.0, 0.0, 0.0)
    share = 1.0 - c[RHO] if c[TWO] > 0 else 1.0
    for i in range(5):
        e[i, 5], e[i, 6] = base[i], pull[i] - base[i]
        for k in range(8, 17):
            e[i, k] = 0.0
    if m[0] != 0:
        for g in range(GAUSS_X.size):
            z = _linear(c, (0.0, 1.0 / share, 0.0, 0.0, 0.0), m, 0.0, tau, a_emf, h * (1.0 - GAUSS_X[g]), 0.0, 0.0, 0.0)
            for i in range(5):
                v = z[i] * h * GAUSS_W[g]
                e[i, 8] += v
                e[i, 9] += v * GAUSS_X[g]
                e[i, 10] += v * GAUSS_X[g] ** 2
    if c[HARDEN] > 0:
        push = (0.0, 1.0 / share if m[0] != 0 else 0.0, 0.0, 0.0, -1.0 / c[RHO] if m[3] != 0 else 0.0)
        for g in range(GAUSS_X.size):
            z = _linear(c, push, m, 0.0, tau, a_emf, h * (1.0 - GAUSS_X[g]), 0.0, 0.0, 0.0)
            for i in range(5):
                for k in range(3):
                    e[i, 11 + k] += z[i] * h * GAUSS_W[g] * GAUSS_X[g] ** k
    if driven and m[3] != 0:
        for g in range(GAUSS_X.size):
            z = _linear(
                c, (0.0, 0.0, 0.0, 0.0, 1.0 / c[RHO]), m, 0.0, tau, a_emf, h * (1.0 - GAUSS_X[g]), 0.0, 0.0, 0.0
            )
            for i in range(5):
                for k in range(3):
                    e[i, 14 + k] += z[i] * h * GAUSS_W[g] * GAUSS_X[g] ** k
    for i in range(5):
        e[i, 7] = -c[C_1] * e[i, 8]


@njit(nogil=True)
def _no_maps():
    """Room for the maps over a step and over half of it in every mode away from the stops: (2, 3, 3, 3, 5, 17), indices
    s + 1, s_m + 1, twist + 1. NaN: not made yet, since most modes are never met, and half steps only under laws.
    """
    return np.full((2, 3, 3, 3, 5, 17), np.nan)


@inlined
def _make(e, half, c, m, tau, a_emf, step, driven):
    """The map over the step (half 0) or its half (half 1) in the mode m, where it was not made before."""
    here = e[half, m[0] + 1, m[3] + 1, m[4] + 1]
    if here[0, 0] != here[0, 0]:
        _fill_map(here, c, (m[0], 0, 0, m[3], m[4]), tau, a_emf, step / (1 + half), driven)


@inlined
def _row(e, i, x, drive, side, f0, f1, f2):
    return (
        e[i, 0] * x[0]
        + e[i, 1] * x[1]
        + e[i, 2] * x[2]
        + e[i, 5]
        + e[i, 6] * drive
        + e[i, 7] * side
        + e[i, 8] * f0
        + e[i, 9] * f1
        + e[i, 10] * f2
    )


@inlined
def _mapped(e, two, x, drive, side, f0, f1, f2):
    """The state after a map, under the force f0 + f1 s + f2 s^2 (s from 0 to 1) on the rudder."""
    if not two:
        return (
            _row(e, 0, x, drive, side, f0, f1, f2),
            _row(e, 1, x, drive, side, f0, f1, f2),
            _row(e, 2, x, drive, side, f0, f1, f2),
            x[3],
            x[4],
        )
    return (
        _row(e, 0, x, drive, side, f0, f1, f2) + e[0, 3] * x[3] + e[0, 4] * x[4],
        _row(e, 1, x, drive, side, f0, f1, f2) + e[1, 3] * x[3] + e[1, 4] * x[4],
        _row(e, 2, x, drive, side, f0, f1, f2) + e[2, 3] * x[3] + e[2, 4] * x[4],
        _row(e, 3, x, drive, side, f0, f1, f2) + e[3, 3] * x[3] + e[3, 4] * x[4],
        _row(e, 4, x, drive, side, f0, f1, f2) + e[4, 3] * x[3] + e[4, 4] * x[4],
    )


@inlined
def _three(e, i, k, f):
    return e[i, k] * f[0] + e[i, k + 1] * f[1] + e[i, k + 2] * f[2]


@inlined
def _parted(e, x, drive, side, f, q, r):
    """The same of two bodies under the force f (3,) on the rudder, q (3,) between the two, of a shaft that hardens, and
    r (3,) on the motor.
    """
    z = _mapped(e, True, x, drive, side, f[0], f[1], f[2])
    return (
        z[0] + _three(e, 0, 11, q) + _three(e, 0, 14, r),
        z[1] + _three(e, 1, 11, q) + _three(e, 1, 14, r),
        z[2] + _three(e, 2, 11, q) + _three(e, 2, 14, r),
        z[3] + _three(e, 3, 11, q) + _three(e, 3, 14, r),
        z[4] + _three(e, 4, 11, q) + _three(e, 4, 14, r),
    )


@inlined
def _parabola(begin, middle, end):
    """(3,) of a force over a segment, from its values at three instants."""
    return begin, 4.0 * middle - 3.0 * begin - end, 2.0 * (end - 2.0 * middle + begin)


@inlined
def _extra(c, on, p, load, t, x, s):
    """What the laws of effects add to the force on a slipping rudder under a known ``load``, per total inertia; what
    they take of its inertia of one body only.
    """
    level = c[C_PLUS] if s > 0 else c[C_MINUS]
    share = 1.0 - c[PHI] if c[TWO] > 0 else 1.0
    force = total_torque(on, p, x[0], x[1], x[2], t) - s * share * (
        friction_level(on, p, level, x[0], x[1], x[2], float(s)) - level
    )
    if on[2, 0] > 0 and c[TWO] <= 0:
        side = 1.0 if x[0] > c[THETA_0] else -1.0
        rest = (
            c[BIAS]
            + load
            + c[A_1] * (c[THETA_0] - x[0])
            - c[C_1] * side
            + x[2]
            - (c[A_PLUS] if s > 0 else c[A_MINUS]) * x[1]
            - s * level
        )
        force = moved(on, p, x[0], x[1], rest + force) - rest
    return force


@inlined
def _beside(c, on, p, lawful, load, t, x, m):
    """(force on the rudder, between the bodies, on the motor) beside the linear ones of two bodies, per total
    inertia.
    """
    f = load + _extra(c, on, p, load, t, x, m[0]) if lawful and m[0] != 0 else load
    r = 0.0
    if lawful and m[3] != 0:
        r = drive_torque(on, p, x[3], x[4], x[2], t) - m[3] * (_motor_level(c, on, p, lawful, x) - _motor_friction(c))
    return f, _hardening(c, x) if c[HARDEN] > 0 else 0.0, r


@inlined
def _segment(e, step, c, on, p, lawful, t, x, m, drive, tau, a_emf, load, h, extra):
    """The state a whole segment later if no event falls into it, and what the laws add there; ``extra`` is what they
    add now (NaN: unknown). ``e`` holds maps over a ``step`` (see _no_maps).
    """
    two = c[TWO] > 0
    if _bends(c, m):
        bias = c[BIAS]
        c[BIAS] = bias + load
        z = _flow(c, on, p, lawful, t, x, m, drive, tau, a_emf, h)
        c[BIAS] = bias
        return z, np.nan
    driven = lawful and two and not _has_bristle(c)
    _make(e, 0, c, m, tau, a_emf, step, driven)
    if lawful or c[HARDEN] > 0:
        _make(e, 1, c, m, tau, a_emf, step, driven)
    whole, half = e[0, m[0] + 1, m[3] + 1, m[4] + 1], e[1, m[0] + 1, m[3] + 1, m[4] + 1]
    if two and not _has_bristle(c) and (lawful or c[HARDEN] > 0):
        f0, q0, r0 = _beside(c, on, p, lawful, load, t, x, m)
        z = _parted(half, x, drive, m[1], (f0, 0.0, 0.0), (q0, 0.0, 0.0), (r0, 0.0, 0.0))
        fa, qa, ra = _beside(c, on, p, lawful, load, t + 0.5 * h, z, m)
        z = _parted(
            whole, x, drive, m[1], (f0, 2.0 * (fa - f0), 0.0), (q0, 2.0 * (qa - q0), 0.0), (r0, 2.0 * (ra - r0), 0.0)
        )
        fb, qb, rb = _beside(c, on, p, lawful, load, t + h, z, m)
        return (
            _parted(whole, x, drive, m[1], _parabola(f0, fa, fb), _parabola(q0, qa, qb), _parabola(r0, ra, rb)),
            np.nan,
        )
    if not lawful or m[0] == 0:
        return _mapped(whole, two, x, drive, m[1], load, 0.0, 0.0), np.nan
    g0 = load + (extra if extra == extra else _extra(c, on, p, load, t, x, m[0]))
    ga = load + _extra(c, on, p, load, t + 0.5 * h, _mapped(half, two, x, drive, m[1], g0, 0.0, 0.0), m[0])
    end = _extra(c, on, p, load, t + h, _mapped(whole, two, x, drive, m[1], g0, 2.0 * (ga - g0), 0.0), m[0])
    gb = load + end
    return _mapped(whole, two, x, drive, m[1], *_parabola(g0, ga, gb)), end


@inlined
def _grazes(c, x, z, m, h):
    """True where a rudder on a bristle may have crossed theta_0 and come back between x and z."""
    inwards, outwards = -m[1] * x[1], m[1] * z[1]
    if c[C_1] <= 0 or m[0] == 0 or inwards <= 0 or outwards <= 0:
        return False
    return m[1] * (x[0] - c[THETA_0]) < inwards * h * inwards / (inwards + outwards)


@inlined
def _still(c, on, p, lawful, t, x, m, drive, tau, a_emf):
    """Whether a rudder on a bent bristle rests: in the corner, or within STILL of the bristle's whole bend from where
    it would.
    """
    if m[0] == 0:
        return x[1] == 0.0 and _violation(3, c, on, p, lawful, t, x, m) <= 0
    small = STILL * (c[C_PLUS] + c[C_MINUS])
    return (
        abs(x[1]) * math.sqrt(c[K_BRISTLE]) < small
        and abs(_derivative(c, on, p, lawful, t, x, m, drive, tau, a_emf)[1]) < small
    )


@inlined
def _turns(c, on, p, lawful, t, x, z, m, drive, tau, a_emf, h):
    """True where a slipping body may have stopped and gone on within the step from x to z: it brakes first, speeds up
    last.
    """
    if _has_bristle(c):
        return _grazes(c, x, z, m, h)
    if m[0] == 0 or _never_sticks(c, on):
        return False
    d0 = _derivative(c, on, p, lawful, t, x, m, drive, tau, a_emf)[1] * m[0]
    return (
        d0 < 0.0
        and abs(z[1]) < -d0 * h
        and _derivative(c, on, p, lawful, t + h, z, m, drive, tau, a_emf)[1] * m[0] > 0.0
    )


@inlined
def _law_step(c, a_emf):
    """Length of a segment [s] at most under a law."""
    return LAW_STEP / (max(abs(c[A_PLUS]), abs(c[A_MINUS])) + math.sqrt(abs(c[A_1])) + a_emf)


@njit(nogil=True)
def _cuts(c, h0, tau, a_emf, lawful, refine):
    """Segment ends within a uniform sample [s] and whether the input of this sample (1) or the one before (0) acts in
    each.

    Returns (ends (k,), fresh (k,), whole samples that the delay swallows).
    """
    step = h0
    if lawful:
        step = min(step, _law_step(c, a_emf))
    if c[FALL] > 0 and c[TAU] > 0:
        step = min(step, FALL_STEP * c[TAU])
    if c[TWO] > 0:
        step = min(
            step, CONTACT_STEP / math.sqrt(c[K_TWIST] / (c[RHO] * (1.0 - c[RHO])) if c[RHO] > 0 else c[K_BRISTLE])
        )
    step /= refine
    skip = int(c[DELAY] / h0 + 1e-9)
    late = c[DELAY] - skip * h0
    if late < 1e-9 * h0:
        late = 0.0
    before, after = int(math.ceil(late / step - 1e-9)), int(math.ceil((h0 - late) / step - 1e-9))
    ends, fresh = np.empty(before + after), np.zeros(before + after, np.int64)
    for k in range(before):
        ends[k] = late * (k + 1) / before
    for k in range(after):
        ends[before + k] = late + (h0 - late) * (k + 1) / after
        fresh[before + k] = 1
    return ends, fresh, skip


@inlined
def _clean(c, on, p, lawful, t, x, z, m, tau, load, h):
    """Whether the state z, h after x, lies within the mode of two bodies."""
    bias = c[BIAS]
    c[BIAS] = bias + load
    clean = not (_has_bristle(c) and _grazes(c, x, z, m, h))
    for event in range(7):
        clean = clean and _violation(event, c, on, p, lawful, t + h, z, m) <= 0
    if tau <= 0:
        clean = clean and _violation(3, c, on, p, lawful, t, x, m) <= 0
    c[BIAS] = bias
    return clean


@inlined
def _calm(c, x, h):
    """Whether the twist of two bodies is further from the ends of the play than it moves within h."""
    return c[GAP] <= 0 or abs(x[4] - x[1]) * h <= CALM * abs(abs(x[3] - x[0]) - c[GAP])


@inlined
def _steady(x, z):
    """Whether neither body comes near rest between the states x and z."""
    return abs(z[1]) >= CALM * abs(x[1]) and abs(z[4]) >= CALM * abs(x[4])


@inlined
def _fallen(c, on, p, lawful, t, x, m, drive, h):
    """The constant drive under which a current whose inductance does not fall comes as far within h as one whose
    inductance does under ``drive``, with the back-EMF of the segment's middle and what the inductance has fallen to
    there.
    """
    d = _derivative(c, on, p, lawful, t, x, m, drive, c[TAU], c[A_EMF])
    speed = _drive_speed(c, x) + 0.5 * h * _drive_speed(c, d)
    short, rate = x[2] - (drive - c[A_EMF] * speed), h / c[TAU]
    middle = x[2] + short * (math.exp(-0.5 * rate * (1.0 + _faster(c, x[2]))) - 1.0)
    kept = math.exp(-rate)
    return drive + short * (math.exp(-rate * (1.0 + _faster(c, middle))) - kept) / (1.0 - kept)


@inlined
def _faster(c, j):
    """How much faster, in shares, a current rises whose inductance falls: the iron keeps LEAST_IRON of it."""
    return min((c[FALL] * j) ** 2, 1.0 / LEAST_IRON - 1.0)


@inlined
def _last(ends):
    """Length of a sample's last segment [s]."""
    return ends[-1] - (ends[-2] if ends.size > 1 else 0.0)


@part
def _march(t, u, enable, load, y, gain, every, c, on, p, refine, x0, ends, fresh, skip, late, early, whole, leaps, out):
    """See ``_simulate``: through the samples, by maps over segments (late, early, the first of a sample) or, if it
    ``leaps``, over a whole sample.
    """
    n = t.size
    lawful, two, bristle, slips = is_lawful(on), c[TWO] > 0, _has_bristle(c), _never_sticks(c, on)
    h0, last = t[1] - t[0], _last(ends)
    tau, a_emf, bias = c[TAU], c[A_EMF], c[BIAS]
    h_max = np.inf
    if c[UPPER] < np.inf or c[LOWER] > -np.inf:
        h_max = CONTACT_STEP / (math.sqrt(c[K_STOP]) + c[D_STOP])
    if two or lawful:
        h_max = min(h_max, last / refine)
    corner = CORNER * (c[C_1] + c[C_PLUS]) * h0
    if bristle:
        corner = max(corner, BRISTLE_CORNER * c[C_1] * last * refine)
    budget = EVENT_BUDGET * n * (ends.size if bristle else 1) + 1000
    resting = -1  # the sample that begins in a rest which was checked already
    extra = np.nan  # what the laws add where a segment ended that holds no event
    x = (x0[0], x0[1], x0[2], x0[0], x0[1] if two and not bristle else 0.0)
    if bristle:  # a spring stretched by as much as a motion of this speed would have left it
        slip = 0.5 * (c[C_PLUS] + c[C_MINUS]) / c[K_BRISTLE]
        x = (x[0], x[1], x[2], x[0] - min(max(x[1] / math.sqrt(c[K_BRISTLE]), -slip), slip), 0.0)
    m = _start_mode(c, on, p, lawful, t[0], x)
    for k in range(n):
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = x[0], x[1], x[2], x[0] if bristle else x[3]
        if k == n - 1:
            break
        remember(on, p, x, t[k + 1] - t[k])
        if gain > 0.0 and k % every == 0 and y[k] == y[k]:
            resting, extra = -1, np.nan
            x, m = _corrected(c, on, p, lawful, t[k], x, m, gain * (y[k] - x[0]))
        uniform = abs(t[k + 1] - t[k] - h0) < 1e-6 * h0
        stretch = 1.0 if uniform else (t[k + 1] - t[k]) / h0
        start = 0.0
        if leaps and uniform and enable[k] and m[2] == 0 and _calm(c, x, h0):
            drive = c[B] * u[max(k - skip, 0)]
            if tau <= 0:
                x = (x[0], x[1], drive - a_emf * _drive_speed(c, x), x[3], x[4])
            z, _ = _segment(whole, h0, c, on, p, lawful, t[k], x, m, drive, tau, a_emf, load[k], h0, np.nan)
            if tau <= 0:
                z = (z[0], z[1], drive - a_emf * _drive_speed(c, z), z[3], z[4])
            if _calm(c, z, h0) and _steady(x, z) and _clean(c, on, p, lawful, t[k], x, z, m, tau, load[k], h0):
                x = z
                continue
        for i in range(ends.size):
            h = (ends[i] - start) * stretch
            now = t[k] + start * stretch
            start = ends[i]
            drive = c[B] * u[max(k - skip - 1 + fresh[i], 0)]
            if c[FALL] > 0 and tau > 0:
                drive = _fallen(c, on, p, lawful, now, x, m, drive, h)
            if uniform and enable[k] and m[2] == 0:
                e, step = (late, last) if fresh[i] == 1 else (early, ends[0])
                if m[0] == 0 and not two:
                    j = drive + (x[2] - drive) * math.exp(-h / tau) if tau > 0 else drive
                    x = (x[0], 0.0, x[2] if tau > 0 else drive, x[3], x[4])
                    z = (x[0], 0.0, j, x[3], x[4])
                    c[BIAS] = bias + load[k]
                    held = _violation(3, c, on, p, lawful, now + h, z, m) <= 0 and (
                        (tau > 0 and resting == k) or _violation(3, c, on, p, lawful, now, x, m) <= 0
                    )
                    c[BIAS] = bias
                    if held:
                        x = z
                        resting = k + 1 if i == ends.size - 1 and load[k + 1] == load[k] else k
                        continue
                elif not two:
                    if tau <= 0:
                        x = (x[0], x[1], drive - a_emf * x[1], x[3], x[4])
                    z, extra = _segment(
                        e,
                        step,
                        c,
                        on,
                        p,
                        lawful,
                        now,
                        x,
                        m,
                        drive,
                        tau,
                        a_emf,
                        load[k],
                        h,
                        extra if tau > 0 else np.nan,
                    )
                    if tau <= 0:
                        z = (z[0], z[1], drive - a_emf * z[1], z[3], z[4])
                    if (
                        (slips or z[1] * m[0] > 0)
                        and (z[0] - c[THETA_0]) * m[1] >= 0
                        and z[0] <= c[UPPER]
                        and z[0] >= c[LOWER]
                        and not (
                            abs(z[1]) < 0.2 * abs(x[1]) and _turns(c, on, p, lawful, now, x, z, m, drive, tau, a_emf, h)
                        )
                    ):
                        x = z
                        continue
                else:
                    if tau <= 0:
                        x = (x[0], x[1], drive - a_emf * _drive_speed(c, x), x[3], x[4])
                    if bristle and m[3] == 0:
                        j = drive + (x[2] - drive) * math.exp(-h / tau) if tau > 0 else x[2]
                        z = (x[0], x[1], j, x[3], x[4])
                        c[BIAS] = bias + load[k]
                        still = _still(c, on, p, lawful, now, x, m, drive, tau, a_emf) and _still(
                            c, on, p, lawful, now + h, z, m, drive, tau, a_emf
                        )
                        c[BIAS] = bias
                        if still:
                            x = z
                            continue
                    z, _ = _segment(e, step, c, on, p, lawful, now, x, m, drive, tau, a_emf, load[k], h, np.nan)
                    if tau <= 0:
                        z = (z[0], z[1], drive - a_emf * _drive_speed(c, z), z[3], z[4])
                    if _clean(c, on, p, lawful, now, x, z, m, tau, load[k], h):
                        x = z
                        continue
            extra = np.nan
            c[BIAS] = bias + load[k]
            if enable[k]:
                x, m, events = _advance(c, on, p, lawful, now, x, m, drive, tau, a_emf, h, h_max, corner)
            else:
                x, m, events = _advance(
                    c, on, p, lawful, now, (x[0], x[1], 0.0, x[3], x[4]), m, 0.0, 0.0, 0.0, h, h_max, corner
                )
            c[BIAS] = bias
            budget -= events
        if not _bounded(x) or budget < 0:
            out[k + 1 :, :] = np.nan
            return


def _simulate(t, u, enable, load, y, gain, every, c, on, p, refine, x0, out):
    """Fill out (N, 4) with (theta, w, j, theta_m) at the sample times, taken just before u[k] acts.

    ``gain`` in [0, 1] is the observer's: at one sample in ``every`` theta is moved by gain * (y - theta); 0 is a free
    run. ``y`` may hold NaN (no correction there). ``load`` is a known acceleration of the rudder, ``enable`` false an
    open circuit. ``on`` holds the rows of the effects with a law (see laws.rows_of), ``p`` (effects, N_PARAMETERS)
    their constants, of which memories change; ``refine`` divides the segments. A motion that runs away, or chatters
    beyond EVENT_BUDGET, is NaN from there on.
    """
    lawful, h0 = is_lawful(on), t[1] - t[0]
    tau, a_emf = c[TAU], c[A_EMF]
    ends, fresh, skip = _cuts(c, h0, tau, a_emf, lawful, refine)
    late = _no_maps()
    early = late if fresh[0] == 1 else _no_maps()
    leaps = c[TWO] > 0 and not _has_bristle(c) and c[HARDEN] <= 0 and c[FALL] <= 0 and ends.size > 1 and fresh[0] == 1
    leaps = leaps and (not lawful or refine * h0 <= _law_step(c, a_emf))
    whole = _no_maps() if leaps else late
    _march(t, u, enable, load, y, gain, every, c, on, p, refine, x0, ends, fresh, skip, late, early, whole, leaps, out)


READ, READ_BOOL = types.Array(types.float64, 1, "C", readonly=True), types.Array(types.bool_, 1, "C", readonly=True)
ROWS, LAWS = types.int64[:, ::1], types.float64[:, ::1]
VECTOR = types.float64[::1]

with compiled_cache():  # one signature each: locked and other arrays alike
    simulate_kernel = njit(
        types.void(
            READ, READ, READ_BOOL, READ, READ, types.float64, types.int64, VECTOR, ROWS, LAWS, types.int64, VECTOR, LAWS
        ),
        nogil=True,
        cache=True,
    )(_simulate)
