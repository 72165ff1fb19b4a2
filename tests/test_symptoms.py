"""Sensor effects that show in the data itself."""

import numpy as np
import pytest

from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.decisions.thresholds import POLICY
from ers_mj.effects import BY_NAME
from ers_mj.effects.base import Symptoms

T = np.arange(0.0, 4.0, 1e-3)


@pytest.mark.parametrize(
    "degrees, travel, is_angle, told",
    [
        (0.041, 0.5, True, True),
        (0.029, 0.5, True, False),
        (0.0879, 1.9, True, False),
        (0.041, 0.5, False, False),
        (0.041, 0.2, False, True),
    ],
)
def test_a_step_is_an_effect_where_rudders_converters_are_finer_or_the_travel_has_few(degrees, travel, is_angle, told):
    step = np.radians(degrees)
    y = 0.5 * travel * np.sin(5.0 * T) + 1e-4 * np.random.default_rng(2).standard_normal(T.size)
    trace = trace_of(from_arrays(T, np.zeros(T.size), np.round(y / step) * step), None)
    seen = Symptoms(np.zeros(0), 4.0, np.array([trace.quantum]), travel, is_angle)
    found = BY_NAME["sensor_quantisation"].symptom(seen, POLICY)
    assert found == pytest.approx([step], rel=1e-3) if told else found is None


@pytest.mark.parametrize("count", [2, 3, 12])
def test_few_spans_that_were_lost_may_be_chance(count):
    seen = Symptoms(np.full(count, 0.02), 6.0, np.zeros(1), 0.5, True)
    found = BY_NAME["sensor_dropout"].symptom(seen, POLICY)
    assert found is None if count < POLICY.fewest_dropouts else found == pytest.approx([count / 6.0, 0.02])


def test_most_effects_have_no_symptom():
    seen = Symptoms(np.full(12, 0.02), 6.0, np.full(1, 0.1), 0.5, True)
    assert {name for name, effect in BY_NAME.items() if effect.symptom(seen, POLICY) is not None} == {
        "sensor_dropout",
        "sensor_quantisation",
    }
