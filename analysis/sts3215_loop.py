"""STS3215 from the commanded position alone: selection on the training runs, errors on the held-out and brutal ones.

python analysis/sts3215_loop.py [--jobs N]
"""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from ers_mj.data.recording import Recording, from_arrays
from ers_mj.decisions.thresholds import POLICY
from ers_mj.position_loop.confirmation import confirmed
from ers_mj.position_loop.runs import runs_of
from ers_mj.position_loop.selection import Selector

DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "sts3215"


def recordings_of(wanted: str) -> list[Recording]:
    """The runs of one set of the split, with the register, the mass and the arm of the index."""
    with (DATA / "closed_loop_split.csv").open() as file:
        runs = [int(row["run"]) for row in csv.DictReader(file) if row["set"] == wanted]
    with (DATA / "runs_index.csv").open() as file:
        index = {int(row["run"]): row for row in csv.DictReader(file)}
    return [_recording(run, index[run]) for run in runs]


def _recording(run: int, row: dict[str, str]) -> Recording:
    table = pq.read_table(DATA / "runs.parquet", filters=[("run", "=", run)])
    column = {name: table[name].to_numpy().astype(float) for name in table.column_names}
    return from_arrays(
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


def mae(model, runs) -> float:
    """Mean absolute error [rad] over all scored samples."""
    return float(np.mean(np.abs(np.concatenate([(run.y - model.predicted(run))[run.scored] for run in runs]))))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=1)
    begun, train = time.time(), recordings_of("train")
    selector = Selector(runs_of(train), True, parser.parse_args().jobs)
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
    for name in ("train", "heldout", "brutal"):
        runs = runs_of(recordings_of(name), train[0])
        print(f"{name}: MAE base {mae(chosen.base.model, runs):.4f}, answer {mae(model, runs):.4f} rad")


if __name__ == "__main__":
    main()
