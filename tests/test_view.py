"""The plant in pictures: every model that the package accepts is drawn, and what cannot be drawn is told."""

import io
import json
import sys

import mujoco
import numpy as np
import pytest
from PIL import Image

from ers_mj import cli
from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays, read_recording, write_recording
from ers_mj.diagnosis.evidence import Evidence, RecordView
from ers_mj.errors import InputError
from ers_mj.plants.mujoco.mjcf_folder import mjcf_folder
from ers_mj.report.diagnosis_report import report_page
from ers_mj.servo.datasheet import Datasheet, read_datasheet
from ers_mj.servo.model_file import write_model
from ers_mj.view.frames import frames_of
from ers_mj.view.looped import replayed
from ers_mj.view.model_file import read_plant, recorded_file
from ers_mj.view.rendering import Painter
from ers_mj.view.replay import moments_of, plant_of, posed, recorded, simulated

SHEET = read_datasheet("table1")
PLAY = Datasheet(parameters=SHEET.parameters, effects=(("backlash", {"gap": 0.02}),))
SMALL = "--width 96 --duration 0.15"
T = np.arange(300) * 1e-3


def drawing_fails() -> str:
    try:
        with Painter(mujoco.MjModel.from_xml_string("<mujoco/>"), 16, 16):
            return ""
    except InputError as error:
        return str(error)


WHY_NOT = drawing_fails()
draws = pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT)


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder with one model of every kind, a recording, and files that are none."""
    monkeypatch.chdir(tmp_path)
    write_model("play.toml", PLAY)
    write_model(
        "lumped.toml",
        Datasheet(lumped={"a_1": 27.0, "a_2": 70.0, "b": -90.0, "c_1": 129.0, "c_2": 105.0, "theta_0": 0.26}),
    )
    write_model("loop.toml", Datasheet(lumped={"a_2": 8.0, "c_2": 20.0}, loop={"K": 900.0, "D": 50.0, "L": 600.0}))
    (tmp_path / "plant.xml").write_text(plant_of(PLAY).xml())
    write_recording("asked.csv", {"t_s": T, "theta_ref_rad": 0.2 * np.sign(T - 0.05), "theta_rad": 2 * T - 0.2})
    write_recording("run.csv", {"t_s": T, "u_V": 4 * np.sin(20 * T), "theta_rad": 0.3 + 0.2 * np.sin(20 * T)})
    write_recording("slide.csv", {"t_s": T, "u_V": 4 * np.sin(20 * T), "x_m": 0.02 * np.sin(20 * T)})
    for name, text in {
        "cut.xml": "<mujoco><body>",
        "robot.xml": "<robot/>",
        "words.xml": "hello",
        "empty.xml": "",
        "odd.xml": "<mujoco><magic/></mujoco>",
        "still.xml": "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>",
        "kept.png": "kept",
        "strange.toml": "[parameters]\nJJ = 1\n",
        "no_b.toml": "[parameters]\nk_s = 1\n",
    }.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def pictures(path) -> list[np.ndarray]:
    with Image.open(path) as image:
        frames = []
        for k in range(getattr(image, "n_frames", 1)):
            image.seek(k)
            frames.append(np.asarray(image.convert("RGB")).astype(int))
    return frames


@draws
@pytest.mark.parametrize(
    "model",
    [
        "table1",
        "table1 --linkage rod --gap 1",
        "play.toml",
        "lumped.toml",
        "loop.toml",
        "plant.xml",
        *(str(mjcf_folder() / f"{name}.xml") for name in ("scene", "rudder_rod", "rudder_constant")),
    ],
)
def test_every_model_is_drawn_still_and_moving(model, place, capsys):
    assert cli.main(f"view {model} --render still.png --width 96 --json".split()) == 0
    assert json.loads(capsys.readouterr().out)["frames"] == 1
    (still,) = pictures("still.png")
    assert still.shape == (72, 96, 3) and still.std() > 15
    assert cli.main(f"view {model} --render film.gif {SMALL} --json".split()) == 0
    summary, film = json.loads(capsys.readouterr().out), pictures("film.gif")
    assert len(film) == summary["frames"] == 4 and film[0].shape == (72, 96, 3)
    assert np.abs(film[-1] - film[0]).max() > 60


@draws
@pytest.mark.parametrize(
    "argv",
    [
        "play.toml --replay run.csv",
        "plant.xml --replay run.csv",
        "lumped.toml --replay slide.csv",
        "loop.toml --replay asked.csv",
    ],
)
def test_a_recording_is_replayed(argv, place, capsys):
    assert cli.main(f"view {argv} --render film.gif {SMALL}".split()) == 0
    assert len(pictures("film.gif")) == 4
    capsys.readouterr()
    assert cli.main(f"view {argv} --render still.png --width 96 --json".split()) == 0
    assert json.loads(capsys.readouterr().out)["frames"] == 1


@draws
def test_the_ghost_stands_where_the_measurement_is():
    """A ghost at the simulated angle covers the rudder, one elsewhere adds a second rudder."""
    film = posed(plant_of(SHEET), np.zeros(1), np.array([0.2]))
    with Painter(film.model, 160, 120) as painter:
        plain, same, other, none = (
            painter.draw(film.qpos[0], measured).astype(int) for measured in (None, 0.2, -0.4, np.nan)
        )
    changed = [(np.abs(x - plain).max(axis=2) > 20) for x in (same, other, none)]
    assert changed[2].sum() == 0 < changed[0].sum()
    assert (changed[1] & ~changed[0]).sum() > 200


def test_a_replay_follows_the_simulation():
    t = np.arange(400) * 1e-3
    plant = plant_of(PLAY)
    film = simulated(plant, t, 6 * np.sin(20 * t), moments_of(t, 20, 1.0))
    rocker, gap = (film.model.joint(name).qposadr[0] for name in ("rocker", "gap"))
    np.testing.assert_allclose(film.qpos[:, rocker] + film.qpos[:, gap], film.theta, atol=1e-12)
    assert 0.01 < np.abs(film.qpos[:, gap]).max() < 0.025 and np.ptp(film.theta) > 0.05


def test_a_servo_with_a_loop_follows_what_it_is_asked(place, capsys):
    """Out and home to half a radian; under a recording it starts where that was measured."""
    argv = "view loop.toml --input square --render a.png --width 96 --json --duration"
    ends = {}
    for seconds in ("0.3", "0.9"):
        assert cli.main([*argv.split(), seconds, "--force"]) == 0
        ends[seconds] = json.loads(capsys.readouterr().out)["theta"][-1]
    assert ends["0.3"] == pytest.approx(0.5, abs=0.05) and ends["0.9"] == pytest.approx(0.0, abs=0.05)
    film = replayed(read_datasheet("loop.toml"), read_recording("asked.csv"), moments_of(T, 20, 1.0))
    assert film.theta[0] == pytest.approx(-0.2) and film.theta[-1] > 0.1
    np.testing.assert_allclose(film.measured, 2 * film.t - 0.2, atol=1e-9)


def test_a_recording_starts_where_it_was_measured():
    y = 0.5 + 0.1 * T
    film = recorded(plant_of(SHEET), trace_of(from_arrays(T, 0 * T, y), None), moments_of(T, 10, 1.0))
    assert film.theta[0] == pytest.approx(0.5) and film.measured[-1] == pytest.approx(y[-1])


@pytest.mark.parametrize(
    "sheet",
    [SHEET, Datasheet(lumped={"a_1": 27.0, "a_2": 70.0, "b": 90.0, "c_1": 129.0, "c_2": 105.0, "theta_0": 0.2})],
)
def test_a_plant_file_replays_as_the_plant_does(sheet, tmp_path):
    """From the same start, with speed, under the same input."""
    plant = plant_of(sheet)
    (tmp_path / "plant.xml").write_text(plant.xml())
    trace = trace_of(from_arrays(T, 5 * np.sin(30 * T), 0.5 - 2.0 * T), None)
    moments = moments_of(T, 50, 1.0)
    film = recorded_file(read_plant(tmp_path / "plant.xml"), trace, moments)
    np.testing.assert_allclose(film.theta, recorded(plant, trace, moments).theta, atol=5e-4)
    assert np.ptp(film.theta) > 0.05


def test_frames_are_evenly_spaced_and_no_longer_than_the_recording():
    t = 5.0 + np.arange(1000) * 1e-3
    np.testing.assert_array_equal(moments_of(t, 20, 0.2), [0, 50, 100, 150, 200])
    assert moments_of(t, 20, 99)[-1] <= 999 and moments_of(t[:1], 20, 1).tolist() == [0]


BAD = {
    "no display": "",
    "no such xml": "none.xml --render a.png",
    "cut": "cut.xml --render a.png",
    "robot": "robot.xml --render a.png",
    "words": "words.xml --render a.png",
    "empty": "empty.xml --render a.png",
    "odd": "odd.xml --render a.png",
    "folder": ". --render a.png",
    "no actuator": "still.xml --input steps --render a.gif",
    "no rudder": "still.xml --replay run.csv --render a.gif",
    "linkage of xml": "plant.xml --linkage rod --render a.png",
    "gap of xml": "plant.xml --gap 1 --render a.png",
    "rod of lumped": "lumped.toml --linkage rod --render a.png",
    "gap of a loop": "loop.toml --gap 1 --render a.png",
    "rod of a loop": "loop.toml --replay asked.csv --linkage rod --render a.png",
    "voltage for a loop": "loop.toml --replay run.csv --render a.png",
    "two plays": "play.toml --gap 1 --render a.png",
    "no model": "none.toml --render a.png",
    "strange": "strange.toml --render a.png",
    "no b": "no_b.toml --render a.png",
    "suffix": "--render a.jpg",
    "exists": "--render kept.png",
    "under a file": "--render kept.png/a.png",
    "input": "--input stepz --render a.gif",
    "both": "--input steps --replay run.csv --render a.gif",
    "no recording": "--replay none.csv --render a.gif",
    "map": "--map t_s=Time --render a.gif",
    "too long": "--duration 1e6 --render a.gif",
    "wide": "--width 99999 --render a.png",
    "narrow": "--width 1 --render a.png",
    "linkage": "--linkage rope --render a.png",
}


@pytest.mark.parametrize("argv", BAD.values(), ids=BAD)
def test_bad_input_is_one_sentence_and_nothing_written(argv, place, monkeypatch, capsys):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    before = {path.name: path.read_bytes() for path in place.iterdir()}
    assert cli.main(["view", *argv.split()]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("ers: ") and err.count("\n") == 1 and len(err) > 25
    assert {path.name: path.read_bytes() for path in place.iterdir()} == before


def evidence(off: float, unit: str = "rad") -> Evidence:
    """One held-out recording, from which the model before is off by a bump and the model after is not."""
    y = 0.3 + 0.2 * np.sin(20 * T)
    bump = off * np.exp(-(((T - 0.2) / 0.02) ** 2))
    return Evidence((RecordView("held.csv", True, T, 0 * T, y, y + bump, y),), (), None, 1e-4, unit, "V")


@draws
@pytest.mark.parametrize("sheet", [SHEET, Datasheet(lumped={"a_2": 70.0, "b": 90.0})])
def test_a_report_shows_the_worst_moment_before_and_after(sheet):
    frames = frames_of(plant_of(sheet), evidence(0.02))
    worst = max(frames.moments, key=lambda frame: abs(frame.before - frame.measured))
    assert worst.t == pytest.approx(0.2, abs=1e-3) and frames.enlarged == 10 and len(frames.moments) == 3
    before, after = (
        np.asarray(Image.open(io.BytesIO(x))).astype(int) for x in (worst.picture_before, worst.picture_after)
    )
    assert before.shape == (360, 480, 3) and (np.abs(before - after).max(axis=2) > 60).sum() > 500
    page = report_page({}, evidence(0.02), frames)
    assert page.count("data:image/jpeg;base64,") == 6 and "10 times as large" in page


@draws
@pytest.mark.parametrize(
    ("effects", "unit", "rig"),
    [((), "rad", "joint"), ((), "m", "slide"), ((("gravity_imbalance", {"g_s": 30.0, "g_c": 10.0}),), "rad", "arm")],
)
def test_the_rig_is_drawn_as_what_it_is(effects, unit, rig):
    plant = plant_of(Datasheet(lumped={"a_2": 70.0, "b": 90.0}, effects=effects), output_unit=unit)
    frames = frames_of(plant, evidence(0.02, unit))
    assert frames.rig == rig and len(frames.moments) == 3
    assert f"The {rig} at the worst moments" in report_page({}, evidence(0.02, unit), frames)


@pytest.mark.parametrize(
    ("kind", "said"), [("position", "joint within the servo’s position loop"), ("voltage", "joint")]
)
def test_a_page_of_another_joint_does_not_speak_of_the_paper(kind, said):
    page = report_page({"data": {"input_kind": kind}}, evidence(0.02))
    assert f"is a plain {said}, refitted" in page and "paper’s" not in page and "rudder" not in page


def test_frames_are_left_out_where_they_would_tell_nothing():
    plant = plant_of(SHEET)
    assert frames_of(plant, evidence(1e-4)) is None and frames_of(plant, evidence(0.02, "m")) is None


@pytest.mark.skipif(sys.platform != "linux", reason="EGL is Linux's")
def test_a_report_without_egl_says_so(monkeypatch):
    lack_egl(monkeypatch)
    frames = frames_of(plant_of(SHEET), evidence(0.02))
    assert frames.moments == () and "libegl1" in report_page({}, evidence(0.02), frames)


@pytest.mark.skipif(sys.platform != "linux", reason="EGL is Linux's")
def test_without_egl_it_is_told_what_to_install(place, monkeypatch, capsys):
    lack_egl(monkeypatch)
    assert cli.main("view --render a.png".split()) == 2
    assert "libegl1" in capsys.readouterr().err and not (place / "a.png").exists()


def lack_egl(monkeypatch) -> None:
    """A machine without EGL: what MuJoCo draws with cannot be imported."""
    monkeypatch.setenv("MUJOCO_GL", "egl")
    monkeypatch.setitem(sys.modules, "mujoco.egl", None)
