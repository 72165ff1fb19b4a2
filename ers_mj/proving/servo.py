"""Draws a servo: its parameters about the datasheet's, its sensor, its controller, and what it is excited with."""

from __future__ import annotations

import numpy as np

from ers_mj.proving.plant import CONTROLLER, DEG, TABLE_1
from ers_mj.proving.quick import COARSE, ROUGH, run, simulate
from ers_mj.proving.sampling import Setup
from ers_mj.proving.waves import WAVES

RATES, WEIGHTS = (500, 1000, 2000), (0.15, 0.7, 0.15)
"""[Hz] sample rates, and how often each is drawn."""
CLOSED = ("chirp", "slow_triangle", "triangle", "square")
SCATTER = {"J": 0.12, "B": 0.15, "K_t": 0.08, "K_e": 0.08, "k_s": 0.1, "T_LH": 0.08, "F_c": 0.12, "R": 0.1, "L": 0.15}
"""Standard deviation of the logarithm of true over datasheet value, 8-15 %."""


def draw_params(rng):
    """True parameters (SI) about Table 1; n exact, theta_0 off by a few tenths of a degree."""
    params = {
        name: float(TABLE_1[name] * np.exp(sd * np.clip(rng.standard_normal(), -2.0, 2.0)))
        for name, sd in SCATTER.items()
    }
    params["T_LH"] = max(params["T_LH"], 1.05 * params["F_c"])
    shares = {
        "motor_inertia_share": float(rng.uniform(0.45, 0.75)),
        "motor_damping_share": float(rng.uniform(0.3, 0.7)),
    }
    return params | {"theta_0": TABLE_1["theta_0"] + float(rng.normal(0.0, 0.3)) * DEG, "n": TABLE_1["n"]} | shares


def draw_sensor(rng, coloured, rates, weights):
    """Noise and converter [rad], whether the current is measured, sample rate [Hz]."""
    bits = int(rng.choice([0, 0, 12, 13, 14]))
    step = 120.0 * DEG / 2**bits if bits else 0.0
    sigma = float(np.exp(rng.uniform(np.log(0.005), np.log(0.03)))) * DEG
    return {
        "noise_sigma_rad": sigma,
        "noise_sigma_eff_rad": float(np.hypot(sigma, step / np.sqrt(12.0))),
        "noise_colour_corner_hz": float(rng.uniform(20.0, 200.0)) if rng.random() < coloured else None,
        "adc_bits": bits,
        "adc_step_rad": step,
        "has_current": bool(rng.random() < 0.5),
        "current_sigma_A": float(rng.uniform(0.01, 0.05)),
        "sample_rate_hz": int(rng.choice(rates, p=weights)),
    }


def draw_controller(rng, umax):
    """PID gains [V/rad ...] and the feed-forward of spring and preload, on in half of the cases."""
    gains = [
        rng.uniform(15.0, 30.0),
        rng.uniform(30.0, 60.0),
        rng.uniform(0.2, 0.5),
        rng.uniform(0.003, 0.009),
        umax,
        rng.integers(2),
        rng.uniform(0.7, 0.95) * TABLE_1["R"] / (TABLE_1["n"] * TABLE_1["K_t"]),
        TABLE_1["T_LH"],
        TABLE_1["k_s"],
        15.0 * DEG,
    ]
    return {name: float(value) for name, value in zip(CONTROLLER, gains)}


def noise_of(rng, samples, sensor):
    """(samples,) white noise [rad], or first-order coloured of the same rms."""
    white = rng.standard_normal(samples)
    corner = sensor["noise_colour_corner_hz"]
    if corner is None:
        return sensor["noise_sigma_rad"] * white
    keep, out = np.exp(-2.0 * np.pi * corner / sensor["sample_rate_hz"]), np.empty(samples)
    out[0] = white[0]
    for k in range(1, samples):
        out[k] = keep * out[k - 1] + np.sqrt(1.0 - keep**2) * white[k]
    return sensor["noise_sigma_rad"] * out


# ---- recordings ----------------------------------------------------------------------------------------------------


def open_size(params, t, wave, umax, wanted):
    """[V] amplitude at which the effect-free servo travels `wanted` [rad], by bisection, at most umax."""
    low, high = 2.5, umax
    for _ in range(9):
        mid = 0.5 * (low + high)
        travel = np.ptp(simulate(params, [], t, mid * wave, step=1e-4).true)
        low, high = (mid, high) if travel < wanted else (low, mid)
    return 0.5 * (low + high)


def closed_size(params, t, wave, controller, wanted):
    """[rad] amplitude at which the effect-free loop travels at least half of `wanted` [rad], at most 25 deg: a loop
    without feed-forward breaks away late."""
    size = 0.5 * wanted
    while size < 25.0 * DEG:
        ref = TABLE_1["theta_0"] + size * wave
        if (
            np.ptp(simulate(params, [], t, None, setup=Setup(controller=controller, theta_ref=ref), step=ROUGH).true)
            > 0.5 * wanted
        ):
            break
        size *= 1.4
    return size


def draw_record(rng, kind, params, controller, sensor):
    """One excitation: its voltage [V] where open loop, its reference [rad] where closed, and the noise."""
    rate = sensor["sample_rate_hz"]
    t = np.arange(int(round(rate * np.round(rng.uniform(5.5, 7.5), 1)))) / rate
    wave = WAVES[kind](rng, t)
    closed = kind in CLOSED or (kind == "staircase" and rng.random() < 0.5)
    wanted = np.exp(rng.uniform(np.log(8.0), np.log(40.0))) * DEG
    u = ref = None
    if closed:
        wave = rng.uniform(-0.2, 0.2) + wave
        ref = np.round(TABLE_1["theta_0"] + closed_size(params, t, wave, controller, wanted) * wave, 5)
    else:
        u = np.round(
            np.clip(
                open_size(params, t, wave, controller["UMAX"], wanted) * wave, -controller["UMAX"], controller["UMAX"]
            ),
            4,
        )
    return {
        "kind": kind,
        "closed_loop": closed,
        "t": t,
        "u": u,
        "ref": ref,
        "bare": {},
        "noise": noise_of(rng, t.size, sensor),
    }


def draw_kinds(rng):
    """Three to five excitations, one of them an open-loop multisine."""
    others = list(rng.permutation([k for k in WAVES if k != "multisine"]))[: rng.integers(2, 5)]
    return [str(k) for k in rng.permutation(["multisine", *others])]


def draw_servo(rng, coloured=0.0, rates=RATES, weights=WEIGHTS):
    """Servo, sensor, controller, records and what the effect-free records reach."""
    params, sensor = draw_params(rng), draw_sensor(rng, coloured, rates, weights)
    controller = draw_controller(rng, float(np.round(rng.uniform(10.0, 24.0), 1)))
    servo = {"params": params, "sensor": sensor, "controller": controller}
    servo["records"] = [draw_record(rng, kind, params, controller, sensor) for kind in draw_kinds(rng)]
    runs = [run(servo, record, k, [], COARSE) for k, record in enumerate(servo["records"])]
    angles = np.concatenate([r.true for r in runs]) - params["theta_0"]
    servo["context"] = {
        "params": params,
        "travel": (float(angles.min()), float(angles.max())),
        "records": len(runs),
        "peak_V": float(max(np.abs(r.u).max() for r in runs)),
        "umax_V": controller["UMAX"],
        "peak_A": float(max(np.abs(r.i_A).max() for r in runs)),
        "durations": [float(r["t"][-1]) for r in servo["records"]],
    }
    return servo
