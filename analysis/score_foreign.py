"""How servos of other families are told: `python analysis/score_foreign.py --cases f1-1 --sheet none`.

Diagnoses the cases of ../shared/foreign and the torque-driven joints of ../shared/menagerie, keeps what each answered
under --out (a case that is there is not asked again), and prints a line a case and the sums: the class right at first
place beside what the family always has, exactly the right names, names on nulls, outside flagged.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

from ers_mj.data.recording import read_recording
from ers_mj.diagnosis import pipeline
from ers_mj.diagnosis.mujoco_check import Rig
from ers_mj.effects import EQUIVALENT
from ers_mj.servo.datasheet import read_datasheet

SHARED = Path(__file__).resolve().parents[2] / "shared"
SHEETS = {"none": None, "own": "datasheet.toml", "full": "full_datasheet.toml"}
TORQUE = {"tau_cmd_Nm": "u_V"}  # of family 2, whose torque stands under another name


def kind_of(name: str) -> str:
    """What a name counts as: the class that it is one of."""
    return next(("/".join(sorted(group)) for group in EQUIVALENT if name in group), name)


def truth_of(case: str) -> dict:
    """What a case holds: kind, effect, inherent."""
    folder = SHARED / ("menagerie" if case.startswith("m") else "foreign") / "truth"
    if (path := folder / f"{case}.json").exists():
        truth = json.loads(path.read_text())
        if case.startswith("m"):
            inherent = ["gravity_imbalance", "presliding"]
            return {"kind": "single", "effect": "gravity_imbalance", "inherent": inherent}
        return truth
    if case.startswith("g"):
        return {"kind": "single", "effect": "gravity_imbalance", "inherent": []}
    return {"kind": "single", "effect": case.removeprefix("s_"), "inherent": []}


def ask(case: str, sheet: str) -> dict:
    """What a diagnosis answers; raises FileNotFoundError where the case has no such datasheet."""
    folder = SHARED / ("menagerie" if case.startswith("m") else "foreign") / case
    if SHEETS[sheet] and not (folder / SHEETS[sheet]).exists():
        raise FileNotFoundError(folder / SHEETS[sheet])
    known = SHEETS[sheet] and read_datasheet(folder / SHEETS[sheet])
    names = TORQUE if case.startswith("f2") else None
    recordings = [read_recording(path, names) for path in sorted(folder.glob("rec*.csv"))]
    begun = time.process_time()
    document = pipeline.diagnose(recordings, known, jobs=1).document
    return {**document, "cpu_s": time.process_time() - begun}


def row(case: str, answer: dict, sheet: str) -> dict:
    """What counts of an answer; without a datasheet, which would tell it, a winding may be named."""
    truth = truth_of(case)
    inherent = set(truth.get("inherent") or ()) - {truth["effect"]}
    if sheet == "none" and kind_of(truth["effect"] or "") != kind_of("inductance"):
        inherent.add("inductance")
    names = [m["effect"] for m in answer["missing"]]
    beside = [name for name in names if name not in inherent]
    right = kind_of(truth["effect"]) if truth["effect"] else ""
    return {
        "case": case,
        "kind": truth["kind"],
        "truth": truth["effect"] or "-",
        "names": names,
        "first": bool(beside) and kind_of(beside[0]) == right,
        "exact": sorted(map(kind_of, beside)) == ([right] if truth["kind"] == "single" else []),
        "missed": [name for name in truth.get("inherent") or () if name not in (*names, "presliding")],
        "flagged": answer["remainder"]["significant"],
        "cpu_s": answer["cpu_s"],
        "after": answer["fit"]["heldout_rmse_after_rad"] / answer["fit"]["noise_floor_rad"],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--cases", nargs="*", help="all by default")
    parser.add_argument("--sheet", choices=SHEETS, default="none")
    parser.add_argument("--out", type=Path, default=Path("foreign-answers"))
    arguments = parser.parse_args()
    Rig.rmse = lambda self, *others: None  # nothing decides on the MuJoCo twin
    found = sorted(p.parent.name for p in (SHARED / "foreign").glob("*/rec1.csv")) + ["m20", "m22"]
    rows = []
    for case in arguments.cases or found:
        kept = arguments.out / arguments.sheet / f"{case}.json"
        try:
            answer = json.loads(kept.read_text()) if kept.exists() else ask(case, arguments.sheet)
        except FileNotFoundError:
            continue
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(json.dumps(answer))
        rows.append(one := row(case, answer, arguments.sheet))
        print(
            f"{case:16}{one['kind']:9}{one['truth']:30}{', '.join(one['names']) or 'none':60}"
            f"first {one['first']!s:6}exact {one['exact']!s:6}missed {', '.join(one['missed']) or '-':18}"
            f"flag {one['flagged']!s:6}{one['after']:8.2f} noise{one['cpu_s']:7.0f} s",
            flush=True,
        )
    for kind, what in (("single", "first"), ("single", "exact"), ("null", "exact"), ("outside", "flagged")):
        some = [one[what] for one in rows if one["kind"] == kind]
        print(f"{kind} {what}: {sum(some)} of {len(some)}")


if __name__ == "__main__":
    main()
