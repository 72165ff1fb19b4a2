"""STS3215 from the commanded position: selection on the training runs, errors on the held-out and brutal ones, in
closed loop and under the recorded voltage.

python analysis/sts3215_loop.py [--second] [--jobs N]     (--second: the voltage is an output to explain as well)
"""

from __future__ import annotations

import argparse
import csv
import math
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from ers_mj.data.recording import Recording, from_arrays
from ers_mj.decisions.thresholds import POLICY
from ers_mj.position_loop import beside
from ers_mj.position_loop.confirmation import confirmed
from ers_mj.position_loop.model import LoopModel
from ers_mj.position_loop.runs import Run, runs_of
from ers_mj.position_loop.selection import Selector

DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "sts3215"


def recordings_of(wanted: str, second: bool = False) -> list[Recording]:
    """The runs of one set of the split, with the register, the mass and the arm of the index, and the voltage as a
    ``second`` output.
    """
    with (DATA / "closed_loop_split.csv").open() as file:
        runs = [int(row["run"]) for row in csv.DictReader(file) if row["set"] == wanted]
    with (DATA / "runs_index.csv").open() as file:
        index = {int(row["run"]): row for row in csv.DictReader(file)}
    return [_recording(run, index[run], second) for run in runs]


def _recording(run: int, row: dict[str, str], second: bool) -> Recording:
    table = pq.read_table(DATA / "runs.parquet", filters=[("run", "=", run)])
    column = {name: table[name].to_numpy().astype(float) for name in table.column_names}
    found = from_arrays(
        column["t_s"],
        column["theta_ref_rad"],
        column["theta_rad"],
        name=f"run {run}",
        input_unit="rad",
        enable=column["torque_enable"],
        kp=float(row["kp"]),
        load_kg=float(row["mass_kg"]),
        arm_m=float(row["length_m"]),
    )
    return replace(found, second=column["u_V"], second_name="u_V", second_unit="V") if second else found


def mae(model, runs) -> float:
    """Mean absolute error [rad] over all scored samples."""
    return float(np.mean(np.abs(np.concatenate([(run.y - model.predicted(run))[run.scored] for run in runs]))))


def under_voltage(model: LoopModel, runs: Sequence[Run], volt: float) -> float:
    """Mean absolute error [rad] of the plant alone, driven by the recorded voltage; ``volt`` is the voltage of a drive
    of 1 rad/s^2. A loop so soft that its reference alone makes the drive gives the plant what it is told.
    """
    soft = 1e-6
    open_loop = replace(
        model, values={**model.values, **dict.fromkeys(("D", "I", "tau_s", "band", "idle", "least"), 0.0)}
    )
    open_loop = replace(open_loop, values={**open_loop.values, "K": soft, "L": math.inf, "R": math.inf})
    errors = []
    for run in runs:
        drive = np.nan_to_num(run.beside.values) / volt
        driven = replace(run, r=drive / (soft * run.gain), before=float(drive[0]) / (soft * run.gain))
        errors.append((run.y - open_loop.predicted(driven))[run.scored])
    return float(np.mean(np.abs(np.concatenate(errors))))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--second", action="store_true")
    arguments = parser.parse_args()
    begun, train = time.time(), recordings_of("train", arguments.second)
    selector = Selector(runs_of(train), True, arguments.jobs)
    chosen = selector.run(lambda text, share: print(f"{time.time() - begun:.0f} s {text}", flush=True))
    for ranked in chosen.rounds:
        print("round", [(c.name, round(c.gain, 1), round(c.fit.misfit, 1)) for c in ranked[:6]])
    print("found", [(x.name, round(x.gain, 1)) for x in chosen.left], flush=True)
    chosen, judged = confirmed(selector, chosen, (), POLICY)
    model = chosen.chosen.model
    print(f"{time.time() - begun:.0f} s {judged.sentence}: {judged.before.mae:.4f} to {judged.after.mae:.4f} rad")
    print("without", {name: round(score.mae, 4) for name, score in judged.without.items()})
    print("left out", [(x.name, round(x.gain, 1)) for x in chosen.left])
    print({k: round(float(v), 4) for k, v in model.values.items() if k in model.free}, model.effects)
    fitted_to = runs_of(recordings_of("train", True))
    volt = float(beside.factors(model, fitted_to, [model.motion(run) for run in fitted_to])[0])
    for name in ("train", "heldout", "brutal"):
        runs = runs_of(recordings_of(name, True), train[0])
        closed = f"MAE base {mae(chosen.base.model, runs):.4f}, answer {mae(model, runs):.4f} rad"
        print(f"{name}: {closed}; under the recorded voltage {under_voltage(model, runs, volt):.4f} rad", flush=True)


if __name__ == "__main__":
    main()
