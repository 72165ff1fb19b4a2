"""Bad input of a command: one clear sentence, code 2 and nothing written."""

import pytest
from command_files import contents, lay_out, stub

from ers_mj import cli

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
    monkeypatch.chdir(tmp_path)
    return lay_out(tmp_path)


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
