"""What `ers excite` promises against what fits then find: Monte Carlo under the designed and under the named input.

    python analysis/excite_pays.py --seed 1
 Table 1 with its L, +-24 V, +-60 deg about home, 10 s at 1 kHz, noise 0.01 deg, and 0.02 A where the current is
measured. Each recording has noise of its own, the servo begins at rest, and the fit starts from numbers that are off by
a factor of 1 % (standard deviation); it is least squares in the observer form, after the package's fit. Printed for
each wanted number: the standard deviation promised and found (1.48 times the median error, and RMS) under either input,
and the ratios designed / named of what was promised and of the medians found.
"""

from __future__ import annotations

import argparse
import math
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat

import numpy as np

from ers_mj.experiment_design.optimal_input import planned, reference
from ers_mj.experiment_design.question import Question, Rig
from ers_mj.servo.datasheet import read_datasheet

CURRENT = 0.02  # [A]
ASKED = {
    "B, with the current": (("B",), True, True),
    "all, with the current": ((), True, True),
    "all but L, angle alone": ((), False, False),
    "B, angle alone": (("B",), False, True),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--fits", type=int, default=40)
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    sheet = read_datasheet("table1")
    for asked, (wanted, current, inductance) in ASKED.items():
        rig = Rig.of(
            sheet.parameters["theta_0"],
            24.0,
            math.radians(60),
            10.0,
            1000.0,
            math.radians(0.01),
            CURRENT if current else None,
        )
        question = Question.of(sheet, rig, wanted, inductance=inductance)
        before = reference(question)
        after = planned(question, before)
        told = " then ".join(
            ", ".join(
                f"{k} {v}" for k, v in part.items() if k not in ("offset", "peak_u", "lead_s", "rate_hz", "start")
            )
            for part in after.parts
        )
        print(f"{asked}: {told}")
        seeds = range(arguments.seed * 1000, arguments.seed * 1000 + arguments.fits)
        with ProcessPoolExecutor(arguments.jobs) as pool:
            found = [np.array(list(pool.map(question.errors, repeat(plan.u), seeds))) for plan in (before, after)]
        middle, rms = (
            [f(np.abs(x)) for x in found]
            for f in (lambda x: 1.4826 * np.median(x, axis=0), lambda x: np.sqrt(np.mean(x**2, axis=0)))
        )
        for k, name in enumerate(question.wanted):
            scale, unit = (math.degrees(1.0), "deg") if name == "theta_0" else (100.0, "%")
            cells = [
                f"promised {scale * p.spread[name]:.3g}, found {scale * m[k]:.3g} (RMS {scale * r[k]:.3g}) {unit}"
                for p, m, r in zip((before, after), middle, rms)
            ]
            print(
                f"  {name:8} named: {cells[0]}; designed: {cells[1]}; ratio promised"
                f" {after.spread[name] / before.spread[name]:.2f}, found {middle[1][k] / middle[0][k]:.2f} (RMS"
                f" {rms[1][k] / rms[0][k]:.2f})",
                flush=True,
            )


if __name__ == "__main__":
    main()
