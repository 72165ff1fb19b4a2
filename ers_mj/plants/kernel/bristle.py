"""A bristle that carries friction: how far it bends within a step of fixed length, and how it damps (Dahl 1968;
Olsson, Astrom, Canudas de Wit, Gafvert and Lischinsky 1998).
"""

from __future__ import annotations

import math

from ers_mj.plants.compiling.compiled import inline


@inline
def _unbent(c, left, way):
    """What is left of a bristle's share of its level to bend, which was ``left``, after a way counted in the
    displacement of its whole bend.
    """
    delta = c.dahl
    if delta == 1.0:
        return left * math.exp(-way)
    size = abs(left)
    if size <= 0.0:
        return 0.0
    after = size ** (1.0 - delta) + (delta - 1.0) * way
    return math.copysign(after ** (1.0 / (1.0 - delta)), left) if after > 0.0 else 0.0


@inline
def bent(c, z, w, level, h):
    """The bend after h at the speed w under this level of friction."""
    if w == 0.0:
        return z
    end = math.copysign(level / c.k_bristle, w)
    return end * (1.0 - _unbent(c, 1.0 - z / end, abs(w) * h * c.k_bristle / level))


@inline
def bristle_damping(c, w, z, level):
    """Damping of a bristle that a motion bends on at the speed w."""
    if c.d_bristle <= 0.0:
        return 0.0
    left = max(1.0 - math.copysign(1.0, w) * c.k_bristle * z / level, 0.0)
    return c.d_bristle * (left if c.dahl == 1.0 else left**c.dahl) * math.exp(-((w / c.fade) ** 2))
