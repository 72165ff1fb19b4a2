"""What may be concealed between motor and rudder."""

from __future__ import annotations

import numpy as np

from ers_mj.proving.concealed.base import CONTACT, RIGID, Effect, angle, between, choose, index, sign
from ers_mj.proving.plant import DEG

SHAFT = ("linear", "sinh", "in stages")


def draw_backlash(rng, context):
    """Stiffness and damping of the flanks, share of the dry friction on the motor's side."""
    return {
        "form": choose(rng, *CONTACT),
        "contact_k": between(rng, 1200.0, 3000.0) * context.get("stiffness", 1.0),
        "contact_zeta": float(rng.uniform(0.1, 0.25)),
        "motor_friction_share": float(rng.uniform(0.15, 0.4)),
    }


def split(p, k, zeta, share):
    """Two masses joined by k [N m/rad] and damping ratio zeta."""
    motor = p["share_J"][0] * p["J"][0]
    reduced = motor * (1.0 - p["share_J"][0])
    p["two"], p["con_k"], p["con_c"], p["share_F"] = 1.0, k, 2.0 * zeta * np.sqrt(k * reduced), share


def put_backlash(p, s, shape, record):
    """Strength: total gap at the output [deg]."""
    split(p, shape["contact_k"], shape["contact_zeta"], shape["motor_friction_share"])
    p["gap"], form = 0.5 * s * DEG, shape.get("form", CONTACT[0])
    p["con_form"] = 3.0 if form == RIGID else index(CONTACT, form)


def draw_compliance(rng, context):
    """A linear shaft, or one that gets stiffer."""
    return {
        "form": choose(rng, *SHAFT),
        "zeta": float(rng.uniform(0.03, 0.2)),
        "motor_friction_share": float(rng.uniform(0.15, 0.4)),
    }


def put_compliance(p, s, shape, record):
    """Strength [deg per N m]."""
    split(p, 1.0 / (s * DEG), shape["zeta"], shape["motor_friction_share"])
    p["con_form"] = 2.0 * index(SHAFT, shape.get("form", SHAFT[0]))


def draw_ratio(rng, context):
    """Crank and rod (start angle, crank over rod) or a polynomial along the travel."""
    if rng.random() < 0.5:
        return {
            "form": "crank and rod",
            "psi0_rad": float(rng.uniform(0.2, 0.5)) * sign(rng),
            "lam": float(rng.uniform(-0.4, 0.4)),
        }
    return {
        "form": "polynomial",
        "slope": float(rng.uniform(0.3, 1.0)) * sign(rng),
        "curvature": float(rng.uniform(-0.8, 0.8)),
    }


def put_ratio(p, s, shape, record):
    """Strength: scale of n(theta)/n0 - 1."""
    crank = shape.get("form", "crank and rod") == "crank and rod"
    p["ratio_s"], p["ratio_form"] = s, 1.0 if crank else 2.0
    p["ratio_a"], p["ratio_b"] = (shape["psi0_rad"], shape["lam"]) if crank else (shape["slope"], shape["curvature"])


def draw_ripple(rng, context):
    """Teeth a turn of the output, and a share of the second harmonic in half of the cases."""
    turns = float(choose(rng, 18.0, 22.26, 36.0, rng.uniform(14.0, 60.0))) * context.get("turns", 1.0)
    return {
        "cycles_per_output_rev": turns,
        "phase": angle(rng),
        "second_harmonic": float(choose(rng, 0.0, rng.uniform(0.1, 0.3))),
    }


def put_ripple(p, s, shape, record):
    """Strength: amplitude at the output [N m]."""
    p["rip_a"], p["rip_k"], p["rip_ph"] = -s, shape["cycles_per_output_rev"], shape["phase"]
    p["rip_h2"] = shape.get("second_harmonic", 0.0)


ENTRIES = (
    Effect("backlash", "total gap at output (deg)", 0.02, 3.0, draw_backlash, put_backlash),
    Effect("shaft_compliance", "compliance (deg per N m)", 0.1, 6.0, draw_compliance, put_compliance),
    Effect("variable_ratio", "scale of n(theta)/n0-1", 0.003, 0.9, draw_ratio, put_ratio),
    Effect("transmission_ripple", "amplitude (N m at output)", 0.0008, 0.3, draw_ripple, put_ripple),
)
