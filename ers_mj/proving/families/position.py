"""A servo that is told a position: its firmware closes a P, PD or PI loop of its own, of which only the reference is
logged. Latency and limit are always there, a limit of the reference's speed and gravity now and then.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ers_mj.proving.concealed.base import between
from ers_mj.proving.families.base import (
    FRICTION,
    RUDDER_SUPPLY,
    Family,
    Motor,
    Record,
    Sensor,
    Servo,
    Units,
    controller_of,
    draw_motor,
    draw_references,
    draw_sensor,
    shared,
    top_speed,
    units_of,
)

COUNT = 2.0 * np.pi / 4096
MOTOR = Motor(
    supply=(1.0,),  # the full duty
    stall=(0.6, 3.0),
    no_load=(4.0, 10.0),
    settling=(0.0125, 0.065),
    friction=(0.02, 0.1),
    viscous=(0.1, 0.5),
    gear=(150.0, 350.0),
    travel=(0.7, 0.9),
)
SENSOR = Sensor(rates=(100, 100, 200), noise=(2e-4, 4e-4), count=COUNT)


@dataclass(frozen=True)
class Firmware:
    """What is drawn of the loop."""

    rates: tuple[int, ...] = (500, 1000, 1000)  # [Hz]
    lead: float = 1.0  # [s] in which the loop comes to rest before the log begins
    rest: float = 0.2  # [s] in which the reference stands still at first
    latency: tuple[float, float] = (3e-3, 30e-3)  # [s]
    integral: float = 0.2  # share of the loops that are PI
    limited: float = 0.3  # share of the references with a limit of their speed
    gravity: float = 0.5  # share of the servos that lift an arm
    loaded: float = 0.3  # share of the servos with two loads
    two_gains: float = 0.4  # share of the servos recorded at two gains,
    whole: float = 0.5  # and of these the share whose register multiplies the damping and the integral as well


FIRMWARE = Firmware()


def draw(rng: np.random.Generator, labels: tuple[str, ...]) -> Servo:
    """One servo at one or two gains of the firmware and one or two loads."""
    real, supply, half = draw_motor(rng, MOTOR)
    units = units_of(real, supply, half)
    own, sensor = shared(rng, units.own(real)), draw_sensor(rng, SENSOR, units)
    firmware = int(rng.choice(FIRMWARE.rates))
    gains = _gains(rng, own, 1.0 / firmware)
    inherent = _inherent(rng, own, units, labels)
    registers = [1.0, between(rng, 2.0, 4.0)] if rng.random() < FIRMWARE.two_gains else [1.0]
    scaled = ("KP", "KI", "KD") if len(registers) > 1 and rng.random() < FIRMWARE.whole else ("KP",)
    loads = [1.0, between(rng, 1.5, 2.5)] if rng.random() < FIRMWARE.loaded else [1.0]
    carried, mass, arm = float(rng.uniform(0.3, 0.7)), between(rng, 0.1, 0.5), between(rng, 0.05, 0.2)
    records = []
    for k, (kind, t, told) in enumerate(draw_references(rng, sensor, SENSOR.seconds)):
        register, load = registers[k % len(registers)], loads[k // 2 % len(loads)]
        known = {"kp": register} if len(registers) > 1 else {}
        known |= {"load_kg": mass * load, "arm_m": arm} if len(loads) > 1 else {}
        params = own | {"J": own["J"] * (1.0 + carried * (load - 1.0))}
        record = Record(kind, t, told, t, params, _at(gains, scaled, register), _under(inherent, load), known)
        records.append(_in_firmware(rng, record, firmware, sensor))
    names = ("input_delay", "voltage_saturation", *(effect["label"] for effect in inherent))
    pulled = ("pull", "tilt") if "gravity_imbalance" in names else ()
    return Servo(
        "position",
        units,
        real,
        own,
        records,
        sensor,
        free=("J", "B", "F_c", "KP", "KD", "UMAX", "latency", *pulled),
        inherent_names=names,
        columns={"input": "theta_ref_rad", "output": "theta_rad"},
        closed=True,
        stride=firmware // sensor["sample_rate_hz"],
        latency=max(round(between(rng, *FIRMWARE.latency) * firmware), 1) / firmware,
        decimals=None,
    )


def _gains(rng: np.random.Generator, own: dict, period: float) -> dict:
    """P, PD with the derivative of the angle, or PI."""
    gains = controller_of(rng, own, period, damped=bool(rng.random() < 0.5)) | {"D_ON_Y": 1.0}
    if rng.random() < FIRMWARE.integral:
        gains |= {"KI": between(rng, 0.5, 3.0) * gains["KP"], "KD": 0.0}
    return gains


def _inherent(rng: np.random.Generator, own: dict, units: Units, labels: tuple[str, ...]) -> list[dict]:
    """Gravity in half of the servos; a limit of the reference's speed in some, if none is concealed."""
    out = []
    stall = own["n"] * own["K_t"] * RUDDER_SUPPLY / own["R"]
    pull, tilt = between(rng, 0.05, 0.25) * stall, float(rng.uniform(-0.5, 0.5))
    if rng.random() < FIRMWARE.gravity:
        shape = {"phase": tilt, "wave": units.angle}
        out.append({"label": "gravity_imbalance", "strength": pull, "shape": shape})
    cut, limited = float(rng.uniform(0.3, 0.65)), rng.random() < FIRMWARE.limited
    if limited and "rate_limit" not in labels:
        out.append({"label": "rate_limit", "strength": cut, "shape": {"top_rad_s": top_speed(own)}})
    return out


def _at(gains: dict, scaled: tuple[str, ...], register: float) -> dict:
    """Gains, of which some are so many times the first ones at this register; the limit is the motor's."""
    return gains | {name: gains[name] * register for name in scaled}


def _under(inherent: list[dict], load: float) -> list[dict]:
    """The same effects under a load that is so many times the first one."""
    return [e | {"strength": e["strength"] * load} if e["label"] == "gravity_imbalance" else e for e in inherent]


def _in_firmware(rng: np.random.Generator, record: Record, firmware: int, sensor: dict) -> Record:
    """The record on the firmware's clock, a while at rest before its log begins."""
    lead, stride = round(FIRMWARE.lead * firmware), firmware // sensor["sample_rate_hz"]
    rest = record.ref.copy()
    rest[: round(FIRMWARE.rest * sensor["sample_rate_hz"])] = 0.0
    told = np.round(rest, 5)
    t = np.arange(lead + told.size * stride) / firmware
    record.t, record.told, record.lead = t, told, lead
    record.ref = np.concatenate([np.full(lead, told[0]), np.repeat(told, stride)])
    record.noise = sensor["noise_sigma_rad"] * rng.standard_normal(t.size)
    return record


POSITION = Family(
    "position",
    draw,
    effects=(
        *FRICTION,
        "rate_limit",
        "load_dependent_friction",
        "backlash",
        "shaft_compliance",
        "drive_dead_zone",
        "end_stop",
    ),
    outside=("second_resonance", "hysteretic_spring", "friction_ageing", "intermittent_gain"),
)
