"""Five parameters in MuJoCo, beside `mujoco.sysid`: `python analysis/against_mujoco_sysid.py --seed 31 --runs 3` (needs
`pip install "mujoco[sysid]"`).

One joint in MuJoCo with Table 1's a_1, a_2, b, c_1, c_2 (theta_0 known), step 5e-4 s, recorded for 5 s at 2 kHz under
the package's multisine with 0.01 deg of noise. Both are given the same model, record, bounds [0.2, 3] x truth and start
(drawn within [0.5, 1.8] x truth); one thread each. Then a record of the plant with a play of +-0.5 deg, which neither
knows of: what either says.
"""

from __future__ import annotations

import argparse
import logging
import math
import time

import numpy as np

from ers_mj.data.recording import from_arrays
from ers_mj.identification.estimate import identify
from ers_mj.identification.finding import Settings
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.mujoco.plant import MechanicalPlant
from ers_mj.plants.reduced import lumped
from ers_mj.servo.datasheet import Datasheet, read_datasheet

NAMES, STEP = ("a_1", "a_2", "b", "c_1", "c_2"), 5e-4


def plant(values: dict[str, float], gap: float = 0.0) -> MechanicalPlant:
    return MechanicalPlant(lumped(values), gap=gap, timestep=STEP)


def theirs(t, u, y, begin, theta_0):
    """(values, seconds, 95 % half-widths) by mujoco.sysid, whose rollouts show a sensor as it was one step before."""
    from mujoco import sysid

    def build(params, spec):
        return plant({**{name: float(params[name].value[0]) for name in NAMES}, "theta_0": theta_0}).model

    params = sysid.ParameterDict()
    for name in NAMES:
        params.add(
            sysid.Parameter(
                name,
                nominal=begin["truth"][name],
                min_value=0.2 * begin["truth"][name],
                max_value=3.0 * begin["truth"][name],
            )
        )
        params[name].value[:] = begin["start"][name]
    built = plant({**begin["start"], "theta_0": theta_0})
    stepper = built._stepper()
    stepper.reset(built._start(None))
    state = sysid.create_initial_state(built.model, stepper.data.qpos, stepper.data.qvel, stepper.data.act)
    control = np.zeros((t.size, built.model.nu))
    control[:, built.model.actuator("motor").id] = u
    measured = sysid.TimeSeries(t + STEP, y[:, None], {"theta": (sysid.SignalType.MjSensor, np.array([0]))})
    sequences = sysid.ModelSequences(
        "servo",
        built._skeleton.spec,
        "record",
        state,
        sysid.TimeSeries(t, control),
        measured,
        allow_missing_sensors=True,
    )
    residual = sysid.build_residual_fn(models_sequences=[sequences], build_model=build, n_threads=1)
    clock = time.process_time()
    found, result = sysid.optimize(params, residual, optimizer="mujoco", verbose=False)
    spent = time.process_time() - clock
    _, half = sysid.calculate_intervals(residual(found.as_vector(), found)[0], result.jac)
    return {name: float(found[name].value[0]) for name in NAMES}, spent, dict(zip(NAMES, np.ravel(half)))


def ours(t, u, y, begin, theta_0):
    """(values, seconds, what it says)."""
    settings = Settings(
        plant="mujoco",
        fixed={"theta_0": theta_0},
        bounds={name: (0.2 * x, 3.0 * x) for name, x in begin["truth"].items()},
        timestep=STEP,
    )
    recording, sheet = from_arrays(t, u, y), Datasheet(lumped={**begin["start"], "theta_0": theta_0})
    clock = time.process_time()
    found = identify([recording], sheet, settings)
    return {row.name: row.value for row in found.rows if row.name in NAMES}, time.process_time() - clock, found.sentence


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=31)
    parser.add_argument("--runs", type=int, default=3)
    arguments = parser.parse_args()
    logging.disable(logging.WARNING)
    known = read_datasheet("table1").to_lumped()
    true, theta_0, random = (
        {name: known[name] for name in NAMES},
        known["theta_0"],
        np.random.default_rng(arguments.seed),
    )
    t = STEP * np.arange(round(5.0 / STEP))
    u = INPUTS["multisine"](t)
    for k in range(arguments.runs + 1):
        gap = math.radians(0.5) if k == arguments.runs else 0.0
        y = plant({**true, "theta_0": theta_0}, gap).simulate(t, u).theta + math.radians(0.01) * random.standard_normal(
            t.size
        )
        begin = {"truth": true, "start": {name: x * random.uniform(0.5, 1.8) for name, x in true.items()}}
        print(
            f"record {k + 1}{', with a play of +-0.5 deg' if gap else ''}: errors in per cent, seconds of one processor"
        )
        for title, solve in (("mujoco.sysid", theirs), ("ers identify", ours)):
            values, spent, said = solve(t, u, y, begin, theta_0)
            errors = "  ".join(
                (
                    f"{name} {100 * (values[name] / true[name] - 1):+8.3f}"
                    if values[name] is not None
                    else f"{name} not told"
                )
                for name in NAMES
            )
            words = (
                said
                if isinstance(said, str)
                else "95 % half-widths [%] "
                + ", ".join(f"{name} {100 * said[name] / true[name]:.2g}" for name in NAMES)
            )
            print(f"   {title:13} {errors}   {spent:6.2f} s\n      {words}", flush=True)


if __name__ == "__main__":
    main()
