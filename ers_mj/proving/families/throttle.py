"""An electronic throttle: a preloaded spring about its limp-home angle, 85 deg of travel, 12 V, logged slowly."""

from __future__ import annotations

import numpy as np

from ers_mj.proving.concealed.base import between
from ers_mj.proving.families.base import (
    LATE,
    VOLTS,
    Family,
    Motor,
    Sensor,
    Servo,
    controller_of,
    draw_motor,
    driven,
    units_of,
)

DEG = np.pi / 180.0
MOTOR = Motor(
    supply=(12.0,),
    stall=(2.5, 5.0),
    no_load=(20.0, 40.0),
    settling=(0.008, 0.02),
    friction=(0.03, 0.06),
    viscous=(0.05, 0.25),
    gear=(15.0, 25.0),
    travel=(0.64, 0.68),
    resistance=(1.0, 2.5),
)
SENSOR = Sensor(rates=(100, 100, 200), noise=(0.03 * DEG, 0.08 * DEG))


def draw(rng: np.random.Generator, labels: tuple[str, ...]) -> Servo:
    """The loop knows spring and preload roughly, as a rudder's does."""
    real, supply, half = draw_motor(rng, MOTOR)
    stall = real["n"] * real["K_t"] * supply / real["R"]
    real |= {
        "k_s": between(rng, 0.1, 0.3) * stall,
        "T_LH": between(rng, 1.3, 3.0) * real["F_c"],
        "theta_0": float(rng.uniform(0.15, 0.3)),
    }
    units = units_of(real, supply, half)

    def controller(own, dt):
        gains = controller_of(rng, own, dt)
        share = float(rng.uniform(0.7, 0.95))
        known = {"FF_C": share * own["R"] / (own["n"] * own["K_t"]), "FF_TLH": own["T_LH"], "FF_KS": own["k_s"]}
        return gains | known | {"FF_ON": 1.0, "FF_TH0": own["theta_0"], "KI": 2.0 * gains["KP"]}

    return driven(
        rng,
        "throttle",
        (real, units),
        SENSOR,
        controller,
        middle=0.74 / units.angle,
        free=("J", "B", "K_e", "F_c", "k_s", "T_LH", "theta_0"),
        inherent_names=(),
        columns=VOLTS,
    )


THROTTLE = Family(
    "throttle",
    draw,
    effects=(
        *LATE,
        "stribeck",
        "asymmetric_friction",
        "load_dependent_friction",
        "quadratic_drag",
        "position_dependent_friction",
        "backlash",
        "voltage_saturation",
        "drive_dead_zone",
        "supply_sag",
        "hinge_moment_cubic",
        "end_stop",
        "load_disturbance",
        "sensor_nonlinearity",
        "sensor_quantisation",
        "sensor_dropout",
    ),
    outside=("hysteretic_spring", "viscoelastic_spring", "friction_ageing", "intermittent_gain", "brush_drop"),
)
