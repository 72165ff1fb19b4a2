"""A hobby servo on a pendulum: no spring, gravity over most of a turn, a P loop; its input is duty times supply, or the
duty.
"""

from __future__ import annotations

import numpy as np

from ers_mj.proving.concealed.base import between
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

COUNT = 2.0 * np.pi / 4096
MOTOR = Motor(
    supply=(6.0, 7.4),
    stall=(0.6, 2.5),
    no_load=(4.0, 9.0),
    settling=(0.04, 0.12),
    friction=(0.04, 0.1),
    viscous=(0.03, 0.2),
    gear=(150.0, 300.0),
    travel=(2.0, 2.8),
    resistance=(2.0, 5.0),
)
SENSOR = Sensor(rates=(100, 125, 200), noise=(0.25 * COUNT, 0.4 * COUNT), count=COUNT)


def draw(rng: np.random.Generator, labels: tuple[str, ...]) -> Servo:
    """A pendulum that hangs at first; gravity takes a quarter to six tenths of the stall torque."""
    real, supply, half = draw_motor(rng, MOTOR)
    units = units_of(real, supply, half)
    pull = between(rng, 0.25, 0.6) * real["K_t"] * real["n"] * supply / real["R"]
    hanging = {"phase": 0.0, "wave": units.angle}
    gravity = {"label": "gravity_imbalance", "strength": pull / units.torque, "shape": hanging}
    duty = rng.random() < 0.3
    return driven(
        rng,
        "hobby",
        (real, units),
        SENSOR,
        lambda own, dt: controller_of(rng, own, dt, damped=False),
        inherent=(gravity,),
        free=("J", "B", "K_e", "F_c", "pull", "tilt"),
        inherent_names=("gravity_imbalance",),
        columns={"input": "u_duty_pct", "output": "theta_rad"} if duty else VOLTS,
        window_s=1.0,
        turns=True,
        shift=float(rng.uniform(-0.3, 0.3)),
        input_scale=100.0 / supply if duty else 1.0,
    )


HOBBY = Family(
    "hobby",
    draw,
    effects=(
        *FRICTION,
        *LATE,
        "load_dependent_friction",
        "backlash",
        "shaft_compliance",
        "drive_dead_zone",
        "supply_sag",
        "voltage_saturation",
        "end_stop",
        "load_disturbance",
        "bias_torque",
        "sensor_dropout",
    ),
    outside=("hysteretic_spring", "friction_ageing", "brush_drop", "intermittent_gain", "second_resonance"),
)
