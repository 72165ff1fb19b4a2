"""Signs, limits, tables, and what is remembered for later steps."""

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
