"""How large a gain do servos without any missing physics offer? `python analysis/null_gains.py --cases 24 --seed 1`.

Draws effect-free servos (analysis/concealed_cases.py, half of them with coloured noise), fits the baseline, and refits
every effect whose secant promises anything at all, with the gates `least_gain` of the policy and `least_promise` of the
search open. Prints the largest gain in C of each servo, whether no other law is offered nearly as much
(decisions/ordering.py, stands_alone), and (1 + misfit) / 2 of its worst block, from whose tails come the scales that
decisions/confirmation.py, paired_p, assumes.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from concealed_cases import main as make_cases

from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import read_recording
from ers_mj.decisions.thresholds import Policy
from ers_mj.effects import BY_NAME
from ers_mj.estimation.baseline import baseline
from ers_mj.estimation.objective import tau_of
from ers_mj.selection.bench import Bench
from ers_mj.selection.budget import Search
from ers_mj.selection.candidates import candidates
from ers_mj.selection.comparison import stands_alone
from ers_mj.servo.datasheet import read_datasheet

OPEN, ASKING_ALL = Policy(least_gain=0.0), Search(least_promise=0.0)


def largest_gain(folder):
    """(gain in C, name) of the best effect on the recordings of a folder, whether it stands alone, and what the worst
    block is off by.
    """
    sheet = read_datasheet(str(folder / "datasheet.toml"))
    traces = [trace_of(read_recording(str(path)), sheet.parameters["J"]) for path in sorted(folder.glob("rec*.csv"))]
    start = baseline(traces, sheet, True)
    bench = Bench(start.traces, tau_of(start.fit.misfit), exclude=("inductance",), policy=OPEN, search=ASKING_ALL)
    ranked = [c for c in candidates(bench, start.fit, start.anchors) if c.name in BY_NAME]
    best = max(ranked, key=lambda c: c.gain, default=None)
    worst = 0.5 + 0.5 * float(start.fit.misfit.max())
    return (best.gain, best.name, stands_alone(best, ranked), worst) if best else (0.0, "nothing", False, worst)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=24)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    gains, lone, worst = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        make_cases(
            [
                "--out",
                folder,
                "--seed",
                str(options.seed),
                "--cases",
                str(options.cases),
                "--kind",
                "none",
                "--coloured",
                "0.5",
                "--no-refit",
            ]
        )
        for case in sorted(Path(folder).glob("case-*")):
            gain, name, alone, block = largest_gain(case)
            gains.append(max(gain, 0.0))
            lone.append(alone)
            worst.append(block)
            print(
                f"{case.name}  {gain:6.2f}  {name:32}  {'alone' if alone else '':5}  worst block {block:6.2f}",
                flush=True,
            )
    print(
        f"{len(gains)} servos: mean {np.mean(gains):.2f}, 90 % {np.quantile(gains, 0.9):.2f}, largest"
        f" {np.max(gains):.2f}; alone {sum(lone)}, of those that gain 1 or more"
        f" {sum(a for a, gain in zip(lone, gains) if gain >= 1.0)} of {sum(gain >= 1.0 for gain in gains)}; worst"
        f" blocks: median {np.median(worst):.2f}, 90 % {np.quantile(worst, 0.9):.2f}, largest {np.max(worst):.2f}"
    )
