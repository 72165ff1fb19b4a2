"""What a family of servos is, and how its members draw: a plant in real units, the loop round it, what excites it.

Every plant is simulated in units of its own in which its travel, friction and supply are the rudder's, so that the laws
and their strengths serve all of them; `Units` leads there and back.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from ers_mj.proving.concealed.base import between
from ers_mj.proving.waves import WAVES

RUDDER_TRAVEL, RUDDER_FRICTION, RUDDER_SUPPLY, RUDDER_STALL = 0.3, 0.34, 14.0, 9.0
"""[rad, N m, V, A] what a plant's half travel, friction, supply and stall current are in its own units."""
RUDDER_INERTIA = 0.0031  # [kg m2] for which the contacts' stiffness is drawn


@dataclass(frozen=True)
class Units:
    """How much of the real unit one of the plant's own is: angle [rad or m], torque [N m or N], volt [unit of the
    input], amp [A], time [s].
    """

    angle: float
    torque: float
    volt: float
    amp: float
    time: float = 1.0

    def own(self, real: Mapping[str, float]) -> dict[str, float]:
        """Parameters by Table 1's letters in the plant's own units."""
        a, torque, volt, amp, s = self.angle, self.torque, self.volt, self.amp, self.time
        n = real["n"] * a  # the motor's angle is the same
        return {
            "J": real["J"] * a / (torque * s**2),
            "B": real["B"] * a / (torque * s),
            "k_s": real["k_s"] * a / torque,
            "T_LH": real["T_LH"] / torque,
            "F_c": real["F_c"] / torque,
            "R": real["R"] * amp / volt,
            "L": real["L"] * amp / (volt * s),
            "K_t": real["n"] * real["K_t"] * amp / (torque * n),
            "K_e": real["n"] * real["K_e"] * a / (volt * s * n),
            "theta_0": real["theta_0"] / a,
            "n": n,
        }


@dataclass(frozen=True)
class Motor:
    """Ranges from which a plant is drawn, real units of the family.

    Attributes:
        supply: choices of the largest input.
        stall: torque at it.
        no_load: speed at it, of what the motor does without friction.
        settling: time constant of the speed [s].
        friction: dry friction over stall torque.
        viscous: share of the damping that is not back-EMF.
        resistance, electrical: of the winding [ohm], its L/R [s]; None: too short to show, its current is where it
            settles.
        gear: n, motor angle over output.
        travel: half of it.
    """

    supply: tuple[float, ...]
    stall: tuple[float, float]
    no_load: tuple[float, float]
    settling: tuple[float, float]
    friction: tuple[float, float]
    viscous: tuple[float, float]
    gear: tuple[float, float]
    travel: tuple[float, float]
    resistance: tuple[float, float] = (0.8, 4.0)
    electrical: tuple[float, float] | None = None


@dataclass(frozen=True)
class Sensor:
    """How a family is recorded: rates [Hz], noise and count (0: none) in the output's unit, whether i_A is logged, and
    how long a recording is [s of the plant's own time].
    """

    rates: tuple[int, ...]
    noise: tuple[float, float]
    count: float = 0.0
    current: bool = False
    seconds: tuple[float, float] = (5.5, 7.5)


@dataclass
class Record:
    """One excitation: sample times of the loop (samples,) [own s], reference [own rad], noise [own rad], what is known
    of the whole recording, its parameters and gains.
    """

    kind: str
    t: np.ndarray
    ref: np.ndarray
    noise: np.ndarray
    params: dict
    controller: dict
    inherent: list[dict]
    constants: dict[str, float] = field(default_factory=dict)  # columns kp, load_kg, arm_m
    told: np.ndarray = field(default_factory=lambda: np.zeros(0))  # of a position loop: the reference that is logged
    lead: int = 0  # samples of the loop before the log begins


@dataclass
class Servo:
    """A drawn servo in its own units, and all that is known of it in real ones.

    Attributes:
        real: parameters, Table 1's letters.
        free: what a refit moves, names that `Bench.moved` knows.
        inherent_names: what may be named beside what is concealed: the family has it.
        window_s: own seconds after which a refitted model is set back on the truth; None: it runs free.
        closed: whether the refitted model includes the loop (a servo that is told a position).
        stride: samples of the loop for one of the log.
        latency: by which the loop hears its reference late [own s].
        shift: of the output's zero, real.
        input_scale: the logged input over the real one.
        decimals: of the input [own V]; None: not rounded.
        turns: whether its angle is counted within one turn.
    """

    family: str
    units: Units
    real: dict
    params: dict
    records: list[Record]
    sensor: dict
    free: tuple[str, ...]
    inherent_names: tuple[str, ...]
    columns: dict[str, str]
    window_s: float | None = None
    closed: bool = False
    stride: int = 1
    latency: float = 0.0
    shift: float = 0.0
    input_scale: float = 1.0
    decimals: int | None = 4
    turns: bool = False


@dataclass(frozen=True)
class Family:
    """A kind of servo: its name, how one is drawn, what may be concealed in it."""

    name: str
    draw: Callable[[np.random.Generator, tuple[str, ...]], Servo]
    effects: tuple[str, ...]
    outside: tuple[str, ...]


# -- drawing ---------------------------------------------------------------------------------------------------------


def draw_motor(rng: np.random.Generator, m: Motor) -> tuple[dict, float, float]:
    """(parameters, largest input, half travel), real units, of a plant that a voltage drives."""
    supply, half = float(rng.choice(m.supply)), between(rng, *m.travel)
    stall, no_load = between(rng, *m.stall), between(rng, *m.no_load)
    damping, viscous = stall / no_load, float(rng.uniform(*m.viscous))
    n, resistance = between(rng, *m.gear), between(rng, *m.resistance)
    gain = stall / supply
    real = {
        "J": between(rng, *m.settling) * damping,
        "B": viscous * damping,
        "K_t": gain * resistance / n,
        "K_e": (1.0 - viscous) * damping / gain / n,
        "k_s": 0.0,
        "T_LH": 0.0,
        "F_c": between(rng, *m.friction) * stall,
        "R": resistance,
        "L": resistance * between(rng, *m.electrical) if m.electrical else 0.0,
        "theta_0": 0.0,
        "n": n,
    }
    return real, supply, half


def units_of(real: Mapping[str, float], supply: float, half: float, time: float = 1.0) -> Units:
    """The plant's own units: in them its travel, friction, supply and stall current are the rudder's."""
    amp = supply / real["R"] / RUDDER_STALL
    return Units(half / RUDDER_TRAVEL, real["F_c"] / RUDDER_FRICTION, supply / RUDDER_SUPPLY, amp, time)


def shared(rng: np.random.Generator, own: dict) -> dict:
    """Own parameters as the laws read them: the motor's shares of inertia and damping, for what splits the plant in
    two, and whether the current is where it settles.
    """
    return own | {
        "quasi": float(own["L"] == 0.0),
        "motor_inertia_share": float(rng.uniform(0.45, 0.75)),
        "motor_damping_share": float(rng.uniform(0.3, 0.7)),
    }


def lumped(p: Mapping[str, float], torque: bool = False) -> dict[str, float]:
    """Eq. (6)'s coefficients of parameters in any units; of a torque drive b = 1/J."""
    J, n = p["J"], p["n"]
    a_2 = p["B"] / J + (0.0 if torque else n**2 * p["K_t"] * p["K_e"] / (p["R"] * J))
    b = 1.0 / J if torque else n * p["K_t"] / (p["R"] * J)
    return {"a_1": p["k_s"] / J, "a_2": a_2, "b": b, "c_1": p["T_LH"] / J, "c_2": p["F_c"] / J}


def top_speed(p: Mapping[str, float]) -> float:
    """[own rad/s] at the largest input, without friction."""
    coefficients = lumped(p)
    return coefficients["b"] * RUDDER_SUPPLY / coefficients["a_2"]


def controller_of(
    rng: np.random.Generator, own: Mapping[str, float], dt: float, *, damped: bool = True, torque: bool = False
) -> dict[str, float]:
    """P or PD gains [own V/rad]: the largest input at a drawn error, a damping ratio of 0.5 to 0.8 where a derivative
    may give it, slow enough for the sample time dt [s].
    """
    coefficients = lumped(own, torque)
    b, a_2 = coefficients["b"], coefficients["a_2"]
    kp = min(RUDDER_SUPPLY / (between(rng, 0.1, 0.5) * RUDDER_TRAVEL), max((0.2 / dt) ** 2, 0.35 * a_2 / dt) / b)
    ratio = float(rng.uniform(0.5, 0.8))
    if not damped:
        kp = min(kp, (a_2 / (2.0 * 0.35)) ** 2 / b)
    kd = max((2.0 * ratio * np.sqrt(kp * b) - a_2) / b, 0.0) if damped else 0.0
    gains = {"KP": kp, "KI": 0.0, "KD": kd, "TF": 2.0 * dt, "UMAX": RUDDER_SUPPLY}
    return gains | dict.fromkeys(("FF_ON", "FF_C", "FF_TLH", "FF_KS", "FF_TH0", "D_ON_Y"), 0.0)


def draw_sensor(rng: np.random.Generator, s: Sensor, units: Units) -> dict:
    """Rate [Hz], noise and converter [own rad], whether the current is logged."""
    sigma, step = between(rng, *s.noise) / units.angle, s.count / units.angle
    return {
        "sample_rate_hz": int(rng.choice(s.rates)),
        "noise_sigma_rad": sigma,
        "noise_sigma_eff_rad": float(np.hypot(sigma, step / np.sqrt(12.0))),
        "adc_step_rad": step,
        "has_current": s.current,
        "current_sigma_A": float(rng.uniform(0.01, 0.05)),
    }


KINDS = ("staircase", "chirp", "multisine", "slow_triangle", "triangle", "square")


def draw_references(
    rng: np.random.Generator, sensor: Mapping, seconds: tuple[float, float], *, time: float = 1.0, middle: float = 0.0
) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Four of (kind, own times, reference [own rad]): steps, a sweep or sines, and two others, one of them over nearly
    all of the travel.
    """
    kinds = ["staircase", str(rng.choice(["chirp", "multisine"]))]
    kinds += [str(k) for k in rng.permutation([k for k in KINDS if k not in kinds])[:2]]
    sizes = np.exp(rng.uniform(np.log(0.3), 0.0, 4))
    sizes[int(rng.integers(4))] = 1.0
    out = []
    for kind, size in zip(kinds, sizes):
        step = 1.0 / (sensor["sample_rate_hz"] * time)
        t = np.arange(int(round(rng.uniform(*seconds) / step))) * step
        wave = rng.uniform(-0.1, 0.1) + 0.9 * WAVES[kind](rng, t)
        size = 0.4 * size if kind in ("chirp", "multisine") else size
        out.append((kind, t, middle + size * RUDDER_TRAVEL * wave))
    return out


def driven(
    rng: np.random.Generator,
    family: str,
    plant: tuple[dict, Units],
    sensor: Sensor,
    controller: Callable[[Mapping[str, float], float], dict],
    *,
    middle: float = 0.0,
    inherent: tuple[dict, ...] = (),
    **known,
) -> Servo:
    """A servo whose input is logged, in a loop of the recorder's: four records of it.

    Args:
        plant: parameters in real units, and the units.
        controller: (own parameters, own sample time) -> gains.
        middle: of the references [own rad].
        inherent: effects that it always has.
        known: what else `Servo` holds.
    """
    real, units = plant
    own, drawn = shared(rng, units.own(real)), draw_sensor(rng, sensor, units)
    gains = controller(own, 1.0 / (drawn["sample_rate_hz"] * units.time))
    records = [
        Record(kind, t, ref, drawn["noise_sigma_rad"] * rng.standard_normal(t.size), own, gains, list(inherent))
        for kind, t, ref in draw_references(rng, drawn, sensor.seconds, time=units.time, middle=middle)
    ]
    return Servo(family, units, real, own, records, drawn, **known)


FRICTION = ("stribeck", "presliding", "asymmetric_friction", "quadratic_drag", "position_dependent_friction")
LATE = ("input_delay", "sensor_lag")
"""Effects of the lists that families share."""
VOLTS = {"input": "u_V", "output": "theta_rad"}
