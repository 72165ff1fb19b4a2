"""Diagnose concealed cases blind and score the answers: `python analysis/score_concealed.py FOLDER [--half
tuning|reporting|all] [--out FILE] [--jobs N]`.

FOLDER holds case-NNN/ (recordings and datasheet) and truth/case-NNN.json, as ../shared/concealed does and
concealed_cases.py writes. Each case is handed to `ers diagnose` as files; its truth is opened only after its answer has
been printed. Lines go to FILE as they come, and a second run with the same FILE goes on where the first ended.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

CLASSES = [
    {"bias_torque", "asymmetric_friction"},
    {"inductance", "input_delay", "sensor_lag"},
    {"voltage_saturation", "current_limit", "supply_sag"},
    {"cogging", "transmission_ripple"},
]
LIBRARY = {p.stem for p in (Path(__file__).resolve().parents[1] / "ers_mj" / "effects").glob("*.py")} - {
    "__init__",
    "base",
}


def class_of(name: str) -> frozenset[str]:
    """The names that count as one with this one."""
    return frozenset(next((c for c in CLASSES if name in c), {name}))


def answer(folder: Path, limit: float) -> dict:
    """diagnosis.json of one case, with the wall and processor time [s].

    Raises:
        subprocess.SubprocessError: no answer within ``limit`` seconds, or a failure.
    """
    recordings = sorted(map(str, folder.glob("rec*.csv")))
    command = [
        sys.executable,
        "-m",
        "ers_mj",
        "diagnose",
        *recordings,
        "--datasheet",
        str(folder / "datasheet.toml"),
        "--json",
        "--jobs",
        "1",
    ]
    begin = time.perf_counter()
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(command, stdout=said, stderr=subprocess.DEVNULL)
        watch = threading.Timer(limit, process.kill)
        watch.start()
        _, status, usage = os.wait4(process.pid, 0)
        watch.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            raise subprocess.CalledProcessError(process.returncode, command[:4])
        said.seek(0)
        document = json.loads(said.read())
    return {**document, "wall_s": time.perf_counter() - begin, "cpu_s": usage.ru_utime + usage.ru_stime}


def halves(truths: dict[str, dict]) -> dict[str, str]:
    """Of the cases of one effect, the lowest number is for tuning; nulls and pairs are for reporting."""
    seen, half = set(), {}
    for case, truth in sorted(truths.items()):
        single = truth["labels"][0] if len(truth["labels"]) == 1 else None
        half[case] = "tuning" if single and single not in seen else "reporting"
        seen.add(single)
    return half


def line(case: str, document: dict, truth: dict) -> dict:
    """What is kept of one case."""
    named = [m["effect"] for m in document["missing"]]
    return {
        "case": case,
        "labels": truth["labels"],
        "named": named,
        "verdict": document["verdict"],
        "wall_s": round(document["wall_s"], 1),
        "cpu_s": round(document["cpu_s"], 1),
        "visibility": truth.get("visibility_after_refit_sigma"),
        "where": [w["label"] for w in document["where"] if w["axis"] == "subsystem"][:1],
        "before": document["fit"]["heldout_rmse_before_rad"],
        "after": document["fit"]["heldout_rmse_after_rad"],
        "floor": document["fit"]["noise_floor_rad"],
        "significant": document["remainder"]["significant"],
    }


def summary(rows: list[dict]) -> str:
    """Counts with 95 % binomial intervals."""
    out = []
    singles = [r for r in rows if len(r["labels"]) == 1]
    for title, pick in (
        ("singles in the library", [r for r in singles if r["labels"][0] in LIBRARY]),
        (
            "of these visible >= 1 sigma",
            [r for r in singles if r["labels"][0] in LIBRARY and (r["visibility"] or 0) >= 1],
        ),
    ):
        for kind, same in (("class", class_of), ("name", lambda n: n)):
            right = sum(bool(r["named"]) and same(r["named"][0]) == same(r["labels"][0]) for r in pick)
            out.append(_share(f"{title}, first place right by {kind}", right, len(pick)))
    nulls = [r for r in rows if not r["labels"]]
    out.append(_share("null cases with a named effect", sum(bool(r["named"]) for r in nulls), len(nulls)))
    others = [r for r in singles if r["labels"][0] not in LIBRARY]
    out.append(
        _share(
            "singles outside the library flagged (unexplained or remainder)",
            sum(r["significant"] for r in others),
            len(others),
        )
    )
    out.append(
        f"time a case, median: {np.median([r['wall_s'] for r in rows]):.1f} s, of one processor"
        f" {np.median([r['cpu_s'] for r in rows]):.1f} s"
    )
    wrong = Counter(
        (r["labels"][0], r["named"][0] if r["named"] else r["verdict"])
        for r in singles
        if r["labels"][0] in LIBRARY and (not r["named"] or class_of(r["named"][0]) != class_of(r["labels"][0]))
    )
    return "\n".join(out + [f"  {n} x {truth} -> {named}" for (truth, named), n in wrong.most_common()])


def _share(title: str, k: int, n: int) -> str:
    if n == 0:
        return f"{title}: none"
    low, high = binomtest(k, n).proportion_ci(method="wilson")
    return f"{title}: {k} of {n} = {k / n:.2f} [{low:.2f}, {high:.2f}]"


def main() -> None:
    """Diagnose, log, score."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--half", choices=("tuning", "reporting", "all"), default="all")
    parser.add_argument("--library", action="store_true", help="only nulls and singles whose effect the library has")
    parser.add_argument("--out", type=Path, default=None)
    parser.add_argument("--limit", type=float, default=300.0, help="seconds a case")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="cases at once, each on one core")
    arguments = parser.parse_args()
    truths = {p.stem: json.loads(p.read_text()) for p in sorted((arguments.folder / "truth").glob("*.json"))}
    half = halves(truths)
    rows = (
        [json.loads(x) for x in arguments.out.read_text().splitlines() if x.startswith("{")]
        if arguments.out and arguments.out.exists()
        else []
    )
    done = {r["case"] for r in rows}
    wanted = [
        case
        for case, truth in truths.items()
        if case not in done
        and arguments.half in ("all", half[case])
        and not (arguments.library and (len(truth["labels"]) > 1 or not set(truth["labels"]) <= LIBRARY))
    ]

    def row(case: str) -> dict:
        try:
            return line(case, answer(arguments.folder / case, arguments.limit), truths[case])
        except (subprocess.SubprocessError, json.JSONDecodeError) as error:
            print(f"{case}: no answer ({str(error)[-200:]})", file=sys.stderr)
            return {
                "case": case,
                "labels": truths[case]["labels"],
                "named": [],
                "verdict": "no answer",
                "wall_s": arguments.limit,
                "cpu_s": arguments.limit,
                "visibility": truths[case].get("visibility_after_refit_sigma"),
                "where": [],
                "before": None,
                "after": None,
                "floor": None,
                "significant": False,
            }

    with ThreadPoolExecutor(arguments.jobs) as pool:
        for found in pool.map(row, wanted):
            rows.append(found)
            text = json.dumps(found)
            print(text, flush=True)
            if arguments.out:
                with arguments.out.open("a") as log:
                    log.write(text + "\n")
    print(summary(rows))


if __name__ == "__main__":
    main()
