"""Many servos: a list checked before the work, one row each, the same bytes whatever ran them and however often it was
stopped.
"""

import csv
import json
import math
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from ers_mj.cli import main
from ers_mj.errors import InputError
from ers_mj.fleet import batch, diagnosing
from ers_mj.fleet.manifest import read_manifest
from ers_mj.workers.here import Here
from ers_mj.workers.hiring import crew

ROOT = Path(__file__).resolve().parents[1]


DECAY = math.exp(-40.0 / 100.0)  # of the speed in a sample


def record(path, seed, samples=110):
    """A servo of 60 rad/s^2/V and 40 1/s under steps at 100 Hz, with noise."""
    random, rows = np.random.default_rng(seed), ["t_s,u_V,theta_rad"]
    theta = omega = 0.0
    for k in range(samples):
        u = 4.0 * ((k // 20) % 2) - 2.0
        rows.append(f"{k / 100:.2f},{u},{theta + 1e-4 * random.standard_normal():.6f}")
        theta += 0.01 * 1.5 * u + (omega - 1.5 * u) * (1.0 - DECAY) / 40.0
        omega = 1.5 * u + (omega - 1.5 * u) * DECAY
    path.write_text("\n".join(rows) + "\n")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    for k in range(1, 5):
        record(tmp_path / f"r{k}.csv", k)
    return tmp_path


def manifest(folder, *rows, heads="name,recordings"):
    (folder / "servos.csv").write_text("\n".join([heads, *rows]) + "\n")
    return str(folder / "servos.csv")


# -- the list ---------------------------------------------------------------------------------------------------------


def test_a_row_is_read_whole(folder):
    given = manifest(
        folder,
        '"unit 1", r1.csv ; r[23].csv,table1,r4.csv,t_s=Time;theta_deg=Angle',
        "b,log.parquet#run=7,,,",
        heads="name,recordings,datasheet,holdout,map",
    )
    first, second = read_manifest(given)
    assert first.recordings == ("r1.csv", "r2.csv", "r3.csv") and first.holdout == ("r4.csv",)
    assert (first.name, first.datasheet, dict(first.mapping)["theta_deg"]) == ("unit 1", "table1", "Angle")
    assert second.recordings == ("log.parquet#run=7",) and second.path("x") == folder / "x"


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (["a,r1.csv", "A,r2.csv"], "line 3: the name 'A' stands twice"),
        (["../a,r1.csv"], "cannot be that of a folder"),
        (["a/b,r1.csv"], "cannot be that of a folder"),
        (["a\\b,r1.csv"], "cannot be that of a folder"),
        ([".batch,r1.csv"], "cannot be that of a folder"),
        (["report.html,r1.csv"], "is that of a file of the results"),
        ([",r1.csv"], "a servo has no name"),
        (["a,"], "a has no recordings"),
        (["a,r1.csv,r2.csv"], "more cells than the 2 columns"),
        ([], "names no servo"),
    ],
)
def test_a_wrong_list_is_one_sentence_before_the_work(folder, rows, said):
    with pytest.raises(InputError, match=said):
        read_manifest(manifest(folder, *rows))


def test_a_pattern_that_finds_nothing_stays_for_its_row_to_say_so(folder):
    (servo,) = read_manifest(manifest(folder, "a,x*.csv"))
    assert servo.recordings == ("x*.csv",)


@pytest.mark.parametrize(
    ("heads", "said"),
    [("name", "has no column 'recordings'"), ("name,recordings,holdouts", "a column 'holdouts'; there are name")],
)
def test_wrong_columns_are_said(folder, heads, said):
    with pytest.raises(InputError, match=said):
        read_manifest(manifest(folder, heads=heads))


@pytest.mark.parametrize("cell", ["Time", "t_s=", "t_s=a;t_s=b"])
def test_a_wrong_map_is_said(folder, cell):
    with pytest.raises(InputError, match="map"):
        read_manifest(manifest(folder, f"a,r1.csv,{cell}", heads="name,recordings,map"))


def test_a_list_that_is_not_there_is_said(folder, capsys):
    assert main(["batch", "nowhere.csv"]) == 2
    assert "nowhere.csv: cannot be read" in capsys.readouterr().err and not (folder / "ers-out").exists()


# -- the batch, with a diagnosis that takes no time -------------------------------------------------------------------


class Told:
    """Stands for a diagnosis: as far as a batch looks at one."""

    def __init__(self, recordings):
        self.document = {
            "verdict": "missing_physics",
            "missing": [{"effect": "backlash"}, {"effect": "stribeck"}],
            "fit": {"heldout_rmse_before_rad": 0.1, "heldout_rmse_after_rad": 1 / 3, "noise_floor_rad": 1e-3},
            "parameters": {"b": {"value": float(recordings[0].y.std()), "unit": "1/s", "ci95": [0.9, 1.2]}},
        }

    def to_dict(self):
        return self.document

    def save(self, folder):
        path = Path(folder) / "diagnosis.json"
        path.write_text(json.dumps(self.document))
        (Path(folder) / "report.html").write_text(f"{self.made_by} on {self.made_on}")
        return [path, path.with_name("report.html")]


@pytest.fixture
def asked(monkeypatch):
    """The recordings that were diagnosed; r3.csv is a surprise to the stub."""
    calls = []

    def stub(recordings, datasheet, holdout, **settings):
        calls.append(recordings[0].name)
        if recordings[0].name == "r3.csv":
            raise ZeroDivisionError("a surprise")
        return Told(recordings)

    monkeypatch.setattr(diagnosing, "diagnose", stub)
    return calls


ROWS = ("a,r1.csv", "gone,missing.csv", "b,r2.csv", "odd,r3.csv", "d,r4.csv")


def everything(folder):
    """Every file of a folder, as bytes."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_a_row_that_fails_has_its_sentence_and_the_rest_goes_on(folder, asked, capsys):
    assert main(["batch", manifest(folder, *ROWS), "--out", "o", "--jobs", "1"]) == 1
    with (folder / "o" / "batch.csv").open(newline="") as table:
        found = list(csv.DictReader(table))
    assert [row["name"] for row in found] == ["a", "gone", "b", "odd", "d"]
    assert found[0] == {
        "name": "a",
        "verdict": "missing_physics",
        "effects": "backlash;stribeck",
        "heldout_before": "0.1",
        "heldout_after": repr(1 / 3),
        "noise_floor": "0.001",
        "error": "",
    }
    assert found[1]["error"] == "missing.csv: there is no such file"
    assert found[3]["error"] == "the diagnosis failed (ZeroDivisionError: a surprise)"
    assert (folder / "o" / "a" / "report.html").read_text() == "ers batch servos.csv on 1 January 1970"
    page = (folder / "o" / "report.html").read_text()
    assert 'href="a/report.html"' in page and "3 missing physics, 2 without an answer" in capsys.readouterr().out
    assert page.count("<svg") == 4


def test_what_is_there_is_kept_and_what_changed_is_not(folder, asked, capsys):
    argv = ["batch", manifest(folder, "a,r1.csv", "b,r2.csv", "d,r4.csv"), "--out", "o", "--jobs", "1"]
    assert main(argv) == 0
    whole, asked[:] = everything(folder / "o"), []
    assert main(argv) == 0 and asked == [] and everything(folder / "o") == whole
    assert "goes on, 3 of 3 servos are there" in capsys.readouterr().err
    record(folder / "r2.csv", 9)
    assert main(argv) == 0 and asked == ["r2.csv"]
    asked[:] = []
    assert main([*argv, "--seed", "3"]) == 0 and len(asked) == 3


def test_killed_between_files_and_row_it_is_done_again(folder, asked):
    argv = ["batch", manifest(folder, "a,r1.csv", "b,r2.csv"), "--out", "o", "--jobs", "1"]
    assert main(argv) == 0
    whole, asked[:] = everything(folder / "o"), []
    (folder / "o" / ".batch" / "b.json").unlink()
    (folder / "o" / "b" / "report.html").unlink()
    assert main(argv) == 0 and asked == ["r2.csv"] and everything(folder / "o") == whole


def test_a_folder_of_something_else_is_refused(folder, asked, capsys):
    (folder / "o").mkdir()
    (folder / "o" / "mine.txt").touch()
    given = manifest(folder, "a,r1.csv")
    assert main(["batch", given, "--out", "o"]) == 2 and "give --force" in capsys.readouterr().err
    assert main(["batch", given, "--out", "o", "--force", "--jobs", "1"]) == 0


def test_json_without_a_folder_writes_none(folder, asked, capsys):
    assert main(["batch", manifest(folder, "a,r1.csv"), "--json", "--jobs", "1"]) == 0
    assert json.loads(capsys.readouterr().out)["servos"][0]["verdict"] == "missing_physics"
    assert not (folder / "ers-out").exists()


def test_stopped_it_keeps_what_is_done(folder, asked, monkeypatch, capsys):
    def stopped(self, tasks):
        yield next(plain(self, tasks))
        raise KeyboardInterrupt

    given, plain = manifest(folder, "a,r1.csv", "b,r2.csv"), Here.run
    with monkeypatch.context() as patch:
        patch.setattr(Here, "run", stopped)
        assert main(["batch", given, "--out", "o", "--jobs", "1"]) == 130
    assert "goes on from there" in capsys.readouterr().err and not (folder / "o" / "batch.csv").exists()
    asked[:] = []
    assert main(["batch", given, "--out", "o", "--jobs", "1"]) == 0 and asked == ["r2.csv"]


# -- and with a real one ----------------------------------------------------------------------------------------------


def test_killed_and_carried_on_by_a_cluster_that_loses_a_worker(folder):
    """kill -9 after the first servo; the rest on two workers, one of which is killed: the bytes of a serial run."""
    pytest.importorskip("distributed")
    from dask_cluster import Cluster

    given = manifest(folder, "a,r1.csv", "gone,missing.csv", "b,r2.csv", "c,r3.csv")
    command = [sys.executable, "-m", "ers_mj", "batch", given, "--quick", "--out", "o", "--jobs", "1"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    begun = subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL)
    while not (folder / "o" / ".batch" / "a.json").exists():
        assert begun.poll() is None
        time.sleep(0.05)
    begun.kill()
    begun.wait()
    with Cluster() as two:
        servos = read_manifest(given)
        settings = diagnosing.Settings(quick=True, made_by="ers batch servos.csv")
        hired, told = crew(1, two.address), []
        watch = lambda text, share: (told.append(text), two.workers[0].kill())
        batch.conduct(folder / "o", servos, settings, hired, progress=watch)
        hired.close()
    assert len(told) == 2  # b and c, each once
    batch.conduct(folder / "serial", servos, settings, Here(1))
    assert everything(folder / "o") == everything(folder / "serial")
