"""What the consistency pass tells of recordings: `python analysis/consistency.py FOLDER...` reads every recording below
the folders and prints its faults, a line each; at the end how many recordings have none.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from ers_mj.data.recording import read_recording
from ers_mj.errors import InputError


def specs(folder: Path) -> list[str]:
    """Recordings below a folder; each run of a file of runs."""
    found = [str(p) for p in sorted(folder.rglob("*.csv")) if "t_s" in p.open().readline()]
    for path in sorted(folder.rglob("*.parquet")):
        if "run" in pq.read_schema(path).names:
            runs = np.unique(pq.read_table(path, columns=["run"])["run"].to_numpy())
            found += [f"{path}#run={run}" for run in runs]
    return found


def main(folders: list[str]) -> int:
    """Read, list, count."""
    clean, kinds = 0, Counter()
    for spec in (spec for folder in folders for spec in specs(Path(folder))):
        try:
            faults = read_recording(spec).faults
        except InputError as error:
            print(f"{spec}\trefused\t{error}")
            continue
        clean += not faults
        for fault in faults:
            kinds[fault.kind] += 1
            print(f"{spec}\t{fault.kind}\t{fault.count}\t{fault.sentence}")
    print(f"{clean} without a fault; {dict(kinds)}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
