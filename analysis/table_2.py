"""The paper's identification experiment, Table 2 and Figure 10, with rivals: `python analysis/table_2.py --trials 30
--seed 7`.

Table 2's plant under 2 s of the package's multisine at 1 kHz, without noise. Each method minimises Eq. (13) over the
paper's nine parameters, in its own units, within [0.2, 3] x truth. Printed: the fitness reached, evaluations to given
fitnesses, processor time, and the paper's errors (41), (42) of the nine parameters beside those of the seven
combinations that angle and voltage can tell. Then the same for IGA within other bounds: what the nine errors measure.
Figure 10: --figure FILE.png. Each trial is told on standard error as it ends and kept in --trials-file, from which the
same command goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np

from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.identification.minimisers import MINIMISERS, Minimum
from ers_mj.identification.misfit import Misfit, Search
from ers_mj.identification.structure import Structure
from ers_mj.identification.unknowns import unknowns_of
from ers_mj.plants.inputs import INPUTS
from ers_mj.report.identify_figures import progress_figure
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.simulation import simulate_recording

TABLE_2 = {"L": 0.003, "R": 1.2, "k_s": 0.08, "T_LH": 0.4, "F_c": 0.2, "J": 0.001, "B": 0.006, "K_t": 0.5, "K_e": 0.6}
PRINTED = {
    "pso": (33, 27, 25, 37.5, 55, 20, 35, 38, 47),
    "ga": (33, 15, 37.5, 37.5, 25, 20, 48.3, 24, 25),
    "iga": (16.7, 7.9, 11.3, 20, 15, 10, 15, 16, 15),
}
COMBINATIONS = {
    "L/R": {"L": 1, "R": -1},
    "k_s/J": {"k_s": 1, "J": -1},
    "T_LH/J": {"T_LH": 1, "J": -1},
    "F_c/J": {"F_c": 1, "J": -1},
    "B/J": {"B": 1, "J": -1},
    "nK_t/(JR)": {"K_t": 1, "J": -1, "R": -1},
    "nK_e": {"K_e": 1},
}
LEVELS = (1e-4, 1e-6, 1e-8)  # [rad^2 s]
BOUNDS = ((0.5, 1.5), (0.2, 3.0), (0.1, 10.0))


def fitness(sheet: Datasheet) -> tuple:
    """(x (M, 9) -> (M,) [rad^2 s] on a recording of the sheet's plant, the truth (9,), the letters)."""
    t = np.arange(2000) / 1e3
    columns = simulate_recording(sheet, t, INPUTS["multisine"](t), inductance=True)
    trace = trace_of(from_arrays(columns["t_s"], columns["u_V"], columns["theta_rad"]), None)
    traces = (replace(trace, start=(0.0, 0.0)),)
    unknowns = unknowns_of(traces, sheet, {"theta_0": 0.0}, {})
    nothing = Structure(unknowns.names, np.empty((0, 9)), (), np.ones(9))
    misfit = Misfit(Search(unknowns, nothing, 1.0, traces))

    def objective(x):
        return misfit(np.array([misfit.search.coordinates(row) for row in x]))

    return objective, np.array([TABLE_2[name] for name in unknowns.names]), unknowns.names


class Trials:
    """Runs of minimisers by (method, bounds, seed), those of an earlier call read from a file of JSON lines."""

    def __init__(self, objective, truth: np.ndarray, budget: int, path: Path | None):
        self._objective, self._truth, self._budget, self._path, self._done = objective, truth, budget, path, {}
        for line in path.read_text().splitlines() if path is not None and path.exists() else ():
            kept = json.loads(line)
            self._done[tuple(kept["key"])] = (
                Minimum(np.array(kept["x"]), kept["value"], kept["evaluations"], np.array(kept["trace"])),
                kept["seconds"],
            )

    def run(self, method: str, low: float, high: float, seed: int) -> tuple[Minimum, float]:
        """(what was found within [low, high] x truth, seconds of one processor)."""
        key = (method, low, high, seed, self._budget)
        if key not in self._done:
            begin = time.process_time()
            found = MINIMISERS[method].minimise(
                self._objective, low * self._truth, high * self._truth, seed=seed, budget=self._budget
            )
            self._done[key] = found, time.process_time() - begin
            print(f"{method} within [{low:g}, {high:g}], seed {seed}: {found.value:.2e}", file=sys.stderr, flush=True)
            if self._path is not None:
                kept = {
                    "key": key,
                    "x": found.x.tolist(),
                    "value": found.value,
                    "evaluations": found.evaluations,
                    "trace": found.trace.tolist(),
                    "seconds": self._done[key][1],
                }
                with self._path.open("a") as file:
                    file.write(json.dumps(kept) + "\n")
        return self._done[key]


def lumped_errors(x: np.ndarray, truth: np.ndarray, names) -> np.ndarray:
    """|relative error| (7,) of the combinations."""
    ratio = dict(zip(names, x / truth))
    return np.array(
        [
            abs(np.prod([ratio[name] ** power for name, power in powers.items()]) - 1.0)
            for powers in COMBINATIONS.values()
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=30)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--budget", type=int, default=10_000)
    parser.add_argument("--methods", default="pso,ga,iga,iga-rotated,de,cma")
    parser.add_argument("--figure")
    parser.add_argument("--trials-file", type=Path, help="JSON lines, one a trial that has ended")
    arguments = parser.parse_args()
    objective, truth, names = fitness(Datasheet(parameters={**TABLE_2, "theta_0": 0.0}))
    trials = Trials(objective, truth, arguments.budget, arguments.trials_file)
    seeds = [arguments.seed * 1000 + k for k in range(arguments.trials)]
    runs: dict[str, list] = {}
    print(
        f"{arguments.trials} trials from seed {arguments.seed}, {arguments.budget} evaluations, bounds [0.2, 3] x"
        " truth\n"
    )
    print(
        f"{'method':12}{'median fitness':>16}{'best':>10}{'worst':>10}"
        + "".join(f"{f'to {level:.0e}':>16}" for level in LEVELS)
        + f"{'s a trial':>11}"
    )
    for method in arguments.methods.split(","):
        ended = [trials.run(method, 0.2, 3.0, seed) for seed in seeds]
        runs[method] = [run for run, _ in ended]
        value = np.array([run.value for run in runs[method]])
        reached = [[run.evaluations_to(level) for run in runs[method]] for level in LEVELS]
        cells = "".join(f"{_reached(found):>16}" for found in reached)
        print(
            f"{method:12}{np.median(value):16.1e}{value.min():10.1e}{value.max():10.1e}{cells}"
            f"{np.mean([spent for _, spent in ended]):11.1f}",
            flush=True,
        )
    print(
        "\nto a fitness: median evaluations of the trials that reach it, and how many do\n\nmean error over the trials"
        " [%]; the paper's single numbers in brackets"
    )
    print(f"{'method':12}" + "".join(f"{name:>12}" for name in names) + f"{'E_APE':>14}")
    for method, found in runs.items():
        errors = 100 * np.array([np.abs(run.x / truth - 1.0) for run in found]).mean(axis=0)
        printed = PRINTED.get(method)
        cells = [f"{e:.1f}" + (f" ({printed[k]:g})" if printed else "") for k, e in enumerate(errors)]
        print(
            f"{method:12}"
            + "".join(f"{cell:>12}" for cell in cells)
            + f"{errors.mean():8.1f}"
            + (f" ({np.mean(printed):.1f})" if printed else "")
        )
    print("\nmedian error of the combinations that can be told [%]")
    print(f"{'method':12}" + "".join(f"{name:>12}" for name in COMBINATIONS))
    for method, found in runs.items():
        print(
            f"{method:12}"
            + "".join(
                f"{e:12.2g}" for e in 100 * np.median([lumped_errors(run.x, truth, names) for run in found], axis=0)
            )
        )
    print("\niga within other bounds: the nine parameters' mean error follows the bounds, the fitness does not")
    for low, high in BOUNDS:
        found = [trials.run("iga", low, high, seed)[0] for seed in seeds]
        errors = 100 * np.array([np.abs(run.x / truth - 1.0) for run in found])
        drawn = 100 * np.abs(np.random.default_rng(0).uniform(low, high, 100_000) - 1.0).mean()
        print(
            f"  [{low:g}, {high:g}] x truth: fitness {np.median([run.value for run in found]):.1e}, E_APE"
            f" {errors.mean():.1f} % (a blind draw from the bounds {drawn:.0f} %)",
            flush=True,
        )
    if arguments.figure:
        matplotlib.use("Agg")
        progress_figure({method: [run.trace for run in found] for method, found in runs.items()}, 9.8).savefig(
            arguments.figure, dpi=110
        )


def _reached(found: list) -> str:
    there = [n for n in found if n is not None]
    return f"{np.median(there):.0f} ({len(there)})" if there else "- (0)"


if __name__ == "__main__":
    main()
