"""A ball screw: it moves in metres, its scale counts micrometres, 24 V, a PD loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ers_mj.proving.families.base import (
    FRICTION,
    LATE,
    Family,
    Motor,
    Sensor,
    Servo,
    controller_of,
    draw_motor,
    driven,
    units_of,
)

MOTOR = Motor(
    supply=(24.0,),
    stall=(150.0, 500.0),  # [N]
    no_load=(0.8, 2.0),  # [m/s]
    settling=(0.04, 0.1),
    friction=(0.04, 0.1),
    viscous=(0.04, 0.15),
    gear=(300.0, 1300.0),  # [rad/m]: leads of 5 to 20 mm
    travel=(0.1, 0.2),  # [m]
    resistance=(0.8, 2.0),
)
WOUND = replace(MOTOR, electrical=(3e-4, 8e-4))  # half of them: its time constant shows
SENSOR = Sensor(rates=(500, 1000, 1000), noise=(2e-6, 6e-6), count=1e-6)


def draw(rng: np.random.Generator, labels: tuple[str, ...]) -> Servo:
    """A horizontal axis; it reads metres from an end of its scale."""
    real, supply, half = draw_motor(rng, WOUND if rng.random() < 0.5 else MOTOR)
    return driven(
        rng,
        "screw",
        (real, units_of(real, supply, half)),
        SENSOR,
        lambda own, dt: controller_of(rng, own, dt),
        free=("J", "B", "K_e", "F_c"),
        inherent_names=(),
        columns={"input": "u_V", "output": "x_m"},
        window_s=0.5,
        shift=float(rng.choice([0.0, rng.uniform(0.2, 0.4)])),
    )


SCREW = Family(
    "screw",
    draw,
    effects=(
        *FRICTION,
        *LATE,
        "load_dependent_friction",
        "backlash",
        "shaft_compliance",
        "transmission_ripple",
        "voltage_saturation",
        "current_limit",
        "drive_dead_zone",
        "supply_sag",
        "bias_torque",
        "end_stop",
        "load_disturbance",
    ),
    outside=("second_resonance", "hysteretic_spring", "friction_ageing", "intermittent_gain", "running_in"),
)
