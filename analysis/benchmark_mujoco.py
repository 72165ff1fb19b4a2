"""How close the MuJoCo plant is, and what it costs: `python analysis/benchmark_mujoco.py [SECTION...]`.

Sections: reduced play step hold warnings twins speed; all without argument (about four minutes on two cores). Angles
are RMS of theta in degrees on ten seconds at 1 kHz unless said otherwise.
"""

import os
import sys
import time
from pathlib import Path

import mujoco
import mujoco.rollout
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
import independent_two_mass

from ers_mj.effects import EFFECTS, Scales
from ers_mj.plants.bare_gap import MOTOR_SHARE
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.mujoco.bodies import LINKAGES
from ers_mj.plants.mujoco.mjcf_folder import mjcf_folder
from ers_mj.plants.mujoco.plant import MechanicalPlant, simulate_many
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.servo.datasheet import read_datasheet

T = np.arange(0.0, 10.0, 1e-3)
SHEET = read_datasheet("table1")
MODELS = {False: lumped(SHEET.to_lumped() | {"tau_e": 0.0}), True: lumped(SHEET.to_lumped())}
GAPS_DEG = (0.1, 0.5, 1.0)
SCALES = Scales(
    position=0.4,
    low=0.15,
    high=0.4,
    speed=4.0,
    acceleration=110.0,
    input=10.0,
    sample_time=1e-3,
    noise=1e-4,
    quantum=0.0,
    is_angle=True,
)


def rms_deg(x):
    return float(np.degrees(np.sqrt(np.mean(np.square(x)))))


def rudder(inductance=False, **options):
    return MechanicalPlant(MODELS[inductance], parameters=SHEET.parameters, **options)


def row(label, numbers):
    print(f"  {label:34s}" + "  ".join(f"{name} {x:.4f}" for name, x in numbers.items()), flush=True)


def reduced():
    """No play, constant ratio, against the event-exact reduced model."""
    for inductance, c in MODELS.items():
        errors = {
            name: rms_deg(rudder(inductance).simulate(T, f(T)).theta - ReducedModel(c).simulate(T, f(T)).theta)
            for name, f in INPUTS.items()
        }
        row(f"inductance {'on' if inductance else 'off'}", errors)


def play():
    """Play against two rigid masses."""
    for inductance in MODELS:
        for gap_deg in GAPS_DEG:
            gap, errors = np.radians(gap_deg), {}
            for name, f in INPUTS.items():
                truth = independent_two_mass.simulate(
                    SHEET.parameters, gap, MOTOR_SHARE, T, f(T), inductance=inductance
                )
                errors[name] = rms_deg(rudder(inductance, gap=gap).simulate(T, f(T)).theta - truth)
            row(f"+-{gap_deg} deg, inductance {'on' if inductance else 'off'}", errors)


def step():
    """Half the timestep."""
    for linkage in LINKAGES:
        for gap_deg in (0.0, *GAPS_DEG):
            options = {"linkage": linkage, "gap": np.radians(gap_deg)}
            moved = {
                name: rms_deg(
                    rudder(**options).simulate(T, f(T)).theta
                    - rudder(timestep=2.5e-5, **options).simulate(T, f(T)).theta
                )
                for name, f in INPUTS.items()
            }
            row(f"{linkage}, +-{gap_deg} deg", moved)


def hold():
    """Creep [deg] in 2 s under 0.9 F_c, half a second after the load came on, 0.1 rad off theta_0."""
    c, t = MODELS[False], np.arange(0.0, 2.5, 1e-3)
    u = np.full(t.size, (0.9 * c.c_2_plus + c.c_1 + 0.1 * c.a_1) / c.b)
    theta = rudder().simulate(t, u, start=(c.theta_0 + 0.1, 0.0)).theta
    print(f"  {np.degrees(np.ptp(theta[500:])):.2e}")


def warnings():
    """MuJoCo's warnings in 60 s of random voltage (+-24 V, a new one every 5 to 50 ms)."""
    shipped = {
        name: mujoco.MjModel.from_xml_path(str(mjcf_folder() / name))
        for name in ("scene.xml", "rudder_rod.xml", "rudder_constant.xml")
    }
    built = {
        f"built, {linkage}, +-{gap} deg, inductance {on}": rudder(on, linkage=linkage, gap=np.radians(gap)).model
        for linkage in LINKAGES
        for gap in (0.0, 0.5)
        for on in MODELS
    }
    for name, model in (shipped | built).items():
        data, rng = mujoco.MjData(model), np.random.default_rng(7)
        while data.time < 60.0:
            data.ctrl[model.actuator("motor").id] = rng.uniform(-24, 24)
            mujoco.mj_step(model, data, int(rng.integers(100, 1000)))
        theta = np.degrees(data.sensor("theta").data[0])
        print(f"  {name:44s} warnings {int(data.warning.number.sum())}, theta at the end {theta:.0f} deg", flush=True)


def twins():
    """Each effect at its first start: how far it moves theta, and how far law and twin differ."""
    t, c = T[:4000], MODELS[False]
    u = INPUTS["multisine"](t)
    without = ReducedModel(c).simulate(t, u).theta
    for effect in EFFECTS:
        for start in effect.starts(SCALES)[:1]:
            law = ReducedModel(c, [(effect.name, start)]).simulate(t, u).theta
            twin = MechanicalPlant(c, [(effect.name, start)], parameters=SHEET.parameters).simulate(t, u).theta
            row(effect.name, {"size": rms_deg(law - without), "difference": rms_deg(law - twin)})


def speed():
    """One core, and a batch on all of them against a bare mujoco.rollout of the same models; best of 3, alternating."""
    t, cores = T[:500], os.cpu_count()
    for linkage in LINKAGES:
        plant, start = rudder(linkage=linkage), time.perf_counter()
        plant.simulate(T, INPUTS["multisine"](T))
        print(f"  one run, {linkage}: {(time.perf_counter() - start) / (T[-1] / plant.timestep) * 1e6:.2f} us a step")
    plants = [rudder(gap=np.radians(0.5), timestep=5e-5) for _ in range(32)]
    u = np.array([a * INPUTS["multisine"](t) for a in np.linspace(0.5, 1.0, 32)])
    control = np.zeros((32, (t.size - 1) * 20, plants[0].model.nu))
    control[:, :, 0] = np.repeat(u[:, :-1], 20, axis=1)
    states = np.array([_start(plant) for plant in plants])
    ours, bare = [], []
    with mujoco.rollout.Rollout(nthread=cores) as pool:
        for _ in range(3):
            ours.append(_seconds(lambda: simulate_many(plants, t, u)))
            data = [mujoco.MjData(plants[0].model) for _ in range(cores)]
            bare.append(_seconds(lambda: pool.rollout([p.model for p in plants], data, states, control)))  # noqa: B023
    steps = 32 * (t.size - 1) * 20
    print(
        f"  32 plants on {cores} cores: {steps / min(ours) / 1e3:.0f} k steps/s, bare rollout"
        f" {steps / min(bare) / 1e3:.0f} k; ratio of times {min(ours) / min(bare):.3f}"
    )


def _start(plant):
    stepper = plant._stepper()
    stepper.reset(plant._start(None))
    state = np.empty(mujoco.mj_stateSize(plant.model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(plant.model, stepper.data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    return state


def _seconds(work):
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


if __name__ == "__main__":
    sections = {f.__name__: f for f in (reduced, play, step, hold, warnings, twins, speed)}
    if unknown := [name for name in sys.argv[1:] if name not in sections]:
        sys.exit(f"there is no section {unknown[0]!r}; there are {', '.join(sections)}")
    for name in sys.argv[1:] or sections:
        print(f"{name}: {sections[name].__doc__}")
        sections[name]()
