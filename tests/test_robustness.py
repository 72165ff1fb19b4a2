"""Scattered servos: the same whatever the jobs, within the spread, and told."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ers_mj import cli
from ers_mj.control.monte_carlo import Fleet, Spread, scatter, scattered
from ers_mj.control.trial import Conditions, try_out
from ers_mj.servo.datasheet import read_datasheet
from ers_mj.workers.finished import Finished
from ers_mj.workers.here import Here

SHEET = read_datasheet("table1")
CONDITIONS = Conditions(rate_hz=500.0, noise=1e-4, seed=3, effects=(("stribeck", {"dF_s": 0.05, "v_s": 0.3}),))


def test_jobs_do_not_change_the_result_and_seeds_do():
    runs = [
        scatter(Fleet(SHEET, 3, 1.3), ["pid"], ["reduced"], ["step"], replace(CONDITIONS, seed=seed), crew=Here(jobs))
        for seed, jobs in ((3, 1), (3, 2), (4, 1))
    ]
    assert runs[0] == runs[1] and runs[0] != runs[2] and len(runs[0][0].measures) == 3


def test_factors_stay_within_the_spread_and_differ():
    sheet, effects = scattered(
        replace(SHEET, effects=(("cogging", {"A": 0.01, "period": 0.1}),)),
        CONDITIONS.effects,
        1.5,
        np.random.default_rng(0),
    )
    ratio = {name: sheet.parameters[name] / x for name, x in SHEET.parameters.items() if x}
    assert ratio["n"] == ratio["theta_0"] == 1.0 and len(set(ratio.values())) == 10
    assert all(1 / 1.5 <= x <= 1.5 for x in ratio.values())
    assert (
        dict(effects)["stribeck"]["v_s"] == 0.3
        and dict(effects)["stribeck"]["dF_s"] != 0.05
        and dict(sheet.effects)["cogging"]["period"] == 0.1
    )


def test_no_spread_is_the_servo_itself():
    (spread,) = scatter(Fleet(SHEET, 1, 1.0), ["pid"], ["reduced"], ["step"], CONDITIONS)
    assert spread.measures == (try_out(SHEET, ["pid"], ["reduced"], ["step"], CONDITIONS)[0].measures,)


def test_quantiles_are_of_the_loops_that_have_the_measure():
    sound = try_out(SHEET, ["pid"], ["reduced"], ["step"], CONDITIONS)[0].measures
    many = [replace(sound, rmse_rad=x) for x in (1.0, 2.0, 3.0)] + [
        replace(sound, settling_time_s=None, rmse_rad=4.0),
        replace(sound, stable=False, rmse_rad=None, settling_time_s=None),
    ]
    told = Spread("pid", "reduced", "step", tuple(many)).as_document()
    assert told["plants"] == 5 and told["unstable"] == 1 and told["never_settled"] == 1
    assert told["measures"]["rmse_rad"]["median"] == 2.5 and told["measures"]["rmse_rad"]["largest"] == 4.0


def test_the_command_tells_the_distribution(tmp_path, capsys):
    arguments = [
        "trial",
        "--controller",
        "pid,ftrc",
        "--rate-hz",
        "500",
        "--plants",
        "3",
        "--scatter",
        "1.1",
        "--jobs",
        "1",
    ]
    assert cli.main([*arguments, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["robustness"]
    assert [s["controller"] for s in told] == ["pid", "ftrc"] and all(
        s["plants"] == 3 and s["unstable"] == 0 for s in told
    )
    assert (
        told[0]["measures"]["rmse_rad"]["q05"]
        <= told[0]["measures"]["rmse_rad"]["median"]
        <= told[0]["measures"]["rmse_rad"]["largest"]
    )
    assert cli.main([*arguments, "--out", str(tmp_path / "out")]) == 0
    assert (
        "3 servos" in capsys.readouterr().out and "Scattered servos" in (tmp_path / "out" / "report.html").read_text()
    )


@pytest.mark.parametrize(("arguments", "says"), [(["--plants", "-1"], "--plants"), (["--scatter", "0.5"], "below 1")])
def test_bad_numbers_are_refused(arguments, says, capsys):
    assert cli.main(["trial", "--json", *arguments]) == 2 and says in capsys.readouterr().err


# -- stopped, and carried on ------------------------------------------------------------------------------------------

FEW = ["trial", "--controller", "pid", "--rate-hz", "500", "--plants", "3", "--jobs", "1", "--out"]


def test_a_servo_that_is_finished_is_not_tried_again(tmp_path, monkeypatch, capsys):
    """Stopped after the first servo, the rest is tried alone, and the results are those of a run in one go."""
    plain, tried = Here.run, []

    def stopped(self, tasks):
        yield next(plain(self, tasks))
        raise KeyboardInterrupt

    def counted(self, tasks):
        tried.extend(tasks)
        yield from plain(self, tried)

    out, whole = tmp_path / "out", tmp_path / "whole"
    with monkeypatch.context() as patch:
        patch.setattr(Here, "run", stopped)
        assert cli.main([*FEW, str(out)]) == 130
    assert "goes on from there" in capsys.readouterr().err and not (out / "trials.json").exists()
    monkeypatch.setattr(Here, "run", counted)
    assert cli.main([*FEW, str(out)]) == 0 and [task.name for task in tried] == ["1", "2"]
    assert "goes on where it was left" in capsys.readouterr().err
    assert cli.main([*FEW, str(whole)]) == 0
    assert {path.name for path in out.iterdir()} == {"trials.json", "report.html"}
    for path in whole.iterdir():
        assert (out / path.name).read_bytes() == path.read_bytes()


def test_a_servo_that_was_asked_otherwise_is_tried_again(tmp_path):
    finished = Finished(tmp_path)
    asked = ["pid"], ["reduced"], ["step"]
    first = scatter(Fleet(SHEET, 2, 1.3), *asked, CONDITIONS, finished=finished)
    other = scatter(Fleet(SHEET, 2, 1.3), *asked, replace(CONDITIONS, noise=2e-4), finished=finished)
    assert first != other == scatter(Fleet(SHEET, 2, 1.3), *asked, replace(CONDITIONS, noise=2e-4))


def test_nothing_stays_of_a_trial_that_is_stopped_at_once(tmp_path, monkeypatch):
    def stopped(self, tasks):
        raise KeyboardInterrupt

    monkeypatch.setattr(Here, "run", stopped)
    assert cli.main([*FEW, str(tmp_path / "out")]) == 130 and not (tmp_path / "out").exists()


def test_killed_it_goes_on_to_the_same_bytes(tmp_path, capsys):
    """kill -9 as soon as a servo is finished."""
    asked, out, whole = [*FEW[:-1], "--rate-hz", "1000", "--out"], tmp_path / "out", tmp_path / "whole"
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}
    command, quiet = [sys.executable, "-m", "ers_mj", *asked, str(out)], subprocess.DEVNULL
    begun = subprocess.Popen(command, env=environment, stdout=quiet, stderr=quiet)
    while not (out / ".trial/0.json").exists():
        assert begun.poll() is None
        signal.sigtimedwait([], 0.01)
    begun.kill()
    begun.wait()
    assert not (out / "trials.json").exists()
    assert cli.main([*asked, str(out)]) == cli.main([*asked, str(whole)]) == 0
    assert capsys.readouterr().err.count("goes on where it was left") == 1
    for path in whole.iterdir():
        assert (out / path.name).read_bytes() == path.read_bytes()
