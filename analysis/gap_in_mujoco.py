"""Play in the MuJoCo plant, found again: `python analysis/gap_in_mujoco.py [--plants N] [--seed S]`.

Servos with parameters scattered by 10 % and a rigid play of +-0.3 to 1 deg (gap joint, constant linkage) are recorded
in MuJoCo with
0.01 deg of noise: multisine and steps for training, a chirp held out. The diagnosis gets Table 1 as the datasheet and
those recordings. Printed: what was named first, the size of the play, and MuJoCo's own held-out error with plant.xml's
model over the noise floor.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from ers_mj.data.recording import from_arrays
from ers_mj.diagnosis.pipeline import diagnose
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.mujoco.plant import MechanicalPlant
from ers_mj.plants.reduced import lumped
from ers_mj.servo.datasheet import TABLE_1, Datasheet, read_datasheet

SCATTERED = ("J", "B", "K_t", "K_e", "k_s", "T_LH", "F_c", "R")
NOISE = np.radians(0.01)
TIME = np.arange(6000) / 1000.0


def servo(rng: np.random.Generator) -> tuple[MechanicalPlant, float]:
    """A scattered servo with play, and the play's half-width [rad]."""
    parameters = {**TABLE_1, **{name: TABLE_1[name] * float(np.exp(0.1 * rng.standard_normal())) for name in SCATTERED}}
    gap = float(np.radians(rng.uniform(0.3, 1.0)))
    values = Datasheet(parameters=parameters).to_lumped() | {"tau_e": 0.0}
    return MechanicalPlant(lumped(values), parameters=parameters, gap=gap), gap


def main() -> None:
    """Simulate, diagnose, tell."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plants", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    named, errors, ratios = 0, [], []
    for k in range(arguments.plants):
        rng = np.random.default_rng([arguments.seed, k])
        plant, gap = servo(rng)
        recordings = []
        for name in ("multisine", "steps", "chirp"):
            u = INPUTS[name](TIME + rng.uniform(0, 4))
            theta = plant.simulate(TIME, u).theta + NOISE * rng.standard_normal(TIME.size)
            recordings.append(from_arrays(TIME, u, theta, name=name))
        begin = time.perf_counter()
        document = diagnose(recordings[:2], read_datasheet("table1"), recordings[2:]).document
        first = document["missing"][0] if document["missing"] else {"effect": document["verdict"], "parameters": {}}
        found = first["parameters"].get("gap", {}).get("value", np.nan)
        fit = document["fit"]
        ratio = fit["mujoco_heldout_rmse_after_rad"] / fit["noise_floor_rad"]
        named += first["effect"] == "backlash"
        errors.append(abs(found / gap - 1))
        ratios.append(ratio)
        print(
            f"{k:2d} {first['effect']:20s} {[m['effect'] for m in document['missing'][1:]]} play {np.degrees(gap):.3f}"
            f" deg found {np.degrees(found):.3f} deg ({found / gap - 1:+.1%}), MuJoCo held out"
            f" {np.degrees(fit['mujoco_heldout_rmse_before_rad']):.4f} ->"
            f" {np.degrees(fit['mujoco_heldout_rmse_after_rad']):.4f} deg = {ratio:.2f} noise floors,"
            f" {time.perf_counter() - begin:.0f} s",
            flush=True,
        )
    print(
        f"backlash first: {named} of {arguments.plants}; play within 15 %: {int(np.sum(np.array(errors) <= 0.15))} of"
        f" {arguments.plants}; MuJoCo's held-out error over the noise floor, median: {np.median(ratios):.2f}"
    )


if __name__ == "__main__":
    main()
