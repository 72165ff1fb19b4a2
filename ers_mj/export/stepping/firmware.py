"""The loop that a servo's firmware closes, as far as it hangs on no speed at the end of a step."""

# ruff: noqa: F821  the calls to other parts and to what portable.py writes
# mypy: ignore-errors
import math


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


def passed(c):
    """The largest drive that the bridge passes."""
    return c.L - c.idle


def ask(c, x, v):
    """The motor's force where the firmware asks for v beyond its limit."""
    x.force = x.fresh * limited(v, passed(c)) + x.late
    x.brake = c.a_emf


def asked_of(c, x, w_before, w):
    """What the firmware asks for at the mean of two speeds."""
    return x.ahead - 0.5 * own_damping(c) * (w_before + w)


def bridge(c, x, w_before, w):
    """Take off what the firmware asks for what the bridge loses of it, at the mean of two speeds."""
    x.ahead = x.whole - limited(x.whole - 0.5 * own_damping(c) * (w_before + w), c.idle)


def integrate(c, x, v):
    """Bring the loop's integral on, and keep the drive."""
    if c.I > 0.0 and (abs(v) < passed(c) or v * x.e < 0.0):
        x.xi = limited(x.xi + c.h * c.I * x.e, c.L)
    x.drive = limited(v, passed(c))
    keep(x.drives, c.drives_kept, x.count, x.drive)
