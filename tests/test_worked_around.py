"""What can be worked around in a recording is, and is told."""

import numpy as np
import pytest
from csv_made import N, problem

from ers_mj.data.checks import gaps_in
from ers_mj.data.inspection import inspected
from ers_mj.data.recording import from_arrays


def test_missing_values_are_masked_in_y_and_held_in_u(columns):
    t, u, y = columns.values()
    u, y = u.copy(), y.copy()
    u[[0, 100, 101]], y[[50, 60]] = np.nan, np.nan
    record = from_arrays(t, u, y)
    assert np.flatnonzero(~record.valid).tolist() == [50, 60]
    assert np.isnan(record.y[~record.valid]).all()
    assert record.u[0] == u[1] and (record.u[100:102] == u[99]).all()
    assert problem(record, "u is missing").endswith("in 3 samples (0.75%), which are taken as the last value before")
    assert "2 samples (0.50%)" in problem(record, "y is missing")


def test_an_optional_column_that_is_mostly_blank_is_dropped_and_told(columns):
    record = from_arrays(*columns.values(), current=np.full(N, np.nan))
    assert record.current is None
    assert problem(record, "current") == "current lacks 100% of its values and is not used"


def test_gaps_and_jitter_are_counted(columns):
    t, u, y = columns.values()
    gapped = t + 0.05 * (t >= 0.1) + 0.02 * (t >= 0.2)
    assert problem(from_arrays(gapped, u, y), "gap") == "time has 2 gaps, the largest of 0.051 s after 0.099 s"
    jittered = t + 1e-5 * np.random.default_rng(0).normal(size=N)
    share = float(problem(from_arrays(jittered, u, y), "jitter").split("by ")[1].split("%")[0])
    assert share == pytest.approx(100 * np.std(np.diff(jittered)) / 1e-3, abs=0.2)
    assert from_arrays(t + 1e-8 * np.random.default_rng(0).normal(size=N), u, y).problems == ()


def test_clipped_spans_of_input_and_output(columns):
    t, u, y = columns.values()
    record = from_arrays(t, np.clip(u, -4, 4), np.clip(y, 0.2, 0.33))
    assert "u looks clipped at -4, 4" in problem(record, "u looks clipped")
    assert "y looks clipped at 0.2, 0.33" in problem(record, "y looks clipped")


@pytest.mark.parametrize(("rail", "shape"), [(0.4, np.sin), (0.501, lambda t: np.tanh(8 * np.sin(t)))])
def test_what_a_rail_hides_is_left_out(rail, shape):
    """Where the motion goes well beyond, and where it is noise alone that meets the rail, now and then."""
    t = 0.01 * np.arange(2000)
    y = 0.5 * shape(t) + 2e-3 * np.random.default_rng(0).standard_normal(t.size)
    record = from_arrays(t, np.cos(t), np.minimum(y, rail))
    (fault,) = [fault for fault in record.faults if fault.kind == "clipped"]
    assert fault.count == np.sum(y >= rail) and np.array_equal(record.valid, y < rail)
    assert from_arrays(t, np.cos(t), y).valid.all()


@pytest.mark.parametrize("stop", [0.4, 0.499])
def test_a_hard_stop_without_noise_is_no_rail(stop):
    t = 0.01 * np.arange(3000)
    record = from_arrays(t, np.cos(t), np.clip(0.5 * np.sin(3 * t), -stop, stop))
    assert record.valid.all() and not record.faults


@pytest.mark.parametrize("wave", [lambda t: np.sign(np.sin(60 * t)), lambda t: np.round(2 * np.sin(60 * t))])
def test_squares_and_steps_are_not_clipped(columns, wave):
    t, _, y = columns.values()
    assert from_arrays(t, wave(t), y).problems == ()


def test_a_stuck_sensor_is_told_and_not_masked(columns):
    t, u, y = columns.values()
    stuck = y.copy()
    stuck[100:130] = stuck[100]
    record = from_arrays(t, u, stuck)
    assert "30 samples (7.50%) in 1 span, the longest for 0.029 s from 0.1 s on" in problem(record, "stuck")
    assert record.valid.all()


def test_a_rudder_at_rest_is_not_a_stuck_sensor(columns):
    t, u, _ = columns.values()
    noise = 1e-4 * np.random.default_rng(2).normal(size=N)
    moving = 0.1 * np.sin(40 * np.maximum(t - 0.15, 0))
    for step in (0, 5.113e-4, 1e-4, 1e-9):
        y = np.round((moving + noise * (step > 1e-9)) / step) * step if step else moving
        assert not [p for p in from_arrays(t, u, y).problems if "stuck" in p or "clipped" in p]


def test_a_constant_input_is_told(columns):
    t, u, y = columns.values()
    assert problem(from_arrays(t, np.full(N, 3.0), y), "constant") == "the input u is constant at 3"


def test_rows_that_a_regular_clock_skips_are_gaps_and_no_jitter():
    t = np.delete(0.002 * np.arange(2500), [300, 701, 1100, 1101, 1502, 1900])
    kept = from_arrays(t, np.sin(8.0 * t), np.cos(8.0 * t))
    assert any("time has 5 gaps" in problem for problem in kept.problems)
    assert not any("jitter" in problem for problem in kept.problems)
    assert inspected(kept).jitter < 1e-6
    late = np.random.default_rng(2).uniform(0.0, 0.8, kept.t.size) * 0.002
    assert not gaps_in(np.arange(kept.t.size) * 0.002 + late).any()
