"""The forces of Eq. (1)/(5) on both bodies within a mode, and on a body at rest; all per total inertia."""

from __future__ import annotations

import math

from ers_mj.plants.compiling.compiled import inline, unit
from ers_mj.plants.kernel.laws import drive_torque, friction_level, moved, total_torque
from ers_mj.plants.kernel.state import C, F, M, State, X, drive_speed, has_bristle, is_parted, types

LEAST_LEVEL = 0.2  # of the mean friction, which laws cannot lower a bristle's beyond
PAIR, TRIPLE = types.UniTuple(F, 2), types.UniTuple(F, 3)


@inline
def stop_force(c, stop, theta, w):
    """Acceleration of the touched stop (0 where none is)."""
    if stop == 0:
        return 0.0
    wall = c.upper if stop > 0 else c.lower
    return -c.k_stop * (theta - wall) - c.d_stop * w


@inline
def stop_at(c, theta):
    """(force of the spring of the stop that is touched there, damping in it), of steps that know no modes."""
    if theta > c.upper:
        return c.k_stop * (c.upper - theta), c.d_stop
    if theta < c.lower:
        return c.k_stop * (c.lower - theta), c.d_stop
    return 0.0, 0.0


@inline
def twist_force(c, twist, theta, w, theta_m, w_m):
    """Acceleration that the motor's side exerts on the rudder through the contact."""
    if twist == 0:
        return 0.0
    x = theta_m - theta - twist * c.gap
    return c.k_twist * x * (1.0 + c.harden * x * x) + c.d_twist * (w_m - w)


@inline
def hardening(c, x):
    """What a shaft that hardens adds to the force of its spring."""
    return c.k_twist * c.harden * (x.theta_m - x.theta) ** 3


@inline
def bristle_level(c, x, direction):
    """Level of friction on a bristle in one direction."""
    level = c.c_2_plus if direction > 0 else c.c_2_minus
    if c.lawful > 0:
        level = friction_level(c, level, x.theta, x.w, x.j, direction)
    return max(level, LEAST_LEVEL * 0.5 * (c.c_2_plus + c.c_2_minus))


@inline
def _bending(c, share):
    """Speed at which a bristle bends over the rudder's, under this share of the level along the motion."""
    if c.dahl == 1.0:
        return 1.0 - share
    return math.copysign(abs(1.0 - share) ** c.dahl, 1.0 - share)


@inline
def bristle(c, x, s_m):
    """(force of the bristle on the rudder; the speed of its foot)."""
    if s_m != 0:
        return -s_m * bristle_level(c, x, float(s_m)), x.w
    pull, speed = c.k_bristle * (x.theta - x.theta_m), 0.0
    if x.w != 0.0:
        way = 1.0 if x.w > 0 else -1.0
        speed = x.w * (1.0 - _bending(c, way * pull / bristle_level(c, x, way)))
    return -pull - c.d_bristle * math.exp(-((x.w / c.fade) ** 2)) * (x.w - speed), speed


@inline
def viscous(c, s_m, w):
    """Mechanical damping of a rudder on a bristle."""
    return c.a_mech_plus if s_m > 0 or (s_m == 0 and w > 0) else c.a_mech_minus


@unit(TRIPLE(C, F, X, M))
def held_rudder(c, t, x, m):
    """(net acceleration without friction on the rudder at rest, its friction up, down)."""
    theta, _, j, theta_m, w_m = x
    a = c.bias + c.a_1 * (c.theta_0 - theta) - c.c_1 * m.side + stop_force(c, m.stop, theta, 0.0)
    share = 1.0
    if has_bristle(c):
        a += j + bristle(c, State(theta, 0.0, j, theta_m, w_m), m.s_m)[0]
        share = 0.0
    elif c.two_body > 0:
        a += twist_force(c, m.twist, theta, 0.0, theta_m, w_m)
        share = 1.0 - c.phi
    else:
        a += j
    up, down = c.c_2_plus, c.c_2_minus
    if c.lawful > 0:
        a += total_torque(c, theta, 0.0, j, t)
        up, down = friction_level(c, up, theta, 0.0, j, 1.0), friction_level(c, down, theta, 0.0, j, -1.0)
    up, down = share * up, share * down
    if m.side == 0:
        up, down = up + c.c_1, down + c.c_1
    return a, up, down


@inline
def motor_friction(c):
    """Friction of the motor's side. Without any it never sticks: its slip s_m stays 1."""
    return c.phi * 0.5 * (c.c_2_plus + c.c_2_minus)


@inline
def motor_level(c, theta, j, w_m):
    """The same with what laws make of it at the motor's speed, the mean of both directions."""
    up, down = c.c_2_plus, c.c_2_minus
    if c.lawful > 0 and c.phi > 0 and c.frictions > 0:
        up, down = friction_level(c, up, theta, w_m, j, 1.0), friction_level(c, down, theta, w_m, j, -1.0)
    return c.phi * 0.5 * (up + down)


@unit(PAIR(C, F, X, M))
def held_motor(c, t, x, m):
    """(net acceleration without friction on the motor's side at rest, its friction)."""
    a = x.j - twist_force(c, m.twist, x.theta, x.w, x.theta_m, 0.0)
    if c.lawful > 0:
        a += drive_torque(c, x.theta_m, 0.0, x.j, t)
    return a, motor_level(c, x.theta, x.j, 0.0)


@inline
def _rudder_acceleration(c, t, x, m, push):
    """Acceleration of a rudder that slips, under what the motor's side or a bristle adds."""
    theta, w, j, _, _ = x
    level = c.c_2_plus if m.s > 0 else c.c_2_minus
    a_mech = c.a_mech_plus if m.s > 0 else c.a_mech_minus
    force = c.bias + c.a_1 * (c.theta_0 - theta) - c.c_1 * m.side + stop_force(c, m.stop, theta, w)
    if c.lawful > 0:
        force += total_torque(c, theta, w, j, t)
        level = friction_level(c, level, theta, w, j, float(m.s))
    if is_parted(c):
        force += push - (1.0 - c.beta) * a_mech * w - (1.0 - c.phi) * level * m.s
        return force / (1.0 - c.rho)
    if has_bristle(c):
        return force + j + push - viscous(c, m.s_m, w) * w
    a = force + j - a_mech * w - level * m.s
    return moved(c, theta, w, a) if c.lawful > 0 else a


@unit(F(C, F, X, M, F))
def _motor_acceleration(c, t, x, m, push):
    """Acceleration of a motor's side that slips."""
    theta, _, j, theta_m, w_m = x
    a_mech = c.a_mech_plus if w_m > 0 else c.a_mech_minus
    force = j - push - c.beta * a_mech * w_m - m.s_m * motor_level(c, theta, j, w_m)
    if c.lawful > 0:
        force += drive_torque(c, theta_m, w_m, j, t)
    return force / c.rho


@inline
def derivative(c, t, x, m, drive, tau, a_emf):
    """d/dt of (theta, w, j, theta_m, w_m) within a mode."""
    theta, w, j, theta_m, w_m = x
    dj = dw = dw_m = push = 0.0
    if tau > 0:
        dj = (drive - a_emf * drive_speed(c, x) - j) / tau
    else:
        j = drive - a_emf * drive_speed(c, x)
    x = State(theta, w, j, theta_m, w_m)
    if is_parted(c):
        push = twist_force(c, m.twist, theta, w, theta_m, w_m)
    elif has_bristle(c):
        push, w_m = bristle(c, x, m.s_m)
    if m.s != 0:
        dw = _rudder_acceleration(c, t, x, m, push)
    if is_parted(c) and m.s_m != 0:
        dw_m = _motor_acceleration(c, t, x, m, push)
    return State(w, dw, dj, w_m, dw_m)


@inline
def extra(c, load, t, x, s):
    """What the laws of effects add to the force on a slipping rudder under a known ``load``; what they take of its
    inertia of one body only.
    """
    theta, w, j, _, _ = x
    level = c.c_2_plus if s > 0 else c.c_2_minus
    share = 1.0 - c.phi if c.two_body > 0 else 1.0
    force = total_torque(c, theta, w, j, t) - s * share * (friction_level(c, level, theta, w, j, float(s)) - level)
    if c.inertias > 0 and c.two_body <= 0:
        side = 1.0 if theta > c.theta_0 else -1.0
        a_mech = c.a_mech_plus if s > 0 else c.a_mech_minus
        rest = c.bias + load + c.a_1 * (c.theta_0 - theta) - c.c_1 * side + j - a_mech * w - s * level
        force = moved(c, theta, w, rest + force) - rest
    return force


@unit(TRIPLE(C, F, F, X, M))
def beside(c, load, t, x, m):
    """(force on the rudder, between the bodies, on the motor) beside the linear ones of two bodies."""
    f = load + extra(c, load, t, x, m.s) if c.lawful > 0 and m.s != 0 else load
    r = 0.0
    if c.lawful > 0 and m.s_m != 0:
        level = motor_level(c, x.theta, x.j, x.w_m)
        r = drive_torque(c, x.theta_m, x.w_m, x.j, t) - m.s_m * (level - motor_friction(c))
    return f, hardening(c, x) if c.harden > 0 else 0.0, r
