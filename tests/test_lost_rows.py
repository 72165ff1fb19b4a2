"""Rows that a log lost, and what was put in there."""

import numpy as np

from ers_mj.data.checks import gaps_in
from ers_mj.data.inspection import inspected
from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.estimation.lost_rows import with_lost_inputs
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.servo.model import Model

DRIVE = {"a_1": 0.0, "a_2": 0.9, "b": 34.0, "c_1": 0.0, "c_2": 1.9, "theta_0": 0.0}
MODEL = Model({**DRIVE, "tau_e": 0.0, "emf_share": 0.0, "ampere": 1.0}, ("a_2", "b", "c_2"))
LOST = np.array([300, 701, 1100, 1101, 1502, 1900])
NOISE = 3e-4


def recorded(lost=LOST):
    """(what the log kept, all of it): a drive without a spring, held near zero by a torque that is noisy at 500 Hz."""
    t, rng = np.arange(0.0, 5.0, 0.002), np.random.default_rng(1)
    u = 2.0 * np.sin(2 * np.pi * 1.3 * t) + 0.6 * rng.standard_normal(t.size)
    y = ReducedModel(lumped(DRIVE)).simulate(t, u).theta + NOISE * rng.standard_normal(t.size)
    kept = np.setdiff1d(np.arange(t.size), lost)
    return [from_arrays(t[rows], u[rows], y[rows], input_unit="N m") for rows in (kept, np.arange(t.size))]


def test_what_was_put_in_while_rows_were_lost_is_told_by_the_motion_behind():
    kept, whole = recorded()
    plain = trace_of(kept, None)
    (told,) = with_lost_inputs(MODEL, [plain])
    error, before, best = (
        float(np.sqrt(np.nanmean((trace.y - MODEL.predict(trace)) ** 2)))
        for trace in (told, plain, trace_of(whole, None))
    )
    assert best < 2.0 * NOISE and error < 0.7 * before
    lost = np.flatnonzero(gaps_in(plain.t))
    assert set(np.flatnonzero(told.u != plain.u)) == set(lost)
    put = [
        np.mean(whole.u[(a - 1e-4 < whole.t) & (whole.t < b - 1e-4)]) for a, b in zip(plain.t[lost], plain.t[lost + 1])
    ]
    assert np.std(told.u[lost] - put) < 0.5 * np.std(plain.u[lost] - put)


def test_a_log_that_lost_nothing_stays_as_it_is():
    whole = trace_of(recorded()[1], None)
    assert with_lost_inputs(MODEL, [whole])[0] is whole


def test_rows_that_a_regular_clock_skips_are_gaps_and_no_jitter():
    kept, _ = recorded()
    assert any("time has 5 gaps" in problem for problem in kept.problems)
    assert not any("jitter" in problem for problem in kept.problems)
    assert inspected(kept).jitter < 1e-6
    late = np.random.default_rng(2).uniform(0.0, 0.8, kept.t.size) * 0.002
    assert not gaps_in(np.arange(kept.t.size) * 0.002 + late).any()


def test_where_friction_holds_nothing_is_told():
    kept, _ = recorded()
    stuck = Model({**MODEL.values, "c_2": 1e3}, MODEL.free)
    plain = trace_of(kept, None)
    assert np.array_equal(with_lost_inputs(stuck, [plain])[0].u, plain.u)
