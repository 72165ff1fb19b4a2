"""The drive of a servo that is told a voltage, a torque or a current."""

# mypy: ignore-errors
import math


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
