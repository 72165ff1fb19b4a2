"""A current whose inductance falls as it grows, by that of a constant one under another drive."""

from __future__ import annotations

import math

from ers_mj.effects.base import LEAST_IRON
from ers_mj.plants.compiling.compiled import inline, unit
from ers_mj.plants.kernel.forces import derivative
from ers_mj.plants.kernel.state import C, F, M, State, X, drive_speed, types


@inline
def faster(c, j):
    """How much faster, in shares, a current rises whose inductance falls: the iron keeps LEAST_IRON of it."""
    return min((c.fall * j) ** 2, 1.0 / LEAST_IRON - 1.0)


@unit(types.UniTuple(F, 2)(C, F, X, M, F, F))
def fallen(c, t, x, m, drive, h):
    """(the constant drive under which a current whose inductance does not fall has the same mean over h as one whose
    inductance does under ``drive``, how much further that one has come then), with the back-EMF of the segment's middle
    and Simpson's rule for the rate at which it comes near and for the mean.
    """
    d = derivative(c, t, x, m, drive, c.tau_e, c.a_emf)
    emf = c.a_emf * (drive_speed(c, x) + 0.5 * h * drive_speed(c, d))
    goal, rate, first = drive - emf, h / c.tau_e, faster(c, x.j)
    short = x.j - goal
    half = faster(c, goal + short * math.exp(-0.5 * rate * (1.0 + first)))
    half = faster(c, goal + short * math.exp(-0.5 * rate * (1.0 + 0.5 * (first + half))))
    last = faster(c, goal + short * math.exp(-rate * (1.0 + half)))
    by_half = math.exp(-0.5 * rate * (1.0 + (5.0 * first + 8.0 * half - last) / 12.0))
    by_end = math.exp(-rate * (1.0 + (first + 4.0 * half + last) / 6.0))
    kept = math.exp(-rate)
    usual = (1.0 - kept) / rate
    other = goal + short * ((1.0 + 4.0 * by_half + by_end) / 6.0 - usual) / (1.0 - usual)
    return other + emf, goal + short * by_end - (other + (x.j - other) * kept)


@inline
def charged(x, further):
    """The state with so much more drive."""
    return State(x.theta, x.w, x.j + further, x.theta_m, x.w_m)
