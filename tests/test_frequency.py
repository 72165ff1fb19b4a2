"""`ers frequency`: its JSON, its page, its refusals."""

import json
from dataclasses import replace

import pytest
from test_report import read

from ers_mj import cli
from ers_mj.servo.datasheet import read_datasheet
from ers_mj.servo.model_file import write_model

SHEET = read_datasheet("table1")
FREE = replace(SHEET, parameters={**SHEET.parameters, "F_c": 0.0, "T_LH": 0.0})


@pytest.fixture(scope="module")
def free(tmp_path_factory):
    folder = tmp_path_factory.mktemp("free")
    write_model(folder / "free.toml", FREE)
    assert (
        cli.main(
            [
                "simulate",
                str(folder / "free.toml"),
                "--input",
                "multisine",
                "--noise-deg",
                "0.01",
                "--out",
                str(folder / "rec.csv"),
            ]
        )
        == 0
    )
    return folder


def test_json_has_the_contracts_keys(free, capsys):
    arguments = [
        "frequency",
        str(free / "rec.csv"),
        "--datasheet",
        str(free / "free.toml"),
        "--controller",
        "pid",
        "--rate-hz",
        "2000",
        "--json",
    ]
    capsys.readouterr()
    assert cli.main(arguments) == 0
    told = json.loads(capsys.readouterr().out)
    assert {"gain_margin_db", "phase_margin_deg", "sensitivity_peak", "bandwidth_hz"} <= told.keys() and told["loops"][
        0
    ]["gain_margin_db"] == told["gain_margin_db"]
    recording = told["recordings"][0]
    found = recording["gaps"]["reduced, slipping"]
    assert (
        found["max_db"] < 0.5 and found["max_deg"] < 3.0 and len(recording["f_hz"]) == len(recording["gain_db"]) == 20
    )
    assert told["cycles"][0]["simulated"] == {"reduced": None}


def test_a_table_and_a_page_are_written(free, tmp_path, capsys):
    arguments = [
        "frequency",
        str(free / "rec.csv"),
        "--controller",
        "ftrc",
        "--plant",
        "reduced,mujoco",
        "--rate-hz",
        "500",
        "--gap",
        "0.5",
        "--out",
        str(tmp_path / "out"),
    ]
    assert cli.main(arguments) == 0
    out = capsys.readouterr().out
    assert "ftrc, mujoco" in out and "limit cycles" in out and "friction described" in out
    page = read((tmp_path / "out" / "report.html").read_text())
    words = " ".join(page.words)
    assert all(x in words for x in ("Loops over frequency", "Limit cycles", "Recording rec.csv", "Plants")) and len(
        page.ids
    ) == len(set(page.ids))
    assert not [x for x in page.references if not x.startswith("#")]
    assert len(json.loads((tmp_path / "out" / "frequency.json").read_text())["loops"]) == 2
    assert cli.main(arguments) == 2 and "--force" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--controller", "lqr"], "there is no 'lqr'; there are ftrc"),
        (["--plant", "adams"], "there are reduced, mujoco"),
        (["nothing.csv"], "no such file"),
        (["--pid", "Q=1"], "there is no gain 'Q'; there are P, I, D"),
        (["--pid", "P=x"], "a number was expected"),
        (["--pid", "P=-1"], "not between"),
        (["--amplitude-deg", "0"], "not above 0"),
        (["--rate-hz", "5"], "20 Hz to 100000 Hz was expected"),
        (["--delay-ms", "1e6"], "1000 at most"),
        (["--rate-hz", "1e12"], "20 Hz to"),
        (["--datasheet", "nothing.toml"], "no such file"),
        (["--gap", "0.5", "--effect", "backlash:gap=0.01"], "twice"),
    ],
)
def test_bad_input_is_one_sentence_and_code_2(arguments, says, capsys):
    assert cli.main(["frequency", "--json", *arguments]) == 2
    error = capsys.readouterr().err
    assert says in error and error.count("\n") == 1
