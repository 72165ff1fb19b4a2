"""What may be concealed and stands on no list: no library can name it."""

from __future__ import annotations

import numpy as np

from ers_mj.proving.concealed.base import Effect, angle, between, put_in_samples, sign
from ers_mj.proving.plant import DEG


def draw_appendage(rng, context):
    """A mass on a spring on the rudder."""
    return {"freq_hz": between(rng, 4.0, 25.0), "zeta": float(rng.uniform(0.01, 0.06))}


def put_appendage(p, s, shape, record):
    """Strength: its inertia over J (J is the total)."""
    j, w = s * p["J"][0], 2.0 * np.pi * shape["freq_hz"]
    p["app_J"], p["app_k"], p["app_c"] = j, j * w * w, 2.0 * shape["zeta"] * j * w


def draw_hysteresis(rng, context):
    """Bouc-Wen: angle of the turn and sharpness."""
    return {"x_deg": between(rng, 1.5, 6.0), "sharpness": float(rng.uniform(1.0, 2.5))}


def put_hysteresis(p, s, shape, record):
    """Strength: hysteretic torque [N m]."""
    p["bw_T"], p["bw_x"], p["bw_n"] = s, shape["x_deg"] * DEG, shape["sharpness"]


def draw_ageing(rng, context):
    """Rate and state: friction grows with the logarithm of the dwell and is worn off over a distance."""
    return {"t0_s": between(rng, 0.003, 0.03), "slip_deg": between(rng, 0.3, 3.0)}


def put_ageing(p, s, shape, record):
    """Strength: growth of Fc per e-fold of dwell."""
    p["age_a"], p["age_t0"], p["age_D"] = s, shape["t0_s"], shape["slip_deg"] * DEG


def draw_brush(rng, context):
    """Current scale of the brush contact's logarithm."""
    return {"i0_A": between(rng, 0.02, 0.3)}


def put_brush(p, s, shape, record):
    """Strength: V in V sgn(i) log(1 + |i|/i0)."""
    p["brush_V"], p["brush_i"] = s, shape["i0_A"]


def draw_angle_damping(rng, context):
    """Angle over which the damping grows."""
    return {"P_deg": float(max(-context["travel"][0], context["travel"][1]) / DEG)}


def put_angle_damping(p, s, shape, record):
    """Strength: damping added at the end of the travel [N m s/rad]."""
    p["angdamp_a"], p["angdamp_P"] = s, shape["P_deg"] * DEG


def draw_tacho(rng, context):
    """Phase of the eccentric encoder of the drive's speed loop."""
    return {"phase": angle(rng)}


def put_tacho(p, s, shape, record):
    """Strength: share of the back-EMF fed back with one wave a turn of the motor."""
    p["tacho_a"], p["tacho_ph"] = s, shape["phase"]


def draw_gaps(rng, context):
    """When the drive's gain breaks down: on average so often, so long."""
    return {
        "rate_per_s": float(rng.uniform(0.4, 1.5)),
        "mean_s": between(rng, 0.04, 0.3),
        "seed": int(rng.integers(2**31)),
    }


def put_magnetic(p, s, shape, record):
    """Strength: share of K_t lost at the current's peak."""
    p["kt_sat"] = np.sqrt(s / (1.0 - s)) / shape["current_peak_A"]


def draw_peak(rng, context):
    """The effect-free current peak [A]."""
    return {"current_peak_A": context["peak_A"]}


def draw_maxwell(rng, context):
    """Relaxation time of the spring's rubber."""
    return {"tau_s": between(rng, 0.1, 1.5)}


def put_maxwell(p, s, shape, record):
    """Strength: stiffness of the relaxing element [N m/rad]."""
    p["mxw_k"], p["mxw_tau"] = s, shape["tau_s"]


def draw_running_in(rng, context):
    """Sum of travel over which the friction settles, up or down, in each record anew."""
    return {"distance_deg": between(rng, 10.0, 80.0), "sign": sign(rng)}


def put_running_in(p, s, shape, record):
    """Strength: relative change of Fc."""
    p["run_a"], p["run_D"] = s * shape["sign"], shape["distance_deg"] * DEG


ENTRIES = (
    Effect("second_resonance", "inertia of the appendage over J", 0.01, 0.5, draw_appendage, put_appendage, False),
    Effect("hysteretic_spring", "Bouc-Wen torque (N m)", 0.0005, 0.2, draw_hysteresis, put_hysteresis, False),
    Effect("friction_ageing", "growth of Fc per e-fold of dwell", 0.001, 0.3, draw_ageing, put_ageing, False),
    Effect("brush_drop", "V (V) in V sgn(i) log(1+|i|/i0)", 0.0005, 0.5, draw_brush, put_brush, False),
    Effect(
        "angle_dependent_damping",
        "damping added at the end of travel (N m s/rad)",
        0.0005,
        0.5,
        draw_angle_damping,
        put_angle_damping,
        False,
    ),
    Effect("tacho_eccentricity", "share of back-EMF rippling", 0.003, 0.4, draw_tacho, put_tacho, False),
    Effect("intermittent_gain", "share of the drive's gain lost", 0.01, 0.9, draw_gaps, put_in_samples, False),
    Effect(
        "magnetic_saturation", "share of K_t lost at the current's peak", 0.005, 0.5, draw_peak, put_magnetic, False
    ),
    Effect(
        "viscoelastic_spring",
        "stiffness of the relaxing element (N m/rad)",
        0.005,
        0.6,
        draw_maxwell,
        put_maxwell,
        False,
    ),
    Effect("running_in", "relative change of Fc", 0.002, 0.6, draw_running_in, put_running_in, False),
)
