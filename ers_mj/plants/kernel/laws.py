"""The laws of the effects as the compiled integrator calls them: torques, frictions, inertias and memories, those that
are on and no others.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import types

from ers_mj.effects import EFFECTS
from ers_mj.effects.quantities import Coefficients
from ers_mj.plants.compiling.compiled import address_of, by_address, inline
from ers_mj.plants.kernel.state import COUNTED, LAW, MOST_LAWS, N_CONSTANTS, PLANT, C, F

MEMORY = 4  # the constant of a law that may be a memory
CONSTANTS = types.CPointer(F)
SIGNATURES = {
    "torque": F(CONSTANTS, F, F, F, F),
    "friction": F(CONSTANTS, F, F, F, F, F),
    "inertia": types.UniTuple(F, 2)(CONSTANTS, F),
    "memory": F(CONSTANTS, F, F, F, F),
}
_torque, _friction, _inertia, _memory = (
    by_address(C.fields["laws"].type.dtype, signature) for signature in SIGNATURES.values()
)


@inline
def total_torque(c, theta, w, j, t):
    """Sum of the torques of the effects that are on: those on the rudder only where the motor is a body of its own."""
    a = 0.0
    for i in range(c.torques):
        a += _torque(c.torque_at[i], c.laws[c.torque_of[i]], theta, w, j, t)
    return a


@inline
def drive_torque(c, theta_m, w_m, j, t):
    """The same on a motor that is a body of its own, at its angle and speed seen at the output."""
    a = 0.0
    for i in range(c.motor_torques):
        a += _torque(c.motor_torque_at[i], c.laws[c.motor_torque_of[i]], theta_m, w_m, j, t)
    return a


@inline
def friction_level(c, level, theta, w, j, direction):
    """The friction level after every effect that is on."""
    for i in range(c.frictions):
        level = _friction(c.friction_at[i], c.laws[c.friction_of[i]], level, theta, w, j, direction)
    return level


@inline
def moved(c, theta, w, a):
    """The acceleration that is left of ``a``, per total inertia, where effects change the inertia along the travel."""
    for i in range(c.inertias):
        inertia, half_slope = _inertia(c.inertia_at[i], c.laws[c.inertia_of[i]], theta)
        a = (a - half_slope * w * w) / inertia
    return a


@inline
def remember(c, theta, w, j, theta_m, w_m, h):
    """Bring the memories of effects, their fifth constants, on by a sample of length h from this state."""
    for i in range(c.memories):
        law = c.laws[c.memory_of[i]]
        if law.at_motor == 0:
            law.constants[MEMORY] = _memory(c.memory_at[i], law, theta, w, j, h)
        else:
            law.constants[MEMORY] = _memory(c.memory_at[i], law, theta_m, w_m, j, h)


class Acting(NamedTuple):
    """The effects that act by laws, their rows of EFFECTS in the order of the calls, whether the motor is a body of its
    own, and whether any is a torque or a friction: what may go to another process, unlike the laws' addresses.
    """

    rows: tuple[int, ...]
    parted: bool
    pushes: bool


@lru_cache
def acting(names: tuple[str, ...], parted: bool) -> Acting:
    """The effects named, of those that have a law."""
    rows = tuple(row for row, effect in reversed(list(enumerate(EFFECTS))) if effect.name in names)
    return Acting(rows, parted, any(EFFECTS[row].torque or EFFECTS[row].friction for row in rows))


def laid_out(c: np.ndarray, on: Acting, p: np.ndarray) -> np.ndarray:
    """The plant's record as an array of numbers: coefficients c (see Coefficients), the laws that are on and their
    constants p (effects, N_CONSTANTS). The kernels change it: c.bias for a moment, memories for good.
    """
    flat = _without_numbers(on).copy()
    flat[: len(Coefficients._fields)] = c
    _rows(flat)[: len(p), -N_CONSTANTS:] = p
    return flat


@lru_cache
def _without_numbers(on: Acting) -> np.ndarray:
    """What is laid out of any plant with these laws in this process, which compiles them."""
    if len(on.rows) > MOST_LAWS:
        raise ValueError(f"{len(on.rows)} effects act by laws at once, of at most {MOST_LAWS}")
    flat = np.zeros(PLANT.itemsize // np.float64().nbytes)
    plant, effects = flat.view(PLANT)[0], [EFFECTS[row] for row in on.rows]
    for law, effect in zip(plant.laws, effects, strict=False):
        law["at_motor"] = on.parted and effect.at_motor
    for kind in COUNTED:
        law, is_own = kind.removeprefix("motor_"), kind.startswith("motor_")
        having = [
            i
            for i, effect in enumerate(effects)
            if getattr(effect, law) and (law != "torque" or is_own == (on.parted and effect.at_motor))
        ]
        plant[COUNTED[kind]], plant[f"{kind}_of"][: len(having)] = len(having), having
        addresses = [address_of(getattr(effects[i], law), SIGNATURES[law]) for i in having]
        plant[f"{kind}_at"][: len(having)] = addresses
    plant.lawful = plant.torques + plant.frictions + plant.motor_torques
    return flat


def _rows(flat: np.ndarray) -> np.ndarray:
    """The laws of what is laid out, a row of numbers each."""
    return flat[-MOST_LAWS * LAW.itemsize // flat.itemsize :].reshape(MOST_LAWS, -1)
