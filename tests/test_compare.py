"""Two diagnoses beside each other: what is beyond chance is told, what is chance is not, unlike ones are refused."""

import copy
import json

import numpy as np
import pytest

from ers_mj.cli import main
from ers_mj.comparing.chance import Estimate, between, beyond_chance, p_value
from ers_mj.comparing.differences import compare
from ers_mj.comparing.documents import Told, read_told
from ers_mj.errors import InputError

VALUES = {"a_1": 27.0, "a_2": 70.0, "b": 90.0, "c_1": 130.0, "c_2": 105.0, "theta_0": 0.26}


def entry(value, spread, unit="1/s"):
    """A parameter with its interval, by factor but of an angle."""
    ends = [value - 1.96 * spread, value + 1.96 * spread] if unit == "rad" else None
    ends = ends or [value * np.exp(-1.96 * spread), value * np.exp(1.96 * spread)]
    return {"value": value, "unit": unit, "ci95": [float(x) for x in ends], "datasheet": 1.0, "identifiable": True}


def diagnosis(values=VALUES, spread=0.02, missing=(), significant=False, **data):
    rows = {k: entry(x, spread, "rad" if k == "theta_0" else "1/s") for k, x in values.items()}
    rows["k_s/J"] = rows["a_1"]
    rows["J"] = {"value": None, "unit": "kg m^2", "ci95": [None, None], "datasheet": 3e-3, "identifiable": False}
    return {
        "version": 1,
        "verdict": "missing_physics" if missing else "parameters_only",
        "missing": list(missing),
        "remainder": {"significant": significant},
        "record_state": [],
        "fit": {"measure": "free_run", "window_s": None, "heldout_rmse_after_rad": 1e-3, "noise_floor_rad": 1e-3},
        "parameters": rows,
        "data": {"input_kind": "voltage", "input_unit": "V", "output_unit": "rad", "sha256": [], "files": []} | data,
    }


def named(effect, p=1e-6, alternatives=(), **parameters):
    return {
        "effect": effect,
        "parameters": {k: entry(*x) for k, x in parameters.items()},
        "evidence": {"p_value": p},
        "alternatives": [{"effect": other} for other in alternatives],
    }


def lines(a, b):
    return {d["what"]: d for d in compare(Told("a", a), Told("b", b))["differences"]}


def beyond(a, b):
    return {what for what, line in lines(a, b).items() if line["significant"]}


def test_nothing_differs_from_itself():
    found = compare(Told("a", diagnosis()), Told("b", diagnosis()))
    assert not any(d["significant"] for d in found["differences"])
    assert found["sentence"] == "Nothing differs beyond chance."


def test_a_servo_twice_differs_at_most_as_often_as_is_said():
    """Estimates of one servo, drawn 400 times: one difference or more in 5 % of the pairs, within chance of that."""
    random, wrong = np.random.default_rng(1), 0
    drawn = lambda: {
        k: x + 0.02 * random.standard_normal() if k == "theta_0" else x * np.exp(0.02 * random.standard_normal())
        for k, x in VALUES.items()
    }
    for _ in range(400):
        wrong += bool(beyond(diagnosis(drawn()), diagnosis(drawn())))
    assert 0.02 < wrong / 400 < 0.09


def test_a_changed_parameter_is_the_one_that_is_told():
    line = lines(diagnosis(), diagnosis({**VALUES, "b": 110.0}))
    assert {what for what, x in line.items() if x["significant"]} == {"b"}
    low, high = line["b"]["ci95"]
    assert low < 20.0 < high and (line["b"]["a"], line["b"]["b"]) == (90.0, 110.0)
    assert "beyond chance" in line["b"]["sentence"] and "k_s/J" not in line and "J" not in line


def test_what_one_cannot_tell_is_said():
    other = diagnosis()
    other["parameters"]["b"]["value"] = None
    found = compare(Told("a", diagnosis()), Told("b", other))
    assert "b" not in {d["what"] for d in found["differences"]}
    assert any("cannot tell: b" in note for note in found["notes"])


@pytest.mark.parametrize(
    ("entry_a", "other", "told"),
    [
        (named("backlash"), diagnosis(), True),
        (named("backlash", p=0.9), diagnosis(), False),
        (named("backlash", alternatives=["cogging"]), diagnosis(missing=[named("cogging")]), False),
        (named("backlash"), diagnosis(significant=True), False),
    ],
    ids=["it differs", "by chance", "by another name", "hidden in what is left"],
)
def test_an_effect_that_one_names(entry_a, other, told):
    a = diagnosis(missing=[entry_a], significant=other["remainder"]["significant"])
    assert ("backlash" in beyond(a, other)) is told
    assert lines(other, a)["backlash"]["b"] is True


def test_the_parameters_of_a_shared_effect_are_compared():
    a, b = (diagnosis(missing=[named("backlash", gap=(gap, 0.03, "m"))]) for gap in (0.01, 0.02))
    assert beyond(a, b) == {"backlash gap"}


def test_a_drift_that_one_has():
    drifting = diagnosis()
    drifting["record_state"] = [
        {"name": "gain", "unit": "-", "values": [1.0, 1.16], "ci95": [[None, None], [1.1, 1.2]]}
    ]
    assert beyond(diagnosis(), drifting) == {"drift of gain"}


def test_tests_are_judged_together():
    assert beyond_chance([0.04, 0.5]) == [False, False] and beyond_chance([0.02, 0.04]) == [True, True]
    assert beyond_chance([]) == []


def test_intervals_of_differences():
    a, b = Estimate(1.0, 0.9, 1.1), Estimate(2.0, 1.8, 2.2)
    assert between(a, b) == pytest.approx((1.0 - np.hypot(0.2, 0.1), 1.0 + np.hypot(0.2, 0.1)))
    assert p_value(a, a) == 1.0 and p_value(Estimate(1.0, 1.0, 1.0), Estimate(2.0, 2.0, 2.0)) == 0.0
    open_end = diagnosis()
    open_end["parameters"]["b"]["ci95"] = [80.0, None]
    line = lines(diagnosis({**VALUES, "b": 500.0}), open_end)["b"]
    assert line["ci95"] is None and not line["significant"]


# -- the command ------------------------------------------------------------------------------------------------------


@pytest.fixture
def two(tmp_path):
    for name, document in (("a", diagnosis()), ("b", diagnosis({**VALUES, "c_2": 160.0}))):
        (tmp_path / name).mkdir()
        (tmp_path / name / "diagnosis.json").write_text(json.dumps(document))
    return tmp_path


def test_the_command_tells_shows_and_writes(two, capsys):
    assert main(["compare", str(two / "a"), str(two / "b" / "diagnosis.json"), "--out", str(two / "out")]) == 0
    assert "1 of what was compared differs beyond chance: c_2." in capsys.readouterr().out
    page = (two / "out" / "report.html").read_text()
    assert page.count("<svg") == 2 and page.count("<table") == 1
    assert main(["compare", str(two / "a"), str(two / "b"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["differences"]
    assert {"what", "a", "b", "unit", "ci95", "significant", "sentence"} <= set(found[0])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"output_unit": "m"}, "its output is in m, that of"),
        ({"input_kind": "torque"}, "its input is a torque"),
        ({"input_unit": "pct"}, "its input is in pct"),
    ],
)
def test_unlike_diagnoses_are_refused(two, change, said, capsys):
    other = copy.deepcopy(diagnosis(**change))
    (two / "b" / "diagnosis.json").write_text(json.dumps(other))
    assert main(["compare", str(two / "a"), str(two / "b"), "--json"]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"version": 1}', json.dumps(diagnosis() | {"version": 2})])
def test_what_is_no_diagnosis_is_refused(two, text):
    (two / "b" / "diagnosis.json").write_text(text)
    with pytest.raises(InputError, match=r"diagnosis\.json"):
        read_told(two / "b")


def test_a_folder_without_a_diagnosis_is_refused(two):
    for path in (two, two / "nowhere"):
        with pytest.raises(InputError, match="was expected"):
            read_told(path)
