"""Position-commanded servos against their truths: the joints of ../shared/menagerie, the cases of ../shared/cases.

python analysis/score_position.py m01 m11 ... | cases | all [--jobs N]
"""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path

from ers_mj.data.recording import read_recording
from ers_mj.diagnosis.pipeline import diagnose

SHARED = Path(__file__).resolve().parents[2] / "shared"
INHERENT = {"gravity_imbalance", "input_delay", "voltage_saturation"}
# pdplay's README says 0.020; a simulation with its own gains, inertias and contact (analysis/pdplay_gap.py) leaves the
# noise alone at a gap of 0.0300, friction 0.25 tanh(w/0.01) N m on the motor and 0.05 on the load, and 20 times the
# noise at 0.020 whatever else is free: friction that creeps below breakaway is in it, too.
CASES = {
    "posservo_saturating": (["posservo_saturating.csv"], {"K": 3600.0, "L": 360.0}, {"voltage_saturation"}, set()),
    "pdplay": (["pdplay_1200rows.csv", "pdplay_2000rows.csv"], {"gap": 0.030}, {"backlash"}, {"presliding"}),
    "pdloop_delay": (["pdloop_delay.csv"], {"K": 1000.0, "tau_s": 0.009}, {"input_delay"}, set()),
}


def truth_of(case: str) -> tuple[dict[str, float], set[str], set[str], dict]:
    """(numbers of the loop, names that must stand, names that may, the truth's own record) of a menagerie joint."""
    truth = json.loads((SHARED / "menagerie" / "truth" / f"{case}.json").read_text())
    rates, inertia = truth["rates"], truth["inertia"]
    numbers = {"K": truth["kp"] / inertia, "a_2+D": rates["damping_total_over_J"], "c_2": rates["friction_over_J"]}
    expected = truth["expected"]
    must = {expected["effect"]} - {None}
    if expected.get("gravity_visible"):
        must.add("gravity_imbalance")
    if truth["class"] == "saturated":
        numbers["L"] = truth["force_limit"][1] / inertia
    creeps = expected.get("creep_distinguishable_from_dry_friction") is not False  # MuJoCo's dry friction creeps
    may = {"presliding"} if expected.get("friction_visible") and creeps else set()
    return numbers, must, may, truth


def score(name: str, files: list[Path], numbers: dict, must: set[str], may: set[str], jobs: int) -> bool:
    """Diagnose and print one line of what is right and what not."""
    begun = time.time()
    document = diagnose([read_recording(f) for f in files], None, jobs=jobs).document
    named = [m["effect"] for m in document["missing"]]
    rows = document["parameters"] | {k: v for m in document["missing"] for k, v in m["parameters"].items()}
    told = []
    for key, true in numbers.items():
        row = rows.get(key) or {}
        low, high = row.get("ci95") or (None, None)
        inside = low is not None and low <= true <= high
        value = row.get("value")
        told.append(
            f"{key} {true:.4g}: {'null' if value is None else f'{value:.4g} [{low:.4g} {high:.4g}]'}"
            f" {'in' if inside else 'OUT' if value is not None else '-'}"
        )
    right = must <= set(named) and not set(named) - must - may - INHERENT and not (INHERENT & set(named)) - must
    fit = document["fit"]
    rms = fit["train_rmse_after_rad"] / fit["noise_floor_rad"] if fit["noise_floor_rad"] else math.nan
    print(
        f"{name:20} {'right' if right else 'WRONG'}  named {named}  must {sorted(must)}  rms {rms:.2f}"
        f"  {document['verdict']}  remainder {document['remainder']['significant']}  {time.time() - begun:.0f} s\n"
        f"{'':20} {'; '.join(told)}",
        flush=True,
    )
    return right


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="+")
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    joints = sorted(
        p.stem
        for p in (SHARED / "menagerie" / "truth").glob("*.json")
        if json.loads(p.read_text())["command"] == "position"
    )
    wanted = arguments.names
    if wanted == ["all"]:
        wanted = [*CASES, *joints]
    elif wanted == ["cases"]:
        wanted = list(CASES)
    right = 0
    for name in wanted:
        if name in CASES:
            files, numbers, must, may = CASES[name]
            right += score(name, [SHARED / "cases" / f for f in files], numbers, must, may, arguments.jobs)
        else:
            numbers, must, may, _ = truth_of(name)
            recordings = sorted((SHARED / "menagerie" / name).glob("rec*.csv"))
            right += score(name, recordings, numbers, must, may, arguments.jobs)
    print(f"{right} of {len(wanted)} right")


if __name__ == "__main__":
    main()
