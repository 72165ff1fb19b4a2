"""What every named effect is worth: how far the held-out error rises where it is left out and the rest refitted.

    python analysis/worth.py FOLDER...      # folders in which `ers diagnose`, `batch` or `prove` left diagnosis.json

A row a name: the held-out error with and without it in noise floors, and by how much the squared error above the noise
rises without it. The model without it begins at the answer's own parameters and has the same steps as every refit. What
acts in one recording only cannot make another one better, and is listed without a figure. Ends with 1 where a name is
worth less than MOST_IDLE.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path

MOST_IDLE = 0.1  # share by which the squared held-out error above the noise must rise without a name


def names_of(path: Path) -> Iterator[tuple[str, float | None, float | None, float | None]]:
    """(effect, error with it, error without it [noise floors], rise) of a diagnosis; None where nothing is held out."""
    document = json.loads(path.read_text(encoding="utf-8"))
    noise = document["fit"]["noise_floor_rad"]
    for named in document["missing"]:
        told = (named["evidence"][f"heldout_rmse_{way}_rad"] for way in ("with", "without"))
        with_it, without = (None if x is None else x / noise for x in told)
        if with_it is None or without is None:
            yield named["effect"], None, None, None
            continue
        left, lost = (max(x * x - 1.0, 0.0) for x in (with_it, without))
        yield named["effect"], with_it, without, lost / left - 1.0 if left > 0 else math.inf


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path)
    files = [f for folder in parser.parse_args().folders for f in sorted(folder.rglob("diagnosis.json"))]
    if not files:
        sys.exit("worth: there is no diagnosis.json in these folders")
    idle = total = 0
    print(f"{'case':24}{'effect':28}{'with':>9}{'without':>9}{'rise':>10}")
    for path in files:
        for name, with_it, without, rise in names_of(path):
            if with_it is None or without is None or rise is None:
                print(f"{path.parent.name:24}{name:28}{'-':>9}{'-':>9}{'-':>10}")
                continue
            total, idle = total + 1, idle + (rise < MOST_IDLE)
            print(f"{path.parent.name:24}{name:28}{with_it:9.2f}{without:9.2f}{rise:10.1%}")
    print(f"{total} names in {len(files)} diagnoses, {idle} of them worth less than {MOST_IDLE:.0%}")
    return int(idle > 0)


if __name__ == "__main__":
    sys.exit(main())
