"""`ers diagnose` and `ers demo`: what they read, write and tell."""

import json

import numpy as np
import pytest
from command_files import GOOD, N, columns, contents, csv, lay_out, stub

from ers_mj import cli
from ers_mj.servo.datasheet import read_datasheet


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lay_out(tmp_path)


def test_diagnose_writes_its_files_and_tells(place, monkeypatch, capsys):
    calls = stub(monkeypatch)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    assert (
        cli.main("diagnose good.csv --holdout second.csv --datasheet good.toml --seed 5 --jobs 2 --out res".split())
        == 0
    )
    out, err = capsys.readouterr()
    assert sorted(p.name for p in (place / "res").iterdir()) == [
        "diagnosis.json",
        "model.toml",
        "plant.xml",
        "report.html",
    ]
    document = json.loads((place / "res/diagnosis.json").read_text())
    assert document["fit"]["heldout_rmse_after_rad"] is None and document["seed"] == 5
    page = (place / "res/report.html").read_text()
    assert "2 January 1970 · <code>ers diagnose good.csv --holdout second.csv" in page
    assert all(f'href="{name}"' in page for name in ("diagnosis.json", "model.toml", "plant.xml"))
    assert read_datasheet(place / "res/model.toml").lumped["b"] == 1.0
    assert "PARAMETERS_ONLY" in out and "parameters_only" in out and "report.html" in out and err == ""
    assert "91.0 rad/s²/V   (95 %: 90.0 … 92.0)   datasheet 81.0" in out
    (call,) = calls
    assert (
        [r.name for r in call.holdout] == ["second.csv"] and call.jobs == 2 and call.datasheet.parameters["J"] == 0.0031
    )


def test_a_quick_look_says_what_it_leaves_out(place, monkeypatch, capsys):
    stub(monkeypatch)
    assert cli.main(["diagnose", "good.csv", "--quick"]) == 0
    told = capsys.readouterr().out
    assert "left out" in told and "not run in MuJoCo" in told
    assert "not run in MuJoCo" in (place / "ers-out/report.html").read_text()
    assert cli.main(["diagnose", "good.csv"]) == 0
    assert "left out" not in capsys.readouterr().out


def test_json_without_out_writes_nothing(place, monkeypatch, capsys):
    stub(monkeypatch)
    before = contents(place)
    assert cli.main(["diagnose", "good.csv", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["verdict"] == "parameters_only"
    assert contents(place) == before


def test_json_with_out_writes_and_prints_the_same(place, monkeypatch, capsys):
    stub(monkeypatch)
    assert cli.main(["diagnose", "good.csv", "--json", "--out", "res"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads((place / "res/diagnosis.json").read_text())


def test_the_default_folder_may_be_overwritten_a_named_one_needs_force(place, monkeypatch):
    stub(monkeypatch)
    assert [cli.main(["diagnose", "good.csv"]) for _ in range(2)] == [0, 0]
    assert (place / "ers-out/report.html").exists()
    assert cli.main(["diagnose", "good.csv", "--out", "ers-out"]) == 2
    assert cli.main(["diagnose", "good.csv", "--out", "folder", "--force"]) == 0
    assert (place / "folder/x.txt").read_text() == "kept" and (place / "folder/model.toml").exists()


@pytest.mark.parametrize(
    ("argv", "trained", "held"),
    [
        ("good.csv --holdout second.csv", ["good.csv"], ["second.csv"]),
        ("good.csv --holdout second.csv third.csv", ["good.csv"], ["second.csv", "third.csv"]),
        ("good.csv --holdout second.csv --holdout third.csv", ["good.csv"], ["second.csv", "third.csv"]),
        ("--holdout second.csv good.csv third.csv", ["good.csv", "third.csv"], ["second.csv"]),
        ("--holdout second.csv good.csv --seed 3", ["good.csv"], ["second.csv"]),
        ("--seed 3 good.csv third.csv", ["good.csv", "third.csv"], []),
    ],
)
def test_holdout_may_be_repeated_listed_or_come_first(argv, trained, held, place, monkeypatch):
    (place / "third.csv").write_text(csv(columns(0.7)))
    calls = stub(monkeypatch)
    assert cli.main(["diagnose", *argv.split(), "--json"]) == 0
    assert [r.name for r in calls[0].recordings] == trained and [r.name for r in calls[0].holdout] == held


def test_two_runs_of_one_file_are_two_recordings(place, monkeypatch):
    import pyarrow as pa
    import pyarrow.parquet

    both = {k: np.tile(v, 2) for k, v in columns().items()} | {"run": np.repeat([16, 17], N)}
    pa.parquet.write_table(pa.table(both), place / "runs.parquet")
    calls = stub(monkeypatch)
    assert cli.main("diagnose runs.parquet#run=16 --holdout runs.parquet#run=17 --json".split()) == 0
    assert calls[0].recordings[0].name == "runs.parquet#run=16"
    assert cli.main("diagnose runs.parquet#run=16 --holdout runs.parquet#run=16 --json".split()) == 2


def test_other_names_are_mapped_in(place, monkeypatch):
    (place / "odd.csv").write_text(GOOD.replace("t_s", "Time").replace("theta_rad", "Angle"))
    calls = stub(monkeypatch)
    assert cli.main("diagnose odd.csv --map t_s=Time --map theta_deg=Angle --json".split()) == 0
    np.testing.assert_allclose(np.degrees(calls[0].recordings[0].y), columns()["theta_rad"], rtol=1e-12)


def test_an_interrupt_leaves_nothing_behind(place, monkeypatch, capsys):
    stub(monkeypatch, raises=KeyboardInterrupt())
    before = contents(place)
    assert cli.main(["diagnose", "good.csv"]) == 130
    assert capsys.readouterr().err.count("\n") == 1 and contents(place) == before


def test_a_file_that_cannot_be_written_leaves_nothing_behind(place, monkeypatch):
    stub(monkeypatch, model=object())
    before = contents(place)
    with pytest.raises(AttributeError):
        cli.main(["diagnose", "good.csv", "--out", "res"])
    assert contents(place) == before


def test_demo_diagnoses_what_the_package_ships(place, monkeypatch):
    calls = stub(monkeypatch)
    assert cli.main(["demo", "--json"]) == 0
    assert calls[0].recordings and calls[0].holdout and calls[0].datasheet
