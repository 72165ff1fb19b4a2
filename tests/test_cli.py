"""The command line: what it does with good input, and one clear sentence, code 2 and nothing written for bad input."""

import json
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from ers_mj import cli
from ers_mj import diagnosis as diagnosis_room
from ers_mj.commands import output
from ers_mj.data.recording import read_recording
from ers_mj.diagnosis.evidence import Evidence
from ers_mj.door.saving import as_json
from ers_mj.servo.datasheet import Datasheet, read_datasheet

N = 200
T = np.arange(N) * 1e-2


def csv(columns: dict) -> str:
    rows = zip(*[map(str, column) for column in columns.values()], strict=True)
    return "\n".join([",".join(columns), *map(",".join, rows)]) + "\n"


def columns(phase: float = 0.0) -> dict:
    return {"t_s": T, "u_V": 4 * np.sin(3 * T), "theta_rad": 0.26 + 0.1 * np.sin(3 * T + phase)}


def with_cell(column: str, row: int, text: str) -> dict:
    cells = [str(x) for x in columns()[column]]
    cells[row] = text
    return columns() | {column: cells}


GOOD = csv(columns())
SHEET = "[parameters]\nJ = 0.0031\nR = 1.55\nK_t = 0.0175\n"
FILES = {
    "good.csv": GOOD,
    "second.csv": csv(columns(0.3)),
    "copy.csv": GOOD,
    "good.toml": SHEET,
    "folder/x.txt": "kept",
    "empty.csv": "",
    "blank.csv": "\n\n",
    "header.csv": "t_s,u_V,theta_rad\n",
    "short.csv": "\n".join(GOOD.split("\n")[:50]),
    "text.csv": csv(with_cell("theta_rad", 7, "hello")),
    "text_time.csv": csv(with_cell("t_s", 7, "noon")),
    "infinite.csv": csv(with_cell("u_V", 7, "inf")),
    "repeats.csv": csv(with_cell("t_s", 7, "0.06")),
    "backwards.csv": csv(with_cell("t_s", 7, "0.01")),
    "ragged.csv": GOOD + "1,2\n",
    "binary.csv": "\0\1\2,\n\0",
    "constant.csv": csv(columns() | {"theta_rad": np.ones(N)}),
    "hole_time.csv": csv(with_cell("t_s", 9, "")),
    "mostly_nan.csv": csv(columns() | {"theta_rad": ["nan" if k % 2 else k for k in range(N)]}),
    "no_output.csv": csv({k: v for k, v in columns().items() if k != "theta_rad"}),
    "no_input.csv": csv({k: v for k, v in columns().items() if k != "u_V"}),
    "no_time.csv": csv({k: v for k, v in columns().items() if k != "t_s"}),
    "turns.csv": GOOD.replace("theta_rad", "theta_turns"),
    "amps.csv": GOOD.replace("u_V", "u_A"),
    "metres.csv": GOOD.replace("theta_rad", "x_m"),
    "duty.csv": GOOD.replace("u_V", "u_duty_pct"),
    "twice.csv": GOOD.replace("theta_rad", "u_V"),
    "two_outputs.csv": csv(columns() | {"theta_deg": np.degrees(columns()["theta_rad"])}),
    "notes.odt": GOOD,
    "fake.parquet": GOOD,
    "bad.toml": "[parameters",
    "unknown.toml": "[parameters]\nJJ = 1\n",
    "negative.toml": "[parameters]\nJ = -1\n",
    "nan.toml": "[parameters]\nJ = nan\n",
    "word.toml": '[parameters]\nJ = "big"\n',
    "section.toml": "[servo]\nJ = 1\n",
    "both.toml": SHEET + "[lumped]\nb = 1\n",
    "nothing.toml": "",
    "lumped.toml": "[lumped]\nb = 80\na_2 = 50\nc_2 = 100\n",
    "no_b.toml": "[parameters]\nk_s = 1\n",
    "strange.toml": SHEET + '[[effect]]\nname = "magic"\n',
    "volts.csv": csv({"t_s": T, "u_V": 8 * np.sin(3 * T)}),
    "volts_text.csv": csv({"t_s": T, "u_V": ["x"] * N}),
    "volts_hole.csv": csv({"t_s": T, "u_V": [""] + [1] * (N - 1)}),
    "volts_back.csv": csv({"t_s": T[::-1], "u_V": T}),
    "volts_one.csv": "t_s,u_V\n0,1\n",
    "exists.csv": "kept",
}

DIAGNOSE = {
    "no recording": "",
    "no such file": "missing.csv",
    "a folder": "folder",
    "empty": "empty.csv",
    "blank": "blank.csv",
    "header only": "header.csv",
    "too short": "short.csv",
    "text": "text.csv",
    "text in time": "text_time.csv",
    "infinite": "infinite.csv",
    "time repeats": "repeats.csv",
    "time backwards": "backwards.csv",
    "ragged": "ragged.csv",
    "binary": "binary.csv",
    "constant output": "constant.csv",
    "time missing": "hole_time.csv",
    "mostly missing": "mostly_nan.csv",
    "no output": "no_output.csv",
    "no input": "no_input.csv",
    "no time": "no_time.csv",
    "unknown output unit": "turns.csv",
    "unknown input unit": "amps.csv",
    "column twice": "twice.csv",
    "two outputs": "two_outputs.csv",
    "suffix": "notes.odt",
    "no parquet": "fake.parquet",
    "no run": "good.csv#run=3",
    "second file bad": "good.csv empty.csv",
    "held-out file bad": "good.csv --holdout empty.csv",
    "held-out file absent": "good.csv --holdout missing.csv",
    "no datasheet": "good.csv --datasheet missing.toml",
    "bad toml": "good.csv --datasheet bad.toml",
    "unknown key": "good.csv --datasheet unknown.toml",
    "negative": "good.csv --datasheet negative.toml",
    "nan": "good.csv --datasheet nan.toml",
    "word": "good.csv --datasheet word.toml",
    "section": "good.csv --datasheet section.toml",
    "both": "good.csv --datasheet both.toml",
    "nothing": "good.csv --datasheet nothing.toml",
    "csv as datasheet": "good.csv --datasheet good.csv",
    "empty datasheet name": ["good.csv", "--datasheet", ""],
    "same file twice": "good.csv copy.csv",
    "trained and held out": "good.csv second.csv --holdout copy.csv",
    "held out twice": "second.csv --holdout good.csv copy.csv",
    "output units": "good.csv metres.csv",
    "input units": "good.csv --holdout duty.csv",
    "folder holds files": "good.csv --out folder",
    "out is a file": "good.csv --out exists.csv",
    "out under a file": "good.csv --out exists.csv/deep",
    "out empty": ["good.csv", "--out", ""],
    "out without value": "good.csv --out",
    "json and full folder": "good.csv --json --out folder",
    "map form": "good.csv --map t_s",
    "map name": "good.csv --map time=t_s",
    "map column": "good.csv --map t_s=Time",
    "map twice": "good.csv --map t_s=a --map t_s=b",
    "seed": "good.csv --seed x",
    "negative seed": "good.csv --seed -1",
    "jobs": "good.csv --jobs 0",
    "fraction of jobs": "good.csv --jobs 1.5",
    "unknown option": "good.csv --fast",
    "holdout without value": "good.csv --holdout",
}
STEPS = "--plant reduced --input steps --out new.csv"
SIMULATE = {
    "no input": "--out new.csv",
    "no out": "--input steps",
    "input name": "--input stepz --out new.csv",
    "input file": "--input missing.csv --out new.csv",
    "input without u": "--input no_input.csv --out new.csv",
    "input text": "--input volts_text.csv --out new.csv",
    "input holes": "--input volts_hole.csv --out new.csv",
    "input backwards": "--input volts_back.csv --out new.csv",
    "input of one": "--input volts_one.csv --out new.csv",
    "input empty": "--input empty.csv --out new.csv",
    "rate of a file": "--input volts.csv --rate-hz 100 --out new.csv",
    "plant": "--plant real --input steps --out new.csv",
    "plants": "--plant reduced,mujoco --input steps --out new.csv",
    "linkage of the reduced": f"{STEPS} --linkage rod",
    "rod of a joint": f"lumped.toml {STEPS} --linkage rod --plant mujoco",
    "play twice": f"{STEPS} --gap 1 --effect backlash:gap=0.01",
    "printed without gap": f"{STEPS} --play printed",
    "printed in mujoco": f"{STEPS} --play printed --gap 1 --plant mujoco",
    "printed with effect": f"{STEPS} --play printed --gap 1 --effect bias_torque:tau_0=0.1",
    "play": f"{STEPS} --play loose",
    "linkage": f"{STEPS} --linkage rope",
    "inductance": f"{STEPS} --inductance maybe",
    "effect": f"{STEPS} --effect magic",
    "near effect": f"{STEPS} --effect stribek:dF_s=1",
    "effect key": f"{STEPS} --effect stribeck:F=1,v_s=1",
    "effect word": f"{STEPS} --effect stribeck:dF_s=big,v_s=1",
    "effect nan": f"{STEPS} --effect stribeck:dF_s=nan,v_s=1",
    "effect form": f"{STEPS} --effect stribeck:dF_s",
    "effect key twice": f"{STEPS} --effect bias_torque:tau_0=1,tau_0=2",
    "effect needs": f"{STEPS} --effect stribeck:dF_s=1",
    "effect without": f"{STEPS} --effect bias_torque",
    "effect sign": f"{STEPS} --effect input_delay:T_d=-1",
    "effect bounds": f"{STEPS} --effect load_dependent_friction:mu=2",
    "effect twice": f"{STEPS} --effect bias_torque:tau_0=1 --effect bias_torque:tau_0=2",
    "stops crossed": f"{STEPS} --effect end_stop:lower=1,upper=0",
    "gap and backlash": f"{STEPS} --gap 1 --effect backlash:gap=0.01",
    "effect empty": [*STEPS.split(), "--effect", ""],
    "noise": f"{STEPS} --noise-deg -1",
    "noise word": f"{STEPS} --noise-deg loud",
    "gap": f"{STEPS} --gap -1",
    "gap inf": f"{STEPS} --gap inf",
    "rate": f"{STEPS} --rate-hz 0",
    "rate huge": f"{STEPS} --rate-hz 1e12",
    "duration": f"{STEPS} --duration -3",
    "seed": f"{STEPS} --seed 1.5",
    "model": f"missing.toml {STEPS}",
    "model bad": f"bad.toml {STEPS}",
    "model too little": f"no_b.toml {STEPS}",
    "model magic": f"strange.toml {STEPS}",
    "inductance without L": f"good.toml {STEPS} --inductance on",
    "out exists": "--input steps --out exists.csv",
    "out folder": "--input steps --out folder",
    "out parquet": "--input steps --out new.parquet",
    "out under file": "--input steps --out exists.csv/new.csv",
    "two models": f"good.toml both.toml {STEPS}",
}
VALIDATE = {
    "gap word": "--gap wide",
    "gap negative": "--gap -0.5",
    "gap inf": "--gap 0,inf",
    "gap twice": "--gap 0.5,0.50",
    "gap open list": "--gap 0.5,",
    "gap without value": "--gap",
    "linkage": "--linkage rope",
    "linkages": "--linkage constant,rope",
    "linkage twice": "--linkage rod,rod",
    "inductance": "--inductance 1",
    "no datasheet": "--datasheet missing.toml",
    "bad datasheet": "--datasheet bad.toml",
    "too little": "--datasheet no_b.toml",
    "empty datasheet name": ["--datasheet", ""],
    "rod of a joint": "--datasheet lumped.toml --linkage rod",
    "no inductance": "--datasheet lumped.toml --inductance off,on",
    "jobs": "--jobs 0",
    "folder holds files": "--out folder",
    "out is a file": "--out exists.csv",
    "file given": "good.csv",
    "unknown option": "--quick",
}
OTHERS = {
    "no command": [],
    "unknown command": ["diagnoze"],
    "unknown option": ["--quick"],
    "demo with a file": ["demo", "good.csv"],
    "demo seed": ["demo", "--seed", "x"],
    "demo into files": ["demo", "--out", "folder"],
}
SPLIT = {
    **{f"diagnose {k}": ["diagnose", *(v if isinstance(v, list) else v.split())] for k, v in DIAGNOSE.items()},
    **{f"simulate {k}": ["simulate", *(v if isinstance(v, list) else v.split())] for k, v in SIMULATE.items()},
    **{f"validate {k}": ["validate", *(v if isinstance(v, list) else v.split())] for k, v in VALIDATE.items()},
    **OTHERS,
}


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder full of good and bad files, and a diagnosis that must not be reached."""
    for name, text in FILES.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def contents(folder) -> dict:
    return {str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}


def stub(monkeypatch, **changes) -> list:
    """Put a diagnosis in the place of the real one; its calls."""
    calls = []

    def diagnose(recordings, datasheet, holdout, *, seed, jobs, progress, search):
        calls.append(SimpleNamespace(recordings=recordings, datasheet=datasheet, holdout=holdout, seed=seed, jobs=jobs))
        progress("fitting", 0.5)
        if "raises" in changes:
            raise changes["raises"]
        document = {
            "version": 1,
            "verdict": "parameters_only",
            "sentence": "Only the parameters were off.",
            "missing": [],
            "where": [],
            "parameters": {"b": {"value": 91.0, "unit": "rad/s^2/V", "ci95": [90.0, 92.0], "datasheet": 81.0}},
            "fit": {"heldout_rmse_before_rad": np.float64(0.1), "heldout_rmse_after_rad": float("nan")},
            "seed": seed,
            "left_out": [{"part": part, "sentence": sentence} for part, sentence in search.left_out()],
            "data": {
                "output_unit": "rad",
                "input_unit": "V",
                "files": [r.name for r in recordings],
                "sha256": [],
                "problems": [],
            },
        }
        return SimpleNamespace(
            document=document,
            evidence=Evidence((), (), None, 1e-3, "rad", "V"),
            plant=SimpleNamespace(xml=lambda: "<mujoco/>"),
            model=changes.get("model", Datasheet(lumped={"b": 1.0})),
        )

    stub = SimpleNamespace(diagnose=diagnose)
    monkeypatch.setitem(sys.modules, "ers_mj.diagnosis.pipeline", stub)
    monkeypatch.setattr(diagnosis_room, "pipeline", stub, raising=False)  # where it has been imported already
    return calls


@pytest.mark.parametrize("argv", SPLIT.values(), ids=SPLIT)
def test_bad_input_is_one_sentence_code_2_and_nothing_written(argv, place, monkeypatch, capsys):
    calls, before = stub(monkeypatch), contents(place)
    assert cli.main(argv) == 2
    out, err = capsys.readouterr()
    assert out == "" and calls == []
    assert err.startswith("ers: ") and err.count("\n") == 1 and err.endswith("\n")
    assert "Traceback" not in err and 25 < len(err) < 2500
    assert contents(place) == before


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        ("simulate --input steps --out n.csv --effect stribek:dF_s=1", "did you mean stribeck?"),
        ("simulate --input steps --out n.csv --effect bias_torque:tau=1", "tau_0 (constant torque"),
        ("simulate --input stepz --out n.csv", "multisine, chirp, ramp, steps, square"),
        ("simulate --input steps --out n.csv --linkage rod", "a rod linkage needs --plant mujoco"),
        (
            "simulate lumped.toml --input steps --out n.csv --plant mujoco --linkage rod",
            "a rod linkage needs a datasheet with J, n and K_t",
        ),
        ("simulate --input steps --out n.csv --gap 1 --effect backlash:gap=0.01", "the play is given twice"),
        ("diagnoze", "did you mean diagnose? there are demo, diagnose, identify, simulate, validate, view"),
        ("validate --linkage constant,rope", "there is no 'rope'; there are constant, rod"),
        ("validate --datasheet lumped.toml --linkage rod", "a rod linkage needs a datasheet with J, n and K_t"),
        ("diagnose good.csv --map t_s=Time", "the columns are t_s, u_V, theta_rad"),
        ("diagnose good.csv metres.csv", "in m and that of good.csv in rad"),
        (
            "diagnose good.csv --holdout copy.csv",
            "copy.csv: is held out and also among the training recordings (as good.csv)",
        ),
        ("diagnose good.csv --out folder", "give --force"),
    ],
)
def test_the_sentence_says_what_exists(argv, words, place, monkeypatch, capsys):
    stub(monkeypatch)
    assert cli.main(argv.split()) == 2
    assert words in capsys.readouterr().err


# -- diagnose -------------------------------------------------------------------------------------------------------


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


# -- simulate ---------------------------------------------------------------------------------------------------------


def test_simulate_writes_a_recording_in_the_contracts_format(place, capsys):
    assert (
        cli.main(
            "simulate --plant reduced --input multisine --rate-hz 500 --duration 4 --noise-deg 0.01 --seed 3 --out"
            " new.csv --json".split()
        )
        == 0
    )
    summary = json.loads(capsys.readouterr().out)
    recording = read_recording(place / "new.csv")
    assert (place / "new.csv").read_text().startswith("t_s,u_V,theta_rad\n")
    assert recording.t.size == summary["samples"] == 2000 and recording.rate_hz == pytest.approx(500)
    assert np.degrees(recording.y.std()) > 2
    first = (place / "new.csv").read_bytes()
    again = "simulate --input multisine --rate-hz 500 --duration 4 --noise-deg 0.01 --seed 3 --out new.csv --force"
    assert cli.main(again.split()) == 0
    assert (place / "new.csv").read_bytes() == first


def test_simulate_keeps_the_users_times_and_voltages(place):
    assert cli.main("simulate --input volts.csv --out deep/new.csv".split()) == 0
    recording = read_recording(place / "deep/new.csv")
    np.testing.assert_array_equal(recording.t, T)
    np.testing.assert_array_equal(recording.u, 8 * np.sin(3 * T))
    assert recording.y[0] == pytest.approx(np.radians(15), abs=1e-12)


def simulated(place, options: str) -> np.ndarray:
    """theta (N,) [rad] of the file that a call of simulate writes."""
    assert cli.main(f"simulate --input steps --out new.csv --force {options}".split()) == 0
    return read_recording(place / "new.csv").y


def rms_deg(x: np.ndarray) -> float:
    return float(np.degrees(np.sqrt(np.mean(x**2))))


@pytest.mark.parametrize("inductance", ["off", "on"])
@pytest.mark.parametrize("gap", ["0", "0.5"])
def test_a_gap_is_the_same_play_on_both_plants(gap, inductance, place):
    options = f"--duration 2 --gap {gap} --inductance {inductance}"
    reduced, mujoco = simulated(place, options), simulated(place, f"--plant mujoco {options}")
    assert rms_deg(reduced - mujoco) < 0.02
    if gap != "0":
        assert rms_deg(reduced - simulated(place, "--duration 2")) > 0.1


def test_mujoco_simulates_rods_lumped_models_and_effects(place):
    short = "--duration 1 --plant mujoco"
    assert rms_deg(simulated(place, f"{short} --linkage rod") - simulated(place, short)) > 0.1
    lumped = simulated(place, f"lumped.toml {short}"), simulated(place, "lumped.toml --duration 1")
    assert rms_deg(lumped[0] - lumped[1]) < 0.01
    stopped = [
        simulated(place, f"--duration 1 {plant} --effect end_stop:upper=0.6,f_stop=80")
        for plant in ("", "--plant mujoco")
    ]
    assert stopped[0].max() < 0.7 and rms_deg(stopped[0] - stopped[1]) < 0.02


def test_play_as_printed_is_another_motion(place):
    printed, plain = simulated(place, "--duration 2 --gap 5 --play printed"), simulated(place, "--duration 2")
    assert 0.05 < rms_deg(printed - plain) < 5


def test_effects_act_in_si(place):
    def theta(options: str) -> np.ndarray:
        return simulated(place, options)

    plain = theta("")
    stopped = theta("--effect end_stop:upper=0.6,f_stop=80")
    assert plain.max() > 0.8 and 0.6 < stopped.max() < 0.68
    np.testing.assert_array_equal(theta("--gap 0"), plain)
    assert np.abs(theta("--inductance on") - plain).max() > 1e-6
    strong = theta("--effect bias_torque:tau_0=0.9")  # above F_c + T_LH = 0.8 N m: moves off without voltage
    weak = theta("--effect bias_torque:tau_0=0.7")
    assert strong[200] > strong[0] + 1e-3 and weak[200] == weak[0]
    steps = theta("--effect sensor_quantisation:step=0.01 --noise-deg 0.1") / 0.01
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)


def test_a_model_simulates_with_its_own_effects(place):
    (place / "model.toml").write_text(
        read_text_of_table1() + '[[effect]]\nname = "end_stop"\n[effect.parameters]\nupper = 0.6\n'
    )
    assert cli.main("simulate model.toml --input steps --out new.csv".split()) == 0
    assert read_recording(place / "new.csv").y.max() < 0.7


def read_text_of_table1() -> str:
    return "[parameters]\n" + "".join(f"{key} = {x!r}\n" for key, x in read_datasheet("table1").parameters.items())


# -- the program itself -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", ["", "cache", "demo", "diagnose", "simulate", "validate", "view"])
def test_help_has_an_example(command, capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main([*command.split(), "--help"])
    assert ended.value.code == 0 and "example" in capsys.readouterr().out


def test_help_loads_nothing_heavy():
    code = (
        "import sys; from ers_mj import cli\ntry: cli.main(['--help'])\nexcept SystemExit: pass\n"
        "print([m for m in ('numpy', 'numba', 'pyarrow', 'matplotlib', 'scipy') if m in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"


def test_the_cache_is_shown_and_cleared_of_what_is_ours(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cli.main(["cache", "--clear", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["files"] == 0 and list(tmp_path.iterdir()) == []
    code = tmp_path / "ers_mj" / "code"
    code.mkdir(parents=True, mode=0o700)
    (tmp_path / "ers_mj").chmod(0o700)
    stem = "ers_mj.plants.calm.rest-0123456789abcdef0123.py311"
    for name in (f"{stem}.nbi", f"{stem}.1.nbc", "notes.nbi", "thesis.txt"):
        (code / name).write_text("x" * 10)
    assert cli.main(["cache"]) == 0
    told = capsys.readouterr().out
    assert str(code) in told and "2 files" in told and "plants" in told and "2 files that are not ours" in told
    assert cli.main(["cache", "--clear"]) == 0
    assert {file.name for file in code.iterdir()} - {"lock"} == {"notes.nbi", "thesis.txt"}


def test_progress_is_silent_in_a_pipe(capsys):
    with output.Progress() as progress:
        progress("fitting", 0.3)
    assert capsys.readouterr() == ("", "")


def test_json_has_no_nan():
    assert json.loads(as_json({"a": np.array([1.0, np.nan]), "b": (np.int64(2), float("inf"))})) == {
        "a": [1.0, None],
        "b": [2, None],
    }
