"""What held-out data confirms, what a model betrays of its sensor, and how far the unseen moves the numbers."""

import math
from dataclasses import replace

import numpy as np
import pytest
from servo import NOISE, TRUTH, bench_of, started, trace

from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.decisions.policy import POLICY
from ers_mj.diagnosis.mujoco_check import HELD_SECONDS, LEFT_OUT_SECONDS, run_in_mujoco
from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import fit
from ers_mj.estimation.initial_state import without_spikes
from ers_mj.estimation.intervals import half_widths, unseen_widths
from ers_mj.selection.candidates import candidates
from ers_mj.selection.confirmation import Court, Judged
from ers_mj.selection.cross_validation import Fold, Score, folds, halves, scored
from ers_mj.selection.stepwise import Selection


@pytest.fixture(scope="module")
def plain():
    """A servo without missing physics."""
    return started([trace(name, seed=k) for k, name in enumerate(("multisine", "steps", "chirp"))])


def court_of(start, traces=None):
    """Where effects beside this baseline are judged by each recording in turn."""
    start = start if traces is None else replace(start, traces=traces)
    return Court(start, Selection(start.fit, start.fit, (), 1.0, start.traces), [], 1, POLICY)


def holding(y, begins, length=12):
    y = y.copy()
    for begin in begins:
        y[begin : begin + length] = y[begin]
    return y


def test_a_hold_behind_a_coarse_converter_is_betrayed_by_the_model(plain):
    begins = np.arange(150, 2900, 125)
    step = 2.5 * NOISE
    coarse = trace("multisine", sensor=lambda y: step * np.round(holding(y, begins) / step))
    found = without_spikes(plain.fit.model, [coarse])[0]
    moving = [b for b in begins if abs(coarse.y[b + 12] - coarse.y[b]) > 6 * step]
    masked = [b for b in moving if not found.valid[b + 1 : b + 12].any()]
    assert len(coarse.lost) >= 3 and len(moving) >= 8 and len(masked) >= 0.8 * len(moving)


def test_what_a_coarse_converter_rounds_off_is_no_sensors_error(plain):
    """A wave of less than half a step along the travel is the converter's, where it makes the noise; a larger one is
    not, nor any beside a finer converter.
    """
    step = 0.016
    coarse, fine = ([trace("multisine", sensor=lambda y, s=s: s * np.round(y / s))] for s in (step, NOISE))
    small, large = (
        plain.fit.model.with_effect("sensor_nonlinearity", np.array([np.inf, np.inf, size * step, 0.043, 0.3]))
        for size in (0.3, 0.8)
    )
    by_coarse, by_fine = court_of(plain, coarse), court_of(plain, fine)
    assert by_coarse.is_a_converters("sensor_nonlinearity", small)
    assert not by_coarse.is_a_converters("sensor_nonlinearity", large)
    assert not by_fine.is_a_converters("sensor_nonlinearity", small)
    assert not by_coarse.is_a_converters("bias_torque", small.with_effect("bias_torque", np.array([0.1])))


def test_a_rudder_that_sticks_is_not_held(plain):
    whole = trace("multisine", sensor=lambda y: 2.5 * NOISE * np.round(y / (2.5 * NOISE)))
    whole = replace(whole, lost=(slice(5, 6),) * 3)  # as where its sensor had been seen to hang
    assert np.array_equal(without_spikes(plain.fit.model, [whole])[0].valid, whole.valid)


def test_what_cannot_be_scaled_is_refitted_from_all_its_starts(plain):
    peak = max(float(np.abs(t.u).max()) for t in plain.traces)
    clipped = [
        trace(name, [("voltage_saturation", np.array([0.93 * peak, np.inf]))], seed=k)
        for k, name in enumerate(("multisine", "steps", "chirp"))
    ]
    start = started(clipped)
    best, *others = candidates(bench_of(start.traces, only=("voltage_saturation", "current_limit")), start.fit)
    clip = next(c for c in (best, *others) if c.name == "voltage_saturation")
    assert clip.gain == pytest.approx(best.gain, abs=0.01)  # without inductance a limit of the current is the same
    assert dict(clip.fit.model.effects)[clip.name][0] == pytest.approx(0.93 * peak, rel=0.01)


def test_an_effect_that_one_recording_shows_is_judged_within_it():
    calm, wide = trace("multisine", gain=0.5), trace("multisine", gain=1.0)
    upper = float(np.nanquantile(wide.y, 0.97))
    stop = np.array([-math.inf, upper, 3e5, 50.0])
    assert np.nanmax(calm.y) < upper
    traces = [
        trace("multisine", [("end_stop", stop)], gain=0.5),
        trace("steps", gain=0.5, seed=1),
        trace("multisine", [("end_stop", stop)], seed=2),
    ]
    start = started(traces)
    chosen = fit(start.fit.model.with_effect("end_stop", stop), start.traces)
    court = court_of(start)

    def p(model):
        after = [scored(some, fold.held_out) for some, fold in zip(court.refits(model), court.parts, strict=True)]
        return court.judged("end_stop", model, after).p

    assert p(chosen.model) < 0.05
    nowhere = start.fit.model.with_effect("end_stop", np.array([float(np.nanmin(wide.y)) - 1.0, math.inf, 3e5, 50.0]))
    assert p(nowhere) > 0.2
    first, second = halves(start.traces, 2)
    assert first.known == second.known == [0, 1, 2] and first.held_out.t[-1] < second.held_out.t[0]
    assert [fold.known for fold in folds(start.traces, [])[0]] == [[1, 2], [0, 2], [0, 1]]


def test_what_is_too_small_to_be_found_widens_the_intervals(plain):
    faint = started(
        [
            trace(name, [("quadratic_drag", np.array([0.02, np.inf]))], seed=k)
            for k, name in enumerate(("multisine", "steps", "chirp"))
        ]
    )
    model, layout = faint.fit.model, faint.fit.model.layout()
    noise, unseen = half_widths(model, faint.traces, (), 1.0), unseen_widths(model, faint.traces, 1.0)
    off = np.abs(model.vector(layout) - replace(model, values={**model.values, **TRUTH}).vector(layout))
    assert np.all(unseen > 0) and np.all(off < 2.0 * np.hypot(noise, unseen))


def test_a_knock_at_an_edge_whose_torque_may_as_well_be_none_is_taken_out():
    """Of a recording where few samples bear it, or while its start is read; within one the interval of what moves a
    rudder that sticks tells little.
    """
    quiet = [trace(name, seed=k) for k, name in enumerate(("multisine", "steps", "chirp"))]
    for begun, knocked, none in (
        (2.9, False, True),
        (-0.28, True, True),
        (0.03, True, True),
        (1.0, False, False),
        (1.0, True, False),
        (2.6, True, False),
    ):
        knock = np.array([40.0, begun, 0.3, 1.0, np.inf])
        traces = [quiet[0], trace("steps", [("load_disturbance", knock)], seed=1) if knocked else quiet[1], quiet[2]]
        start = started(traces)
        found = fit(start.fit.model.with_effect("load_disturbance", knock), start.traces)
        assert court_of(start).may_be_none("load_disturbance", found.model) == none


def test_a_wave_of_many_that_does_not_pay_for_its_numbers_is_any_wave(plain):
    """Three numbers among a hundred blocks cost 6.9 of C; a limit, or a bent sensor's wave of few periods, is judged by
    its p-value alone.
    """
    model = plain.fit.model
    for name in ("cogging", "transmission_ripple", "periodic_gust", "sensor_nonlinearity", "voltage_saturation"):
        model = model.with_effect(name, BY_NAME[name].starts(model.scales)[-1])
    left, little, much = (Score(1.0, 1, np.full(100, math.expm1(c / 100) + 0.5)) for c in (20.0, 14.0, 8.0))
    court, waves = court_of(plain), ("cogging", "transmission_ripple", "periodic_gust")
    for name in model.names:
        told = [court.is_any_wave(name, model, Judged([], left, ([after], [left]), 0.0)) for after in (little, much)]
        assert told == [name in waves, False]


@pytest.mark.parametrize("training, most", [(None, HELD_SECONDS), ((), LEFT_OUT_SECONDS)])
def test_mujoco_runs_a_few_seconds_of_what_was_held_out(training, most):
    def held(seconds):
        t = np.arange(0.0, seconds, 1e-2)
        return Fold(trace_of(from_arrays(t, np.sin(t), np.sin(t), name=f"{seconds} s"), None), training)

    (long,) = run_in_mujoco([held(12.0), held(2.0)])
    assert long.name == "12.0 s" and long.t[-1] == pytest.approx(most, abs=0.011)
    assert [trace.name for trace in run_in_mujoco([held(0.4 * most), held(0.5 * most), held(0.4 * most)])] == [
        f"{0.4 * most} s",
        f"{0.5 * most} s",
    ]
