"""What a diagnosis takes, this checkout beside an older commit, and how it grows with a recording's length.

    python analysis/speed.py                       # cases of ../shared/concealed, both checkouts in turn: ratios
    python analysis/speed.py --first               # `ers demo` with an empty cache, both checkouts in turn
    python analysis/speed.py --growth 1 4 16 60    # minutes at 1 kHz: diagnose, identify, frequency, this checkout
    python analysis/speed.py --side-by-side        # by the clock: --jobs 2 beside --jobs 1, on an idle machine
    python analysis/speed.py --inspect             # `ers inspect` of 100 000 rows beside reading them twice and a plot

Seconds are a processor's in user mode, one thread, kernels compiled beforehand; of several rounds the least counts,
since other work on a machine only adds. Seconds belong to a machine, ratios hold.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from cold_start import BEFORE, ROOT, unpacked

CONCEALED = ROOT.parent / "shared/concealed"
CASES = ("case-001", "case-010", "case-032", "case-053")  # three with one effect, one with two
# the bars: share of the older commit's time, of its first answer's, and how much faster two threads are
MOST, MOST_FIRST, TWICE = 1.0 / 3.0, 0.2, 1.7


TWICE_AND_PLOT = """
import sys
import ers_mj as ers
record = [ers.read(sys.argv[1]) for _ in range(2)][0]
from matplotlib.figure import Figure
figure = Figure()
above, below = figure.subplots(2, 1, sharex=True)
above.plot(record.t, record.y)
below.plot(record.t, record.u)
figure.savefig(sys.argv[2])
"""


def taken(checkout: Path, cache: Path, arguments: list[str], script: str = "") -> tuple[float, float]:
    """(processor time in user mode [s], largest memory [MiB]) of `ers` from a checkout with a cache of its own, or of a
    script there.
    """
    cache.mkdir(mode=0o700, exist_ok=True)
    environment = {**os.environ, "PYTHONPATH": str(checkout), "XDG_CACHE_HOME": str(cache), "OPENBLAS_NUM_THREADS": "1"}
    what = ["-c", script] if script else ["-m", "ers_mj"]
    started = subprocess.Popen(
        [sys.executable, *what, *arguments], env=environment, cwd=cache, stdout=subprocess.DEVNULL
    )
    _, status, usage = os.wait4(started.pid, 0)
    if status:
        raise SystemExit(f"{' '.join(arguments)} ended with {os.waitstatus_to_exitcode(status)}")
    return usage.ru_utime, usage.ru_maxrss / 1024


def case_arguments(case: Path, out: Path) -> list[str]:
    sheet = case / "datasheet.toml"
    known = ["--datasheet", str(sheet)] if sheet.exists() else []
    return ["diagnose", *map(str, sorted(case.glob("rec*.csv"))), *known, "--jobs", "1", "--out", str(out), "--force"]


def compare(cases: list[str], before: str, rounds: int) -> int:
    """Print what each case takes on both sides, and the ratio; 1 where the median misses the bar."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        sides = {"before": unpacked(before, folder / "checkout"), "now": ROOT}
        ratios = []
        print(f"{'case':12}{'before':>10}{'now':>10}{'share':>8}   (bar: {MOST:.2f}, median)")
        for name in cases:
            least = dict.fromkeys(sides, np.inf)
            for k in range(rounds + 1):  # the first round compiles
                for side, checkout in sides.items():
                    spent, _ = taken(checkout, folder / side, case_arguments(CONCEALED / name, folder / f"{side}-out"))
                    least[side] = min(least[side], spent) if k else np.inf
            ratios.append(least["now"] / least["before"])
            print(f"{name:12}{least['before']:8.1f} s{least['now']:8.1f} s{ratios[-1]:8.3f}", flush=True)
    print(f"{'median':12}{'':20}{statistics.median(ratios):8.3f}")
    return 0 if statistics.median(ratios) <= MOST else 1


def first_answer(before: str) -> int:
    """Print what `ers demo` takes on both sides with an empty cache and then, and the ratios; 1 where the first misses
    the bar.
    """
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        sides = {"before": unpacked(before, folder / "checkout"), "now": ROOT}
        print(f"{'ers demo':14}{'before':>10}{'now':>10}{'share':>8}   (bar: {MOST_FIRST:.2f}, empty cache)")
        shares = []
        for name in ("empty cache", "compiled"):
            spent = {
                side: taken(checkout, folder / side, ["demo", "--out", str(folder / f"{side}-out"), "--force"])[0]
                for side, checkout in sides.items()
            }
            shares.append(spent["now"] / spent["before"])
            print(f"{name:14}{spent['before']:8.1f} s{spent['now']:8.1f} s{shares[-1]:8.3f}", flush=True)
    return 0 if shares[0] <= MOST_FIRST else 1


def serial_share(faster: float, apart: float) -> float:
    """What share of the time of one thread cannot run side by side, by Amdahl, where two threads are ``faster`` and the
    machine runs two processes ``apart`` times as fast as one after the other.
    """
    return min(max((1.0 / faster - 1.0 / apart) / max(1.0 - 1.0 / apart, 1e-9), 0.0), 1.0)


def side_by_side(cases: list[str]) -> int:
    """Print by the clock what one and two threads take, the start-up aside, and what sixteen cores would; 1 where two
    are less than TWICE times as fast. ``apart`` is what two processes at once gain over one after the other: cores that
    are two threads of one give less than 2.
    """

    def clocked(*commands: Sequence[str]) -> float:
        begun = time.perf_counter()
        with ThreadPoolExecutor(len(commands)) as pool:
            list(pool.map(lambda command: taken(ROOT, folder / "cache", list(command)), commands))
        return time.perf_counter() - begun

    gains = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        columns = f"{'case':12}{'one':>9}{'two':>9}{'faster':>9}{'apart':>9}{'serial':>9}{'sixteen':>10}"
        print(f"{columns}   (bar: {TWICE} times)")
        for name in cases:
            arguments = case_arguments(CONCEALED / name, folder / "out")
            threads = arguments.index("--jobs") + 1
            both = [[*arguments[:threads], jobs, *arguments[threads + 1 :]] for jobs in ("1", "2")]
            clocked(both[0])  # compiles
            start = min(clocked(["diagnose", "--help"]) for _ in range(3))
            one, two = (clocked(each) - start for each in both)
            elsewhere = case_arguments(CONCEALED / name, folder / "other")
            apart = 2.0 * (one + start) / clocked(both[0], elsewhere)
            gains.append(one / two)
            serial = serial_share(gains[-1], apart)
            sixteen = 1.0 / (serial + (1.0 - serial) / 16)
            shares = f"{gains[-1]:9.2f}{apart:9.2f}{serial:9.2f}{sixteen:10.1f}"
            print(f"{name:12}{one:7.1f} s{two:7.1f} s{shares}", flush=True)
    return 0 if statistics.median(gains) >= TWICE else 1


def recorded(minutes: float, path: Path) -> None:
    """A recording of Table 1's servo with friction that falls with speed, under a multisine, at 1 kHz."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    from ers_mj.data.recording import write_recording
    from ers_mj.servo.datasheet import read_datasheet
    from ers_mj.servo.simulation import simulate_recording

    generator, t = np.random.default_rng(3), 1e-3 * np.arange(int(60_000 * minutes))
    u = np.zeros(t.size)
    for f in np.geomspace(0.1, 6.0, 40):
        u += 0.27 * generator.standard_normal() * np.sin(2 * np.pi * f * t + generator.uniform(0, 2 * np.pi))
    effects = [("stribeck", {"dF_s": 0.05, "v_s": 0.2})]
    columns = simulate_recording(read_datasheet("table1"), t, u, effects=effects, noise=2e-4, seed=1)
    if path.suffix == ".csv":
        write_recording(path, columns)
    else:
        pq.write_table(pa.table(columns), path)


def look(rounds: int) -> int:
    """Print what `ers inspect` of 100 000 rows with its page takes, of reading them twice and a plot; 1 above that."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        recorded(100 / 60, path := folder / "long.csv")
        asked = ["inspect", str(path), "--out", str(folder / "out"), "--force"]
        both = [asked, ""], [[str(path), str(folder / "plot.png")], TWICE_AND_PLOT]
        inspected, plotted = (min(taken(ROOT, folder / "cache", *each)[0] for _ in range(rounds + 1)) for each in both)
    print(
        f"ers inspect {inspected:.2f} s, reading twice and a plot {plotted:.2f} s: {inspected / plotted:.2f} (bar: 1)"
    )
    return 0 if inspected <= plotted else 1


def grow(minutes: list[float]) -> int:
    """Print what each length takes, beside its multiple of the first."""
    first: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        print(f"{'command':12}{'minutes':>9}{'processor':>12}{'memory':>11}{'per minute of the first':>26}")
        for k, length in enumerate([minutes[0], *minutes]):  # the first one compiles
            path = folder / f"{length:g}min.parquet"
            recorded(length, path)
            commands = {
                "diagnose": ["diagnose", str(path), "--datasheet", "table1", "--jobs", "1"],
                "identify": ["identify", str(path), "--datasheet", "table1", "--method", "ls", "--jobs", "1"],
                "frequency": ["frequency", str(path)],
            }
            for name, arguments in commands.items():
                spent, memory = taken(ROOT, folder / "cache", [*arguments, "--out", str(folder / name), "--force"])
                if k > 0:
                    first.setdefault(name, spent / length)
                    share = spent / length / first[name]
                    print(f"{name:12}{length:9g}{spent:10.1f} s{memory:7.0f} MiB{share:26.2f}", flush=True)
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="+", default=list(CASES), metavar="CASE")
    parser.add_argument("--before", default=BEFORE, help="the older commit (default: %(default)s)")
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--first", action="store_true")
    parser.add_argument("--growth", nargs="+", type=float, metavar="MINUTES")
    parser.add_argument("--side-by-side", action="store_true")
    parser.add_argument("--inspect", action="store_true")
    chosen = parser.parse_args()
    if chosen.first:
        return first_answer(chosen.before)
    if chosen.inspect:
        return look(chosen.rounds)
    if chosen.side_by_side:
        return side_by_side(chosen.cases)
    return grow(chosen.growth) if chosen.growth else compare(chosen.cases, chosen.before, chosen.rounds)


if __name__ == "__main__":
    sys.exit(main())
