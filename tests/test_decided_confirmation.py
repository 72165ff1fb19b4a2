"""Whether held-out data confirms an effect, by numbers alone."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ers_mj.decisions.confirmation import (
    HeldOut,
    Won,
    is_confirmed,
    is_doubtful,
    is_no_closer,
    is_no_size,
    is_none_together,
    is_one_of_many,
    paired_p,
    pays,
)
from ers_mj.decisions.thresholds import POLICY

HELD = HeldOut(p=0.2, rmse=(0.6, 1.0), noise=0.1, cost=(10.0, 20.0), ratio=0.6, log_ratio=math.log(0.6))


def never():
    raise AssertionError("another day is asked for where nothing else confirms an effect")


@pytest.mark.parametrize(
    "ratio, log_ratio, p, closer",
    [
        (1.2, 0.2, 0.04, False),
        (1.2, 0.2, 1e-6, True),  # beyond doubt forks may make the free run somewhat worse
        (1.4, 0.3, 1e-6, False),
        (0.9, -0.1, 0.04, True),
        (1.4, -0.3, 1e-6, True),  # or one recording swamp the rest
        (1.4, -0.3, 0.04, False),
    ],
)
def test_blocks_beyond_doubt_outweigh_a_free_run_that_forks(ratio, log_ratio, p, closer):
    held = replace(HELD, p=p, ratio=ratio, log_ratio=log_ratio)
    assert is_no_closer(held) is not closer
    assert is_doubtful(held) is not closer and is_doubtful(replace(held, p=0.06))


def test_what_holds_once_another_day_is_known_is_confirmed():
    lost = replace(HELD, rmse=(1.0, 1.0))
    assert is_confirmed(lost, lambda: (0.7, 1.0)) and not is_confirmed(lost, lambda: (0.8, 1.0))
    assert not is_confirmed(lost, lambda: None) and not is_confirmed(
        replace(lost, rmse=(1.4, 1.0)), never
    )  # not where its free runs are worse
    assert is_confirmed(replace(HELD, p=0.01), never)


@pytest.mark.parametrize(
    "with_it, without, worth",
    [
        (2.0, 2.05, False),  # squares above a noise of 1: 3.0 and 3.2
        (2.0, 2.1, True),
        (0.9, 0.95, True),  # nothing above the noise either way: the blocks decide
        (0.9, 1.1, True),
    ],
)
def test_a_name_must_be_worth_a_share_of_the_error_above_the_noise(with_it, without, worth):
    assert pays(replace(HELD, p=0.01, rmse=(with_it, without), noise=1.0, log_ratio=0.0), lambda: None) is worth


def test_a_run_that_forks_does_not_make_a_name_worthless_beyond_doubt():
    forked = replace(HELD, rmse=(9.0, 2.0), noise=1.0, log_ratio=math.log(0.5))
    assert pays(replace(forked, p=1e-9), never) and not pays(replace(forked, p=0.01), lambda: None)


def test_where_the_rig_has_changed_a_name_is_worth_what_it_is_once_the_day_is_known():
    swamped = replace(HELD, p=0.01, rmse=(2.0, 2.0), noise=1.0, log_ratio=0.0)
    assert pays(swamped, lambda: (1.5, 2.0)) and not pays(swamped, lambda: (2.0, 2.01))


@pytest.mark.parametrize(
    "ends, told", [((-0.1, 0.3), False), ((0.1, 0.3), True), ((1e-6, 1.0), False), ((-2.0, -1.0), True)]
)
def test_an_interval_across_zero_or_decades_is_no_size(ends, told):
    assert is_no_size(*ends) is not told


def test_sizes_that_are_unknown_apart_may_be_known_together():
    spread = np.array([[4.0, -3.9], [-3.9, 4.0]])  # each to +-2, their sum to +-0.45
    assert not is_none_together(np.array([1.0, 1.0]), spread)
    assert is_none_together(np.array([1.0, -1.0]), spread)
    assert is_none_together(np.array([0.2, 0.1]), spread)
    rounded = np.array([[1.0, -1.0 - 1e-15], [-1.0 - 1e-15, 1.0]])  # a sum that is known, but for rounding
    assert not is_none_together(np.array([0.3, 0.3]), rounded)


def test_losses_alone_tell_the_scatter_of_chance():
    rare = np.zeros(60)
    rare[:2] = 4.0
    assert paired_p(Won.of(rare)) < 1e-3  # what acts in two blocks and harms nowhere
    noise = 0.3 * np.random.default_rng(0).standard_normal((300, 60))
    found = np.array([paired_p(Won.of(gain)) for gain in noise])
    assert np.mean(found < 0.05) < 0.15  # of sums beside their own losses, which are smaller where the sum is large
    assert paired_p(Won.of(-rare)) == 1.0


def test_the_best_of_many_laws_is_offered_something_by_chance():
    won = Won(total=3.0, losses=0.0, best=1.0, blocks=10)
    least = math.exp(-3.0 / POLICY.null_gain)
    assert paired_p(won) == pytest.approx(least)
    assert paired_p(won, alone=True) == pytest.approx(POLICY.null_alone * least)
    assert paired_p(won, once=True) == pytest.approx(math.exp(-3.0 / POLICY.null_gain_once))


def test_what_acts_once_leaves_no_other_moment_as_bad():
    """Of sixty blocks at the noise one is explained; another one that is as bad beside it speaks of a law instead."""
    after = np.ones(60)
    without = after.copy()
    without[7] = 200.0
    assert not is_one_of_many(after, without)
    after[40] = without[40] = 150.0
    assert is_one_of_many(after, without)
    after[40] = without[40] = 5.0  # half the logarithm is allowed
    assert not is_one_of_many(after, without)
    after[7] = 14.0  # of its own moment, where its form may be another
    assert not is_one_of_many(after, without)
