"""What is said in the end, by numbers alone: the share that is explained, whether more is missing, the verdict."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from ers_mj.decisions import verdict as rules
from ers_mj.decisions.thresholds import POLICY
from ers_mj.decisions.verdict import Shown
from ers_mj.diagnosis.errors_told import as_named
from ers_mj.diagnosis.sentences import of_another_day


def left(output=0.0, current=0.0):
    return {"output": output, "current": current}


@dataclass(frozen=True)
class Findings:
    """A servo whose one effect explains everything, unless told otherwise."""

    names: tuple = ("supply_sag",)
    sensors: tuple = ()
    suspects: tuple = ()
    recordings_differ: bool = False
    explained: float = 1.0
    left_before: dict = field(default_factory=lambda: left(0.5))
    left: dict = field(default_factory=left)
    left_elsewhere: float = 0.0
    free_held: float = 1.0
    least_astray: float = 2.0
    datasheet_explains: bool = False


RIGHT = Findings()
NONE = Findings((), explained=0.0, left_before=left())


@pytest.mark.parametrize(
    "change, said",
    [
        ({}, "parameters_only"),
        ({"datasheet_explains": True}, "consistent"),
        ({"least_astray": 31.0}, "unexplained"),  # no free run meets the plant
        ({"suspects": ("torque_saturation",)}, "unexplained"),
        ({"sensors": ("sensor_dropout",)}, "missing_physics"),
        ({"left": left(0.2)}, "unexplained"),
        ({"left": left(0.02)}, "parameters_only"),
        ({"left": left(current=0.2)}, "unexplained"),
        ({"left_elsewhere": 0.06}, "unexplained"),
        ({"left_elsewhere": 0.04}, "parameters_only"),
    ],
)
def test_the_verdict_on_a_servo_without_names(change, said):
    case = replace(NONE, **change)
    assert rules.verdict(case) == said
    assert rules.is_more_left(case) is (said == "unexplained")


@pytest.mark.parametrize(
    "change, said, more",
    [
        ({}, "missing_physics", False),
        ({"explained": 0.4, "left": left(0.2)}, "unexplained", True),
        ({"suspects": ("torque_saturation",)}, "missing_physics", True),
        ({"left": left(0.2), "explained": 0.9}, "missing_physics", True),
        ({"left": left(0.14), "explained": 0.99}, "missing_physics", False),
    ],
)
def test_the_verdict_on_a_servo_with_a_name(change, said, more):
    case = replace(RIGHT, **change)
    assert rules.verdict(case) == said and rules.is_more_left(case) is more
    assert tuple(rules.told_effects(case)) == (RIGHT.names if said == "missing_physics" else ())


@pytest.mark.parametrize(
    "explained, output, held, part",
    [(0.95, 0.2, 3.0, True), (0.99, 0.2, 3.0, False), (0.95, 0.05, 3.0, False), (0.95, 0.2, 9.0, False)],
)
def test_what_memory_and_held_out_error_both_miss_is_left(explained, output, held, part):
    case = replace(RIGHT, explained=explained, left=left(output), free_held=held)
    assert rules.is_a_part(case) is part
    assert not rules.is_a_part(replace(case, names=()))


def test_what_stands_for_an_unknown_effect_takes_a_part_only():
    """What stands for it in the output seldom does in the current, which no form of the right law leaves amiss."""
    assert not rules.is_more_than_noise(left(0.08), None) and rules.is_more_than_noise(left(0.09), None)
    assert not rules.is_more_than_noise(left(0.14), left(0.5))
    assert rules.is_more_than_noise(left(0.16), left(0.5))
    assert rules.is_more_than_noise(left(0.0, 0.09), left(0.5, 0.5))
    assert rules.is_more_than_noise(left(0.03), None, replace(POLICY, mismatch=0.02))


def shown(before, after, noise=1.0, misfits=(2.0, 1.0)):
    return Shown(before, after, noise, *misfits)


@pytest.mark.parametrize(
    "lost, output, explained",
    [((60.0, 80.0), 0.5, 0.99), ((20.0, 25.0), 0.5, 0.495), ((20.0, 25.0), 0.0, 0.99), ((7.0, 5.0), 0.0, 0.745)],
)
def test_a_free_run_that_is_lost_with_and_without_the_effects_tells_nothing(lost, output, explained):
    ends = [shown(10.0, np.sqrt(1.99)), shown(*lost)]
    assert rules.explained_each(ends, left(0.5), left(output)) == pytest.approx(explained)


def test_where_all_free_runs_fork_the_observer_tells_what_is_explained():
    forked = [shown(11.0, 9.0, misfits=(5.0, 1.5))]
    assert rules.explained_each(forked, left(0.5), left()) == pytest.approx(0.875)


@pytest.mark.parametrize("before, explained", [(0.2, 0.75), (0.05, 0.0)])
def test_where_no_error_is_above_the_noise_memory_tells_what_is_explained(before, explained):
    with_it, without = (left(float(np.log1p(power))) for power in (before / 4, before))
    assert rules.explained_each([shown(0.99, 0.9)], without, with_it) == pytest.approx(explained)


def test_a_share_lies_between_nothing_and_all():
    assert rules.share(10.0, 2.0, 1.0) == pytest.approx(8.0 / 9.0)
    assert rules.share(10.0, 20.0, 1.0) == 0.0 == rules.share(0.5, 0.1, 1.0)
    assert rules.share(10.0, 0.5, 1.0) == 1.0


@pytest.mark.parametrize("names", [("stribeck",), ()])
def test_held_out_error_far_above_the_noise_is_a_mismatch_that_is_left(names):
    """The contract's three noise floors, whatever memory tells and however much is explained."""
    case = replace(RIGHT if names else NONE, explained=0.99 if names else 0.0, free_held=3.1)
    assert rules.is_more_left(case) and not rules.is_more_left(replace(case, free_held=2.9))
    assert rules.verdict(case) == ("missing_physics" if names else "unexplained")


@pytest.mark.parametrize(
    "raw, again, states, said",
    [
        (0.46, 0.054, [{"sentence": "gain differs"}], True),
        (0.46, 0.4, [{"sentence": "gain differs"}], False),  # little of the error goes with it
        (0.46, 0.054, [], False),
        (0.46, None, [{"sentence": "gain differs"}], False),
    ],
)
def test_a_rig_that_changed_before_the_held_out_recording_is_told(raw, again, states, said):
    fits = {"heldout_rmse_after_rad": raw, "recalibrated_rmse_after_rad": again}
    told = of_another_day(fits, states, "V", POLICY)
    assert ("gain differs" in told and "0.054 V, not 0.46 V" in told) if said else told == ""


def test_recordings_that_differ_are_judged_by_what_memory_tells():
    """What is held out has a gain to itself, so that its error tells of no physics; that it is large is still said."""
    case = replace(NONE, recordings_differ=True, free_held=700.0, least_astray=500.0)
    assert rules.verdict(case) == "parameters_only" and rules.is_more_left(case)
    assert rules.verdict(replace(case, left=left(0.2))) == "unexplained"


def test_where_nothing_is_named_after_is_before():
    fits = {"heldout_rmse_before_rad": 2.0, "heldout_rmse_after_rad": 1.5, "measure": "free_run"}
    assert as_named(fits, ("stribeck",), ("stribeck",)) is fits and as_named(fits, (), ()) is fits
    assert as_named(fits, ("stribeck",), ()) == fits | {"heldout_rmse_after_rad": 2.0}
