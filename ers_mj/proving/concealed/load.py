"""What may be concealed in the load."""

from __future__ import annotations

import numpy as np

from ers_mj.proving.concealed.base import CONTACT, RIGID, Effect, angle, between, choose, index, sign
from ers_mj.proving.plant import DEG


def draw_sign(rng, context):
    """Which way."""
    return {"sign": sign(rng)}


def put_bias(p, s, shape, record):
    """Strength: |torque| [N m]; a positive sign loads as Eq. (1)'s T_L does, against positive motion."""
    p["bias"] = -s * shape["sign"]


def draw_gravity(rng, context):
    """Where the imbalance hangs."""
    return {"phase": angle(rng)}


def put_gravity(p, s, shape, record):
    """Strength: m g l [N m] in m g l sin(wave theta + phase); wave 1 but where the angle has a unit of its own."""
    p["grav"], p["grav_ph"], p["grav_k"] = s, shape["phase"], shape.get("wave", 1.0)


HINGE = ("k3 x^3", "6 k3 (x - sin x)", "k3 x^3/(1 + 2 x^2)")


def draw_hinge(rng, context):
    """Which odd function."""
    return {"form": choose(rng, *HINGE)}


def put_hinge(p, s, shape, record):
    """Strength: k3 [N m/rad^3], x = theta - theta_0."""
    p["k3"], p["k3_form"] = s, index(HINGE, shape.get("form", HINGE[0]))


def draw_stop(rng, context):
    """One side or both, springy or Hunt-Crossley."""
    return {
        "form": choose(rng, *CONTACT),
        "k": between(rng, 800.0, 3000.0) * context.get("stiffness", 1.0),
        "zeta": float(rng.uniform(0.1, 0.4)),
        "side": choose(rng, "upper", "lower", "both"),
        "free_travel_deg": [float(x / DEG) for x in context["travel"]],
    }


def put_stop(p, s, shape, record):
    """Strength: share of the free travel to that side of theta_0 that is cut off."""
    low, high = (x * DEG for x in shape["free_travel_deg"])
    if shape["side"] in ("upper", "both"):
        p["stop_hi"] = high * (1.0 - s)
    if shape["side"] in ("lower", "both"):
        p["stop_lo"] = low * (1.0 - s)
    p["stop_k"], p["stop_c"] = shape["k"], 2.0 * shape["zeta"] * np.sqrt(shape["k"] * p["J"][0])
    p["stop_form"] = index((*CONTACT, RIGID), shape.get("form", CONTACT[0]))


PULSE = ("rect", "half sine", "sudden and fading")


def draw_disturbance(rng, context):
    """One pulse in one record."""
    record = int(rng.integers(context["records"]))
    duration = between(rng, 0.08, 0.6)
    start = float(rng.uniform(0.5, context["durations"][record] - duration - 0.8))
    return {"record": record + 1, "t0_s": start, "duration_s": duration, "form": choose(rng, *PULSE), "sign": sign(rng)}


def put_disturbance(p, s, shape, record):
    """Strength: torque [N m] with T_L's sign; `record` counts from one in the shape."""
    if record == shape["record"] - 1:
        p["dist_T"], p["dist_t0"], p["dist_d"] = -s * shape["sign"], shape["t0_s"], shape["duration_s"]
        p["dist_form"] = index(PULSE, shape["form"])


GUST = ("sine", "flat-topped", "swelling")


def draw_gust(rng, context):
    """One frequency, a phase for each record."""
    return {
        "form": choose(rng, *GUST),
        "freq_hz": float(rng.uniform(0.7, 5.0)),
        "phase_per_record": [angle(rng) for _ in range(context["records"])],
    }


def put_gust(p, s, shape, record):
    """Strength: torque amplitude [N m]."""
    p["gust_T"], p["gust_w"], p["gust_ph"] = -s, 2.0 * np.pi * shape["freq_hz"], shape["phase_per_record"][record]
    p["gust_form"] = index(GUST, shape.get("form", GUST[0]))


ENTRIES = (
    Effect("bias_torque", "|torque| (N m)", 0.0001, 0.11, draw_sign, put_bias),
    Effect("gravity_imbalance", "m g l (N m) in mgl sin(theta+ph)", 0.0003, 0.2, draw_gravity, put_gravity),
    Effect("hinge_moment_cubic", "k3 (N m/rad3)", 0.004, 8.0, draw_hinge, put_hinge),
    Effect("end_stop", "fraction of the free travel cut off", 0.01, 0.5, draw_stop, put_stop),
    Effect("load_disturbance", "pulse torque (N m)", 0.01, 1.0, draw_disturbance, put_disturbance),
    Effect("periodic_gust", "torque amplitude (N m)", 0.003, 0.25, draw_gust, put_gust),
)
