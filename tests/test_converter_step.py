"""The step of a converter, and what of a reading is held, are told by the reading alone."""

import numpy as np
import pytest
from csv_made import csv_text, problem, put

from ers_mj.data.recording import read_recording
from ers_mj.data.sensor_faults import converter_step, frozen_spans, leapt_spans, repeated_spans, unmoved_spans


def travel(n: int, sigma: float, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    phase = np.cumsum(rng.normal(0.02, 0.01, n))
    return 0.26 + 0.2 * np.sin(phase) + sigma * rng.normal(size=n)


@pytest.mark.parametrize("decimals", [6, 7, 9, None])
@pytest.mark.parametrize("bits", [8, 10, 12, 14])
@pytest.mark.parametrize("seed", range(3))
def test_a_converter_is_found_under_the_rounding_of_print(bits, decimals, seed):
    step = 2.0944 / 2**bits
    y = np.round(travel(4000, 2e-4, seed) / step) * step
    y = y if decimals is None else np.round(y, decimals)
    assert converter_step(y) == pytest.approx(step, rel=2e-3)


@pytest.mark.parametrize("decimals", [4, 5, 6, 9, None])
@pytest.mark.parametrize("seed", range(5))
def test_print_rounding_is_no_converter(decimals, seed):
    y = travel(4000, 2e-4, seed)
    assert converter_step(y if decimals is None else np.round(y, decimals)) == 0.0
    assert converter_step(y.astype(np.float32).astype(float)) == 0.0


def test_a_converter_is_found_among_outliers():
    step = 5.113e-4
    y = np.round(travel(4000, 2e-4, 0) / step) * step
    y[::400] += 0.0123456
    assert converter_step(np.round(y, 6)) == pytest.approx(step, rel=2e-3)


@pytest.mark.parametrize(
    "coarse, fine",
    [(0.0067, 5.113e-4), (0.001722, 2.5566e-4), (1.39806e-3, 2.5566e-4), (7.3415e-4, 2.5566e-4), (8.795e-4, 1.2783e-4)],
)
def test_a_coarse_step_counts_before_the_converter_behind_it(coarse, fine):
    y = np.round(np.round(travel(4000, 2e-4, 0) / coarse) * coarse / fine) * fine
    assert converter_step(np.round(y, 6)) == pytest.approx(coarse, rel=1e-2)


def test_the_steps_ahead_are_counted_over_long_gaps_too():
    fine, gaps = 2.5566e-4, [1] * 30 + [2] * 13 + [3] * 9 + [4, 5, 5, 6, 7, 7, 8, 9, 10, 12, 12, 14]
    levels = fine * np.round(2.8 * np.cumsum(np.random.default_rng(0).permutation(gaps)))
    assert converter_step(np.round(np.repeat(levels, 5), 7)) == pytest.approx(2.8 * fine, rel=1e-2)


def test_levels_far_apart_lie_on_a_fine_lattice_by_chance():
    fine, steps = 5.114e-4, np.repeat([33, 33, 33, 32, 33, 33, 33, 33], 3)
    levels = 0.1426602 + fine * np.cumsum(steps)
    assert converter_step(np.round(np.repeat(levels, 40), 7)) == pytest.approx(fine * steps.mean(), rel=1e-2)


@pytest.mark.parametrize("times", [2.15, 2.5, 2.85])
def test_a_coarse_step_counts_where_the_converter_behind_makes_one_kind_of_gap_rare(times):
    fine = 5.1133e-4
    y = np.round(np.floor(travel(4000, 2e-4, 0) / (times * fine)) * times) * fine
    assert converter_step(np.round(y, 7)) == pytest.approx(times * fine, rel=1e-2)


@pytest.mark.parametrize("grid", [0.0, 2.5e-4])
def test_a_hold_is_known_by_the_leap_after_it_where_noise_does_not_show_it(grid):
    t = np.arange(4000) * 2e-3
    y = 0.26 + 0.2 * np.sin(4 * t) + 5e-5 * np.random.default_rng(0).normal(size=t.size)
    held = [(330, 350), (1250, 1262), (2450, 2490)]
    for first, last in held:
        y[first + 1 : last] = y[first]
    y = np.round(y / grid) * grid if grid else y
    found = [(s.start - 1, s.stop) for s in leapt_spans(y, grid, 8e-5)]
    assert all(any(abs(a - first) <= 2 and b == last for a, b in found) for first, last in held) and len(found) == len(
        held
    )


def test_a_rudder_that_breaks_loose_is_no_hold():
    t = np.arange(600) * 5e-3
    y = np.where(t < 1.5, 0.3 - 0.02 * np.exp(-8 * t), 0.3 + 40.0 * np.maximum(t - 1.5, 0.0) ** 2)
    assert leapt_spans(np.round(y / 2.5e-4) * 2.5e-4, 2.5e-4, 8e-5) == []


@pytest.mark.parametrize("resting_noise, found", [(2.5e-4, [(2000, 2600)]), (0.0, [])])
def test_a_sensor_that_hangs_at_rest_is_told_by_the_noise_that_no_longer_moves_it(resting_noise, found):
    """Noise of half a converter's step moves a reading every few samples; a rudder that comes to rest without noise is
    no hang.
    """
    rng, grid, n = np.random.default_rng(5), 5e-4, 8000
    swing = 0.1 * np.sin(2 * np.pi * np.arange(2000) / 1000)
    noise = np.where(np.abs(np.arange(n) - n / 2) < 2000, resting_noise, 2.5e-4) * rng.standard_normal(n)
    y = np.round((np.concatenate([swing, np.full(n - 4000, swing[0]), swing]) + noise) / grid) * grid
    if resting_noise:
        y[2000:2600] = y[2000]
    assert [(s.start, round(s.stop, -1)) for s in unmoved_spans(y, grid, 2.9e-4)] == found


@pytest.mark.parametrize(
    "counts, hold, noise, more",
    [
        ([0, 1, 1, 2, 3, 4, 4, 4, 7, 7, 8, 9, 10, 10], 6, 0.49, 1),
        ([0, 0, 4, 4, 7, 7, 7, 11, 12, 13, 14, 15], 5, 0.663, 2),
    ],
)
def test_a_leap_of_few_counts_is_chance(counts, hold, noise, more):
    """A rudder on its way: three alike, and at once some counts that noise and the way since make up, come about within
    some ten thousand samples.
    """
    grid = 5.1133e-4
    y = grid * np.array(counts)
    assert leapt_spans(y, grid, noise * grid) == []
    y[hold + 2 :] += more * grid
    assert leapt_spans(y, grid, noise * grid) == [slice(hold, hold + 2)]


@pytest.mark.parametrize("step", [0.0, 1e-5, 1.3e-4])
@pytest.mark.parametrize("printed", [1e-6, 1e-5])
def test_single_repeats_are_lost_samples_where_they_are_more_than_noise_makes(step, printed):
    rng, n = np.random.default_rng(3), 900
    y = 0.3 * np.sin(np.arange(n) * 0.05) + 8e-4 * rng.standard_normal(n)
    y = np.round((np.round(y / step) * step if step else y) / printed) * printed
    assert repeated_spans(y, 0.0) == []
    lost = np.arange(20, n, 37)
    y[lost] = y[lost - 1]
    found = {k for s in repeated_spans(y, 0.0) for k in range(s.start, s.stop)}
    assert len(found & set(lost)) >= (0 if step == 1.3e-4 else 0.6 * lost.size)
    assert len(found - set(lost)) <= 0.3 * lost.size


def test_decimal_steps_in_degrees_are_told_apart_by_their_size(tmp_path, columns):
    degrees = np.degrees(columns.pop("theta_rad"))
    fine = read_recording(put(tmp_path, csv_text(columns | {"theta_deg": degrees.round(3)})))
    coarse = read_recording(put(tmp_path, csv_text(columns | {"theta_deg": degrees.round(1)})))
    assert fine.quantum == 0.0
    assert coarse.quantum == pytest.approx(np.radians(0.1))
    assert problem(coarse, "converter").startswith("the output theta_deg moves in steps of 0.1,")


@pytest.mark.parametrize("y", [[], [np.nan] * 9, [0.0] * 9, 3.0 * np.arange(300), [1e300, -1e300, 0.0]])
def test_no_lattice_where_there_is_nothing_to_tell(y):
    assert converter_step(np.array(y)) == 0.0


def test_a_servo_that_rests_at_the_end_of_its_way_is_no_hold():
    """A bus that reads late by turns makes even motion jerk to and fro, as noise would; at rest nothing moves."""
    t = np.arange(600) * 0.01
    late = 0.004 * (np.arange(600) % 2)
    way = np.where(t < 1.5, t, np.where(t < 1.7, 1.5, t - 0.2)) + late * ((t < 1.5) | (t > 1.7))
    y = np.round(650 * 0.5 * np.sin(way * np.pi / 3.0))
    assert frozen_spans(y, 1.0) == []
    held = 0.5 * np.sin((t + late) * np.pi / 3.0) * 650
    held[260:275] = held[260]
    assert [(s.start, s.stop) for s in frozen_spans(np.round(held), 1.0)] == [(260, 275)]
