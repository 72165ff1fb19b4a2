"""Speed and error of the reduced model: `python analysis/benchmark_reduced.py`.

Speed is milliseconds of one core for a simulated second at 1 kHz (best of 20). Error is the largest change of theta
[deg] against an independent scheme (baseline) or against segments ten times finer (effects).
"""

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from ers_mj.effects import EFFECTS, Scales
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.proving import quick
from ers_mj.servo.datasheet import read_datasheet

T = np.arange(0.0, 10.0, 1e-3)
SHEET = read_datasheet("table1")
SCALES = Scales(
    position=0.4,
    low=0.15,
    high=0.4,
    speed=4.0,
    acceleration=110.0,
    input=10.0,
    sample_time=1e-3,
    noise=1e-4,
    quantum=0.0,
    is_angle=True,
)


def milliseconds(model, u):
    """Best of 20 runs, per simulated second."""
    best = np.inf
    for _ in range(20):
        begin = time.perf_counter()
        model.simulate(T, u)
        best = min(best, time.perf_counter() - begin)
    return 1e3 * best / T[-1]


def worst(a, b):
    return float(np.degrees(np.max(np.abs(a - b))))


def main():
    base = ReducedModel(lumped(SHEET.to_lumped()))
    print(f"{'baseline with inductance':34}{'ms/s':>8}{'error [deg]':>14}   (bars: 0.2 ms/s, 1e-3 deg)")
    for name in ("multisine", "chirp", "ramp", "steps"):
        u = INPUTS[name](T)
        truth = quick.simulate(dict(SHEET.parameters), [], T, u, step=5e-6, stand=0.0).true
        print(f"{name:34}{milliseconds(base, u):8.3f}{worst(base.simulate(T, u).theta, truth):14.1e}")
    u = INPUTS["multisine"](T)
    print(f"{'effect, multisine':34}{'ms/s':>8}{'error [deg]':>14}")
    for effect in EFFECTS:
        for start in effect.starts(SCALES)[:1]:
            model = ReducedModel(base.coefficients, [(effect.name, start)])
            off = worst(model.simulate(T, u).theta, model.simulate(T, u, refine=10).theta)
            print(f"{effect.name:34}{milliseconds(model, u):8.3f}{off:14.1e}")


if __name__ == "__main__":
    main()
