"""Draws the functional form of a concealed effect so that it is not the one that the effects folder has.

What has one form only (a dead time, a constant torque, a weight on an arm, a reading held) keeps it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ers_mj.proving.concealed.base import CONTACT, RIGID, Effect, between, choose
from ers_mj.proving.concealed.drive import DEAD, LIMIT, SAG
from ers_mj.proving.concealed.friction import HYPERBOLIC, LOAD, STRIBECK
from ers_mj.proving.concealed.load import GUST, HINGE, PULSE
from ers_mj.proving.concealed.sensor import LAG, ROUND
from ers_mj.proving.concealed.transmission import SHAFT

TEXTBOOK: Mapping[str, Callable[[dict], bool]] = {
    "presliding": lambda s: s["delta"] == 1.0 and s["v_d_rad_s"] == 0.0,
    "load_dependent_friction": lambda s: s["form"] == LOAD[0],
    "quadratic_drag": lambda s: abs(s["exponent"] - 2.0) < 0.05,
    "position_dependent_friction": lambda s: s["form"].startswith("one spot"),
    "shaft_compliance": lambda s: s["form"] == "linear",
    "cogging": lambda s: s["second_harmonic"] == 0.0,
    "voltage_saturation": lambda s: s["form"] == "hard",
    "current_limit": lambda s: s["form"] == LIMIT[0],
    "drive_dead_zone": lambda s: s["form"] != DEAD[3],
    "supply_sag": lambda s: s["form"] == "motor's current" and s["tau_s"] == 0.0,
    "hinge_moment_cubic": lambda s: s["form"] == "k3 x^3",
    "load_disturbance": lambda s: s["form"] == "rect",
    "periodic_gust": lambda s: s["form"] == "sine",
    "sensor_lag": lambda s: s["form"] == "first order",
    "sensor_nonlinearity": lambda s: s["form"] != "loaded potentiometer",
    "sensor_quantisation": lambda s: s["form"] == "nearest",
}
"""Effect -> whether a shape is the package's own form."""


def draw_shape(rng: np.random.Generator, effect: Effect, context: dict) -> dict:
    """A shape of this effect in another form than the package's."""
    is_textbook = TEXTBOOK.get(effect.name, lambda shape: False)
    shape = effect.draw(rng, context)
    while is_textbook(shape):
        shape = effect.draw(rng, context)
    return shape | _twist(rng, effect.name)


def _twist(rng: np.random.Generator, name: str) -> dict:
    """What is drawn here beside the catalogue's own shape."""
    if name == "stribeck":
        return {"form": choose(rng, STRIBECK[0], HYPERBOLIC)}
    if name == "asymmetric_friction":
        return {"growing_to_rad_s": between(rng, 0.1, 1.0)}
    if name in ("backlash", "end_stop"):
        return {"form": choose(rng, CONTACT[1], CONTACT[1], RIGID)}
    if name == "inductance":
        return {"saturation_per_A": between(rng, 0.03, 0.2)}
    return {}


PLAIN: Mapping[str, Mapping[str, object]] = {
    "stribeck": {"form": STRIBECK[1]},
    "presliding": {"form": "LuGre, constant bristle damping", "v_d_rad_s": 0.0, "delta": 1.0},
    "load_dependent_friction": {"form": LOAD[0]},
    "asymmetric_friction": {"viscous_per_coulomb": 0.0},
    "quadratic_drag": {"exponent": 2.0},
    "backlash": {"form": CONTACT[0]},
    "shaft_compliance": {"form": SHAFT[0]},
    "transmission_ripple": {"second_harmonic": 0.0},
    "cogging": {"second_harmonic": 0.0},
    "voltage_saturation": {"form": "hard", "exponent": 0.0},
    "current_limit": {"form": LIMIT[0]},
    "drive_dead_zone": {"form": DEAD[1]},
    "supply_sag": {"form": SAG[1], "tau_s": 0.0},
    "hinge_moment_cubic": {"form": HINGE[0]},
    "end_stop": {"form": CONTACT[0]},
    "load_disturbance": {"form": PULSE[0]},
    "periodic_gust": {"form": GUST[0]},
    "sensor_lag": {"form": LAG[1]},
    "sensor_quantisation": {"form": ROUND[0]},
    "thermal_drift": {"fast_share": 0.0},
}
"""Effect -> what makes a drawn shape the package's own form; an effect that stands neither here nor in REDRAWN has one
form only.
"""
REDRAWN = ("position_dependent_friction", "sensor_nonlinearity")  # forms whose other numbers follow from them
OWN = 0.5  # share of the shapes that `draw_either` draws in the package's own form


def draw_either(rng: np.random.Generator, effect: Effect, context: dict) -> dict:
    """A shape in the package's own form or in another, as `own_form` in it says; one-formed effects have the own."""
    if rng.random() >= OWN and effect.name in (*PLAIN, *REDRAWN):
        return draw_shape(rng, effect, context) | {"own_form": False}
    shape = effect.draw(rng, context)
    while effect.name in REDRAWN and not TEXTBOOK[effect.name](shape):
        shape = effect.draw(rng, context)
    return {**shape, **PLAIN.get(effect.name, {}), "own_form": effect.listed}
