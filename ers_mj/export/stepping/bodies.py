"""One body, or a motor and a load: their speeds at the end of a step."""

# ruff: noqa: F821  the calls to other parts and to what portable.py writes
# mypy: ignore-errors


def press(c, x):
    """The forces on the load: springs, laws of effects, stops, the bristle."""
    x.push = c.bias + c.a_1 * (c.theta_0 - x.theta) + total_torque(c, x, x.theta, x.w, x.j, x.t)
    x.damp = c.a_mech_plus if x.w > 0.0 else c.a_mech_minus
    x.wall = 0.0
    x.d_wall = 0.0
    if x.theta > c.upper:
        x.wall = c.k_stop * (c.upper - x.theta)
        x.d_wall = c.d_stop
    if x.theta < c.lower:
        x.wall = c.k_stop * (c.lower - x.theta)
        x.d_wall = c.d_stop


def turn_one(c, x):
    """The speed of one body at the end of the step, under the motor's force as it stands."""
    gain = inertia_at(c, x, x.theta) * (c.buried if x.wall != 0.0 else 1.0)
    push = x.push + x.wall + x.force - half_slope_at(c, x, x.theta) * x.w * x.w
    level = 0.0 if c.k_bristle > 0.0 else friction(c, x, x.theta, x.w, push)
    return cornered(c, gain, push, x.damp + x.d_wall + x.brake, level, x.w, x.theta - c.theta_0)


def carry(c, x, v, w_m):
    """The torque that the gear carries: the motor's, and what the load holds against it, by the other's inertia."""
    motor = limited(x.fresh * limited(v, passed(c)) + x.late - c.a_emf * w_m, c.most)
    x.carried = (1.0 - c.share) * motor - c.share * (x.push + x.wall)


def settle_one(c, x):
    """One body: within the limits of its firmware, and not pulled by a stop."""
    if c.looped > 0.0 and c.idle > 0.0:
        bridge(c, x, x.w, x.w)
        x.force = x.fresh * x.ahead + x.late
    w = turn_one(c, x)
    v = 0.0
    if c.looped > 0.0 and c.idle > 0.0:
        bridge(c, x, x.w, w)
        x.force = x.fresh * x.ahead + x.late
        w = turn_one(c, x)
    if c.looped > 0.0:
        v = asked_of(c, x, x.w, w)
        if abs(v) > passed(c):
            ask(c, x, v)
            w = turn_one(c, x)
        current = x.fresh * limited(v, passed(c)) + x.late - 0.5 * c.a_emf * (x.w + w)
        if abs(current) > c.most:
            x.force = limited(current, c.most)
            x.brake = 0.0
            w = turn_one(c, x)
    held = x.wall - 0.5 * x.d_wall * (x.w + w) - (c.buried - 1.0) * (w - x.w) / c.h
    if held * x.wall < 0.0:
        x.wall = 0.0
        x.d_wall = 0.0
        w = turn_one(c, x)
    if c.looped > 0.0:
        carry(c, x, v, 0.5 * (x.w + w))
        integrate(c, x, v)
    x.w = w
    x.w_m = w
    if c.looped > 0.0 and c.lag > 0.0:
        lag_behind(c, x)


def touch(c, x):
    """The contact between motor and load: none within the play, and it does not pull back."""
    twist = x.theta_m - x.theta
    x.touch = 0.0
    x.d_touch = c.grease
    if abs(twist) > c.gap:
        over = twist - sign(twist) * c.gap
        x.touch = c.k_twist * over * (1.0 + c.harden * over * over)
        x.d_touch = c.d_twist + c.grease
        if c.gap > 0.0 and (x.touch + x.d_touch * (x.w_m - x.w)) * x.touch < 0.0:
            x.d_touch = -x.touch / (x.w_m - x.w)


def turn_motor(c, x, w, level):
    """The motor's speed at the end of the step beside a load that ends at w."""
    push = x.force - x.touch + 0.5 * x.d_touch * (x.w + w)
    if c.looped <= 0.0:
        push += motor_torque(c, x, x.theta_m, x.w_m, x.j, x.t)
    damp = c.beta * (c.a_mech_plus if x.w_m > 0.0 else c.a_mech_minus)
    return rubbed(c, c.rho, push, damp + x.brake + x.d_touch, c.phi * level, x.w_m)


def friction_on_motor(c, x):
    """Level of friction of the whole train by the motor's speed: behind a loop along the motion, else the mean of both
    directions.
    """
    if c.looped > 0.0:
        return friction(c, x, x.theta, x.w_m, x.force)
    if c.c_2_plus + c.c_2_minus <= 0.0:
        return 0.0
    up = friction_level(c, x, c.c_2_plus, x.theta, x.w_m, x.j, 1.0)
    return 0.5 * (up + friction_level(c, x, c.c_2_minus, x.theta, x.w_m, x.j, -1.0))


def settle_two(c, x):
    """A motor and a load with a play or a shaft between them."""
    touch(c, x)
    w = x.w
    w_m = x.w_m
    v = 0.0
    level_m = friction_on_motor(c, x)
    push = x.push + x.wall + x.touch
    level = 0.0 if c.k_bristle > 0.0 else (1.0 - c.phi) * friction(c, x, x.theta, x.w, push)
    damp = (1.0 - c.beta) * x.damp + x.d_wall if c.k_bristle <= 0.0 else x.damp + x.d_wall
    if c.looped > 0.0:
        seen = x.w_m if c.at_motor > 0.0 else x.w
        bridge(c, x, seen, seen)
    k = 0
    while k < 3:
        drag = 0.5 * x.d_touch * (x.w_m + w_m)
        w = cornered(c, 1.0 - c.rho, push + drag, damp + x.d_touch, level, x.w, x.theta - c.theta_0)
        if c.looped > 0.0 and c.at_motor <= 0.0:
            bridge(c, x, x.w, w)
            v = asked_of(c, x, x.w, w)
            ask(c, x, v)
        elif c.looped > 0.0:
            x.force = x.fresh * x.ahead + x.late
            x.brake = x.fresh * own_damping(c) + c.a_emf
        w_m = turn_motor(c, x, w, level_m)
        if c.looped > 0.0 and c.at_motor > 0.0:
            bridge(c, x, x.w_m, w_m)
            v = asked_of(c, x, x.w_m, w_m)
            if abs(v) > passed(c):
                ask(c, x, v)
                w_m = turn_motor(c, x, w, level_m)
        k += 1
    if c.looped > 0.0:
        carry(c, x, v, 0.5 * (x.w_m + w_m))
        integrate(c, x, v)
    x.w = w
    x.w_m = w_m
    if c.looped > 0.0 and c.lag > 0.0:
        lag_behind(c, x)
