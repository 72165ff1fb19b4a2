"""Eq. (4) of the paper as it is printed: a play in the torque, around the reduced model.

    T_l = n (T_m - delta)  where T_m rises and T_l lies on that line
          n (T_m + delta)  where T_m falls and T_l lies on that line
          T_l(t-)          otherwise
 That is the play operator on the torque: T_l follows n T_m at a distance of n delta and rests while T_m moves within
the band. delta is called a distance and subtracted from a torque. Read here as a torque, of which an angle gives the
only one that the model has for it: n delta = k_s gap, what the return spring pulls more from one end of the play to its
centre.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ers_mj.effects.quantities import Coefficients
from ers_mj.plants.compiling.compiled import inline, kernel
from ers_mj.plants.kernel.state import READ, TABLE, F, N, types
from ers_mj.plants.reduced import Motion

STEP = 2e-6  # [s] at most; half of it moves theta by less than 0.01 deg RMS


@dataclass(frozen=True)
class PrintedPlay:
    """The reduced model, Eq. (1)/(5), whose motor torque reaches the rudder through Eq. (4).

    Attributes:
        coefficients: Eq. (6)'s record; its second body, stops, delay and asymmetries are not read.
        threshold: n delta / J [output unit / s^2], half the width of the torque's band; 0 is the model without play.
    """

    coefficients: Coefficients
    threshold: float

    def simulate(self, t: np.ndarray, u: np.ndarray) -> Motion:
        """Free run from rest at theta_0, the band centred, under u (N,) held between the samples t (N,) [s]."""
        c, out = self.coefficients, np.empty((t.size, 3))
        substeps = int(np.ceil(np.diff(t).max() / STEP))
        _run(
            c.a_1,
            c.a_mech_plus,
            c.a_emf,
            c.b,
            c.c_1,
            c.c_2_plus,
            c.theta_0,
            c.tau_e,
            self.threshold,
            np.ascontiguousarray(t, float),
            np.ascontiguousarray(u, float),
            substeps,
            out,
        )
        theta, omega, drive = out.T.copy()
        return Motion(t, theta, omega, drive, theta, theta)


def printed_threshold(c: Coefficients, gap: float) -> float:
    """n delta / J [output unit / s^2] of a play of +-``gap`` [output unit]: what the return spring adds over it."""
    return c.a_1 * gap


@inline
def _speed(slope, push, corner, friction, preload):
    """w that solves slope w + friction Sgn(w) + preload Sgn(w - corner) = push, both Sgn set-valued."""
    for side in (-1.0, 1.0):
        for way in (-1.0, 1.0):
            w = (push - friction * way - preload * side) / slope
            if w * way > 0.0 and (w - corner) * side > 0.0:
                return w
    if corner == 0.0:
        return 0.0
    held = push + preload * (1.0 if corner > 0.0 else -1.0)
    return 0.0 if abs(held) <= friction else corner


@kernel(types.void(F, F, F, F, F, F, F, F, F, READ, READ, N, TABLE))
def _run(a_1, a_mech, a_emf, b, c_1, c_2, theta_0, tau, threshold, t, u, substeps, out):
    """Fill out (N, 3) with angle, speed, transmitted acceleration just before u[k] acts; implicit steps in the
    speed.
    """
    phi = w = motor = through = 0.0
    for k in range(t.size):
        out[k, 0], out[k, 1], out[k, 2] = theta_0 + phi, w, through
        if k == t.size - 1:
            break
        h = (t[k + 1] - t[k]) / substeps
        fade = np.exp(-h / tau) if tau > 0.0 else 0.0
        for _ in range(substeps):
            target = b * u[k] - a_emf * w
            motor = target + (motor - target) * fade
            through = min(max(through, motor - threshold), motor + threshold)
            w = _speed(1.0 + h * (a_mech + h * a_1), w + h * (through - a_1 * phi), -phi / h, h * c_2, h * c_1)
            phi += h * w
