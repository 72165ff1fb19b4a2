"""What a model betrays of its sensor: spans that it held."""

from dataclasses import replace

import numpy as np
from servo import NOISE, trace

from ers_mj.estimation.initial_state import without_spikes

STEP = 2.5 * NOISE  # of a coarse converter


def holding(y, begins, length=12):
    y = y.copy()
    for begin in begins:
        y[begin : begin + length] = y[begin]
    return y


def test_a_hold_behind_a_coarse_converter_is_betrayed_by_the_model(plain):
    begins = np.arange(150, 2900, 125)
    coarse = trace("multisine", sensor=lambda y: STEP * np.round(holding(y, begins) / STEP))
    found = without_spikes(plain.fit.model, [coarse])[0]
    moving = [b for b in begins if abs(coarse.y[b + 12] - coarse.y[b]) > 6 * STEP]
    masked = [b for b in moving if not found.valid[b + 1 : b + 12].any()]
    assert len(coarse.lost) >= 3 and len(moving) >= 8 and len(masked) >= 0.8 * len(moving)


def test_a_rudder_that_sticks_is_not_held(plain):
    whole = trace("multisine", sensor=lambda y: STEP * np.round(y / STEP))
    whole = replace(whole, lost=(slice(5, 6),) * 3)  # as where its sensor had been seen to hang
    assert np.array_equal(without_spikes(plain.fit.model, [whole])[0].valid, whole.valid)
