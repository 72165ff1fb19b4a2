"""Designed inputs: within the limits, never promised to be worse, and as good as promised where refits say so."""

import json
import math

import numpy as np
import pytest

from ers_mj import cli
from ers_mj.data.input_file import read_input
from ers_mj.errors import InputError
from ers_mj.experiment_design import optimal_input as experiment
from ers_mj.experiment_design.optimal_input import built, planned, reference
from ers_mj.experiment_design.question import Question, Rig
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.servo.datasheet import read_datasheet

SHEET = read_datasheet("table1")
HOME, TRAVEL, U_MAX = SHEET.parameters["theta_0"], math.radians(60), 24.0


def rig(current=0.02, duration=2.0):
    return Rig.of(HOME, U_MAX, TRAVEL, duration, 500.0, math.radians(0.01), current)


@pytest.fixture(scope="module")
def for_b():
    question = Question.of(SHEET, rig(), ("B",))
    before = reference(question)
    return question, before, planned(question, before)


def test_the_design_keeps_to_the_limits(for_b):
    plan = for_b[2]
    motion = ReducedModel(lumped(SHEET.to_lumped())).simulate(for_b[0].rig.t, plan.u)
    assert np.max(np.abs(plan.u)) <= U_MAX and np.max(np.abs(motion.theta - HOME)) <= TRAVEL * (1 + 1e-9)
    assert plan.u.size == for_b[0].rig.t.size and np.array_equal(plan.u, np.concatenate([built(p) for p in plan.parts]))


def test_with_the_current_b_is_known_to_a_per_cent_and_several_times_better_than_before(for_b):
    _, before, plan = for_b
    assert (
        plan.found["B"] < 0.01
        and plan.spread["B"] < 0.4 * before.spread["B"]
        and plan.found["B"] < 0.6 * before.found["B"]
    )


def test_refits_keep_the_promise(for_b):
    """RMS of REFITS errors over their standard deviation: chi-square within its 99.9 %, both ways, times what a linear
    promise may err.
    """
    ratio = for_b[2].found["B"] / for_b[2].spread["B"]
    assert 0.4 < ratio < 2.5


def test_information_grows_with_time_and_falls_with_noise():
    """Twice the noise, four times less information; what is known beforehand stays negligible."""
    quiet = Question.of(SHEET, rig(None), ("c_2",), inductance=False)
    loud = Question.of(SHEET, Rig.of(HOME, U_MAX, TRAVEL, 2.0, 500.0, math.radians(0.02)), ("c_2",), inductance=False)
    u = np.clip(experiment.INPUTS["multisine"](quiet.rig.t), -U_MAX, U_MAX)
    assert loud.plan(u).spread["c_2"] / quiet.plan(u).spread["c_2"] == pytest.approx(2.0, rel=0.25)


def test_what_the_sensors_cannot_tell_is_refused():
    with pytest.raises(InputError, match="measuring the current would help"):
        Question.of(SHEET, rig(None), ("B",), inductance=False)
    with pytest.raises(InputError, match="there is no 'Q'"):
        Question.of(SHEET, rig(), ("Q",))
    with pytest.raises(InputError, match="depend on each other"):
        Question.of(SHEET, rig(), ("a_2", "b", "B", "K_e"), "D")


@pytest.mark.parametrize(
    "options",
    [
        ["--against", "x"],
        ["--for", "Q"],
        ["--duration-s", "1e9"],
        ["--umax-V", "-1"],
        ["--for", "B", "--inductance", "off"],
    ],
)
def test_bad_options_are_one_sentence_and_write_nothing(options, tmp_path, capsys):
    out = tmp_path / "next.csv"
    assert cli.main(["excite", "--out", str(out), *options]) == 2
    assert capsys.readouterr().err.count("\n") == 1 and not out.exists()


def test_the_command_writes_an_input_that_simulate_takes(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(experiment, "EFFORT", experiment.Effort(refits=2, rounds=1, checked=2))
    out = tmp_path / "next.csv"
    assert (
        cli.main(
            [
                "excite",
                "--umax-V",
                "12",
                "--duration-s",
                "2",
                "--rate-hz",
                "500",
                "--for",
                "c_2,b",
                "--inductance",
                "off",
                "--out",
                str(out),
                "--json",
            ]
        )
        == 0
    )
    told = json.loads(capsys.readouterr().out)
    assert set(told["half_width_95"]) == {"c_2", "b"} and told["parts"]
    t, u = read_input(out)
    assert t.size == 1000 and np.max(np.abs(u)) <= 12.0
    assert cli.main(["simulate", "--input", str(out), "--out", str(tmp_path / "rec.csv")]) == 0
