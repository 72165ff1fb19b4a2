"""Does the recording that is advised settle what it promises? `python analysis/settled_by_advice.py [--seed N]
[--servos N]`.

Each servo differs from Table 1 at random and has one weak effect of a class whose members are easily confused. Its
recordings are gentle. All members are fitted to them, the next recording is advised, made by the true servo (not by a
fitted model), and added. Beside it a recording of the kind at hand is added instead. Printed: probability of the truth
with the recordings at hand, with one more of the same kind, with the one advised; and C that separates the best wrong
member from the truth, promised and found.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np

from ers_mj.data.excitation import signal
from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.estimation.baseline import baseline
from ers_mj.estimation.fit import fit
from ers_mj.estimation.initial_state import fitted_start
from ers_mj.experiment_design.next_recording import next_recording
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.selection.posterior import probabilities
from ers_mj.servo.datasheet import read_datasheet

NOISE = 2e-4  # [rad]
T = np.arange(0.0, 5.0, 1e-3)
# members with the parameters that their fits begin at; the truth is one of these, of a size between half and once this
CLASSES = {
    "late": {"input_delay": [1e-3], "sensor_lag": [1e-3], "inductance": [1e-3, np.inf]},
    "weak drive": {"voltage_saturation": [5.9], "current_limit": [400.0], "supply_sag": [40.0]},
    "torque": {
        "bias_torque": [2.0],
        "gravity_imbalance": [5.0, 0.3],
        "asymmetric_friction": [2.0, 0.05, np.inf, np.inf],
    },
}


def servo(rng: np.random.Generator) -> dict[str, float]:
    """Eq. (6)'s letters of Table 1, each off by about a tenth."""
    values = read_datasheet("table1").to_lumped()
    return {
        k: v * float(np.exp(0.1 * rng.standard_normal())) if k not in ("theta_0", "emf_share") else v
        for k, v in values.items()
    }


def recorded(values, effect, t, u, name, rng):
    """A recording of the true servo."""
    y = ReducedModel(lumped(values), [effect]).simulate(t, u).measured
    return trace_of(from_arrays(t, u, y + NOISE * rng.standard_normal(t.size), name=name), None)


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--servos", type=int, default=1, help="of each effect")
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    print(f"{'truth':22}{'at hand':>9}{'same':>7}{'advised':>9}{'promised':>10}{'found':>8}  advised")
    for members in CLASSES.values():
        for true, size in [item for item in members.items() for _ in range(arguments.servos)]:
            values = servo(rng)
            shrunk = np.array(size) * np.where(np.arange(len(size)) == 0, rng.uniform(0.5, 1.0), 1.0)
            if true in CLASSES["weak drive"]:
                shrunk = np.array(size)
            effect = true, shrunk
            traces = [recorded(values, effect, T, INPUTS[name](T), name, rng) for name in ("ramp", "steps")]
            start = baseline(traces, read_datasheet("table1"), True, 2)
            traces = start.traces
            fits = {n: fit(start.fit.model.with_effect(n, np.array(at)), traces, steps=25) for n, at in members.items()}
            before = probabilities(fits)
            leader = max(before, key=before.get)
            advice = next_recording(
                (leader, fits[leader]),
                [(n, f, before[n]) for n, f in fits.items() if n != leader and before[n] > 0.02],
                traces,
                "V",
                "rad",
            )
            same = _after(fits, traces, recorded(values, effect, T, INPUTS["ramp"](T), "again", rng))
            if not advice["excitation"] or not advice["separates"]:
                print(
                    f"{true:22}{before[true]:9.2f}{probabilities(same)[true]:7.2f}{'':9}{'':10}{'':8} "
                    f" {advice['sentence'][:110]}"
                )
                continue
            after = _after(fits, traces, recorded(values, effect, *signal(advice["excitation"]), "advised", rng))
            others = list(advice["checked"]["against"]) + [leader]
            promised = min(c["cost"] for c in advice["checked"]["against"].values())
            found = min(after[n].cost - fits[n].cost for n in others if n != true) - (
                after[true].cost - fits[true].cost
            )
            print(
                f"{true:22}{before[true]:9.2f}{probabilities(same)[true]:7.2f}{probabilities(after)[true]:9.2f}{promised:10.1f}{found:8.1f}"
                f"  {advice['excitation']['kind']}, leader {leader}",
                flush=True,
            )


def _after(fits, traces, new):
    """Every member fitted again with one recording more."""
    new = replace(
        new, start=fitted_start(next(iter(fits.values())).model, new)
    )  # by one model for all, as a diagnosis does
    return {n: fit(f.model, [*traces, new], steps=20) for n, f in fits.items()}


if __name__ == "__main__":
    main()
