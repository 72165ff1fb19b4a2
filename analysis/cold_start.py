"""Compiling and running the reduced model, this checkout beside an older commit: `python analysis/cold_start.py`.

Compiling is everything that can be compiled (each kernel, each law), from an empty cache, in seconds of the processor
in user mode. Running is the least time of a thread over many calls of 10 s at 1 kHz, multisine, in eight cases, the two
checkouts in turn. What a motion is must not differ: the sum of |theta| is compared to 1e-9 of it.
"""

from __future__ import annotations

import argparse
import io
import json
import math
import os
import resource
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BEFORE = "581c791"
MOST_COMPILING, MOST_RUNNING = 0.20, 1.03  # the bars: shares of the older commit's times
ROUNDS = 5

COMPILE = """
import importlib, pkgutil
import numpy as np
import ers_mj.plants as plants
there = pkgutil.walk_packages(plants.__path__, "ers_mj.plants.")
modules = [importlib.import_module(m.name) for m in there]
kernels = {id(v): v.piece for m in modules for v in vars(m).values() if hasattr(v, "piece")}
t = np.linspace(0.0, 0.01, 11)
from ers_mj.plants.printed_play import PrintedPlay
from ers_mj.plants.reduced import lumped
PrintedPlay(lumped({"b": 1.0}), 0.1).simulate(t, t)
if kernels:
    from ers_mj.effects import EFFECTS
    from ers_mj.plants.compiling.compiled import make
    from ers_mj.plants.kernel.laws import SIGNATURES, acting, laid_out
    for piece in kernels.values():
        make(piece)
    on = acting(tuple(e.name for e in EFFECTS if any(getattr(e, kind) for kind in SIGNATURES)), False)
    laid_out(np.zeros(29), on, np.zeros((len(on.rows), 7)))
"""
RUN = """
import json, sys, time
import numpy as np
from ers_mj.effects import BY_NAME, Scales
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
try:
    from ers_mj.servo.datasheet import read_datasheet
except ImportError:
    from ers_mj.datasheet import read_datasheet
sheet, t = read_datasheet("table1"), np.arange(0.0, 10.0, 1e-3)
scales = Scales(position=0.4, low=0.15, high=0.4, speed=4.0, acceleration=110.0, input=10.0, sample_time=1e-3,
                noise=1e-4, quantum=0.0, is_angle=True)
one = ("stribeck",)
five = ("stribeck", "cogging", "quadratic_drag", "gravity_imbalance", "load_dependent_friction")
cases = {"plain": (), "inductance": (), "stribeck": one, "5 laws": five, "gap": ("backlash",),
         "gap+law": ("backlash", "cogging"), "bristle": ("presliding",), "stop": ("end_stop",)}
u, times, sums = INPUTS["multisine"](t), {}, {}
for case, names in cases.items():
    c = lumped(sheet.to_lumped() | ({} if case == "inductance" else {"tau_e": 0.0}))
    model = ReducedModel(c, [(name, BY_NAME[name].starts(scales)[0]) for name in names])
    sums[case], best, spent = float(np.abs(model.simulate(t, u).theta).sum()), np.inf, 0.0
    while spent < float(sys.argv[1]):
        begin = time.thread_time()
        model.simulate(t, u)
        taken = time.thread_time() - begin
        best, spent = min(best, taken), spent + taken
    times[case] = best
print(json.dumps([times, sums]))
"""


def asked(checkout: Path, cache: Path, program: str, *arguments: str) -> tuple[str, float]:
    """(what a program prints, its processor time in user mode [s]) with a checkout's package and a cache of its own."""
    cache.mkdir(mode=0o700, exist_ok=True)
    environment = {**os.environ, "PYTHONPATH": str(checkout), "XDG_CACHE_HOME": str(cache), "ERS_MJ_COMPILING": "1"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments],
        env=environment,
        cwd=cache,
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    return done.stdout, resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def unpacked(commit: str, folder: Path) -> Path:
    archive = subprocess.run(["git", "archive", commit], cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout
    with tarfile.open(fileobj=io.BytesIO(archive)) as files:
        files.extractall(folder, filter="data")
    return folder


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--before", default=BEFORE, help="the older commit (default: %(default)s)")
    parser.add_argument("--seconds", default="1.0", help="for each case in each round (default: %(default)s)")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        sides = {"before": unpacked(chosen.before, folder / "checkout"), "now": ROOT}
        compiling = {side: asked(sides[side], folder / side, COMPILE)[1] for side in sides}
        share = compiling["now"] / compiling["before"]
        print(f"{'':12}{'before':>10}{'now':>10}{'share':>8}   (bars: {MOST_COMPILING} and {MOST_RUNNING})")
        print(f"{'compiling':12}{compiling['before']:8.1f} s{compiling['now']:8.1f} s{share:8.3f}", flush=True)
        least, sums = {side: {} for side in sides}, {}
        for _ in range(ROUNDS):
            for side, checkout in sides.items():
                times, sums[side] = json.loads(asked(checkout, folder / side, RUN, chosen.seconds)[0])
                least[side] = {case: min(t, least[side].get(case, t)) for case, t in times.items()}
    kept = share <= MOST_COMPILING
    for case, before in least["before"].items():
        now, same = least["now"][case], math.isclose(sums["now"][case], sums["before"][case], rel_tol=1e-9)
        kept = kept and same and now <= MOST_RUNNING * before
        differ = "" if same else "   ANSWERS DIFFER"
        print(f"{case:12}{1e3 * before:7.3f} ms{1e3 * now:7.3f} ms{now / before:8.3f}{differ}")
    print("bars kept" if kept else "bars NOT kept")
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
