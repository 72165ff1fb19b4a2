"""Dry friction: the speed at the end of a step under it, beside the preload too, and the bristle."""

# ruff: noqa: F821  the calls to other parts and to what portable.py writes
# mypy: ignore-errors
import math


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
