"""What was before the first sample of a servo at rest: the input, of which a dead time lets the motor still see
something, and how its load had twisted it.
"""

from __future__ import annotations

import math

from ers_mj.plants.compiling.compiled import inline, kernel
from ers_mj.plants.kernel.forces import stop_force
from ers_mj.plants.kernel.laws import friction_level, total_torque
from ers_mj.plants.kernel.modes import start_mode
from ers_mj.plants.kernel.state import VECTOR, F, State, has_bristle, plant_in


@inline
def _held(c, m, t, theta, j):
    """What springs, a stop and laws of effects make of a load at rest there."""
    push = c.bias + c.a_1 * (c.theta_0 - theta) - c.c_1 * m.side + stop_force(c, m.stop, theta, 0.0)
    return push + total_torque(c, theta, 0.0, j, t) if c.lawful > 0 else push


@kernel(F(F, F, F, VECTOR))
def resting_input(t, u, theta, plant):
    """The input nearest to u under which the plant, in one piece, rests at theta: what a servo at rest was told before,
    since under any other it would not be at rest.
    """
    c = plant_in(plant)
    if c.b == 0.0:
        return u
    m, j = start_mode(c, State(theta, 0.0, 0.0, theta, 0.0)), c.b * u
    push = _held(c, m, t, theta, j)
    up, down = c.c_2_plus, c.c_2_minus
    if c.lawful > 0:
        up, down = friction_level(c, up, theta, 0.0, j, 1.0), friction_level(c, down, theta, 0.0, j, -1.0)
    if has_bristle(c):  # which begins unbent
        up = down = 0.0
    if m.side == 0:
        up, down = up + c.c_1, down + c.c_1
    return min(max(j, -push - down), up - push) / c.b


@inline
def twist_at_rest(c, t, theta):
    """How far the motor's side is ahead of a load that rests at theta: against a play, and into a shaft, as far as the
    load's own friction, and a preload at its corner, do not hold it. A load that is nearer to the corner than that
    has been drawn into it: that is where it is.
    """
    if c.two_body <= 0:
        return 0.0
    m = start_mode(c, State(theta, 0.0, 0.0, theta, 0.0))
    push = _held(c, m, t, theta, 0.0)
    pushed = abs(push) - (1.0 - c.phi) * 0.5 * (c.c_2_plus + c.c_2_minus) - (c.c_1 if m.side == 0 else 0.0)
    if pushed <= 0.0:
        return 0.0
    x = even = pushed / c.k_twist if c.k_twist > 0.0 else 0.0
    for _ in range(8):  # steps of Newton's to the root of k x (1 + harden x^2), from beyond it
        x -= (x * (1.0 + c.harden * x * x) - even) / (1.0 + 3.0 * c.harden * x * x)
    if c.c_1 > 0.0 and abs(theta - c.theta_0) <= c.gap + x:
        return 0.0
    return -math.copysign(c.gap + x, push)


@kernel(F(F, F, VECTOR))
def resting_twist(t, theta, plant):
    """How far the motor's side [output unit] is ahead of a load that rests at theta."""
    return twist_at_rest(plant_in(plant), t, theta)
