"""Can gravity be told from a constant torque? `python analysis/gravity_tie.py CASE [CASE ...]`, each a folder with
rec*.csv and datasheet.toml.

Selects effects as `ers diagnose` does and, where one of TIED is among them, fits each of these in its place from all
its starts, to the floor of its valley. Prints C of each: two that lie within one of each other, the recordings do not
tell apart.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import read_recording
from ers_mj.effects import BY_NAME, SUSPECTS
from ers_mj.errors import InputError
from ers_mj.estimation.baseline import baseline, sharpened
from ers_mj.estimation.fit import descend, fit
from ers_mj.selection.stepwise import select
from ers_mj.servo.datasheet import read_datasheet
from ers_mj.servo.model import OBSERVER_RATE

TIED = ("bias_torque", "asymmetric_friction", "gravity_imbalance")


def costs(folder: Path) -> dict[str, float]:
    """{name: C} of the effects TIED, each in the place of the one that is selected; empty where none is.

    Raises:
        InputError: there are no recordings, or one of the files cannot be read.
    """
    recordings = [read_recording(str(path)) for path in sorted(folder.glob("rec*.csv"))]
    if not recordings:
        raise InputError(f"{folder}: holds no rec*.csv")
    sheet = read_datasheet(str(folder / "datasheet.toml"))
    traces = [trace_of(r, sheet.parameters.get("J")) for r in recordings]
    start = sharpened(baseline(traces, sheet, True, 1), float(np.ptp(np.concatenate([t.y[t.valid] for t in traces]))))
    found = select(start.fit, start.traces, start=start, exclude=("inductance", *SUSPECTS))
    model = found.chosen.model
    selected = next((name for name in model.names if name in TIED), None)
    if selected is None:
        return {}
    less = model.without_effect(selected)
    begun = {
        name: [*([dict(model.effects)[name]] if name == selected else []), *BY_NAME[name].starts(less.scales)]
        for name in TIED
    }
    return {
        name: min(_floor(less.with_effect(name, p), found.traces, found.tau) for p in starts)
        for name, starts in begun.items()
    }


def _floor(model, traces, tau) -> float:
    return descend(fit(model, traces, tau=tau).model, traces, OBSERVER_RATE, tau, 40, 1e-4).cost


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="+", type=Path, metavar="CASE")
    for case in parser.parse_args().cases:
        try:
            told = costs(case)
        except InputError as error:
            print(f"gravity_tie: {error}", file=sys.stderr)
            sys.exit(2)
        print(
            f"{case.name}  "
            + ("  ".join(f"{name} {cost:.2f}" for name, cost in told.items()) or "none of them is selected"),
            flush=True,
        )
