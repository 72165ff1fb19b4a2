"""Controllers on servos with scattered parameters: how often the rival is closer than ftrc and pid-ff, and by how much.

    python analysis/scattered_servos.py --plants 16 --seed 5
 Each servo is Table 1 with J, B, K_t, K_e, k_s, T_LH, F_c and R scaled at random, log-uniform within --known where the
controllers know the servo, within
--unknown where they are designed for Table 1. 1 kHz, noise 0.01 deg, reduced plant. Printed per case: servos on which
`time-optimal` has the least RMS error, the median and the largest ratio of its error to the better of the other two,
and loops that were given up.
"""

from __future__ import annotations

import argparse
import math
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from itertools import repeat

import numpy as np

from ers_mj.control.trial import Conditions, try_out
from ers_mj.servo.datasheet import Datasheet, read_datasheet

LAWS, CASES = ("ftrc", "pid-ff", "time-optimal"), ("step", "square", "ramp", "chirp")
SCATTERED = ("J", "B", "K_t", "K_e", "k_s", "T_LH", "F_c", "R")


def errors(plant: Datasheet, design: Datasheet, seed: int, amplitude: float) -> np.ndarray:
    """RMS errors (cases, laws) [rad], infinite where a loop was given up."""
    conditions = Conditions(amplitude=amplitude, rate_hz=1000.0, noise=math.radians(0.01), seed=seed)
    trials = try_out(plant, LAWS, ["reduced"], CASES, conditions, design=design)
    return np.reshape([t.measures.rmse_rad if t.measures.stable else math.inf for t in trials], (len(CASES), len(LAWS)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plants", type=int, default=16)
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--known", type=float, default=1.4)
    parser.add_argument("--unknown", type=float, default=1.25)
    parser.add_argument("--amplitude-deg", type=float, default=10.0)
    parser.add_argument("--jobs", type=int, default=None)
    arguments = parser.parse_args()
    sheet, random = read_datasheet("table1"), np.random.default_rng(arguments.seed)
    for spread, is_known in ((arguments.known, True), (arguments.unknown, False)):
        factors = spread ** random.uniform(-1, 1, (arguments.plants, len(SCATTERED)))
        plants = [
            replace(
                sheet,
                parameters={
                    **sheet.parameters,
                    **{k: f * sheet.parameters[k] for k, f in zip(SCATTERED, row, strict=True)},
                },
            )
            for row in factors
        ]
        with ProcessPoolExecutor(arguments.jobs) as pool:
            found = np.array(
                list(
                    pool.map(
                        errors,
                        plants,
                        plants if is_known else repeat(sheet),
                        range(arguments.plants),
                        repeat(math.radians(arguments.amplitude_deg)),
                    )
                )
            )
        print(
            f"parameters within a factor {spread:g}, {'known to' if is_known else 'unknown to'} the controllers;"
            f" {np.isinf(found).sum()} loops given up"
        )
        for case, block in zip(CASES, found.transpose(1, 0, 2), strict=True):
            ratio = block[:, 2] / block[:, :2].min(axis=1)
            print(
                f"  {case:7} closest on {(ratio < 1).sum()} of {ratio.size}, error {np.median(ratio):.2f} of the better"
                f" other (median), {ratio.max():.2f} (largest)"
            )


if __name__ == "__main__":
    main()
