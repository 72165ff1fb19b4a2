"""A strain-wave joint: high ratio, 48 V, the motor's current logged, a fine encoder, a PD loop."""

from __future__ import annotations

import numpy as np

from ers_mj.proving.families.base import (
    FRICTION,
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
    supply=(48.0,),
    stall=(400.0, 1200.0),
    no_load=(3.0, 5.5),
    settling=(0.008, 0.025),
    friction=(0.01, 0.025),
    viscous=(0.1, 0.3),
    gear=(80.0, 160.0),
    travel=(0.9, 1.5),
    resistance=(0.5, 1.2),
    electrical=(4e-4, 9e-4),
)
SENSOR = Sensor(rates=(1000,), noise=(0.002 * DEG, 0.005 * DEG), count=2.0 * np.pi / 2**19, current=True)


def draw(rng: np.random.Generator, labels: tuple[str, ...]) -> Servo:
    """A joint about a vertical axis."""
    real, supply, half = draw_motor(rng, MOTOR)
    return driven(
        rng,
        "strain_wave",
        (real, units_of(real, supply, half)),
        SENSOR,
        lambda own, dt: controller_of(rng, own, dt),
        free=("J", "B", "K_e", "F_c"),
        inherent_names=(),
        columns=VOLTS,
        window_s=0.5,
        turns=True,
    )


STRAIN_WAVE = Family(
    "strain_wave",
    draw,
    effects=(
        *FRICTION,
        *LATE,
        "load_dependent_friction",
        "shaft_compliance",
        "transmission_ripple",
        "gravity_imbalance",
        "voltage_saturation",
        "current_limit",
        "drive_dead_zone",
        "supply_sag",
        "thermal_drift",
        "load_disturbance",
    ),
    outside=("second_resonance", "hysteretic_spring", "friction_ageing", "magnetic_saturation", "intermittent_gain"),
)
