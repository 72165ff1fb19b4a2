"""How far the unseen moves the numbers."""

from dataclasses import replace

import numpy as np
from servo import TRUTH, alone, recorded, started

from ers_mj.estimation.intervals import DOUBT, at_given, half_widths, slopes_of, spread_by, unseen_shifts, widths_of


def test_what_is_too_small_to_be_found_widens_the_intervals():
    faint = started(recorded([("quadratic_drag", np.array([0.02, np.inf]))]))
    model, layout = faint.fit.model, faint.fit.model.layout()
    noise = half_widths(model, faint.traces, (), 1.0)
    shifts = unseen_shifts(model, faint.traces, 1.0, slopes_of(model, faint.traces))
    unseen = widths_of(spread_by(shifts, DOUBT.unseen_gain))
    off = np.abs(model.vector(layout) - replace(model, values={**model.values, **TRUTH}).vector(layout))
    assert np.all(unseen > 0) and np.all(off < 2.0 * np.hypot(noise, unseen))
    assert np.all(widths_of(spread_by(shifts, 100.0)) > unseen)  # as where much is left


def test_the_same_by_another_name_does_not_say_that_an_effect_is_none():
    """A weight along a small travel pulls as the constant torque does: a rival of it, and nothing beside it."""
    small = started(recorded([("bias_torque", np.array([0.15]))]))
    model = alone(small, "bias_torque", [0.15]).fit.model
    shifts = unseen_shifts(model, small.traces, 1.0, slopes_of(model, small.traces))
    own = [f.owner == "bias_torque" for f in model.layout()].index(True)
    unseen = widths_of(spread_by(shifts, DOUBT.unseen_gain))
    assert 0 < unseen[own] < 0.5 * abs(model.vector(model.layout())[own]) and np.all(unseen > 0)


def test_what_is_held_widens_nothing():
    spread = np.array([[4.0, 1.9, 0.0], [1.9, 1.0, 0.0], [0.0, 0.0, 9.0]])
    known = np.linalg.inv(np.linalg.inv(spread)[:1, :1])  # of the first where nothing else moves
    assert np.allclose(at_given(spread, [0], [1, 2]), known) and np.allclose(at_given(spread, [0], []), 4.0)
