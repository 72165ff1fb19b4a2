"""Models that leave: what each target does is what the model does, or the model without what LOSSES.md names."""

import importlib.util
import json
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path

import control
import mujoco
import numpy as np
import pytest

import ers_mj as ers
from ers_mj import cli
from ers_mj.effects import BY_NAME, EFFECTS
from ers_mj.export import trying
from ers_mj.export.mujoco_joint import OwnJoint
from ers_mj.export.servo import servo_of
from ers_mj.export.targets import TARGETS
from ers_mj.export.translation import translated
from ers_mj.export.trying import apart, excitation, response
from ers_mj.servo.datasheet import Datasheet, read_datasheet
from ers_mj.servo.model_file import write_model

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "analysis"))
exported = pytest.importorskip("exported", reason="analysis/ is not beside the tests")
MOST = 0.01  # of the response's RMS
COMPILER = shutil.which("cc")
# all of them: analysis/exported.py
RUN = (
    "stribeck", "limit and delay", "stops, dead zone", "loop, gravity", "loop, late damping", "loop, stops",
    "loop, slide", "loop, hard shaft",
)  # fmt: skip


@pytest.fixture(autouse=True)
def brief(monkeypatch, request):
    """Less of the excitation: through rest and friction both ways, and steps to one side; all of it where stops are
    met, which that part hardly does.
    """
    if "stops" not in request.node.name:
        monkeypatch.setattr(trying, "DURATION", 1.3)


def module(path):
    """An exported Python file, loaded."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


@pytest.fixture(scope="module")
def limited(tmp_path_factory):
    """All files of one model, with what they leave out."""
    folder = tmp_path_factory.mktemp("limited")
    model, _ = exported.of(exported.MODELS["limit and delay"])
    return folder, model, model.export(folder, list(TARGETS), force=True)


# -- the same response -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", RUN)
@pytest.mark.parametrize("target", ["control", "mujoco", "lookup", "randomisation"])
def test_a_target_does_what_the_model_does(target, name):
    assert exported.off_by(target, *exported.of(exported.MODELS[name])) < MOST


@pytest.mark.parametrize("name", RUN)
def test_the_fmu_does_what_the_model_does(name):
    pytest.importorskip("fmpy", reason="fmpy is not installed")
    if COMPILER is None:
        pytest.skip("no C compiler (cc) is here: the FMU's source cannot be run")
    assert exported.off_by("fmu", *exported.of(exported.MODELS[name])) < MOST


def library():
    """Every effect that a simulation shows, at a visible size."""
    from ers_mj.effects.quantities import Scales

    scales = Scales(
        position=0.5, low=-0.5, high=0.5, speed=5.0, acceleration=12.0, input=3.0, sample_time=1e-3, noise=1e-4,
        quantum=0.0, is_angle=True, drive=100.0,
    )  # fmt: skip
    for effect in EFFECTS:
        starts = effect.starts(scales)
        if starts and not effect.only_in_loop and not effect.local:
            yield pytest.param(effect.name, starts[0], id=effect.name)


@pytest.mark.parametrize(("name", "values"), [*library()])
def test_every_effect_of_the_library_leaves_as_it_is(name, values):
    document = exported.arm(100.0, 0.5)
    given = {p.name: float(x) for p, x in zip(BY_NAME[name].parameters, values, strict=True) if np.isfinite(x)}
    document["effect"] = exported.listed({name: given})
    model, servo = exported.of(document)
    t, u = excitation(servo)
    assert apart(response(servo, servo.portable, t, u), model.simulate((t, u)).theta) < MOST


# -- each target -------------------------------------------------------------------------------------------------------


def test_python_controls_system_is_the_module_alone(limited):
    folder, model, _ = limited
    assert "ers_mj" not in (folder / "model_control.py").read_text()
    made = module(folder / "model_control.py")
    t = np.arange(300) / 1000.0
    u = 6.0 * np.sin(2.0 * np.pi * 3.0 * t)
    servo = made.plant(rate_hz=1000.0)
    assert (servo.input_labels, servo.output_labels) == (["u_V"], ["theta_rad"])
    held = control.input_output_response(servo, t, u).outputs
    np.testing.assert_allclose(held, made.run(t, u), atol=1e-9)
    assert apart(held, model.simulate((t, u)).theta) < MOST
    np.testing.assert_allclose(np.sort(control.poles(made.linear())), np.sort(control.poles(model.to_control())))


def test_a_late_drives_damping_is_written_in_general_terms():
    _, servo = exported.of(exported.hobby({"D": -1.8}))
    joint = OwnJoint(servo)
    t, u = np.arange(0.0, 1.0, 5e-4), np.full(2000, 0.4)
    assert "<general" in joint.xml and apart(joint.follow(t, u), response(servo, joint.carried, t, u)) < MOST


@pytest.mark.parametrize("name", ["loop", "loop, late damping"])
def test_a_loops_linear_system_follows_its_reference(name):
    _, servo = exported.of(exported.MODELS[name])
    namespace: dict = {}
    exec(TARGETS["control"].write(servo).content.decode(), namespace)
    linear = namespace["linear"]()
    assert linear.input_labels == ["theta_ref_rad"] and control.dcgain(linear) == pytest.approx(1.0)
    assert np.all(control.poles(linear).real < 0.0)


def test_the_fmu_is_source_that_compiles_without_a_word(limited, tmp_path):
    pytest.importorskip("fmpy", reason="fmpy is not installed")
    from fmpy.validation import validate_fmu

    folder, _, _ = limited
    file = folder / "model.fmu"
    assert validate_fmu(str(file)) == []
    with zipfile.ZipFile(file) as archive:
        source = archive.read("sources/model.c")
        described = ET.fromstring(archive.read("modelDescription.xml"))
    assert described.get("fmiVersion") == "2.0" and b"Python.h" not in source
    names = [v.get("name") for v in described.iter("ScalarVariable")]
    assert [source_file.get("name") for source_file in described.iter("File")] == ["model.c"]
    assert names[:4] == ["u_V", "theta_rad", "speed", "start"] and "c_2_plus" in names
    if COMPILER is None:
        pytest.skip("no C compiler (cc) is here: the source cannot be compiled")
    (tmp_path / "model.c").write_bytes(source)
    flags = ["-std=c99", "-Wall", "-Wextra", "-Wno-unused-parameter", "-Werror", "-fsyntax-only"]
    done = subprocess.run([COMPILER, *flags, "model.c"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_law_that_is_not_put_into_c_is_refused_in_a_sentence():
    assert "a - b * floor(a / b)" in translated("def f(a, b):\n    return a % b\n")  # Python's sign, not fmod's
    with pytest.raises(ers.InputError, match=r"for k in at.*--to control"):
        translated("def f(at):\n    for k in at:\n        g(k)\n")


def test_an_fmus_numbers_may_be_changed_and_its_state_kept(limited):
    fmpy = pytest.importorskip("fmpy", reason="fmpy is not installed")
    if COMPILER is None:
        pytest.skip("no C compiler (cc) is here: the FMU's source cannot be run")
    file = str(limited[0] / "model.fmu")
    given = np.array([(0.0, 6.0), (0.2, 6.0)], dtype=[("time", float), ("u_V", float)])
    options = {"input": given, "output": ["theta_rad"], "stop_time": 0.2, "output_interval": 1e-3}
    plain = fmpy.simulate_fmu(file, **options)["theta_rad"]
    stiff = fmpy.simulate_fmu(file, start_values={"c_2_plus": 1e4, "start": 1.0}, **options)["theta_rad"]
    assert np.ptp(plain) > 0.05 and np.ptp(stiff) == 0.0 and stiff[0] == 1.0


def test_joint_xml_loads_as_it_is_and_says_how_far_it_was_off(limited):
    folder, _, found = limited
    own = mujoco.MjModel.from_xml_path(str(folder / "joint.xml"))
    assert own.nu == 1 and own.actuator_delay[0] == pytest.approx(0.0063)
    told = " | ".join(found.losses["mujoco"])
    assert "preload" in told and "measured: at a timestep of 0.5 ms MuJoCo" in told
    text = (folder / "joint.xml").read_text()
    assert 'compiler angle="radian"' in text and "dampratio" not in text and "<general" not in text


def test_friction_that_creeps_is_mujocos_own():
    _, servo = exported.of(exported.MODELS["loop, gravity"])
    joint = ET.fromstring(OwnJoint(servo).xml.split("-->", 1)[1]).find(".//joint")
    assert joint.get("solimpfriction").split()[0] == "0.9"
    assert "a rest without creep" not in " ".join(OwnJoint(servo).losses)


@pytest.mark.parametrize("name", ["mjlab", "newton"])
def test_actuator_files_are_python_of_their_tool_alone(limited, name):
    text = (limited[0] / TARGETS[name].file).read_text()
    compile(text, TARGETS[name].file, "exec")
    assert "import ers_mj" not in text and "DELAY = 0.0063" in text
    assert "saturation_effort" in text  # the drive's limit was found, and the back-EMF is known


def test_an_envelope_is_written_only_where_the_data_show_one():
    _, servo = exported.of(exported.MODELS["plain"])
    assert all("ENVELOPE = None" in TARGETS[name].write(servo).content.decode() for name in ("mjlab", "newton"))


INTERVALS = {"a_2": (50.0, 65.0), "b": (78.0, 84.0), "stribeck.dF_s": (0.1, 0.15)}


def test_randomisation_draws_within_the_intervals():
    sheet = Datasheet(
        parameters=ers.load_model("table1").datasheet.parameters,
        lumped={"a_2": 56.4, "b": 81.1},
        baseline={"emf_share": 0.9},
        effects=(("stribeck", {"dF_s": 0.12, "v_s": 0.3}),),
        verdict="missing_physics",
        intervals=INTERVALS,
    )
    made = TARGETS["randomisation"].write(servo_of(sheet, "rad", "V", ("u_V", "theta_rad")))
    told = json.loads(made.content)
    assert {name: (row["low"], row["high"]) for name, row in told["ranges"].items()} == INTERVALS
    drawn = np.array([[member["parameters"][name] for name in INTERVALS] for member in told["ensemble"]])
    low, high = np.array([*INTERVALS.values()]).T
    assert ((drawn >= low) & (drawn <= high)).all() and (np.ptp(drawn, axis=0) > 0.5 * (high - low)).all()
    assert drawn[0].tolist() == [56.4, 81.1, 0.12]
    dampings = [member["joint"]["damping"] for member in told["ensemble"]]
    np.testing.assert_allclose(dampings, 0.0031 * drawn[:, 0])
    assert any("drawn by itself" in sentence for sentence in made.losses)


def test_without_intervals_nothing_is_drawn():
    made = TARGETS["randomisation"].write(exported.of(exported.MODELS["plain"])[1])
    told = json.loads(made.content)
    assert told["ranges"] == {} and len(told["ensemble"]) == 1 and "no intervals" in made.losses[0]


# -- what is lost ------------------------------------------------------------------------------------------------------

ROWS = [  # of what other tools were measured to do, and the model that meets it
    ("limit and delay", "mujoco", "half a timestep less"),
    ("limit and delay", "mujoco", "mj_resetData"),
    ("plain", "mujoco", "kv brakes more"),
    ("plain", "mujoco", "frictionloss creeps"),
    ("stops, dead zone", "mujoco", "dof_invweight0"),
    ("plain", "control", "steps over short pulses"),
    ("plain", "fmu", "choose the step as your samples are"),
    ("limit and delay", "newton", "grows from 0"),
    ("limit and delay", "newton", "line brakes, also when asked to drive"),
    ("plain", "newton", "Featherstone has no friction"),
    ("limit and delay", "mjlab", "also when asked to drive"),
    ("plain", "mjlab", "`None` in their place"),
    ("plain", "mjlab", "MuJoCo 3.11"),
    ("gravity", "mujoco", "the inertia is not known"),
]


@pytest.mark.parametrize(("model", "target", "words"), ROWS)
def test_what_a_target_does_otherwise_is_said(model, target, words):
    assert words in " | ".join(TARGETS[target].write(exported.of(exported.MODELS[model])[1]).losses)


def test_losses_names_what_is_off_and_warns_of_an_unexplained_model(tmp_path):
    sheet = exported.of(exported.MODELS["stribeck"])[0].datasheet
    told = Datasheet(sheet.parameters, effects=sheet.effects, verdict="unexplained", name="model.toml")
    ers.Model(told).export(tmp_path, ["lookup", "newton"])
    page = (tmp_path / "LOSSES.md").read_text()
    assert "ended as *unexplained*" in page and "## newton: `newton_actuator.py`" in page and "- stribeck" in page


# -- the model's file --------------------------------------------------------------------------------------------------


def test_verdict_and_intervals_travel_in_the_models_file(tmp_path):
    sheet = Datasheet(lumped={"b": 2.0, "a_2": 3.0}, verdict="unexplained", intervals={"a_2": (2.5, 3.5)})
    write_model(tmp_path / "model.toml", sheet)
    assert read_datasheet(tmp_path / "model.toml") == sheet


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ('verdict = "good"', "one of consistent, parameters_only"),
        ("ci95 = 3", "a table was expected"),
        ("[diagnosis.ci95]\nb = [2.0]", "no pair of numbers"),
        ("[diagnosis.ci95]\nb = [3.0, 2.0]", "ends at 2, below its beginning"),
    ],
)
def test_a_diagnosis_in_a_file_that_cannot_be_meant_is_refused(tmp_path, table, words):
    (tmp_path / "model.toml").write_text(f"[lumped]\nb = 2.0\n[baseline]\n[diagnosis]\n{table}\n")
    with pytest.raises(ers.InputError, match=words):
        read_datasheet(tmp_path / "model.toml")


# -- the command -------------------------------------------------------------------------------------------------------


def test_the_command_writes_all_or_nothing(tmp_path, capsys):
    out = tmp_path / "out"
    assert cli.main(["export", "table1", "--to", "lookup,control", "--out", str(out)]) == 0
    assert sorted(file.name for file in out.iterdir()) == ["LOSSES.md", "lookup.csv", "model_control.py"]
    assert "LOSSES.md" in capsys.readouterr().out
    assert cli.main(["export", "table1", "--to", "lookup", "--out", str(out)]) == 2
    assert "give --force" in capsys.readouterr().err
    assert cli.main(["export", "table1", "--to", "lookup", "--out", str(out), "--force", "--json"]) == 0
    assert [*json.loads(capsys.readouterr().out)["losses"]] == ["lookup"]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["table1", "--to", "simulink"], "there are mujoco, control, fmu, mjlab, newton, randomisation, lookup"),
        (["table1", "--to", "fmu,fmu"], "gives a target twice"),
        (["nothing.toml", "--to", "fmu"], "there is no such file"),
        (["table1", "--to", "fmu", "--out", ""], "a folder was expected"),
    ],
)
def test_bad_input_is_one_sentence(given, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["export", *given]) == 2
    said = capsys.readouterr().err
    assert words in said and said.count("\n") == 1 and not [*tmp_path.iterdir()]


def test_the_command_and_the_package_have_the_same_targets():
    from ers_mj.commands import export

    assert tuple(TARGETS) == export.TARGETS
