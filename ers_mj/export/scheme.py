"""The scheme that exported models run by: one text, in Python here, in C by translation.py.

    half a step of the positions -> what arrives of the command -> firmware or winding -> forces -> speeds at the end of
    the step, dry friction and the preload's corner set-valued -> the other half -> sensor

Leapfrog, dampers by the trapezium, a reversal in its instant: of second order in the step h. `c` holds the servo's
numbers, `x` its state, accelerations per total inertia (see effects/quantities.Coefficients and
plants/position_loop.LoopNumbers for the letters). What laws of effects do is called here and written by portable.py.
Only scalars, attributes, `if`, `while` and `math`: that is what translation.py reads.
"""

# ruff: noqa: F821  the calls to what portable.py writes
# mypy: ignore-errors
import math


def sign(a):
    """Of a number, 0 of 0."""
    if a > 0.0:
        return 1.0
    if a < 0.0:
        return -1.0
    return 0.0


def limited(a, most):
    """Within +-most."""
    return min(max(a, -most), most)


def looked_up(at, to, n, a):
    """Straight between the n points (at, to), and on beyond them."""
    k = 0
    while k < n - 2 and at[k + 1] <= a:
        k += 1
    return to[k] + (to[k + 1] - to[k]) * (a - at[k]) / (at[k + 1] - at[k])


def keep(past, n, count, a):
    """Remember a as the count-th of the last n."""
    past[int(count % n)] = a


def late(past, n, count, back):
    """What was kept `back` steps before the count-th, straight between them."""
    whole = math.floor(back)
    part = back - whole
    newer = past[int((count + 4 * n - whole) % n)]
    return (1.0 - part) * newer + part * past[int((count + 4 * n - whole - 1) % n)]


# -- dry friction -----------------------------------------------------------------------------------------------------


def sticking(gain, push, a, level, w, h):
    """Speed after h of gain w' = push - a w - level Sgn(w)."""
    most = gain + 0.5 * h * a
    reach = (gain - 0.5 * h * a) * w + h * push
    if level <= 0.0:
        return reach / most
    rest = 1.0
    if w != 0.0:
        end = (reach - h * level * sign(w)) / most
        if end * w >= 0.0:
            return end
        rest = 1.0 - w / (w - end)
    if abs(push) <= level:
        return 0.0
    return rest * h * (push - level * sign(push)) / most


def creeping(gain, push, a, level, creep, heavy, w, h):
    """The same where friction below its level is creep w, of a body that answers heavily there."""
    soft = 0.5 * h * (a + creep)
    mass = heavy * gain
    end = ((mass - soft) * w + h * push) / (mass + soft)
    holds = push - 0.5 * a * (end + w) - gain * (end - w) / h
    if abs(holds) <= level:
        return end
    return ((gain - 0.5 * h * a) * w + h * (push - sign(holds) * level)) / (gain + 0.5 * h * a)


def rubbed(c, gain, push, a, level, w):
    """Speed at the end of a step under dry friction."""
    if c.creep < math.inf:
        return creeping(gain, push, a, level, c.creep, c.heavy, w, c.h)
    return sticking(gain, push, a, level, w, c.h)


def cornered(c, gain, push, a, level, w, d):
    """The same beside the spring's preload, c_1 Sgn(d), d the place from theta_0 in the middle of the step."""
    if c.c_1 <= 0.0:
        return rubbed(c, gain, push, a, level, w)
    above = rubbed(c, gain, push - c.c_1, a, level, w)
    below = rubbed(c, gain, push + c.c_1, a, level, w)
    corner = -d / c.h
    end = corner
    if above > corner:
        end = above
    elif below < corner:
        end = below
    after = d + c.h * end
    if d * after < 0.0:
        return rubbed(c, gain, push - c.c_1 * (abs(after) - abs(d)) / (after - d), a, level, w)
    return end


def friction(c, x, theta, w, push):
    """Level of friction of the whole train along the motion, at rest the way it is pushed."""
    way = 1.0 if w > 0.0 or (w == 0.0 and push > 0.0) else -1.0
    level = c.c_2_plus if way > 0.0 else c.c_2_minus
    j = x.carried if c.looped > 0.0 else x.j
    return max(friction_level(c, x, level, theta, w, j, way), 0.0)


def unbent(c, left, way):
    """What is left of a bristle's share of its level to bend after a way counted in its whole bend (Dahl)."""
    if c.dahl == 1.0:
        return left * math.exp(-way)
    if left == 0.0:
        return 0.0
    after = abs(left) ** (1.0 - c.dahl) + (c.dahl - 1.0) * way
    return sign(left) * after ** (1.0 / (1.0 - c.dahl)) if after > 0.0 else 0.0


def bend(c, x, theta):
    """Let the bristle that carries the load's friction push, damp and, by the speed of the last step, bend."""
    level = max(friction(c, x, theta, x.w, x.push), 0.1 * (c.c_2_plus + c.c_2_minus))
    if x.w != 0.0:
        whole = sign(x.w) * level / c.k_bristle
        x.z = whole * (1.0 - unbent(c, 1.0 - x.z / whole, abs(x.w) * c.h * c.k_bristle / level))
    x.push -= c.on_bristle * c.k_bristle * x.z
    left = max(1.0 - sign(x.w) * c.k_bristle * x.z / level, 0.0)
    x.damp += c.on_bristle * c.d_bristle * left**c.dahl * math.exp(-((x.w / c.fade) ** 2))


# -- drive ------------------------------------------------------------------------------------------------------------


def charged(c, j, drive, w_m, h):
    """The drive acceleration h later behind the winding."""
    rate = 1.0 / c.tau_e
    if c.fall > 0.0:
        rate = (1.0 + min((c.fall * j) ** 2, c.most_fallen)) / c.tau_e
    end = drive - c.a_emf * w_m
    return end + (j - end) * math.exp(-rate * h)


def energise(c, x):
    """A drive under a voltage: the motor's force, what brakes it, and the current."""
    w_m = x.w_m if c.parted > 0.0 else x.w
    x.drive = c.b * x.asked
    if c.tau_e > 0.0:
        x.j = charged(c, x.j, x.drive, w_m, 0.5 * c.h)
        x.force = x.j
        x.brake = 0.0
    else:
        x.j = x.drive - c.a_emf * w_m
        x.force = x.drive
        x.brake = c.a_emf


def pushed(c, e):
    """The error that the firmware answers to."""
    size = abs(e)
    if c.band > 0.0:
        if size <= c.band:
            return 0.0
        size = min(size - c.lost, 30.0 * (size - c.band))
    if c.least > 0.0 and size > 0.0:
        size = max(size, c.least / c.K)
    return sign(e) * size


def command_loop(c, x):
    """A firmware's loop: what it asks for ahead of its damper, and what of the drive is late."""
    r = x.r + limited(x.asked - x.r, c.R * c.h)
    mean = 0.5 * (x.r + r) if c.R < math.inf else x.asked
    x.r = r
    x.e = mean - (x.theta_m if c.at_motor > 0.0 else x.theta)
    x.ahead = c.K * pushed(c, x.e) + x.xi
    if c.lag > 0.0:
        lag_behind(c, x)
        x.ahead -= c.D * x.slow
    x.whole = x.ahead
    back = c.dead_time / c.h
    x.fresh = max(1.0 - back, 0.0)
    x.late = 0.0
    if back > 0.0:
        keep(x.drives, c.drives_kept, x.count, 0.0)
        x.late = late(x.drives, c.drives_kept, x.count, back)
    x.j = x.drive
    x.force = x.fresh * x.ahead + x.late
    x.brake = x.fresh * own_damping(c) + c.a_emf


def lag_behind(c, x):
    """Bring the speed that the firmware has on by half a step."""
    w = x.w_m if c.at_motor > 0.0 else x.w
    x.slow = w + (x.slow - w) * math.exp(-0.5 * c.h / c.lag)


def own_damping(c):
    """What the firmware's damper makes of the speed itself."""
    return 0.0 if c.lag > 0.0 else c.D


def ask(c, x, v):
    """The motor's force where the firmware asks for v beyond its limit."""
    x.force = x.fresh * limited(v, c.L) + x.late
    x.brake = c.a_emf


def asked_of(c, x, w_before, w):
    """What the firmware asks for at the mean of two speeds."""
    return x.ahead - 0.5 * own_damping(c) * (w_before + w)


def bridge(c, x, w_before, w):
    """Take off what the firmware asks for what the bridge loses of it, at the mean of two speeds."""
    x.ahead = x.whole - limited(x.whole - 0.5 * own_damping(c) * (w_before + w), c.idle)


def integrate(c, x, v):
    """Bring the loop's integral on, and keep the drive."""
    if c.I > 0.0 and (abs(v) < c.L or v * x.e < 0.0):
        x.xi = limited(x.xi + c.h * c.I * x.e, c.L)
    x.drive = limited(v, c.L)
    keep(x.drives, c.drives_kept, x.count, x.drive)


# -- bodies -----------------------------------------------------------------------------------------------------------


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
        if abs(v) > c.L:
            ask(c, x, v)
            w = turn_one(c, x)
        current = x.fresh * limited(v, c.L) + x.late - 0.5 * c.a_emf * (x.w + w)
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
        x.carried = (1.0 - c.share) * (w - x.w) / c.h - x.push - x.wall
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


def settle_two(c, x):
    """A motor and a load with a play or a shaft between them."""
    touch(c, x)
    w = x.w
    w_m = x.w_m
    v = 0.0
    mean = 0.5 * (c.c_2_plus + c.c_2_minus)
    j = x.touch if c.looped > 0.0 else x.j
    level_m = friction(c, x, x.theta, x.w_m, x.force)
    if c.looped <= 0.0:
        up = friction_level(c, x, c.c_2_plus, x.theta, x.w_m, j, 1.0)
        level_m = 0.5 * (up + friction_level(c, x, c.c_2_minus, x.theta, x.w_m, j, -1.0)) if mean > 0.0 else 0.0
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
            if abs(v) > c.L:
                ask(c, x, v)
                w_m = turn_motor(c, x, w, level_m)
        k += 1
    if c.looped > 0.0:
        integrate(c, x, v)
        x.carried = x.touch
    x.w = w
    x.w_m = w_m
    if c.looped > 0.0 and c.lag > 0.0:
        lag_behind(c, x)


# -- a step -----------------------------------------------------------------------------------------------------------


def reading(c, x):
    """What the sensor shows now."""
    y = x.theta_m if c.log_at_motor > 0.0 else x.theta
    if c.T_sensor > 0.0:
        y = x.sensed
    if c.late_sensor > 0.0:
        y = late(x.seen, c.seen_kept, x.count, c.late_sensor / c.h)
    return sensor_law(c, y)


def sense(c, x):
    """Bring the sensor's lag on, theta taken as straight within the step, and keep what it saw."""
    y = x.theta_m if c.log_at_motor > 0.0 else x.theta
    if c.T_sensor > 0.0:
        ratio = c.T_sensor / c.h
        decay = math.exp(-1.0 / ratio)
        x.sensed = decay * x.sensed + (ratio * (1.0 - decay) - decay) * x.before + (1.0 - ratio * (1.0 - decay)) * y
        x.before = y
        y = x.sensed
    keep(x.seen, c.seen_kept, x.count, y)


def step(c, x, command):
    """Bring the state on by the step h under a command."""
    remember(c, x, c.h)
    x.theta += 0.5 * c.h * x.w
    x.theta_m += 0.5 * c.h * x.w_m
    keep(x.past, c.past_kept, x.count, drive_law(c, command))
    x.asked = late(x.past, c.past_kept, x.count, c.delay / c.h)
    if c.looped > 0.0:
        command_loop(c, x)
    else:
        energise(c, x)
    press(c, x)
    if c.k_bristle > 0.0:
        x.damp = (1.0 - c.beta) * x.damp if c.parted > 0.0 else x.damp
        bend(c, x, x.theta)
    if c.parted > 0.0:
        settle_two(c, x)
    else:
        settle_one(c, x)
    if c.looped <= 0.0 and c.tau_e > 0.0:
        x.j = charged(c, x.j, x.drive, x.w_m if c.parted > 0.0 else x.w, 0.5 * c.h)
    x.theta += 0.5 * c.h * x.w
    x.theta_m += 0.5 * c.h * x.w_m
    x.t += c.h
    x.count += 1
    sense(c, x)


def begin(c, x, command):
    """At rest at theta (set before), the command held before."""
    x.theta_m = x.theta
    x.sensed = x.theta
    x.before = x.theta
    x.r = command
    k = 0
    while k < c.past_kept:
        x.past[k] = drive_law(c, command)
        k += 1
    k = 0
    while k < c.seen_kept:
        x.seen[k] = x.theta
        k += 1
    if c.looped > 0.0:
        held = -c.bias - c.a_1 * (c.theta_0 - x.theta) - total_torque(c, x, x.theta, 0.0, 0.0, 0.0)
        v = c.K * (command - x.theta)
        if c.I > 0.0:
            x.xi = limited(held, c.L) - v
        x.drive = limited(v + x.xi, c.L)
    k = 0
    while k < c.drives_kept:
        x.drives[k] = x.drive
        k += 1
