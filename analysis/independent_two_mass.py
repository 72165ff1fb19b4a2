"""Two masses with a rigid play between them, by an implicit scheme that shares nothing with the package's plants.

Motor side (share rho of the inertia J, driven) and rudder (the rest, with spring, damping and set-valued friction F_c
and preload T_LH) meet inelastically at +-gap. Each step solves for the speeds at its end: friction, preload and contact
are inclusions in them, so that nothing is regularised and nothing sticks out of the play.
"""

import math

import numpy as np
from numba import njit


@njit(cache=False)
def _speed(inertia, damping, stiffness, push, theta, rest, h, friction, preload):
    """w that solves inertia w + h (damping + h stiffness) w + h friction Sgn(w) + h preload Sgn(theta + h w - rest) =
    push.
    """
    slope = inertia + h * (damping + h * stiffness)
    corner = (rest - theta) / h
    for side in (-1.0, 1.0):
        for way in (-1.0, 1.0):
            w = (push - h * friction * way - h * preload * side) / slope
            if w * way > 0.0 and (w - corner) * side > 0.0:
                return w
    side = -1.0 if corner > 0.0 else 1.0
    if corner != 0.0 and abs(push - h * preload * side) <= h * friction:
        return 0.0
    if corner == 0.0 and abs(push) <= h * (friction + preload):
        return 0.0
    return corner


@njit(cache=False)
def _run(J, rho, B, k_s, T_LH, F_c, rest, torque_per_volt, emf, tau, gap, t, u, substeps, out):
    """Fill out (N, 2) with rudder and motor-side angle [rad] at t, before u acts."""
    theta = theta_m = rest
    w = w_m = 0.0
    drive = 0.0
    J_m, J_r = rho * J, (1.0 - rho) * J
    for k in range(t.size):
        out[k, 0], out[k, 1] = theta, theta_m
        if k == t.size - 1:
            break
        h = (t[k + 1] - t[k]) / substeps
        for _ in range(substeps):
            if tau > 0.0:
                fade = h / tau
                drive_free = (drive + fade * torque_per_volt * u[k]) / (1.0 + fade)
                emf_now = emf * fade / (1.0 + fade)
            else:
                drive_free, emf_now = torque_per_volt * u[k], emf
            push_m = J_m * w_m + h * drive_free
            push_r = J_r * w - h * k_s * (theta - rest)
            w_m_new = push_m / (J_m + h * emf_now)
            w_new = _speed(J_r, B, k_s, push_r, theta, rest, h, F_c, T_LH)
            twist = theta_m - theta + h * (w_m_new - w_new)
            if abs(twist) > gap:
                side = 1.0 if twist > 0.0 else -1.0
                lead = (side * gap - theta_m + theta) / h
                push = push_m + push_r - (J_m + h * emf_now) * lead
                w_new = _speed(J, B + emf_now, k_s, push, theta, rest, h, F_c, T_LH)
                w_m_new = w_new + lead
            w, w_m = w_new, w_m_new
            theta, theta_m = theta + h * w, theta_m + h * w_m
            drive = drive_free - emf_now * w_m


def simulate(parameters, gap, rho, t, u, *, inductance=False, substeps=2000):
    """Rudder angle (N,) [rad] of Table 1's letters with a play of +-gap [rad], from rest at theta_0.

    ``rho`` is the motor side's share of J; all damping and friction are the rudder's. ``substeps`` a sample: 2000 at 1
    kHz are 5e-7 s, at which halving the step moves theta by less than 1e-3 deg RMS.
    """
    p = parameters
    torque = p["n"] * p["K_t"] / p["R"]
    out = np.empty((len(t), 2))
    _run(
        p["J"],
        rho,
        p["B"],
        p["k_s"],
        p["T_LH"],
        p["F_c"],
        p["theta_0"],
        torque,
        torque * p["n"] * p["K_e"],
        p["L"] / p["R"] if inductance else 0.0,
        gap,
        np.asarray(t, float),
        np.asarray(u, float),
        substeps,
        out,
    )
    if not math.isfinite(out[-1, 0]):
        raise ValueError("the reference runs away")
    return out[:, 0]
