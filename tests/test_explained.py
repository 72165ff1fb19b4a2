"""How much is left, and whether that is explained."""

import numpy as np
import pytest

from ers_mj.decisions import explained
from ers_mj.decisions.thresholds import POLICY

QUIET = np.ones(200)


def test_one_block_stands_out_among_bad_ones():
    misfit = np.concatenate([np.ones(150), np.full(50, 30.0)])
    for worst, out in ((30.0, False), (500.0, False), (1000.0, True)):
        assert explained.stands_out(np.append(misfit, worst), 1.0) is out


def test_the_cost_of_noise_is_nought_and_a_block_counts_by_its_logarithm():
    assert explained.cost(QUIET, 1.0) == 0.0
    assert explained.cost(np.append(QUIET, 2 * np.e - 1.0), 1.0) == pytest.approx(1.0)
    assert explained.score(QUIET, 7.0) == pytest.approx(0.0)


def test_what_no_explanation_could_buy_is_not_attainable():
    counts = np.full(200, 250.0)
    noise = np.random.default_rng(0).chisquare(250, 200) / 250
    assert abs(explained.attainable(noise, counts, 1.0)) < 1.5
    worse = noise.copy()
    worse[:5] = 100.0
    assert explained.attainable(worse, counts, 1.0) == pytest.approx(5 * np.log(101 / 2), rel=0.1)
    assert explained.attainable(0.5 * noise, counts, 1.0) < 2.0  # noise that was taken too large explains nothing


@pytest.mark.parametrize(
    "level, told",
    [(1.0, {"is_near_noise", "is_quiet"}), (4.0, {"is_bent", "is_more_than_forks"})]
    + [(150.0, {"is_bent", "is_more_than_forks", "is_model_error"}), (1.05, {"is_near_noise", "is_quiet"})],
)
def test_how_far_a_model_stands_from_the_noise(level, told):
    misfit = level * QUIET
    for name in ("is_near_noise", "is_model_error"):
        assert getattr(explained, name)(misfit) is (name in told)
    for name in ("is_quiet", "is_bent", "is_more_than_forks"):
        assert getattr(explained, name)(misfit, 1.0) is (name in told)


def test_a_datasheet_is_consistent_within_its_noise():
    assert explained.is_consistent(1.05 * QUIET) and not explained.is_consistent(1.3 * QUIET)
    assert not explained.is_consistent(np.append(QUIET, np.nan))
    assert POLICY.consistent < POLICY.quiet * 2
