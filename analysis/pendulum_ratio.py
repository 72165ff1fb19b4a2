"""Is a pendulum's load recovered in ratio? `python analysis/pendulum_ratio.py ../shared/data/sts3215 [--runs 4]`

The STS3215 servo swings eight known loads. Each load's runs are fitted alone, masses and lengths withheld: Eq. (6)
without spring and preload, with gravity_imbalance, alone and beside what else such a servo may have. Position and
voltage tell m g l only per inertia, and b = n K_t/(J R) likewise, so that (g/J)/b is m g l in units of the motor's
torque per volt, the same unit for all loads. It is printed beside m l, with a straight line through all loads (its zero
is the bare arm's own weight).
"""

import argparse
import csv
import math
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np

from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import read_recording
from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import fit
from ers_mj.estimation.initial_state import with_starts
from ers_mj.estimation.scales import scales_of
from ers_mj.servo.model import Model

BESIDE = ((), ("load_dependent_friction",), ("supply_sag",), ("load_dependent_friction", "supply_sag"))
TRAJECTORIES = ("sin_sin", "up_and_down", "sin_time_square")
START = {
    "a_1": 0.0,
    "a_2": 30.0,
    "b": 12.0,
    "c_1": 0.0,
    "c_2": 5.0,
    "theta_0": 0.0,
    "tau_e": 0.0,
    "emf_share": 0.5,
    "ampere": 1.0,
}


def runs_by_load(folder: Path, count: int) -> dict[tuple[float, float], list[str]]:
    """The first ``count`` runs of each load (mass [kg], length [m]), spread over gains and trajectories."""
    found = defaultdict(list)
    for row in csv.DictReader((folder / "runs_index.csv").open()):
        if row["trajectory"] in TRAJECTORIES and row["rep"] == "1":
            found[float(row["mass_kg"]), float(row["length_m"])].append((float(row["kp"]), row["run"]))
    chosen = {}
    for load, runs in sorted(found.items()):
        runs.sort(reverse=True)
        chosen[load] = [f"{folder}/runs.parquet#run={run}" for _, run in runs[:: max(1, len(runs) // count)][:count]]
    return chosen


def pull(files: list[str], beside: tuple[str, ...]) -> tuple[float, float, float]:
    """(m g l over n K_t/R [V], phase [rad], median misfit) of one load, with these effects beside gravity."""
    traces = [trace_of(read_recording(f), None) for f in files]
    scales = scales_of(traces, START, True, None)
    effects = [
        ("gravity_imbalance", np.array([20.0, 0.1])),
        *((name, BY_NAME[name].starts(scales)[0]) for name in beside),
    ]
    model = Model(START, ("a_2", "b", "c_2"), effects=tuple(effects), scales=scales)
    found = fit(model, traces, steps=40)
    found = fit(found.model, with_starts(found.model, traces), steps=40)
    g_s, g_c = dict(found.model.effects)["gravity_imbalance"]
    return math.hypot(g_s, g_c) / abs(found.model.values["b"]), math.atan2(g_c, g_s), float(np.median(found.misfit))


def compare(found: dict[tuple[float, float], tuple[float, float, float]]) -> None:
    """Print the pulls beside the loads, and the straight line through them."""
    print("  mass kg  length m  m l kg m  pull V  phase deg  median misfit")
    for (mass, length), (volt, phase, misfit) in found.items():
        print(
            f"  {mass:7.3f}  {length:8.3f}  {mass * length:8.4f}  {volt:6.3f}  {math.degrees(phase):9.1f} "
            f" {misfit:13.1f}"
        )
    load, volt = np.array([(mass * length, pull[0]) for (mass, length), pull in found.items()]).T
    slope, zero = np.polyfit(load, volt, 1)
    left = volt - slope * load - zero
    print(
        f"  a straight line: {slope:.2f} V per kg m, {zero:.3f} V at no load; r^2 ="
        f" {1 - left @ left / np.sum((volt - volt.mean()) ** 2):.3f}, largest deviation"
        f" {np.max(np.abs(left / volt)):.1%}"
    )
    print(
        f"  ratio of the heaviest to the lightest: {volt[load.argmax()] / volt[load.argmin()]:.2f}, of their m l"
        f" {load.max() / load.min():.2f}",
        flush=True,
    )


def main(arguments=None) -> int:
    """Fit every load and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--runs", type=int, default=4, help="runs a load")
    options = parser.parse_args(arguments)
    loads = runs_by_load(options.folder, options.runs)
    for beside in BESIDE:
        print(f"gravity_imbalance beside {' and '.join(beside) or 'nothing'}", flush=True)
        compare({load: pull(files, beside) for load, files in loads.items()})
    return 0


if __name__ == "__main__":
    sys.exit(main())
