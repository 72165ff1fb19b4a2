"""A slow and heavy gimbal, as an antenna's azimuth: hundreds of kg m^2, 24 V, logged at 50 Hz for a minute."""

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
SLOW = 8.0  # times slower than a rudder: the plant's own second lasts so long
MOTOR = Motor(
    supply=(24.0,),
    stall=(300.0, 900.0),
    no_load=(0.5, 1.2),
    settling=(0.12, 0.4),
    friction=(0.03, 0.07),
    viscous=(0.08, 0.3),
    gear=(400.0, 1200.0),
    travel=(0.5, 1.0),
)
SENSOR = Sensor(rates=(50,), noise=(0.003 * DEG, 0.01 * DEG), count=2.0 * np.pi / 2**18)


def draw(rng: np.random.Generator, labels: tuple[str, ...]) -> Servo:
    """An azimuth axis in still air."""
    real, supply, half = draw_motor(rng, MOTOR)
    return driven(
        rng,
        "gimbal",
        (real, units_of(real, supply, half, SLOW)),
        SENSOR,
        lambda own, dt: controller_of(rng, own, dt),
        free=("J", "B", "K_e", "F_c"),
        inherent_names=(),
        columns=VOLTS,
        window_s=0.5,
        turns=True,
    )


GIMBAL = Family(
    "gimbal",
    draw,
    effects=(
        *FRICTION,
        *LATE,
        "backlash",
        "shaft_compliance",
        "transmission_ripple",
        "voltage_saturation",
        "drive_dead_zone",
        "supply_sag",
        "bias_torque",
        "load_disturbance",
        "periodic_gust",
        "sensor_nonlinearity",
        "end_stop",
    ),
    outside=("second_resonance", "hysteretic_spring", "friction_ageing", "intermittent_gain", "running_in"),
)
