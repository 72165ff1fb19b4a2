"""The door for Python: lazy, typed, documented; results that show and save themselves; models for other tools."""

import doctest
import importlib
import inspect
import subprocess
import sys

import control
import mujoco
import numpy as np
import pytest

import ers_mj as ers
from ers_mj.selection.budget import QUICK, SEARCH

RATE = 500.0
T = np.arange(1500) / RATE
DEAD = [("drive_dead_zone", {"d": 0.5})]


SCREW = {
    "lumped": {"a_2": 20.0, "b": 3.0},
    "baseline": {"tau_e": 0.0},
    "recording": {"output_unit": "m", "input_unit": "N m"},
}


def arrays(input: str = "multisine", seed: int = 0) -> dict:
    """What a user has after a run: arrays."""
    run = ers.simulate("table1", input, duration=2.0, rate_hz=RATE, effects=DEAD, noise=1.5e-4, seed=seed)
    return {"t": run.t, "u_V": run.u, "theta_rad": run.theta}


@pytest.fixture(scope="module")
def found():
    """A quick diagnosis of a drive that swallows 0.5 V."""
    told = []
    runs = [ers.from_arrays(**arrays(), name="a"), ers.from_arrays(**arrays("ramp", 1), name="b")]
    result = ers.diagnose(runs, "table1", quick=True, progress=lambda text, share: told.append(share))
    assert told and all(0 <= share <= 1 for share in told)
    return result


# -- the package ------------------------------------------------------------------------------------------------------


def test_importing_loads_nothing_and_compiles_nothing():
    code = (
        "import sys, ers_mj as ers; assert {*ers.__all__} <= {*dir(ers)}; "
        "print([m for m in ('numpy', 'scipy', 'numba', 'mujoco', 'pyarrow') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]" and done.stderr == ""


def test_every_name_is_there_and_typed():
    lines = [line.split(" as ") for line in inspect.getsource(ers).splitlines() if line.startswith("    from ")]
    assert sorted(ers.__all__) == sorted(typed for _, typed in lines)
    assert all(getattr(ers, name).__name__ == name for name in ers.__all__)


def test_what_is_not_there_is_said():
    with pytest.raises(AttributeError, match="has no attribute 'diagnoze'; it has read, from_arrays, diagnose"):
        ers.diagnoze  # noqa: B018


def members():
    for name in ers.__all__:
        thing = getattr(ers, name)
        yield name, thing
        if inspect.isclass(thing):
            for attribute, member in vars(thing).items():
                if not attribute.startswith("_") and (callable(member) or isinstance(member, property)):
                    yield f"{name}.{attribute}", member


@pytest.mark.parametrize(("name", "thing"), [*members()], ids=lambda x: x if isinstance(x, str) else "")
def test_what_is_public_is_documented_and_typed(name, thing):
    assert inspect.getdoc(thing)
    function = thing.fget if isinstance(thing, property) else thing
    if inspect.isfunction(function):
        signature = inspect.signature(function)
        assert signature.return_annotation is not signature.empty
        assert all(p.annotation is not p.empty for p in signature.parameters.values() if p.name != "self")


@pytest.mark.parametrize("home", sorted({getattr(ers, name).__module__ for name in ers.__all__}))
def test_examples_in_docstrings_run(home):
    assert doctest.testmod(importlib.import_module(home)).failed == 0


# -- from arrays to a loop --------------------------------------------------------------------------------------------

TEN_LINES = """
import control
import ers_mj as ers
run = ers.from_arrays(t=t, theta_rad=theta, u_V=u)
found = ers.diagnose([run, other], "table1", quick=True)
print(found.verdict, found.effects)
plant = found.model.to_control()
gain_margin, phase_margin, _, _ = control.margin(40 * plant)
print(f"margins: {gain_margin:.3g}, {phase_margin:.3g} deg")
model = found.model.to_mujoco().compile()
print(model.nu, "actuators")
"""


def test_ten_lines_from_arrays_to_margins_and_mujoco(found, monkeypatch, capsys):
    asked = []
    monkeypatch.setattr(ers, "diagnose", lambda *args, **options: asked.append((args, options)) or found)
    a = arrays()
    exec(
        TEN_LINES, {"t": a["t"], "theta": a["theta_rad"], "u": a["u_V"], "other": ers.from_arrays(**arrays("ramp", 1))}
    )
    out = capsys.readouterr().out
    assert "missing_physics ('drive_dead_zone',)" in out and "margins" in out and "actuators" in out
    assert asked[0][1] == {"quick": True} and asked[0][0][0][0].sha256 == ers.from_arrays(**a).sha256


def test_a_quick_look_names_what_it_leaves_out(found):
    document = found.to_dict()
    assert found.effects == ("drive_dead_zone",)
    told = found.model.datasheet
    assert told.verdict == found.verdict and {"b", "drive_dead_zone.d"} <= set(told.intervals)
    assert [part["part"] for part in document["left_out"]] == [part for part, _ in QUICK.left_out()]
    shown = found._repr_html_()
    assert shown.startswith("<iframe") and "svg" in shown and SEARCH.left_out() == ()
    assert all(sentence in shown for sentence in found.left_out)
    assert document["fit"]["mujoco_heldout_rmse_after_rad"] is None and document["next_recording"]["excitation"] is None


def test_a_diagnosis_shows_saves_and_hands_on_its_model(found, tmp_path):
    assert "missing_physics: drive_dead_zone" in repr(found) and found.sentence in repr(found)
    files = found.save(tmp_path / "res")
    assert sorted(file.name for file in files) == ["diagnosis.json", "model.toml", "plant.xml", "report.html"]
    assert "Left out: " in (tmp_path / "res/report.html").read_text()
    with pytest.raises(ers.InputError, match="holds files already"):
        found.save(tmp_path / "res")
    found.save(tmp_path / "res", force=True)
    assert ers.load_model(tmp_path / "res/model.toml") == found.model
    left = found.model.residual(ers.from_arrays(**arrays()))
    assert np.sqrt(np.nanmean(left**2)) < 3e-4


def test_a_table_needs_pandas_and_says_so(found, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ers.MissingPackage, match="pip install pandas"):
        found.to_frame()


def test_a_table_is_a_data_frame(found):
    pytest.importorskip("pandas")
    frame = found.to_frame()
    assert frame[frame.owner == "drive_dead_zone"].value.iloc[0] == pytest.approx(0.5, abs=0.02)
    again = ers.from_arrays(ers.simulate(input="steps", duration=2.0).to_frame())
    assert again.t.size == 2000


# -- recordings -------------------------------------------------------------------------------------------------------


def test_arrays_and_a_file_are_the_same_recording(tmp_path):
    run = ers.simulate(input="chirp", duration=2.0, rate_hz=RATE)
    read, given = ers.read(run.save(tmp_path / "run.csv")), ers.from_arrays(t=run.t, theta_rad=run.theta, u_V=run.u)
    for field in ("t", "u", "y", "valid"):
        np.testing.assert_array_equal(getattr(read, field), getattr(given, field))
    table = {"Time": run.t, "Angle": np.degrees(run.theta), "u_V": run.u}
    mapped = ers.from_arrays(table, map={"t_s": "Time", "theta_deg": "Angle"})
    np.testing.assert_allclose(mapped.y, run.theta, rtol=1e-12)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, "there is no time"),
        ({"t": T, "theta_rad": T}, "there is no input"),
        ({"t": T, "theta_rad": T[:-1], "u_V": T}, "columns of one length"),
        ({"t": T, "theta_rad": np.zeros((1500, 2)), "u_V": T}, "shape"),
        ({"t": T, "t_s": T, "theta_rad": T, "u_V": T}, "given twice"),
        ({"t": T, "theta_rad": ["x"] * 1500, "u_V": T}, "a number was expected"),
    ],
)
def test_arrays_that_are_no_recording_are_refused(given, words):
    with pytest.raises(ers.InputError, match=words):
        ers.from_arrays(**given)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: ers.diagnose([]), "no recording was given"),
        (lambda: ers.diagnose([3]), "a path or a recording was expected"),
        (lambda: ers.diagnose("missing.csv"), "there is no such file"),
        (lambda: ers.from_arrays(3), "a data frame or a mapping was expected"),
        (lambda: ers.load_model({"parameters": {"JJ": 1.0}}), "there is no key 'JJ'; did you mean J"),
        (lambda: ers.load_model("table1", output_unit="deg"), "there is no output unit 'deg'; there are rad, m, V"),
        (lambda: ers.load_model(ers.Datasheet(parameters={"JJ": 1.0})), "there is no key 'JJ'"),
        (lambda: ers.load_model(ers.Datasheet(lumped={"a_2": -1.0, "b": 1.0})), "negative a_2"),
        (lambda: ers.load_model(SCREW, output_unit="rad"), "its output unit is m, but rad was given"),
        (lambda: ers.diagnose(ers.from_arrays(**arrays()), SCREW), "its output is in rad and that of datasheet in m"),
        (lambda: ers.identify(ers.from_arrays(**arrays()), SCREW), "its output is in rad and that of datasheet in m"),
        (lambda: ers.load_model(3), "a path, a mapping, a datasheet or a model was expected"),
        (lambda: ers.simulate(input="stepz"), "no input of that name"),
        (lambda: ers.simulate(plant="real"), "there is no plant 'real'; there are reduced, mujoco"),
        (lambda: ers.simulate(input=(T, T[:3])), "was expected of both"),
        (lambda: ers.validate(linkage="rope"), "there is no linkage 'rope'"),
        (lambda: ers.identify([], "table1"), "no recording was given"),
        (lambda: ers.load_model("table1").losses("drake"), "there is no target 'drake'"),
        (lambda: ers.load_model("table1").joint_lines(bodies=1.0), "the bodies' inertia is 1"),
        (lambda: ers.load_model("table1").joint_lines(actuator="general"), "there is no actuator"),
        (lambda: ers.load_model({"lumped": {"b": 80.0}}).joint_lines(), "give inertia="),
        (lambda: ers.load_model("table1").reset(rate_hz=0.0), "sample rate"),
    ],
)
def test_what_cannot_be_is_one_sentence(call, words):
    with pytest.raises(ers.ErsError, match=words) as caught:
        call()
    assert isinstance(caught.value, ValueError) and "\n" not in str(caught.value)


def test_a_models_file_tells_its_units(tmp_path):
    model = ers.load_model(SCREW)
    assert (model.output_unit, model.input_unit, model.signals) == ("m", "N m", ("tau_cmd_Nm", "x_m"))
    assert ers.load_model(model.save(tmp_path)) == model
    exported = model.export(tmp_path / "out")
    assert "slide" in (tmp_path / "out" / "joint.xml").read_text() and exported.files


# -- models -----------------------------------------------------------------------------------------------------------

EFFECTS = {
    "none": [],
    "late": ["input_delay:T_d=0.0053"],
    "slow sensor": ["sensor_lag:T=0.003,T_d=0.0051"],
    "coarse sensor": ["sensor_quantisation:step=0.01"],
    "remembers": ["thermal_drift:rise=0.3,T_w=1"],
    "two bodies on a bristle": ["presliding:x_s=0.002,zeta=0.5", "backlash:gap=0.01"],
}


def model_with(effects) -> ers.Model:
    from ers_mj.servo.simulation import parse_effect

    sheet = ers.load_model("table1").datasheet
    return ers.Model(ers.Datasheet(parameters=sheet.parameters, effects=tuple(map(parse_effect, effects))))


def test_table1_and_a_model_of_it_are_one():
    assert ers.load_model("table1") == ers.Model("table1") == ers.Model(ers.load_model("table1"))
    assert ers.load_model("table1") != model_with(EFFECTS["late"])
    assert "servo" in ers.load_model("table1")._repr_html_()


@pytest.mark.parametrize("effects", EFFECTS.values(), ids=EFFECTS)
def test_stepping_is_simulating_and_python_control_sees_the_same(effects):
    model, t = model_with(effects), T[:500]
    u = 6.0 * np.sin(9.0 * t)  # from 0, so that a late command finds the same before
    simulated = model.simulate((t, u)).theta
    stepped = [model.reset(RATE), *(model.step(x) for x in u[:-1])]
    np.testing.assert_allclose(stepped, simulated, atol=1e-7)
    servo = model.to_nonlinear(RATE)
    seen = control.input_output_response(servo, t, u)
    np.testing.assert_allclose(seen.outputs, simulated, atol=1e-7)
    assert servo.input_labels == ["u_V"] and servo.output_labels == ["theta_rad"] and servo.dt == 1 / RATE
    x = np.zeros(servo.nstates)
    once, _ = servo.dynamics(0, x, [6.0]), servo.dynamics(0, x + 0.01, [-6.0])
    np.testing.assert_array_equal(servo.dynamics(0, x, [6.0]), once)  # called in any order


def test_the_slipping_plant_has_eq_6s_poles_units_and_dead_time():
    model = ers.load_model("table1")
    lumped, plant = model.to_dict()["lumped"], model.to_control()
    np.testing.assert_allclose(np.sort(plant.poles()), np.sort(np.roots([1, lumped["a_2"], lumped["a_1"]])), rtol=1e-9)
    assert plant.state_labels == ["theta_rad", "speed_rad_s"]
    assert abs(plant(0)) == pytest.approx(lumped["b"] / lumped["a_1"])
    assert ers.Model("table1", inductance=True).to_control().state_labels[-1] == "drive_rad_s2"
    late, w = model_with(EFFECTS["late"]), 2 * np.pi * 5.0
    turned = late.to_control()(1j * w) / plant(1j * w)
    assert turned == pytest.approx(np.exp(-1j * w * 0.0053), abs=1e-6)
    sampled = late.to_control(rate_hz=1000.0)
    assert sampled.dt == 1e-3 and sampled(np.exp(1j * w * 1e-3)) == pytest.approx(
        late.to_control()(1j * w) * np.exp(-0.5j * w * 1e-3), rel=1e-3
    )


def in_its_own_model(lines: ers.JointLines, bodies: float) -> mujoco.MjModel:
    """A model of one's own with the lines put on its joint."""
    joint, actuator = (part for part in lines.xml.splitlines() if part.startswith(("<joint", "<actuator")))
    joint = joint.replace("/>", ' axis="0 1 0"/>')
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><compiler angle="radian" autolimits="true"/><option timestep="{lines.timestep!r}"'
        f' integrator="implicitfast" gravity="0 0 0"/><worldbody><body>{joint}'
        f'<inertial pos="0 0 0" mass="1" diaginertia="{bodies} {bodies} {bodies}"/></body></worldbody>'
        f"{actuator}</mujoco>"
    )


@pytest.mark.parametrize(("actuator", "degrees"), [("motor", 0.2), ("dcmotor", 0.05)])
def test_a_joint_of_ones_own_follows_the_plant(actuator, degrees):
    parameters = {k: x for k, x in ers.load_model("table1").datasheet.parameters.items() if k != "T_LH"}
    limits = [("voltage_saturation", {"u_max": 5.0}), ("input_delay", {"T_d": 0.004})]
    model = ers.Model(ers.Datasheet(parameters=parameters, effects=tuple(limits)), inductance=True)
    lines = model.joint_lines("elbow", bodies=0.001, timestep=1e-4, actuator=actuator)
    assert "dampratio" not in lines.xml and repr(parameters["k_s"]) in lines.xml
    assert lines.actuator["delay"] == pytest.approx(0.00395) and lines.actuator["ctrlrange"] == (-5.0, 5.0)
    t = T[:750]
    u, own = 7.0 * np.sin(12.0 * t), in_its_own_model(lines, 0.001)
    data, theta = mujoco.MjData(own), []
    data.qpos[0] = parameters["theta_0"]
    for volts in u:
        theta.append(data.qpos[0])
        data.ctrl[0] = volts
        mujoco.mj_step(own, data, 20)
    off = np.degrees(np.array(theta) - model.simulate((t, u)).theta)
    assert np.sqrt(np.mean(off**2)) < degrees


def test_what_a_target_cannot_carry_is_said():
    model = model_with(["stribeck:dF_s=0.1,v_s=0.2", "drive_dead_zone:d=0.3", "backlash:gap=0.01"])
    told = {target: " | ".join(model.losses(target)) for target in ("control", "nonlinear", "mujoco", "joint")}
    assert "Coulomb friction" in told["control"] and "drive dead zone" in told["control"]
    assert told["nonlinear"] == "" and "stribeck" in told["mujoco"]
    assert all(word in told["joint"] for word in ("preload", "play or a shaft", "stribeck", "drive dead zone"))
    assert all(sentence in model.joint_lines().xml for sentence in model.losses("joint"))


def test_mujocos_plant_is_the_reduced_one():
    model = ers.load_model("table1")
    spec = model.to_mujoco()
    assert spec.key("home") is not None and spec.compile().nu > 0
    both = [model.simulate("steps", duration=1.0, plant=plant).theta for plant in ("reduced", "mujoco")]
    assert np.degrees(np.abs(both[0] - both[1]).max()) < 0.05


# -- the other jobs ---------------------------------------------------------------------------------------------------


def test_identify_and_validate_are_results_too(tmp_path):
    run = ers.simulate(input="multisine", duration=3.0, rate_hz=RATE, noise=1e-4).recording
    told = ers.identify(run, "table1", fix={"J": 0.0031}, jobs=1)
    assert told.parameters["k_s"] == pytest.approx(0.0877, rel=0.05) and told.model.input_unit == "V"
    assert "Identification by ls" in repr(told) and "svg" in told._repr_html_()
    assert [file.name for file in told.save(tmp_path / "told")] == ["identify.json", "report.html", "model.toml"]
    held = ers.validate(gap=0.0, maps=False, duration=0.3, jobs=1)
    assert {case["input"] for case in held.to_dict()["cases"]} == {"multisine", "chirp", "ramp", "steps", "square"}
    assert held.sentence in repr(held)
