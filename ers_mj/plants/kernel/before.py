"""What arrived before the first sample, of which a dead time lets the motor still see something."""

from __future__ import annotations

from ers_mj.plants.compiling.compiled import kernel
from ers_mj.plants.kernel.forces import stop_force
from ers_mj.plants.kernel.laws import friction_level, total_torque
from ers_mj.plants.kernel.modes import start_mode
from ers_mj.plants.kernel.state import VECTOR, F, State, has_bristle, plant_in


@kernel(F(F, F, F, VECTOR))
def resting_input(t, u, theta, plant):
    """The input nearest to u under which the plant, in one piece, rests at theta: what a servo at rest was told before,
    since under any other it would not be at rest.
    """
    c = plant_in(plant)
    if c.b == 0.0:
        return u
    m, j = start_mode(c, State(theta, 0.0, 0.0, theta, 0.0)), c.b * u
    push = c.bias + c.a_1 * (c.theta_0 - theta) - c.c_1 * m.side + stop_force(c, m.stop, theta, 0.0)
    up, down = c.c_2_plus, c.c_2_minus
    if c.lawful > 0:
        push += total_torque(c, theta, 0.0, j, t)
        up, down = friction_level(c, up, theta, 0.0, j, 1.0), friction_level(c, down, theta, 0.0, j, -1.0)
    if has_bristle(c):  # which begins unbent
        up = down = 0.0
    if m.side == 0:
        up, down = up + c.c_1, down + c.c_1
    return min(max(j, -push - down), up - push) / c.b
