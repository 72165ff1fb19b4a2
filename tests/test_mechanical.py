"""The MuJoCo plant against the reduced model, against two rigid masses, and against itself."""

import pickle
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from ers_mj.errors import InputError
from ers_mj.plants.bare_gap import MOTOR_SHARE
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.mujoco.plant import MechanicalPlant, simulate_many
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.servo.datasheet import read_datasheet

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "analysis"))
SHEET = read_datasheet("table1")
T = np.arange(0.0, 1.1, 1e-3)
EQ_5 = lumped(SHEET.to_lumped() | {"tau_e": 0.0})
EQ_1 = lumped(SHEET.to_lumped())


def rms_deg(x):
    return float(np.degrees(np.sqrt(np.mean(np.square(x)))))


def rudder(c=EQ_5, **options):
    return MechanicalPlant(c, parameters=SHEET.parameters, **options)


@pytest.mark.parametrize("name", INPUTS)
@pytest.mark.parametrize(("c", "bar"), [(EQ_5, 0.01), (EQ_1, 0.02)], ids=["inductance off", "inductance on"])
def test_without_play_it_moves_as_the_reduced_model(c, bar, name):
    u = INPUTS[name](T)
    motion, truth = rudder(c).simulate(T, u), ReducedModel(c).simulate(T, u)
    assert rms_deg(motion.theta - truth.theta) < bar
    assert np.sqrt(np.mean((motion.drive - truth.drive) ** 2)) < 0.01 * np.ptp(truth.drive)
    assert rms_deg(motion.omega - truth.omega) < 0.02 * rms_deg(truth.omega)


@pytest.mark.parametrize("gap_deg", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("name", ["multisine", "square"])
def test_with_play_it_moves_as_two_rigid_masses(name, gap_deg):
    two_mass = pytest.importorskip("independent_two_mass", reason="analysis/ is not beside the tests")
    u, gap = INPUTS[name](T), np.radians(gap_deg)
    truth = two_mass.simulate(SHEET.parameters, gap, MOTOR_SHARE, T, u)
    assert rms_deg(rudder(gap=gap).simulate(T, u).theta - truth) < 0.02


@pytest.mark.parametrize("linkage", ["constant", "rod"])
@pytest.mark.parametrize("gap_deg", [0.0, 0.5])
def test_halving_the_step_moves_little(gap_deg, linkage):
    u = INPUTS["multisine"](T)
    theta = [rudder(gap=np.radians(gap_deg), linkage=linkage, timestep=h).simulate(T, u).theta for h in (5e-5, 2.5e-5)]
    assert rms_deg(theta[0] - theta[1]) < (0.02 if gap_deg else 0.01)


def test_a_held_rudder_does_not_creep():
    c = EQ_5
    u = np.full(T.size, (0.9 * c.c_2_plus + c.c_1 + c.a_1 * 0.1) / c.b)
    theta = rudder().simulate(T, u, start=(c.theta_0 + 0.1, 0.0)).theta
    assert np.degrees(np.ptp(theta[500:])) < 1e-3


ODD = {
    "no spring": {"a_1": 0.0, "c_1": 0.0, "a_2": 20.0, "c_2": 30.0},
    "preload without spring": {"a_1": 0.0, "c_1": 40.0, "a_2": 20.0, "c_2": 30.0, "emf_share": 0.5},
    "inductance without back-EMF": {"a_1": 30.0, "a_2": 20.0, "c_2": 30.0, "tau_e": 2e-3},
    "reversed": {"a_1": 30.0, "a_2": 20.0, "c_2": 30.0, "b": -80.0, "emf_share": 0.7, "tau_e": 2e-3, "theta_0": -1.0},
    "frictionless": {"a_1": 300.0, "a_2": 20.0},
}


@pytest.mark.parametrize("is_angle", [True, False], ids=["hinge", "slide"])
@pytest.mark.parametrize("values", ODD.values(), ids=ODD)
def test_a_lumped_plant_needs_no_datasheet(values, is_angle):
    c, u = lumped({"b": 80.0} | values), INPUTS["multisine"](T)
    truth = ReducedModel(c).simulate(T, u)
    motion = MechanicalPlant(c, is_angle=is_angle).simulate(T, u)
    assert rms_deg(motion.theta - truth.theta) < max(0.01, 1e-3 * rms_deg(truth.theta - truth.theta.mean()))


def test_start_load_and_open_circuit_are_those_of_the_reduced_model():
    u, c = INPUTS["multisine"](T), EQ_1
    extra = {"load": 40 * np.sin(9 * T), "enable": (T % 1.0) < 0.7}
    start = (c.theta_0 - 0.2, 3.0, 50.0)
    truth = ReducedModel(c).simulate(T, u, start, **extra).theta
    for plant in (rudder(c), MechanicalPlant(c)):
        assert rms_deg(plant.simulate(T, u, start, **extra).theta - truth) < 0.02


@pytest.mark.parametrize("gap", [0.0, 0.01])
@pytest.mark.parametrize("values", [{}, {"tau_e": 2e-3}])
def test_what_mujoco_steps_by_itself_is_what_it_steps_under_a_load_of_nothing(gap, values):
    """A load is handed over at every sample; without one MuJoCo goes on from one correction to the next."""
    plant, u = MechanicalPlant(lumped(SHEET.to_lumped() | values), gap=gap, timestep=5e-4), INPUTS["multisine"](T)
    seen = {"y": np.where(T < 0.5, 0.3, np.nan), "gain": 0.1, "every": 8}
    for observed in ({}, seen):
        alone, under = plant.simulate(T, u, **observed), plant.simulate(T, u, load=np.zeros(T.size), **observed)
        for rows in ("theta", "omega", "theta_m", "drive"):
            assert np.allclose(getattr(alone, rows), getattr(under, rows), rtol=1e-9, atol=1e-9)


def test_samples_need_not_be_uniform():
    t = T + 3e-4 * np.sin(50 * T)
    u = INPUTS["steps"](T)
    assert rms_deg(rudder().simulate(t, u).theta - ReducedModel(EQ_5).simulate(t, u).theta) < 0.01


def test_a_rod_starts_at_rest_from_any_angle():
    plant = rudder(linkage="rod")
    for theta in (EQ_5.theta_0, -0.3, 0.6):
        held = plant.simulate(
            T[:50], np.full(50, (EQ_5.c_1 * np.sign(theta - EQ_5.theta_0)) / EQ_5.b), start=(theta, 0.0)
        )
        assert held.theta[0] == pytest.approx(theta)
        assert np.degrees(np.ptp(held.theta)) < 1e-3


def test_many_at_once_are_the_same_as_one_by_one():
    u = np.array([INPUTS[name](T[:500]) for name in ("multisine", "chirp", "steps")])
    plants = [rudder(EQ_1), rudder(EQ_5), rudder(EQ_1._replace(c_2_plus=90.0, c_2_minus=90.0))]
    for motion, plant, ui in zip(simulate_many(plants, T[:500], u), plants, u):
        alone = plant.simulate(T[:500], ui)
        assert np.array_equal(motion.theta, alone.theta) and np.allclose(motion.drive, alone.drive)
    with pytest.raises(InputError, match="equal numbers"):
        simulate_many(plants, T[:500], u[:2])


def test_the_exported_model_is_the_plant():
    effects = [
        ("voltage_saturation", np.array([4.5, np.inf])),
        ("bias_torque", np.array([8.0])),
        ("gravity_imbalance", np.array([15.0, 5.0])),
        ("input_delay", np.array([3e-3])),
    ]
    u, plant = INPUTS["chirp"](T[:1000]), rudder(EQ_1, effects=effects, linkage="rod", gap=0.01)
    model = mujoco.MjModel.from_xml_string(plant.xml())
    data, theta = mujoco.MjData(model), []
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    for voltage in u:
        theta.append(data.qpos[model.joint("rocker").qposadr[0]] + data.qpos[model.joint("gap").qposadr[0]])
        data.ctrl[model.actuator("motor").id] = voltage
        mujoco.mj_step(model, data, 20)
    assert rms_deg(np.array(theta) - plant.simulate(T[:1000], u).theta) < 0.01


def test_a_step_at_the_first_sample_arrives_after_the_dead_time_as_in_the_reduced_model():
    late, u = [("input_delay", np.array([0.0335]))], np.full(200, 8.0)
    theta = rudder(EQ_1, effects=late).simulate(T[:200], u).theta
    assert np.ptp(theta[:34]) < 1e-4 < np.ptp(theta)
    assert rms_deg(theta - ReducedModel(EQ_1, late).simulate(T[:200], u).theta) < 0.05


def test_the_export_says_what_it_does_not_carry():
    plant = rudder(
        effects=[("load_dependent_friction", np.array([0.05, *4 * [np.inf]])), ("drive_dead_zone", np.array([0.2]))]
    )
    assert plant.stepped == ("load_dependent_friction",)
    assert "drive_dead_zone, load_dependent_friction" in plant.xml().splitlines()[0]


def test_a_plant_survives_the_way_to_another_process():
    u, plant = (
        INPUTS["chirp"](T[:200]),
        rudder(gap=0.01, effects=[("load_dependent_friction", np.array([0.05, *4 * [np.inf]]))]),
    )
    again = pickle.loads(pickle.dumps(plant))
    assert np.array_equal(again.simulate(T[:200], u).theta, plant.simulate(T[:200], u).theta)


def test_a_motion_that_runs_away_is_not_a_number():
    softening = [("hinge_moment_cubic", np.array([-400.0, np.inf]))]
    theta = rudder(effects=softening).simulate(T, INPUTS["steps"](T) + 4.0).theta
    assert np.isnan(theta[-1]) and np.isfinite(theta[0])


@pytest.mark.parametrize("b", [1e160, 1e-170, 0.0])
def test_a_drive_beyond_all_sizes_is_refused(b):
    """b^2 is beyond the numbers that there are, above or below."""
    with pytest.raises(InputError, match="cannot be simulated"):
        rudder(lumped(SHEET.to_lumped() | {"b": b}))
