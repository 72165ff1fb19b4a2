"""What may be concealed in the friction."""

from __future__ import annotations

import numpy as np

from ers_mj.proving.concealed.base import Effect, angle, between, choose, index, sign
from ers_mj.proving.plant import DEG

STRIBECK = ("1/(1+(w/v)^2)", "exp(-(w/v)^2)", "exp(-|w|/v)")


HYPERBOLIC = "1/cosh(w/v)"


def draw_stribeck(rng, context):
    """Stribeck speed [rad/s] and the shape of the fall."""
    return {"form": choose(rng, *STRIBECK), "v_stribeck_rad_s": between(rng, 0.08, 0.5)}


def put_stribeck(p, s, shape, record):
    """Strength (Fs - Fc)/Fc."""
    p["stri_f"], p["stri_v"], p["stri_form"] = (
        s,
        shape["v_stribeck_rad_s"],
        index((*STRIBECK, HYPERBOLIC), shape.get("form", STRIBECK[1])),
    )


def draw_presliding(rng, context):
    """LuGre (bristle damping fading with speed or not) or Dahl."""
    form = choose(rng, "LuGre", "LuGre, constant bristle damping", "Dahl")
    shape = {"form": form, "bristle_damping_ratio": 0.0 if form == "Dahl" else float(rng.uniform(0.2, 0.8))}
    return shape | {
        "v_d_rad_s": between(rng, 0.05, 0.3) if form == "LuGre" else 0.0,
        "delta": float(choose(rng, 1.0, 1.5)) if form == "Dahl" else 1.0,
    }


def put_presliding(p, s, shape, record):
    """Strength F_c/sigma_0 [deg]."""
    stiffness = p["F_c"][0] / (s * DEG)
    p["pre_s0"], p["pre_vd"], p["pre_delta"] = stiffness, shape.get("v_d_rad_s", 0.0), shape.get("delta", 1.0)
    p["pre_s1"] = 2.0 * shape["bristle_damping_ratio"] * np.sqrt(stiffness * p["J"][0])


def draw_asymmetric(rng, context):
    """Which way is heavier; viscous friction shares it in half of the cases."""
    return {"sign": sign(rng), "viscous_per_coulomb": float(choose(rng, 0.0, rng.uniform(0.3, 2.0)))}


def put_asymmetric(p, s, shape, record):
    """Strength a in Fc (1 +- a); the viscous asymmetry stands as it is or in proportion to a."""
    viscous = shape["viscous_per_coulomb"] * s if "viscous_per_coulomb" in shape else shape["viscous_asymmetry"]
    p["asym_c"], p["asym_v"] = shape["sign"] * s, shape["sign"] * viscous
    p["asym_dir"] = shape.get("growing_to_rad_s", 0.0)


LOAD = ("motor torque", "motor torque, rounded at zero")


def draw_load(rng, context):
    """Which torque presses."""
    return {"form": choose(rng, *LOAD)}


def put_load(p, s, shape, record):
    """Strength mu in Fc + mu |n Kt i|."""
    p["load_mu"], p["load_form"] = s, index(LOAD, shape.get("form", LOAD[0]))


def draw_quadratic(rng, context):
    """Exponent of the speed."""
    return {"exponent": float(rng.uniform(1.8, 2.2))}


def put_quadratic(p, s, shape, record):
    """Strength c [N m (s/rad)^p] in c |w|^p."""
    p["quad_c"], p["quad_p"] = s, shape.get("exponent", 2.0)


POSITION = ("sin(k x+ph)", "one spot exp(-(k (x-ph))^2)", "outwards tanh(k x^2)")


def draw_position(rng, context):
    """A wave along the travel, one tight or loose spot, or tightening outwards."""
    low, high = context["travel"]
    form = choose(rng, *POSITION)
    k, ph = between(rng, 8.0, 40.0), angle(rng)
    if form == POSITION[1]:
        k, ph = 1.0 / between(rng, 2.0 * DEG, 5.0 * DEG), float(rng.uniform(0.6 * low, 0.6 * high))
    elif form == POSITION[2]:
        k, ph = 1.0 / (0.5 * max(-low, high)) ** 2, 0.0
    return {"form": form, "k": float(k), "ph": ph, "sign": 1.0 if form == POSITION[0] else sign(rng)}


def put_position(p, s, shape, record):
    """Strength: relative modulation of Fc."""
    p["pos_a"], p["pos_k"], p["pos_ph"] = s * shape["sign"], shape["k"], shape["ph"]
    p["pos_form"] = index(POSITION, shape["form"])


ENTRIES = (
    Effect("stribeck", "(Fs-Fc)/Fc", 0.002, 1.2, draw_stribeck, put_stribeck),
    Effect("presliding", "presliding displacement Fc/sigma0 (deg)", 0.04, 3.0, draw_presliding, put_presliding),
    Effect(
        "asymmetric_friction",
        "Coulomb asymmetry a: Fc(1+a) fwd, Fc(1-a) back",
        0.0005,
        0.5,
        draw_asymmetric,
        put_asymmetric,
    ),
    Effect("load_dependent_friction", "mu in Fc + mu*|n Kt i|", 0.0005, 0.25, draw_load, put_load),
    Effect("quadratic_drag", "c (N m (s/rad)^p) in c |w|^p", 0.0001, 0.12, draw_quadratic, put_quadratic),
    Effect("position_dependent_friction", "relative modulation of Fc", 0.004, 0.8, draw_position, put_position),
)
