"""A quasi-direct drive: its input is a torque, so there is no back-EMF; an encoder in the joint, a PD loop."""

from __future__ import annotations

import numpy as np

from ers_mj.proving.families.base import (
    FRICTION,
    LATE,
    RUDDER_FRICTION,
    RUDDER_SUPPLY,
    RUDDER_TRAVEL,
    Family,
    Motor,
    Sensor,
    Servo,
    Units,
    controller_of,
    draw_motor,
    driven,
)

DEG = np.pi / 180.0
MOTOR = Motor(
    supply=(8.0, 12.0, 18.0, 24.0),  # [N m]
    stall=(1.0, 1.0),  # of the input itself, see below
    no_load=(150.0, 400.0),
    settling=(1.0, 4.0),
    friction=(0.006, 0.025),
    viscous=(1.0, 1.0),
    gear=(6.0, 10.0),
    travel=(0.8, 1.8),
)
SENSOR = Sensor(rates=(500, 500, 1000), noise=(0.008 * DEG, 0.02 * DEG), count=2.0 * np.pi / 2**16)


def draw(rng: np.random.Generator, labels: tuple[str, ...]) -> Servo:
    """A joint about a vertical axis."""
    real, supply, half = draw_motor(rng, MOTOR)
    real |= {name: real[name] * supply for name in ("J", "B", "F_c")}
    real |= {"K_t": 1.0 / real["n"], "K_e": 0.0, "R": 1.0, "L": 0.0}
    volt = supply / RUDDER_SUPPLY
    units = Units(half / RUDDER_TRAVEL, real["F_c"] / RUDDER_FRICTION, volt, volt)
    servo = driven(
        rng,
        "direct",
        (real, units),
        SENSOR,
        lambda own, dt: controller_of(rng, own, dt, torque=True),
        free=("J", "B", "F_c"),
        inherent_names=(),
        columns={"input": "tau_cmd_Nm", "output": "theta_rad"},
        window_s=0.5,
        turns=True,
    )
    for record in servo.records:
        record.params = record.params | {"torque": 1.0}
    servo.params = servo.params | {"torque": 1.0}
    return servo


DIRECT = Family(
    "direct",
    draw,
    effects=(
        *FRICTION,
        *LATE,
        "cogging",
        "transmission_ripple",
        "backlash",
        "shaft_compliance",
        "bias_torque",
        "gravity_imbalance",
        "end_stop",
        "load_disturbance",
        "periodic_gust",
        "sensor_nonlinearity",
    ),
    outside=("second_resonance", "hysteretic_spring", "friction_ageing", "intermittent_gain", "magnetic_saturation"),
)
