"""What the compiled integrator works on: the plant's record, a state, a mode.

State x = (theta, w, j, theta_m, w_m): rudder angle and speed, drive acceleration j (the motor torque over J; current
in disguise), and the motor's side where a second body exists. Mode m = (s, side, stop, s_m, twist): the values that the
set-valued terms take until the next event: direction of slip (0 = stuck; 1 throughout without dry friction), side of
theta_0 (0 = held in the corner), stop touched, motor slip, contact of the play (of two bodies without play: 1
throughout, a spring that pushes and pulls).

A second body without inertia (rho = 0) is the foot of LuGre's bristle z = theta - theta_m: z' = w - |w| k z / F, and
the friction is k z + d exp(-(w / w_d)^2) z'. It has no speed of its own (w_m stays 0 in x), and the drive acts on the
rudder, whose slip s is then 1 wherever the preload's corner does not hold it. Its slip s_m is 0 while the bristle
bends, which is stepped as a law is, and the direction of motion once the bristle is bent to the full: from there to the
next reversal friction is Coulomb's and the flow linear. Where a law moves the level F, the bristle lags behind it and
s_m stays 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numba import types

from ers_mj.effects.base import Coefficients
from ers_mj.plants.compiling.compiled import inline, record_in

MOST_LAWS = 40  # effects that act by laws at once
N_CONSTANTS = 11  # of a law at most
MOST_PIECES, MOST_TERMS = 4, 40  # of an expansion of the flow in time
RUNAWAY = 1e9  # [output unit, and that per second] beyond which a motion is given up (NaN)


class State(NamedTuple):
    """Angle and speed of the rudder, drive acceleration, angle and speed of the motor's side."""

    theta: float
    w: float
    j: float
    theta_m: float
    w_m: float


class Mode(NamedTuple):
    """Rudder's slip, side of theta_0, stop touched, motor's slip, contact of the play: each -1, 0 or 1."""

    s: int
    side: int
    stop: int
    s_m: int
    twist: int


def _record(fields: list[tuple]) -> np.dtype:
    return np.dtype((np.record, np.dtype(fields, align=True)))


# kinds of laws and the count of each; the last ones are torques of a motor that is a body of its own
COUNTED = {
    "torque": "torques",
    "friction": "frictions",
    "inertia": "inertias",
    "memory": "memories",
    "motor_torque": "motor_torques",
}
LAW = _record(
    [
        ("at_motor", np.int64),  # whether its memory is of a motor that is a body of its own
        ("constants", np.float64, (N_CONSTANTS,)),
    ]
)
PLANT = _record(
    [
        *((letter, np.float64) for letter in Coefficients._fields),
        ("pieces", np.int64),  # of the expansion at hand, the count of terms and the terms of each (see series)
        ("counts", np.int64, (MOST_PIECES,)),
        ("terms", np.float64, (MOST_PIECES * MOST_TERMS * 5,)),
        ("lawful", np.int64),  # laws that add to the forces
        *((count, np.int64) for count in COUNTED.values()),  # numbers of laws, where their code lies, whose it is
        *((f"{kind}_at", np.int64, (MOST_LAWS,)) for kind in COUNTED),
        *((f"{kind}_of", np.uint64, (MOST_LAWS,)) for kind in COUNTED),
        ("laws", LAW, (MOST_LAWS,)),
    ]
)
plant_in = record_in(PLANT)  # of an array of numbers (see laws.laid_out)

F, N, L = types.float64, types.int64, types.boolean
C = numba.from_dtype(PLANT)
X, M = types.NamedUniTuple(F, 5, State), types.NamedUniTuple(N, 5, Mode)
VECTOR, TABLE, MODES = F[::1], F[:, ::1], N[::1]
READ, READ_BOOL = types.Array(F, 1, "C", readonly=True), types.Array(L, 1, "C", readonly=True)


@inline
def has_bristle(c):
    """Whether the second body is the foot of a bristle, which has no inertia."""
    return c.two_body > 0 and c.rho <= 0


@inline
def is_parted(c):
    """Whether motor and rudder are two bodies."""
    return c.two_body > 0 and not has_bristle(c)


@inline
def bends(c, m):
    """Whether a bristle has not yet let go, which keeps the mode from being linear: it is stepped as a law is."""
    return has_bristle(c) and m.s_m == 0


@inline
def never_sticks(c):
    """Whether the rudder has no dry friction, and the same damping both ways: its slip s then stays 1, whichever way it
    moves.
    """
    return (
        c.c_2_plus <= 0
        and c.c_2_minus <= 0
        and c.c_1 <= 0
        and c.frictions == 0
        and c.a_mech_plus == c.a_mech_minus
        and not has_bristle(c)
    )


@inline
def drive_speed(c, x):
    """Speed of the body that the drive acts on, which makes the back-EMF."""
    return x.w_m if c.two_body > 0 and c.rho > 0 else x.w


@inline
def is_bounded(x):
    """Whether the motion has not run away."""
    return abs(x.theta) < RUNAWAY and abs(x.w) < RUNAWAY


@inline
def with_drive(c, x, drive, tau, a_emf):
    """The state with the drive acceleration that the drive makes of its speed where no inductance delays it."""
    if tau > 0:
        return x
    return State(x.theta, x.w, drive - a_emf * drive_speed(c, x), x.theta_m, x.w_m)
