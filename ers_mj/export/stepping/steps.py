"""A step, its beginning, and what the sensor shows."""

# ruff: noqa: F821  the calls to other parts and to what portable.py writes
# mypy: ignore-errors
import math


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


def place(c, x):
    """Both bodies at rest, the one that is logged at theta (set before): a weight that the load's friction does not
    hold lies against the play and twists the shaft.
    """
    x.theta_m = x.theta
    if c.looped > 0.0 and c.parted > 0.0:
        hold = c.bias + c.a_1 * (c.theta_0 - x.theta) + total_torque(c, x, x.theta, 0.0, 0.0, 0.0)
        pushed = abs(hold) - (1.0 - c.phi) * 0.5 * (c.c_2_plus + c.c_2_minus)
        x_0 = pushed / c.k_twist if pushed > 0.0 and c.k_twist > 0.0 else 0.0
        over = x_0
        k = 0
        while k < 8:
            over -= (over * (1.0 + c.harden * over * over) - x_0) / (1.0 + 3.0 * c.harden * over * over)
            k += 1
        twist = -sign(hold) * (c.gap + over) if pushed > 0.0 else 0.0
        if c.log_at_motor > 0.0:
            x.theta -= twist
        else:
            x.theta_m += twist


def begin(c, x, command):
    """At rest where the log shows theta (set before), the command held before."""
    shown = x.theta
    place(c, x)
    x.sensed = shown
    x.before = shown
    x.r = command
    k = 0
    while k < c.past_kept:
        x.past[k] = drive_law(c, command)
        k += 1
    k = 0
    while k < c.seen_kept:
        x.seen[k] = shown
        k += 1
    if c.looped > 0.0:
        held = -c.bias - c.a_1 * (c.theta_0 - x.theta) - total_torque(c, x, x.theta, 0.0, 0.0, 0.0)
        v = c.K * (command - (x.theta_m if c.at_motor > 0.0 else x.theta))
        if c.I > 0.0:
            x.xi = limited(held, c.L) - v
        x.drive = limited(v + x.xi, passed(c))
    k = 0
    while k < c.drives_kept:
        x.drives[k] = x.drive
        k += 1
