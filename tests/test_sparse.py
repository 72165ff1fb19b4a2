"""What the first steps of a search see of recordings."""

from dataclasses import replace

import numpy as np
import pytest
from servo import TRUTH, recorded, started

from ers_mj.data.quantisation import Converter
from ers_mj.estimation.objective import cost_of
from ers_mj.estimation.sparse import few_of
from ers_mj.servo.model import OBSERVER_RATE


@pytest.fixture(scope="module")
def start():
    return started(recorded([], names=("multisine", "ramp")))


def bent(model):
    """The servo with half its gain, far from its recordings."""
    return replace(model, values={**model.values, "b": 0.5 * TRUTH["b"]})


def test_a_model_that_is_far_sees_few_samples_and_is_as_far_from_them(start):
    model, traces = bent(start.fit.model), start.traces
    few = few_of(model, traces, 1.0)
    assert all(f.t.size < 0.6 * t.t.size for f, t in zip(few, traces, strict=True))
    few_cost, cost = (cost_of(model, some, OBSERVER_RATE, 1.0) for some in (few, traces))
    assert few_cost == pytest.approx(cost, rel=0.02)


def test_what_its_mean_input_would_bend_keeps_all_samples(start):
    """A model at the noise, told a command that changes at every sample."""
    trace = start.traces[0]
    wild = trace.u + 40.0 * (-1.0) ** np.arange(trace.t.size)
    model = start.fit.model
    y = model.predict(replace(trace, u=wild), 0, 0.0)
    traces = [replace(trace, u=wild, y=y)]
    assert few_of(model, traces, 1.0) is traces


def test_a_coarse_converter_or_a_clock_that_jitters_keeps_all_samples(start):
    model, trace = bent(start.fit.model), start.traces[0]
    coarse = [replace(trace, converter=Converter(20.0 * trace.sigma, trace.sigma))]
    assert few_of(model, coarse, 1.0) is coarse
    jittering = [replace(trace, t=trace.t + 1e-4 * np.sin(np.arange(trace.t.size)))]
    assert few_of(model, jittering, 1.0) is jittering
