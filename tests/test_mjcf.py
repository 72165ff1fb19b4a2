"""The hand-written models: their numbers are Table 1's, they load, and they ship."""

import tomllib
from pathlib import Path

import mujoco
import numpy as np
import pytest

from ers_mj.errors import InputError
from ers_mj.plants.mujoco.mjcf_folder import mjcf_folder
from ers_mj.plants.mujoco.plant import MechanicalPlant
from ers_mj.plants.reduced import lumped
from ers_mj.servo.datasheet import TABLE_1, read_datasheet

ROOT = Path(__file__).resolve().parents[1]
SHEET = read_datasheet("table1")


def hand_written(name):
    return mujoco.MjModel.from_xml_path(str(mjcf_folder() / name))


def built(inductance=True):
    values = SHEET.to_lumped() if inductance else SHEET.to_lumped() | {"tau_e": 0.0}
    return MechanicalPlant(lumped(values), parameters=SHEET.parameters).model


def inertia_at_the_rudder(model):
    """Kinetic energy of one rad/s at the rudder, doubled; one lever goes along."""
    data, n = mujoco.MjData(model), TABLE_1["n"]
    mujoco.mj_forward(model, data)
    thread = model.eq_data[model.equality("thread").id][1]
    for joint, speed in {"rocker": 1.0, "rotor": n, "nut": n * thread, "lever_up": 1.0}.items():
        data.qvel[model.joint(joint).dofadr[0]] = speed
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    return data.qvel @ mass @ data.qvel


@pytest.mark.parametrize("model", [hand_written("rudder_constant.xml"), built()], ids=["hand-written", "built"])
def test_the_numbers_are_those_of_table_1(model):
    p, angle, motor = TABLE_1, model.tendon("rudder_angle"), model.actuator("motor")
    K_t, K, R = motor.gear[0], motor.gainprm[1], motor.gainprm[0]
    assert inertia_at_the_rudder(model) == pytest.approx(p["J"], rel=1e-6)
    assert model.tendon_damping[angle.id] == pytest.approx(p["B"])
    assert model.tendon_frictionloss[angle.id] == pytest.approx(p["F_c"])
    assert model.tendon_stiffness[angle.id] == pytest.approx(p["k_s"])
    assert model.tendon_lengthspring[angle.id] == pytest.approx(p["theta_0"])
    assert [model.actuator(f"preload_{way}").biasprm[0] for way in ("up", "down")] == pytest.approx(
        [-p["T_LH"], p["T_LH"]]
    )
    assert model.eq_data[model.equality("ratio").id][1] == pytest.approx(1 / p["n"])
    assert K_t == pytest.approx(p["K_t"])
    assert K_t * K == pytest.approx(p["K_e"])
    assert R * K_t / p["K_e"] == pytest.approx(p["R"])


def test_the_inductance_is_table_1_s_where_it_is_on():
    on, off = built(), built(inductance=False)
    assert (on.na, off.na) == (1, 0)
    assert on.actuator("motor").dynprm[0] == pytest.approx(TABLE_1["L"] / TABLE_1["R"])


@pytest.mark.parametrize("name", ["scene.xml", "rudder_rod.xml", "rudder_constant.xml"])
def test_a_model_of_the_folder_runs_without_warning(name):
    model = hand_written(name)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(1)
    for _ in range(200):
        data.ctrl[0] = rng.uniform(-8, 8)
        mujoco.mj_step(model, data, 200)
    assert not data.warning.number.any()
    assert np.ptp(data.qpos) > 0


def test_the_constant_variant_of_the_folder_is_the_built_one():
    """The same voltages move both alike: the files carry the numbers that the builder writes."""
    theta = []
    for model in (hand_written("rudder_constant.xml"), built(inductance=False)):
        data, rng, track = mujoco.MjData(model), np.random.default_rng(2), []
        for _ in range(100):
            data.ctrl[0] = rng.uniform(-8, 8)
            mujoco.mj_step(model, data, 200)
            track.append(data.ten_length[model.tendon("rudder_angle").id])
        theta.append(track)
    assert np.degrees(np.max(np.abs(np.subtract(*theta)))) < 0.05


def test_the_rod_varies_the_ratio_as_derived():
    plant = MechanicalPlant(lumped(SHEET.to_lumped()), parameters=SHEET.parameters, linkage="rod")
    ratio = [plant.ratio(np.radians(deg)) for deg in (-30, 0, 30)]
    assert ratio == pytest.approx([18.8, 22.26, 19.8], abs=0.05)


def test_every_package_ships():
    """The list in pyproject.toml is written by hand, since one package lies elsewhere."""
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    there = {".".join(p.parent.relative_to(ROOT).parts) for p in (ROOT / "ers_mj").rglob("__init__.py")}
    assert set(listed) == there | {"ers_mj.mjcf"}


def test_what_no_plant_can_have_is_refused():
    c = lumped(SHEET.to_lumped())
    for options, word in (
        ({"gap": -0.1}, "gap"),
        ({"linkage": "belt", "parameters": SHEET.parameters}, "belt"),
        ({"linkage": "rod"}, "datasheet"),
        ({"parameters": {"J": 1.0}}, "n and K_t"),
        ({"timestep": 0.0}, "timestep"),
    ):
        with pytest.raises(InputError, match=word):
            MechanicalPlant(c, **options)
    with pytest.raises(InputError, match="b is 0"):
        MechanicalPlant(c._replace(b=0.0))
