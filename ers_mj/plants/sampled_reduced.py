"""The reduced model one sample at a time, its state carried: what a control loop needs, as event-exact as a free
run.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from ers_mj.effects import BY_NAME
from ers_mj.plants import fixed_steps
from ers_mj.plants.compiled import compiled_cache
from ers_mj.plants.events import (
    A_EMF,
    BRISTLE_CORNER,
    C_1,
    C_PLUS,
    CONTACT_STEP,
    CORNER,
    D_STOP,
    DELAY,
    K_BRISTLE,
    K_STOP,
    LOWER,
    RHO,
    TAU,
    TWO,
    UPPER,
    B,
    _advance,
    _bounded,
    _cuts,
    _has_bristle,
    _last,
    _start_mode,
)
from ers_mj.plants.laws import is_lawful, remember
from ers_mj.plants.reduced import ReducedModel


def _begin(t, c, on, p, x, m):
    """Fill x (5,) after its first three entries, theta w j, and the mode m (5,) that fits them: both bodies together, a
    bristle bent.
    """
    lawful, bristle = is_lawful(on), _has_bristle(c)
    x[3], x[4] = x[0], 0.0
    if bristle:
        slip = c[C_PLUS] / c[K_BRISTLE]
        x[3] = x[0] - min(max(x[1] / math.sqrt(c[K_BRISTLE]), -slip), slip)
    elif c[TWO] > 0:
        x[4] = x[1]
    mode = _start_mode(c, on, p, lawful, t, (x[0], x[1], x[2], x[3], x[4]))
    for i in range(5):
        m[i] = mode[i]


def _sample(t, h0, before, now, c, on, p, refine, x, m):
    """Move x (5,) and m (5,) over one sample of length h0 from t; a delay leaves ``before`` at the terminals at first,
    ``now`` afterwards.

    The slow road of events._simulate, which goes by the same segments. A motion that runs away becomes NaN.
    """
    lawful, two, bristle = is_lawful(on), c[TWO] > 0, _has_bristle(c)
    tau, a_emf = c[TAU], c[A_EMF]
    ends, fresh, _ = _cuts(c, h0, tau, a_emf, lawful, refine)
    last = _last(ends)
    h_max = np.inf
    if c[UPPER] < np.inf or c[LOWER] > -np.inf:
        h_max = CONTACT_STEP / (math.sqrt(c[K_STOP]) + c[D_STOP])
    if two or lawful:
        h_max = min(h_max, last / refine)
    corner = CORNER * (c[C_1] + c[C_PLUS]) * h0
    if bristle:
        corner = max(corner, BRISTLE_CORNER * c[C_1] * last * refine)
    z, mode = (x[0], x[1], x[2], x[3], x[4]), (m[0], m[1], m[2], m[3], m[4])
    start = 0.0
    remember(on, p, x, h0)
    for i in range(ends.size):
        drive = c[B] * (now if fresh[i] == 1 else before)
        z, mode, _ = _advance(c, on, p, lawful, t + start, z, mode, drive, tau, a_emf, ends[i] - start, h_max, corner)
        start = ends[i]
        if not _bounded(z):
            z = (np.nan, np.nan, np.nan, np.nan, np.nan)
            break
    for i in range(5):
        x[i], m[i] = z[i], mode[i]


VECTOR, ROWS, LAWS = types.float64[::1], types.int64[:, ::1], types.float64[:, ::1]
MODE, NUMBER = types.int64[::1], types.float64

with compiled_cache():
    begin_kernel = njit(types.void(NUMBER, VECTOR, ROWS, LAWS, VECTOR, MODE), cache=True)(_begin)
    sample_kernel = njit(
        types.void(NUMBER, NUMBER, NUMBER, NUMBER, VECTOR, ROWS, LAWS, types.int64, VECTOR, MODE), cache=True
    )(_sample)


class SampledReduced:
    """A reduced model under a voltage that is given sample by sample.

    Args:
        model: what runs.
        rate_hz: of the samples.
        start: (theta, omega) at t = 0; the current is what the speed alone leaves (0 at rest).
    """

    def __init__(self, model: ReducedModel, rate_hz: float, start: tuple[float, float]):
        self._model, self._h = model, 1.0 / rate_hz
        c, self._on, p = model._lowered
        self._c, self._p = c.copy(), p.copy()
        self._refine = 2 if any(BY_NAME[name].follows_current for name, _ in model.effects) else 1
        self._x, self._mode = np.array([*start, 0.0, 0.0, 0.0]), np.zeros(5, np.int64)
        self._fixed = model.bends and model.has_motor_side
        self._skip = int(c[DELAY] * rate_hz + 1e-9)
        self._sent = [0.0] * (self._skip + 2)  # what the terminals saw last, oldest first
        self._samples = 0
        if self._fixed:
            self._x = np.array([*start, 0.0, 0.0, 0.0, 0.0])
            fixed_steps.begin_kernel(self._c, self._x)
        else:
            begin_kernel(0.0, self._c, self._on, self._p, self._x, self._mode)

    @property
    def theta(self) -> float:
        """The rudder's angle [rad]."""
        return float(self._x[0])

    @property
    def omega(self) -> float:
        """The rudder's speed [rad/s]."""
        return float(self._x[1])

    def drive(self, v: float) -> float:
        """Drive acceleration n K_t i / J [rad/s^2] with v [V] at the terminals."""
        c, x = self._c, self._x
        if c[TAU] > 0:
            return float(x[2])
        return float(c[B] * v - c[A_EMF] * (x[4] if c[TWO] > 0 and c[RHO] > 0 else x[1]))

    def hold(self, v: float) -> None:
        """Hold v [V] at the terminals until the next sample."""
        self._sent = [*self._sent[1:], v]
        now = self._samples * self._h
        if self._fixed:
            fixed_steps.sample_kernel(
                now, self._h, self._sent[0], self._sent[1], self._c, self._on, self._p, self._refine, self._x
            )
        else:
            sample_kernel(
                now,
                self._h,
                self._sent[0],
                self._sent[1],
                self._c,
                self._on,
                self._p,
                self._refine,
                self._x,
                self._mode,
            )
        self._samples += 1
