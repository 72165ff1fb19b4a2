"""Scattered servos: the same whatever the jobs, within the spread, and told."""

import json
from dataclasses import replace

import numpy as np
import pytest

from ers_mj import cli
from ers_mj.control.monte_carlo import Fleet, Spread, scatter, scattered
from ers_mj.control.trial import Conditions, try_out
from ers_mj.servo.datasheet import read_datasheet
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
