"""The laws of the effects as the compiled integrator calls them: torques, frictions, inertias and memories, those that
are on and no others.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numba import njit

from ers_mj.effects import EFFECTS
from ers_mj.plants.compiled import inlined

MEMORY = 4  # the constant of a law that may be a memory
N_PARAMETERS = 7  # constants of a law at most


def _chain_torque(laws):
    """One compiled function that evaluates the torque of the effect in one row."""
    if not laws:

        @njit(nogil=True, inline="always")
        def pick(k, p, theta, w, j, t):
            return 0.0

        return pick
    (row, law), rest = laws[0], _chain_torque(laws[1:])

    @njit(nogil=True, inline="always")
    def pick(k, p, theta, w, j, t):
        if k == row:
            a = law(p, theta, w, j, t)
        else:
            a = rest(k, p, theta, w, j, t)
        return a

    return pick


def _chain_friction(laws):
    """One compiled function that passes the friction level through the effect in one row."""
    if not laws:

        @njit(nogil=True, inline="always")
        def pick(k, p, level, theta, w, j, direction):
            return level

        return pick
    (row, law), rest = laws[0], _chain_friction(laws[1:])

    @njit(nogil=True, inline="always")
    def pick(k, p, level, theta, w, j, direction):
        if k == row:
            a = law(p, level, theta, w, j, direction)
        else:
            a = rest(k, p, level, theta, w, j, direction)
        return a

    return pick


def _chain_inertia(laws):
    """One compiled function that evaluates the inertia of the effect in one row."""
    if not laws:

        @njit(nogil=True, inline="always")
        def pick(k, p, theta):
            return 1.0, 0.0

        return pick
    (row, law), rest = laws[0], _chain_inertia(laws[1:])

    @njit(nogil=True, inline="always")
    def pick(k, p, theta):
        if k == row:
            a = law(p, theta)
        else:
            a = rest(k, p, theta)
        return a

    return pick


def _chain_memory(laws):
    """One compiled function that evaluates the memory of the effect in one row."""
    if not laws:

        @njit(nogil=True, inline="always")
        def pick(k, p, theta, w, j, h):
            return 0.0

        return pick
    (row, law), rest = laws[0], _chain_memory(laws[1:])

    @njit(nogil=True, inline="always")
    def pick(k, p, theta, w, j, h):
        if k == row:
            a = law(p, theta, w, j, h)
        else:
            a = rest(k, p, theta, w, j, h)
        return a

    return pick


_torque_of = _chain_torque([(row, e.torque) for row, e in enumerate(EFFECTS) if e.torque])
_friction_of = _chain_friction([(row, e.friction) for row, e in enumerate(EFFECTS) if e.friction])
_memory_of = _chain_memory([(row, e.memory) for row, e in enumerate(EFFECTS) if e.memory])
_inertia_of = _chain_inertia([(row, e.inertia) for row, e in enumerate(EFFECTS) if e.inertia])


@inlined
def _constants(p, k):
    return p[k, 0], p[k, 1], p[k, 2], p[k, 3], p[k, 4], p[k, 5], p[k, 6]


@inlined
def _torques(on, row, p, theta, w, j, t):
    """Sum of the torques of the effects that a row names."""
    a = 0.0
    for i in range(on[row, 0]):
        k = on[row, i + 1]
        a += _torque_of(k, _constants(p, k), theta, w, j, t)
    return a


@inlined
def total_torque(on, p, theta, w, j, t):
    """Sum of the torques of the effects that are on: those on the rudder only where the motor is a body of its own."""
    return _torques(on, 0, p, theta, w, j, t)


@inlined
def drive_torque(on, p, theta_m, w_m, j, t):
    """The same on a motor that is a body of its own, at its angle and speed seen at the output."""
    return _torques(on, 4, p, theta_m, w_m, j, t)


@inlined
def is_lawful(on):
    """Whether a law adds to the forces."""
    return on[0, 0] + on[1, 0] + on[4, 0] > 0


@inlined
def friction_level(on, p, level, theta, w, j, direction):
    """The friction level after every effect that is on."""
    for i in range(on[1, 0]):
        k = on[1, i + 1]
        level = _friction_of(k, _constants(p, k), level, theta, w, j, direction)
    return level


@inlined
def moved(on, p, theta, w, a):
    """The acceleration that is left of ``a``, per total inertia, where effects change the inertia along the travel."""
    for i in range(on[2, 0]):
        k = on[2, i + 1]
        inertia, half_slope = _inertia_of(k, _constants(p, k), theta)
        a = (a - half_slope * w * w) / inertia
    return a


@inlined
def remember(on, p, x, h):
    """Bring the memories of effects, their fifth constants, on by a sample of length h from the state x = (theta, w, j,
    theta_m, w_m, ...).
    """
    for i in range(on[3, 0]):
        k = on[3, i + 1]
        p[k, MEMORY] = _memory_of(k, _constants(p, k), x[0], x[1], x[2], h)
    for i in range(on[5, 0]):
        k = on[5, i + 1]
        p[k, MEMORY] = _memory_of(k, _constants(p, k), x[3], x[4], x[2], h)


@lru_cache
def rows_of(names, parted=False):
    """A tuple of effects as the laws are called: (6, 1 + effects) their number and rows, of torques, of frictions, of
    inertias and of memories, and where the motor is ``parted`` from the rudder of those torques and memories that are
    its own."""
    on = np.zeros((6, 1 + len(EFFECTS)), np.int64)
    for kind, (law, own) in enumerate(
        (
            ("torque", False),
            ("friction", False),
            ("inertia", False),
            ("memory", False),
            ("torque", True),
            ("memory", True),
        )
    ):
        rows = [
            row
            for row, effect in reversed(list(enumerate(EFFECTS)))
            if effect.name in names
            and getattr(effect, law)
            and (law not in ("torque", "memory") or own == (parted and effect.at_motor))
        ]
        on[kind, 0], on[kind, 1 : 1 + len(rows)] = len(rows), rows
    return on
