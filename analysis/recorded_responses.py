"""How near a recording's frequency response is to the linear model: `python analysis/recorded_responses.py --plants 8
--seed 90051`.

Each servo is Table 1 without Coulomb friction and preload, its J, B, K_t, K_e, k_s and R scaled at random within
--spread, log-uniform; 1 kHz, noise 0.01 deg. Printed by input and plant: the lines of coherence above 0.95, and the
largest deviation at them over all servos (bar: 0.5 dB, 3 deg for the multisine).
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.signal import butter, sosfilt

from ers_mj.control.frequency.linear import linearised
from ers_mj.data.frequency_response import Gap, frequency_response, gap
from ers_mj.data.recording import from_arrays
from ers_mj.plants.inputs import INPUTS
from ers_mj.servo.datasheet import Datasheet, read_datasheet
from ers_mj.servo.simulation import build_plant, simulate_recording

RATE, NOISE = 1000.0, np.radians(0.01)
SCALED = ("J", "B", "K_t", "K_e", "k_s", "R")


def band_noise(t: np.ndarray) -> np.ndarray:
    """6 V RMS of noise below 30 Hz."""
    x = sosfilt(butter(2, 30.0, output="sos", fs=RATE), np.random.default_rng(5).standard_normal(t.size))
    return 6.0 * x / x.std()


CASES: tuple[tuple[str, Callable, float], ...] = (
    ("multisine", INPUTS["multisine"], 10.0),
    ("multisine", INPUTS["multisine"], 30.0),
    ("chirp", INPUTS["chirp"], 10.0),
    ("steps", INPUTS["steps"], 7.0),
    ("band noise", band_noise, 10.0),
)


def compared(sheet: Datasheet, plant: str, u: Callable, duration: float, seed: int) -> tuple[Gap, int]:
    """The gap between a recording and its plant, and how many lines the response has."""
    t = np.arange(round(duration * RATE)) / RATE
    columns = simulate_recording(sheet, t, u(t), noise=NOISE, seed=seed, plant=plant)
    response = frequency_response(from_arrays(columns["t_s"], columns["u_V"], columns["theta_rad"], name="recorded"))
    linear = linearised(build_plant(sheet, plant=plant), RATE, sheet.parameters["theta_0"] + 0.2)
    return gap(response, linear.response(response.f_hz)), response.f_hz.size


def main() -> None:
    """Scatter, record, compare, tell."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plants", type=int, default=8)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--spread", type=float, default=1.4)
    arguments = parser.parse_args()
    sheet, sheets = read_datasheet("table1"), []
    for k in range(arguments.plants):
        factors = dict(
            zip(
                SCALED,
                arguments.spread ** np.random.default_rng(arguments.seed + k).uniform(-1, 1, len(SCALED)),
                strict=True,
            )
        )
        parameters = {key: x * factors.get(key, 1.0) for key, x in sheet.parameters.items()}
        sheets.append(replace(sheet, parameters={**parameters, "F_c": 0.0, "T_LH": 0.0}))
    for name, u, duration in CASES:
        for plant in ("reduced", "mujoco"):
            found = [compared(x, plant, u, duration, arguments.seed + k) for k, x in enumerate(sheets)]
            print(
                f"{name:10} {duration:3g} s {plant:8} sure {sum(g.lines for g, _ in found)} of"
                f" {sum(n for _, n in found)} lines, at most {max(g.max_db for g, _ in found):.2f} dB"
                f" {max(g.max_deg for g, _ in found):.2f} deg, a gap told of {sum(g.linear for g, _ in found)} servos",
                flush=True,
            )


if __name__ == "__main__":
    main()
