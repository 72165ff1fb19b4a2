"""How long `ers identify` takes on one 10 s, 1 kHz recording: `python analysis/identify_time.py --seed 15 --runs 5`.

Table 1's plant under the package's named inputs in turn, 0.01 deg of noise, with and without a datasheet, each in a
process of its own with one thread and compiled code at hand (one run beforehand). Processor time, so that a machine
that is shared does not count: of the start (Python and the imports), and of all that follows, from reading the file to
the report that is written.
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from ers_mj.data.recording import write_recording
from ers_mj.plants.inputs import INPUTS
from ers_mj.servo.datasheet import read_datasheet
from ers_mj.servo.simulation import simulate_recording

TIMED = """
import sys, time
import ers_mj.commands.identify, ers_mj.identify_report, ers_mj.identifying.estimate, ers_mj.recording
from ers_mj.cli import main
start = time.process_time()
assert main(sys.argv[1:]) == 0
print(start, time.process_time() - start, file=sys.stderr)
"""


def timed(record: Path, out: Path, options: list[str]) -> tuple[float, float]:
    """(start [s], identification [s]) of one call."""
    one = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
    ran = subprocess.run(
        [sys.executable, "-c", TIMED, "identify", str(record), *options, "--jobs", "1", "--out", str(out), "--force"],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, **one},
    )
    start, spent = ran.stderr.splitlines()[-1].split()
    return float(start), float(spent)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=15)
    parser.add_argument("--runs", type=int, default=5)
    arguments = parser.parse_args()
    t, sheet = np.arange(10_000) / 1e3, read_datasheet("table1")
    with tempfile.TemporaryDirectory() as folder:
        record, out = Path(folder) / "rec.csv", Path(folder) / "out"
        for title, options, inductance in (
            ("with the datasheet, L in the plant", ["--datasheet", "table1"], True),
            ("with the datasheet, no L in the plant", ["--datasheet", "table1"], False),
            ("from scratch, no L in the plant", [], False),
            ("from scratch, L in the plant: a model that is wrong", [], True),
        ):
            starts, spent = [], []
            for k in range(-1, arguments.runs):
                wave = list(INPUTS)[max(k, 0) % len(INPUTS)]
                columns = simulate_recording(
                    sheet,
                    t,
                    INPUTS[wave](t),
                    inductance=inductance,
                    noise=math.radians(0.01),
                    seed=arguments.seed * 100 + k,
                )
                write_recording(record, columns)
                start, took = timed(record, out, options)
                if k >= 0:
                    starts.append(start)
                    spent.append(took)
            print(
                f"{title}: start {np.median(starts):.2f} s, identification {', '.join(f'{x:.2f}' for x in spent)} s of"
                f" one processor (median {np.median(spent):.2f})",
                flush=True,
            )


if __name__ == "__main__":
    main()
