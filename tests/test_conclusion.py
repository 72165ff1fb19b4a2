"""What is said in the end, by numbers alone."""

from types import SimpleNamespace

import numpy as np
import pytest

from ers_mj.decisions import conclusion
from ers_mj.decisions.conclusion import Shown
from ers_mj.decisions.confirmation import HeldOut, is_no_closer
from ers_mj.decisions.policy import POLICY


def findings(**some):
    """What is read where nothing is named, nothing is left and the datasheet is wrong; but for ``some``."""
    nothing = {"output": 0.0, "current": 0.0}
    plain = {
        "names": (),
        "sensors": (),
        "suspects": (),
        "explained": 0.0,
        "heldout_cost": (0.0, 0.0),
        "left_before": nothing,
        "left": nothing,
        "left_elsewhere": 0.0,
        "free_train": 1.0,
        "free_held": 1.0,
        "least_astray": 1.0,
        "datasheet_explains": False,
    }
    return SimpleNamespace(**(plain | some))


@pytest.mark.parametrize(
    "some, verdict",
    [
        ({}, "parameters_only"),
        ({"datasheet_explains": True}, "consistent"),
        ({"names": ("stribeck",), "explained": 0.6}, "missing_physics"),
        ({"names": ("stribeck",), "explained": 0.3}, "unexplained"),
        ({"sensors": ("sensor_quantisation",)}, "missing_physics"),
        ({"suspects": ("running_in",)}, "unexplained"),
        ({"left": {"output": 0.2, "current": 0.0}, "free_held": 2.0}, "unexplained"),
        ({"left": {"output": 0.2, "current": 0.0}}, "parameters_only"),
    ],
)
def test_the_verdict(some, verdict):
    """Of a mismatch of the output nothing is said where the free runs leave none."""
    assert conclusion.verdict(findings(**some)) == verdict


def test_where_every_free_run_is_lost_the_parameters_are_not_all_that_was_off():
    verdicts = [conclusion.verdict(findings(least_astray=times * POLICY.astray)) for times in (1.1, 0.9)]
    assert verdicts == ["unexplained", "parameters_only"]


@pytest.mark.parametrize(
    "lost, left, explained",
    [((60.0, 80.0), 0.5, 0.99), ((20.0, 25.0), 0.5, 0.495), ((20.0, 25.0), 0.0, 0.99), ((7.0, 5.0), 0.0, 0.745)],
)
def test_a_free_run_that_is_lost_with_and_without_the_effects_tells_nothing(lost, left, explained):
    shown = [Shown(before, after, 1.0, 1.0, 1.0) for before, after in ((10.0, np.sqrt(1.99)), lost)]
    assert conclusion.explained_each(shown, {"output": 0.0}, {"output": left}) == pytest.approx(explained)


def test_where_all_free_runs_fork_the_observer_tells_what_is_explained():
    shown = [Shown(11.0, 9.0, 1.0, 5.0, 1.5)]
    assert conclusion.explained_each(shown, {"output": 0.0}, {"output": 0.0}) == pytest.approx(0.875)


@pytest.mark.parametrize("before, explained", [(0.2, 0.75), (0.05, 0.0)])
def test_where_no_error_is_above_the_noise_memory_tells_what_is_explained(before, explained):
    shown = [Shown(0.99, 0.9, 1.0, 1.0, 1.0)]
    left, left_before = ({"output": float(np.log1p(power)), "current": 0.0} for power in (before / 4, before))
    assert conclusion.explained_each(shown, left_before, left) == pytest.approx(explained)


@pytest.mark.parametrize(
    "before, after, named",
    [(150.0, 10.0, True), (150.0, 60.0, False), (5.0, 0.2, False)],
)
def test_what_nearly_all_of_a_large_misfit_asks_for_is_named_though_its_free_runs_fork(before, after, named):
    told = conclusion.told_effects(findings(names=("backlash",), heldout_cost=(before, after)))
    assert bool(told) is named


@pytest.mark.parametrize(
    "explained, before, after, named",
    [(0.45, 0.12, 0.01, True), (0.45, 0.12, 0.06, False), (0.3, 0.12, 0.01, False), (0.45, 0.02, 0.0, False)],
)
def test_what_memory_loses_is_named_though_one_free_run_forks(explained, before, after, named):
    left_before, left = ({"output": power, "current": 0.0} for power in (before, after))
    f = findings(names=("backlash",), explained=explained, left_before=left_before, left=left)
    assert bool(conclusion.told_effects(f)) is named


@pytest.mark.parametrize(
    "explained, left, after, part",
    [(0.95, 0.2, 3.0, True), (0.99, 0.2, 3.0, False), (0.95, 0.05, 3.0, False), (0.95, 0.2, 9.0, False)],
)
def test_what_memory_and_held_out_error_both_miss_is_left(explained, left, after, part):
    f = findings(names=("supply_sag",), explained=explained, left={"output": left}, free_held=after)
    assert conclusion.is_a_part(f) is part


@pytest.mark.parametrize(
    "p, ratio, log_ratio, no_closer",
    [
        (0.04, 1.2, 0.18, True),
        (1e-6, 1.2, 0.18, False),
        (1e-6, 1.4, 0.34, True),
        (0.04, 0.9, -0.1, False),
        (1e-6, 1.7, -0.6, False),
        (0.04, 1.7, -0.6, True),
        (1e-6, 1.7, 0.2, True),
    ],
)
def test_blocks_beyond_doubt_outweigh_a_free_run_that_forks(p, ratio, log_ratio, no_closer):
    held = HeldOut(p, (ratio, 1.0), 1.0, (0.0, 0.0), ratio, log_ratio)
    assert is_no_closer(held) is no_closer
