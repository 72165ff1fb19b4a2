"""What naming the physics buys in control: `python analysis/diagnosis_pays.py [--servos N] [--seed S]`.

Each servo is Table 1 with its parameters scattered by 10 % and one concealed effect that limits a loop (a dead time, a
springy shaft, a lagging sensor, a weak converter or a play), as a MuJoCo plant. It is recorded (multisine and steps, 5
s each, 1 kHz, 0.01 deg of noise) and diagnosed with Table 1 as the datasheet. Two models follow: the baseline, refitted
to the same recordings, and the diagnosed one, the same with the named effects. On each `pid-ff` is tuned: P, D and the
speed's filter with the least RMS error over square, ramp and chirp (3 deg, 24 V, 1 kHz, noise) on that model's reduced
plant, no loop given up. Both controllers then run on the true MuJoCo plant, and so does the baseline's with the gains
of (38). Printed: what was named, the gains, the true errors, and their ratio.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from itertools import product

import numpy as np

from ers_mj.control.controllers import PidGains
from ers_mj.control.trial import Conditions, try_out
from ers_mj.data.recording import from_arrays
from ers_mj.diagnosis.pipeline import diagnose
from ers_mj.plants.inputs import INPUTS
from ers_mj.servo.datasheet import TABLE_1, Datasheet, read_datasheet
from ers_mj.servo.simulation import simulate_recording

SCATTERED = ("J", "B", "K_t", "K_e", "k_s", "T_LH", "F_c", "R")
NOISE, TIME = math.radians(0.01), np.arange(5000) / 1000.0
CASES = ("square", "ramp", "chirp")
LOOP = Conditions(amplitude=math.radians(3.0), rate_hz=1000.0, noise=NOISE)
P, D, FILTERS = (2.5, 5.0, 10.0, 20.0, 40.0), (0.02, 0.05, 0.1, 0.2, 0.4), (5e-4, 2e-3)  # [V/deg], [V s/deg], [s]
EFFECTS = {  # name: (parameter: (least, most)), drawn log-uniform
    "input_delay": {"T_d": (2e-3, 6e-3)},
    "sensor_lag": {"T": (2e-3, 6e-3)},
    "shaft_compliance": {"f_shaft": (15.0, 30.0), "zeta": (0.05, 0.1), "rho": (0.5, 0.6), "phi": (0.1, 0.2)},
    "voltage_saturation": {"u_max": (5.0, 8.0)},
    "backlash": {
        "gap": (0.005, 0.01),
        "rho": (0.6, 0.64),
        "phi": (0.1, 0.2),
        "f_contact": (60.0, 120.0),
        "zeta": (0.2, 0.4),
    },
}


def servo(random: np.random.Generator, effect: str) -> Datasheet:
    """The truth: scattered parameters and the effect."""
    parameters = {**TABLE_1, **{k: TABLE_1[k] * float(np.exp(0.1 * random.standard_normal())) for k in SCATTERED}}
    drawn = {k: float(np.exp(random.uniform(*np.log(ends)))) for k, ends in EFFECTS[effect].items()}
    return Datasheet(parameters=parameters, effects=((effect, drawn),), name="truth")


def recordings(truth: Datasheet, seed: int) -> list:
    """What is measured of it."""
    out = []
    for k, name in enumerate(("multisine", "steps")):
        u = INPUTS[name](TIME)
        columns = simulate_recording(truth, TIME, u, noise=NOISE, seed=seed + k, plant="mujoco")
        out.append(from_arrays(columns["t_s"], columns["u_V"], columns["theta_rad"], name=name))
    return out


def error(plant: Datasheet, kind: str, design: Datasheet, pid: PidGains, filter_s: float, seed: int) -> list[float]:
    """RMS error [rad] of `pid-ff` on each case; infinite where a loop was given up."""
    trials = try_out(
        plant, ["pid-ff"], [kind], CASES, replace(LOOP, pid=pid, filter_s=filter_s, seed=seed), design=design
    )
    return [t.measures.rmse_rad if t.measures.stable else math.inf for t in trials]


def tuned(model: Datasheet, seed: int) -> tuple[PidGains, float]:
    """Gains and filter with the least error on a model: the sum over the cases of each over the paper's gains'."""
    first = np.array(error(model, "reduced", model, PidGains(), LOOP.filter_s, seed))
    score = lambda x: float(
        np.sum(np.array(error(model, "reduced", model, PidGains(P=x[0], D=x[1]), x[2], seed)) / first)
    )
    best = min(product(P, D, FILTERS), key=score)
    return PidGains(P=best[0], D=best[1]), best[2]


def main() -> None:
    """Conceal, diagnose, tune twice, run on the truth, tell."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--servos", type=int, default=len(EFFECTS))
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    scores = []
    for k in range(arguments.servos):
        effect = list(EFFECTS)[k % len(EFFECTS)]
        truth = servo(np.random.default_rng([arguments.seed, k]), effect)
        measured = recordings(truth, 100 * k)
        found = diagnose(measured, read_datasheet("table1"))
        baseline = refitted(measured)
        named = [m["effect"] for m in found.document["missing"]]
        print(
            f"{k:2d} concealed {effect} ({', '.join(f'{key} {x:.3g}' for key, x in truth.effects[0][1].items())}),"
            f" named {', '.join(named) or found.document['verdict']}"
        )
        score = {}
        for label, model in (("baseline", baseline), ("diagnosed", found.model)):
            pid, filter_s = tuned(model, arguments.seed)
            score[label] = error(truth, "mujoco", model, pid, filter_s, arguments.seed + 1)
            print(
                f"     tuned on the {label:9} P {pid.P:g} D {pid.D:g} filter {1e3 * filter_s:g} ms:"
                f" {told(score[label])}"
            )
        score["untuned"] = error(truth, "mujoco", baseline, PidGains(), LOOP.filter_s, arguments.seed + 1)
        print(f"     not tuned, (38)'s gains on the baseline: {told(score['untuned'])}", flush=True)
        scores.append([score["baseline"], score["untuned"], score["diagnosed"]])
    for k, label in enumerate(("tuned on the baseline", "not tuned")):
        for case, column in zip(CASES, (np.array(scores)[:, k] / np.array(scores)[:, 2]).T, strict=True):
            print(
                f"{case:7} error {label}, over that tuned on the diagnosed: median {np.median(column):.2f},"
                f" {column.min():.2f} to {column.max():.2f}; the diagnosed is closer on {np.sum(column > 1)} of"
                f" {column.size}"
            )


def refitted(measured: list) -> Datasheet:
    """Table 1 refitted to the recordings without any effect, as the diagnosis starts from it."""
    from ers_mj.data.prepared import trace_of
    from ers_mj.estimation.baseline import baseline

    sheet = read_datasheet("table1")
    values = baseline([trace_of(r, sheet.parameters["J"]) for r in measured], sheet, True).fit.model.values
    return Datasheet(
        parameters=dict(sheet.parameters),
        lumped={key: float(values[key]) for key in ("a_1", "a_2", "b", "c_1", "c_2", "theta_0")},
        baseline={key: float(values[key]) for key in ("tau_e", "emf_share")},
        name="baseline",
    )


def told(errors: list[float]) -> str:
    """Errors in words."""
    return ", ".join(
        f"{case} {'given up' if math.isinf(x) else f'{math.degrees(x):.4f} deg'}"
        for case, x in zip(CASES, errors, strict=True)
    )


if __name__ == "__main__":
    main()
