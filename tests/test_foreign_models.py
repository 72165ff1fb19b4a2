"""Models and names of strangers: they read nothing outside their folder, end, and stand in no page as HTML."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from test_report import read

from ers_mj import cli
from ers_mj.errors import InputError
from ers_mj.report.drawing import both_widths
from ers_mj.view.model_file import read_plant, simulated_file

MODEL = """<mujoco>{top}<worldbody><body><joint name="j" stiffness="{stiffness}"/><geom size="0.1"/></body></worldbody>
<actuator><motor joint="j" gear="{gear}"/></actuator></mujoco>"""
T = np.arange(400) * 0.01


def model(folder, top: str = "", stiffness: str = "1", gear: str = "1", name: str = "model.xml"):
    path = folder / name
    path.write_text(MODEL.format(top=top, stiffness=stiffness, gear=gear))
    return path


def moved(path) -> np.ndarray:
    return simulated_file(read_plant(path), T, np.sin(T), np.array([0, 399])).qpos


@pytest.mark.parametrize(
    "top",
    [
        '<include file="../secret.xml"/>',
        '<include file="{outside}/secret.xml"/>',
        '<include file="inner.xml"/>',
        '<asset><mesh file="../secret.xml"/></asset>',
        '<asset><mesh file="link.obj"/></asset>',
        '<asset><texture type="cube" fileup="/dev/zero"/></asset>',
        '<asset><hfield name="h" file="C:\\secret" size="1 1 1 1"/></asset>',
        '<compiler meshdir="/etc"/><asset><mesh file="passwd"/></asset>',
        '<compiler assetdir="linked"/><asset><mesh file="secret.xml"/></asset>',
        '<asset><model name="m" file="a/../../secret.xml"/></asset>',
    ],
)
def test_a_model_reads_nothing_outside_its_folder(top, tmp_path):
    home = tmp_path / "home"
    home.mkdir()
    (tmp_path / "secret.xml").write_text("<mujoco/>")
    (home / "link.obj").symlink_to(tmp_path / "secret.xml")
    (home / "linked").symlink_to(tmp_path)
    (home / "inner.xml").write_text('<mujoco><include file="../secret.xml"/></mujoco>')
    with pytest.raises(InputError, match="the model's folder, which is all that is read"):
        read_plant(model(home, top.format(outside=tmp_path)))


def test_a_model_reads_its_own_folder(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts/inner.xml").write_text('<mujoco><option timestep="0.01"/></mujoco>')
    plant = read_plant(model(tmp_path, '<include file="parts/inner.xml"/>'))
    assert plant.opt.timestep == 0.01 and np.isfinite(moved(model(tmp_path))).all()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"top": '<option timestep="0.5"/>', "stiffness": "-1e9", "gear": "1e12"}, "unstable"),
        ({"top": '<option timestep="1e-12"/>'}, "at most"),
        ({"top": '<option timestep="-1"/>'}, "step of -1 s"),
        ({"top": '<size memory="900G"/>'}, "not a model"),
        ({"top": '<include file="model.xml"/>'}, "include one another"),
        ({"top": '<worldbody><replicate count="1000000000"><geom size="1"/></replicate></worldbody>'}, "copies"),
        ({"top": 2 * '<worldbody><replicate count="300">' + 2 * "</replicate></worldbody>"}, "copies"),
        ({"top": 9000 * "<worldbody>" + 9000 * "</worldbody>"}, "deep"),
    ],
)
def test_a_model_that_would_not_end_is_told(given, words, tmp_path):
    with pytest.raises(InputError, match=words):
        moved(model(tmp_path, **given))


NASTY = '"><img src=x onerror=alert(1)>\\1\\g<0>{0}%s$\\frac$'


def test_a_name_in_a_figure_is_neither_html_nor_a_pattern():
    page = read(both_widths(lambda width: Figure(figsize=(width, 1)), NASTY))
    assert "img" not in page.tags and page.tags.count("svg") == 2


@pytest.mark.parametrize("command", [["inspect"], ["identify", "--evaluations", "50"]])
def test_names_of_files_and_columns_are_text_in_a_page(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows = (f"{t:.2f},{4 * np.sin(5 * t) + 3 * np.sin(11 * t):.4f},{0.1 * np.sin(5 * t - 0.4):.6f},1" for t in T)
    (tmp_path / f"{NASTY}.csv").write_text("\n".join(["t_s,u_V,theta_rad,<img src=y>", *rows]))
    assert cli.main([*command, f"{NASTY}.csv", "--out", "res", "--json"]) == 0
    page = read((tmp_path / "res/report.html").read_text())
    assert "img" not in page.tags and not [x for x in page.references if x in ("x", "y")]
    assert "onerror=alert" in " ".join(page.words)
