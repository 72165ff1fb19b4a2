"""The paper's whole chain: `python analysis/whole_chain.py --method iga --seed 21`.

A plant (Table 1; the reduced model, then MuJoCo) is recorded under the package's multisine with 0.01 deg of noise.
What is known beforehand is Table 1 with every letter scaled at random within --off. The recording is identified by
--method on the same kind of plant; the finite-time law's k_2, k_3, l and gamma are searched on the identified model for
--settling-ms; that law, which knows nothing but the identified model, then runs the plant, beside the same law with
Table 1's letters and Eq. (40)'s gains, and beside what the knowledge from beforehand would have done. 10 kHz, +-24 V.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import replace

import numpy as np

from ers_mj.control.controllers import Gains, Servo
from ers_mj.control.gains import conditions, search
from ers_mj.control.metrics import settling_time
from ers_mj.control.references import named
from ers_mj.control.trial import Conditions, run_once, try_out
from ers_mj.data.recording import from_arrays
from ers_mj.errors import InputError
from ers_mj.identification.estimate import identify
from ers_mj.identification.finding import Settings
from ers_mj.plants.inputs import INPUTS
from ers_mj.servo.datasheet import Datasheet, read_datasheet
from ers_mj.servo.simulation import build_plant, simulate_recording

CASES = ("step", "square", "ramp", "chirp")
LETTERS = ("a_1", "a_2", "b", "c_1", "c_2")


def designed(model: Datasheet, settling: float, seed: int) -> Gains:
    """Gains for a wished settling time [s] of a 10 deg step on the model; Eq. (40)'s where none are found."""
    known, plant, asked = Servo.of(model), build_plant(model), Conditions()
    aim = named("step", asked.amplitude, asked.start, asked.rate_hz)

    def settle(gains):
        ran = run_once(plant, "ftrc", known, aim, replace(asked, gains=gains))
        return None if ran.lost else settling_time(ran)

    try:
        return search(settling, settle, Gains(), seed).gains
    except InputError as error:
        print(f"   no gains: {error}; Eq. (40)'s are taken")
        return Gains()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=21)
    parser.add_argument("--method", default="iga")
    parser.add_argument("--polish", action="store_true")
    parser.add_argument(
        "--off", type=float, default=1.6, help="largest factor between what is known beforehand and the truth"
    )
    parser.add_argument("--settling-ms", type=float, default=90.0)
    parser.add_argument("--plants", default="reduced,mujoco")
    parser.add_argument("--duration", type=float, default=3.0)
    parser.add_argument("--evaluations", type=int, help="default 10000 on the reduced plant, 600 in MuJoCo")
    arguments = parser.parse_args()
    true, random = read_datasheet("table1"), np.random.default_rng(arguments.seed)
    letters = {k: v for k, v in true.parameters.items() if k != "L"}
    guess = Datasheet(
        parameters={
            k: v if k in ("n", "theta_0") else v * arguments.off ** random.uniform(-1, 1) for k, v in letters.items()
        },
        name="beforehand",
    )
    t = np.arange(round(1000 * arguments.duration)) / 1e3
    for plant in arguments.plants.split(","):
        columns = simulate_recording(
            true, t, INPUTS["multisine"](t), plant=plant, noise=math.radians(0.01), seed=arguments.seed
        )
        recording = from_arrays(columns["t_s"], columns["u_V"], columns["theta_rad"])
        budget = arguments.evaluations or (10_000 if plant == "reduced" else 600)
        begin = time.process_time()
        found = identify(
            [recording],
            guess,
            Settings(
                arguments.method, plant, budget=budget, polish=arguments.polish, seed=arguments.seed, factors=(0.2, 5.0)
            ),
        )
        spent, model = time.process_time() - begin, found.model
        truth, told = true.to_lumped(), model.to_lumped()
        errors = {name: 100 * (told[name] / truth[name] - 1) for name in LETTERS}
        print(
            f"{plant} plant, {arguments.method}: fitness {found.fitness:.2g} rad^2 s, {found.evaluations} evaluations,"
            f" {spent:.0f} s of one processor; errors of Eq. (6)'s letters [%]: "
            + ", ".join(f"{name} {e:+.2f}" for name, e in errors.items())
        )
        gains = designed(model, 1e-3 * arguments.settling_ms, arguments.seed)
        m = conditions(gains)
        print(
            f"   gains from the identified model: k_2 = {gains.k_2:.3g}, k_3 = {gains.k_3:.3g}, m ="
            f" ({', '.join(f'{x:.3g}' for x in m)}){'' if min(m) > 0 else ': conditions fail'}"
        )
        rivals = {
            "identified, gains designed": (model, gains),
            "identified, gains of (40)": (model, Gains()),
            "Table 1, gains of (40)": (true, Gains()),
            "beforehand, gains of (40)": (guess, Gains()),
        }
        print(
            f"   {'ftrc knows':30}{'settles ms':>11}{'overshoot %':>13}{'rest deg':>10}"
            + "".join(f"{case + ' deg':>12}" for case in CASES)
        )
        for title, (design, chosen) in rivals.items():
            ran = {
                trial.case: trial.measures
                for trial in try_out(true, ["ftrc"], [plant], CASES, Conditions(gains=chosen), design=design)
            }
            step = ran["step"]
            settles = "never" if step.settling_time_s is None else f"{1e3 * step.settling_time_s:.1f}"
            print(
                f"   {title:30}{settles:>11}{step.overshoot_pct:13.2f}{math.degrees(step.steady_state_error_rad):10.4f}"
                + "".join(
                    f"{math.degrees(ran[case].rmse_rad):12.4f}" if ran[case].stable else f"{'lost':>12}"
                    for case in CASES
                ),
                flush=True,
            )


if __name__ == "__main__":
    main()
