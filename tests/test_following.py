"""Runs that follow their log, where they lead two bodies that bounce, and a model begun again from its closed form."""

from dataclasses import replace

import numpy as np
import pytest
from test_position_loop import LIMITED, recorded, run_of, steps_of

from ers_mj.data.recording import from_arrays
from ers_mj.effects.backlash import Backlash
from ers_mj.position_loop.fit import Data, fitted
from ers_mj.position_loop.model import LoopModel
from ers_mj.position_loop.runs import runs_of, scales_of
from ers_mj.position_loop.selection import Selector
from ers_mj.position_loop.two_bodies import refitted


def test_a_run_follows_what_was_scored_of_its_log():
    run = runs_of(recorded(LIMITED, seeds=(1,)))[0]
    slower = LoopModel(LIMITED | {"K": 500.0}, ())
    free, followed = (run.y - slower.motion(run, following=rate)[:, 0] for rate in (0.0, 60.0))
    assert np.sqrt(np.mean(followed**2)) < 0.3 * np.sqrt(np.mean(free**2))
    unscored = replace(run, scored=np.zeros(run.t.size, bool))
    assert np.array_equal(slower.motion(unscored, following=60.0), slower.motion(run))


@pytest.mark.parametrize("side", ["load", "motor"])
def test_both_bodies_follow_the_log_of_either(side):
    letters, play = LIMITED | {"rubbed": 0.3, "grease": 0.1}, (Backlash.name, np.array([0.02, 0.6, 0.3, 60.0, 0.5]))
    run = runs_of(recorded(letters, seeds=(1,), effects=(play,), side=side))[0]
    other = LoopModel(letters | {"K": 500.0}, (), (play,), side)
    free, followed = (run.y - other.logged(other.motion(run, following=rate)) for rate in (0.0, 60.0))
    assert np.sqrt(np.mean(followed**2)) < 0.3 * np.sqrt(np.mean(free**2))
    motion = other.motion(run, following=60.0)
    assert np.max(np.abs(motion[:, 0] - motion[:, 2])) < 0.03


def test_a_play_in_a_loop_that_swings_is_fitted_along_runs_that_follow():
    letters = LIMITED | {"K": 6000.0, "rubbed": 0.3, "grease": 0.1}
    model = LoopModel(letters, tuple(letters), ((Backlash.name, np.array([0.01, 0.6, 0.3, 60.0, 0.5])),))
    data = Data.of(runs_of(recorded(letters, seeds=(3,), effects=model.effects)))
    model = replace(model, scales=scales_of(data.runs, True, letters["c_2"], letters["L"]))
    near = []
    for size in (0.5, 0.75, 1.3, 1.6):
        for gain in (0.75, 1.2):
            play = np.array([size * 0.01, 0.6, 0.3, 60.0, 0.5])
            start = model.having(K=gain * letters["K"]).with_effect(Backlash.name, play)
            found = fitted(start, data), refitted([start], data, 30, 1.0)
            near.append([fit.misfit < 2.0 for fit in found])
    free, led = np.sum(near, axis=0)
    assert led >= 6 and free <= led - 2


def test_what_the_register_multiplies_is_told_again_once_all_else_is_there():
    letters = LIMITED | {"D": 8.0, "R": 3.0}
    recordings = []
    for seed, gain in ((1, 1.0), (2, 2.2)):
        t, r = steps_of(seed)
        y = LoopModel(letters, (), whole=True).predicted(replace(run_of(t, r), gain=gain))
        noise = 3e-4 * np.random.default_rng(seed).standard_normal(t.size)
        recordings.append(from_arrays(t, r, y + noise, input_unit="rad", kp=gain))
    selector = Selector(runs_of(recordings), True)
    begun = LoopModel(letters, ("K", "L", "a_2", "c_2", "tau_s", "D", "R"), scales=selector.base().model.scales)
    wrong = fitted(begun, selector.data)
    found = selector.begun_again(wrong)
    assert found.model.whole and found.misfit < 1.2 < wrong.misfit
