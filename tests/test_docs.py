"""README and docs are held to their word: examples run, links lead somewhere, figures have a command beside them."""

import re
import shlex
import shutil
import sys
from pathlib import Path

import control
import matplotlib
import numpy as np
import pytest

import ers_mj as ers
from ers_mj import cli
from ers_mj.diagnosis import pipeline
from ers_mj.effects import EFFECTS
from ers_mj.experiment_design import optimal_input
from ers_mj.selection.budget import QUICK

ROOT = Path(__file__).resolve().parents[1]
DEMO = ROOT / "ers_mj" / "demo_data"
DOCS = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
PAGES = [*ROOT.glob("*.md"), *DOCS[1:], *(ROOT / "mjcf").glob("*.md")]
LINK = re.compile(r"\]\(([^)#\s]*)(#[^)\s]+)?[^)]*\)")
SCRIPT = re.compile(r"\b((?:ers_mj|analysis|tests)/[\w/]+\.py)\b")
FENCE = re.compile(r"(<!-- (?:takes minutes|not run): [^>]+-->\n+)?```(\w+)(?: \w+)?\n(.*?)```", re.S)
COMMAND = re.compile(r"`[^`\n]*(?:ers [a-z]+|python analysis/|--seed|--only|[a-z]+\.csv)|analysis/results/|```sh")
ELSEWHERE = {"docs/extending.md"}  # whose example tests/test_template.py runs
sys.path.insert(0, str(ROOT / "analysis"))
catalogue = pytest.importorskip("catalogue", reason="analysis/ is not beside the tests")


def named(page: Path) -> str:
    return str(page.relative_to(ROOT))


def blocks(page: Path, language: str) -> list[tuple[bool, str]]:
    """(whether a comment exempts it, its text) of a page's fenced blocks."""
    return [(bool(why), text) for why, kind, text in FENCE.findall(page.read_text()) if kind == language]


def lines(text: str) -> list[list[str]]:
    """The calls of `ers` in a block of shell, without the name and comments."""
    whole = text.replace("\\\n", " ").splitlines()  # a line that goes on in the next one
    return [shlex.split(line, comments=True)[1:] for line in whole if line.startswith("ers ")]


def calls(exempt: bool) -> list[list[str]]:
    """The calls in blocks of shell that are run or exempt, each once."""
    found = (argv for page in DOCS for skip, text in blocks(page, "sh") if skip == exempt for argv in lines(text))
    return [list(argv) for argv in dict.fromkeys(map(tuple, found))]


def spoken() -> list[list[str]]:
    """Whole calls within a sentence."""
    spans = (span for page in DOCS for span in re.findall(r"`(ers [a-z]+ [^`\n]*)`", page.read_text()))
    return [shlex.split(span)[1:] for span in spans if "..." not in span and "NAME" not in span]


def test_each_argument_of_the_door_is_documented_by_its_own_name():
    """As the site's builder wants it, which reads one name a line."""
    files = sorted((ROOT / "ers_mj" / "door").rglob("*.py"))
    several = [
        f"{named(f)}: {line.strip()}"
        for f in files
        for line in re.findall(r"^ +(?!self)\w+, \w+: .*", f.read_text(), re.M)
    ]
    assert files and not several


PARSED = calls(exempt=True) + spoken()
PYTHON = [page for page in DOCS if blocks(page, "python") and named(page) not in ELSEWHERE]


@pytest.fixture(scope="session")
def found():
    """A quick diagnosis of the first 4.5 s of a recording that ships, at half its rate, shared by every example."""
    from ers_mj.servo.datasheet import read_datasheet

    t, u, theta = np.loadtxt(DEMO / "rec1.csv", delimiter=",", skiprows=1, max_rows=4500)[::2].T
    run = ers.from_arrays(t=t, u_V=u, theta_rad=theta)
    return pipeline.diagnose([run], read_datasheet(DEMO / "datasheet.toml"), search=QUICK)


@pytest.fixture
def bench(found, tmp_path, monkeypatch):
    """A folder as the pages have it: recordings, a datasheet, and a diagnosis, which is not made again."""
    for name, source in (("run1", "rec1"), ("run2", "rec2"), ("run3", "holdout")):
        shutil.copy(DEMO / f"{source}.csv", tmp_path / f"{name}.csv")
    columns = (DEMO / "rec3.csv").read_text().replace("t_s,u_V,theta_rad", "Time,Volts,Angle", 1)
    (tmp_path / "log.csv").write_text(columns)
    shutil.copy(DEMO / "datasheet.toml", tmp_path / "servo.toml")
    monkeypatch.setattr(pipeline, "diagnose", lambda *_, **__: found)
    monkeypatch.setattr("ers_mj.view.frames.frames_of", lambda *_: None)  # pictures: tests/test_view.py
    little = optimal_input.Effort(refits=2, rounds=1, checked=2)  # more of it: tests/test_experiment.py
    monkeypatch.setattr(optimal_input, "EFFORT", little)
    monkeypatch.chdir(tmp_path)
    ers.Diagnosis(found).model.save(tmp_path / "ers-out" / "model.toml")
    return tmp_path


@pytest.mark.parametrize("argv", calls(exempt=False), ids=" ".join)
def test_a_command_of_a_page_runs(bench, argv, capsys):
    assert cli.main([*argv, "--force"] if argv[0] in ("diagnose", "simulate") else argv) == 0, capsys.readouterr().err


@pytest.mark.parametrize("argv", PARSED, ids=" ".join)
def test_a_command_that_is_not_run_is_one(argv):
    assert cli.parse(argv).command == argv[0]


@pytest.mark.parametrize("page", PYTHON, ids=named)
def test_the_python_of_a_page_runs(bench, page, capsys):
    """The blocks of a page go on from each other."""
    matplotlib.use("Agg")
    space = {}
    for exempt, text in blocks(page, "python"):
        assert not exempt
        exec(compile(text, named(page), "exec"), space)
    assert capsys.readouterr().out


def test_ten_lines_of_one_who_read_readme_only(bench):
    """Arrays in; verdict, margins and a compiled MuJoCo model out."""
    t, u, theta = np.loadtxt("run1.csv", delimiter=",", skiprows=1).T
    run = ers.from_arrays(t=t, u_V=u, theta_rad=theta)
    found = ers.diagnose(run, "servo.toml")
    assert found.verdict == "missing_physics" and found.effects == ("backlash",)
    gain, phase, *_ = control.margin(50 * found.model.to_control())
    assert 1.0 < gain < 100.0 and 0.0 < phase < 90.0
    assert found.model.to_mujoco().compile().nu > 0


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_every_relative_link_leads_somewhere(page):
    text = page.read_text()
    links = [(link, anchor) for link, anchor in LINK.findall(text) if ":" not in link]
    assert [link for link, _ in links if link and not (page.parent / link).exists()] == []
    for link, anchor in links:
        target = page.parent / link if link else page
        if anchor and target.suffix == ".md":
            headings = re.findall(r"^#+ (.+)$", target.read_text(), re.M)
            assert anchor[1:] in {re.sub(r"[^\w -]", "", h).strip().lower().replace(" ", "-") for h in headings}
    assert [path for path in SCRIPT.findall(text) if not (ROOT / path).exists()] == []


@pytest.mark.parametrize("page", DOCS, ids=named)
def test_what_was_measured_has_a_command_beside_it(page):
    """In the section of each table of numbers and of each picture, or ahead of the page's first section."""
    head, *sections = re.split(r"^## ", page.read_text(), flags=re.M)
    for section in sections:
        measured = re.search(r"^\|.*\d+(\.\d+)? ?(%|°|s|ms|dB|Hz|mm|V)\b.*\|$", section, re.M)
        if measured or "![" in section:
            assert COMMAND.search(section) or COMMAND.search(head), section.splitlines()[0]


def test_readme_is_one_page():
    assert len((ROOT / "README.md").read_text().split()) <= 500


@pytest.mark.parametrize("page", ["README.md", "docs/limits.md"])
def test_a_page_counts_the_effects_that_there_are(page):
    counted = re.search(r"(\d+) effects", (ROOT / page).read_text())
    assert int(counted[1]) == sum(effect.named for effect in EFFECTS)


def test_the_catalogue_is_what_the_effects_say():
    assert catalogue.PAGE.read_text() == catalogue.catalogue(), "python analysis/catalogue.py writes it"


def test_every_result_that_is_kept_is_printed_on_a_page():
    """A file in analysis/results stands behind a figure: a page links it, or the page of identification its folder."""
    linked = "".join(page.read_text() for page in PAGES)
    elsewhere = ("identification_bars", "against_mujoco_sysid", "identify_time", "table_2", "whole_chain")
    kept = {path.name for path in (ROOT / "analysis" / "results").iterdir()}
    assert {name for name in kept if name not in linked and not name.startswith(elsewhere)} == set()
