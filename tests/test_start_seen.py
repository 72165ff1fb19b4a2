"""The speed with which a recording begins."""

import numpy as np
import pytest

from ers_mj.data.beginnings import speed_about, start_seen


@pytest.mark.parametrize(
    "motion, speed",
    [
        (lambda t: 0.0 * t, 0.0),
        (lambda t: 400.0 * t**2, 0.0),
        (lambda t: 2e4 * t**3, 0.0),
        (lambda t: np.where(t > 0.02, 300.0 * (t - 0.02) ** 2, 0.0), 0.0),
        (lambda t: 3.0 * t, 3.0),
        (lambda t: 3.0 * t - 100.0 * t**2, 3.0),
        (lambda t: np.sin(60.0 * t) / 20.0 + 2e-4 * np.sin(9e2 * t), 3.18),
    ],
)
def test_the_speed_at_the_start_is_what_the_samples_show(motion, speed):
    t = np.arange(50) / 1e3
    low, high = start_seen(t, motion(t) + 1e-4 * np.random.default_rng(3).standard_normal(t.size), 1e-4)
    assert low <= speed <= high and high - low < 2.0 and (low == high == 0.0) == (speed == 0.0)


def test_a_rudder_that_is_thrown_from_rest_had_no_speed():
    t = np.arange(11) / 200.0
    thrown = (
        np.array([0.0, 1.39, 8.6, 21.14, 35.78, 51.07, 64.8, 77.1, 87.58, 95.83, 103.27]) * 1e-3
    )  # rad, in a loop whose reference jumps
    assert start_seen(t, thrown, 1e-4) == (0.0, 0.0)
    assert start_seen(t, -3.0 * t, 1e-4)[1] < -2.0
    t = np.arange(25) / 500.0
    through_a_shaft = np.array(
        [
            0.0,
            0.9,
            -0.3,
            4.6,
            19.0,
            36.0,
            49.9,
            62.1,
            80.6,
            96.8,
            115.4,
            128.3,
            142.5,
            159.9,
            174.6,
            185.8,
            199.3,
            210.3,
            220.2,
            230.9,
            243.6,
            249.5,
            260.2,
            267.2,
            275.7,
        ]
    )  # noise levels
    assert start_seen(t, 1.36e-4 * through_a_shaft, 1.36e-4) == (0.0, 0.0)


def test_few_samples_of_a_fast_motion_do_not_refuse_rest():
    """A throttle thrown from rest, its angle refreshed every 20 ms: no polynomial comes near."""
    t = 0.02 * np.arange(8)
    thrown = np.array([0.2562, 0.4258, 0.6724, 0.7906, 0.8065, 0.8055, 0.8051, 0.8050])  # rad
    assert start_seen(t, thrown, 8e-4) == (0.0, 0.0)
    assert start_seen(t, 0.2562 + 5.0 * t + 0.02 * np.sin(300.0 * t), 8e-4)[0] > 3.0


def test_a_part_that_begins_in_motion_has_the_speed_of_what_lay_before():
    """Though the input switches at its first sample, which throws it the other way."""
    t, at = 0.004 * np.arange(60), 30
    x = t - t[at]
    y = (
        -0.7 * x
        - 4.0 * x**2
        + np.where(x > 0.0, 180.0 * x**2, 0.0)
        + 2e-4 * np.random.default_rng(5).standard_normal(60)
    )
    low, high = speed_about(t, y, at, 2e-4)
    assert low < -0.7 < high < 0.0
    assert speed_about(t, y, 3, 2e-4) is None
