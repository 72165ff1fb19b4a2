"""The numbers of a firmware's loop, as a record that kernels read."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from ers_mj.plants.compiling.compiled import record_in


class LoopNumbers(NamedTuple):
    """The firmware's numbers.

    K [1/s^2], D [1/s] and I [1/s^3] of the loop, ``lag`` [s] of the speed that D multiplies, the loop's limit L
    [output unit/s^2], latency tau [s] of the reference, dead time [s] of the drive, R the limit of the reference's
    speed; ``band`` the error [output unit] within which the drive sleeps and ``lost`` what is still missing outside
    it; ``idle`` [output unit/s^2] the drive that the bridge ignores, and loses of more; ``least`` the smallest drive
    outside the band; ``most`` the largest motor torque; ``creep`` [1/s] the speed's
    factor below breakaway (infinite: friction holds) and ``heavy`` how much slower the body answers there (MuJoCo's
    constraint: 10), as ``buried`` within a stop (20); ``share`` the motor's of the inertia, behind which a gear rubs;
    ``grease`` [1/s] what drags the load along within a play; ``at_motor`` 1 where the loop's sensor sits on the
    motor's side, ``log_at_motor`` the recording's; ``fresh`` 1 where the integral is empty at the beginning.
    """

    K: float
    D: float = 0.0
    lag: float = 0.0
    I: float = 0.0
    L: float = np.inf
    tau: float = 0.0
    dead_time: float = 0.0
    R: float = np.inf
    band: float = 0.0
    lost: float = 0.0
    idle: float = 0.0
    least: float = 0.0
    most: float = np.inf
    creep: float = np.inf
    heavy: float = 1.0
    buried: float = 1.0
    share: float = 0.5
    grease: float = 0.0
    at_motor: float = 0.0
    log_at_motor: float = 0.0
    fresh: float = 0.0


LOOP = np.dtype((np.record, np.dtype([(name, np.float64) for name in LoopNumbers._fields], align=True)))
loop_in = record_in(LOOP)
Q = numba.from_dtype(LOOP)
