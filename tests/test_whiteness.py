"""What a model leaves beyond the noise is told by its memory, whatever the noise's size and whatever the converter
does.
"""

from dataclasses import replace

import numpy as np
import pytest
from servo import NAMES, NOISE, TRUTH, started, trace

from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.data.sensor_faults import converter_step
from ers_mj.decisions.verdict import is_more_than_noise
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.selection.whiteness import left_by_sensor, left_elsewhere, remembered

T = np.arange(0.0, 8.0, 1e-3)
BLOCK = (T / 0.25).astype(int)
FAINT = 0.4  # noise levels


def bent(name, size, seed=0):
    """A recording whose sensor adds a wave of so many noise levels along the travel."""
    return trace(name, sensor=lambda y: y + size * NOISE * np.sin(600.0 * y), seed=seed)


@pytest.fixture(scope="module")
def true_model(plain):
    """The servo as it is."""
    model = plain.fit.model
    return replace(model, values={**model.values, **TRUTH, "tau_e": 0.0, "emf_share": 1.0})


@pytest.mark.parametrize("noise", [0.7, 1.0, 1.4])
def test_the_power_of_a_faint_wave_is_read_whatever_the_noise(noise):
    rng, known = np.random.default_rng(3), np.ones(T.size, bool)
    wave, white = FAINT * np.sqrt(2.0) * np.sin(2 * np.pi * 4.0 * T), noise * rng.standard_normal(T.size)
    known[100:180] = False  # what no sensor saw does not count, however large
    some = np.where(known, wave + white, 1e3)
    assert abs(np.nanmean(remembered(white, known, BLOCK))) < 0.02
    assert np.nanmean(remembered(some, known, BLOCK)) == pytest.approx(FAINT**2, abs=0.03)
    assert np.isnan(remembered(some[:10], known[:10], BLOCK[:10])).all()


@pytest.mark.parametrize("times", [0.0, 1.0, 40.0])
def test_a_converter_leaves_no_mismatch(times, plain):
    """The model that made the recordings, read as it is or by a converter of one or forty noise levels."""
    step = times * NOISE
    read = [trace(name, sensor=lambda y: np.round(y / step) * step, seed=k) for k, name in enumerate(NAMES) if times]
    start = started(read) if times else plain
    assert times < 1.0 or converter_step(start.traces[0].y) == pytest.approx(step, rel=0.1)
    assert abs(left_by_sensor(start.fit.model, start.traces)["output"]) < 0.06


def test_a_mismatch_below_the_noise_is_seen():
    start = started([bent(name, 1.0, k) for k, name in enumerate(NAMES)])
    assert left_by_sensor(start.fit.model, start.traces)["output"] > 0.1


def test_what_the_library_has_no_name_for_leaves_more_than_noise(plain):
    """A torque that hops between two values at random times is no effect of the library."""
    rng, traces = np.random.default_rng(4), []
    for one in plain.traces:
        hops = np.repeat(rng.choice([-25.0, 25.0], 30), one.t.size // 30)
        y = ReducedModel(lumped(TRUTH)).theta(one.t, one.u, (TRUTH["theta_0"], 0.0), load=hops)
        y += NOISE * rng.standard_normal(one.t.size)
        traces.append(trace_of(from_arrays(one.t, one.u, y, name=one.name), None))
    start = started(traces)
    assert is_more_than_noise(left_by_sensor(start.fit.model, start.traces), None)
    assert not is_more_than_noise(left_by_sensor(plain.fit.model, plain.traces), None)


def test_what_one_recording_alone_shows_is_not_left_elsewhere(plain):
    """A wave in one of three recordings is seen by the mean over all, and not by that over the others; a wave in each
    is seen by both.
    """
    model = plain.fit.model

    def left(*waving):
        traces = [bent(name, 2.0 * (name in waving), k) for k, name in enumerate(NAMES)]
        return left_by_sensor(model, traces)["output"], left_elsewhere(model, traces)

    one, every = left("multisine"), left(*NAMES)
    assert one[0] > 0.1 and one[1] < 0.03
    assert every[0] > 0.3 and every[1] > 0.2
    assert left_elsewhere(model, [bent("multisine", 9.0)]) == 0.0


@pytest.mark.parametrize("rate", [1000, 50, 10])
def test_at_low_sample_rates_blocks_are_joined(rate, true_model):
    """A slow mismatch of four noise levels is seen where a quarter of a second holds two samples as well as where it
    holds 250.
    """
    plant, t = ReducedModel(lumped(TRUTH)), np.arange(0.0, 15.0, 1.0 / rate)
    u = 3.0 * np.sign(np.sin(t))
    y = plant.simulate(t, u).measured + NOISE * np.random.default_rng(1).standard_normal(t.size)
    plain, slow = (trace_of(from_arrays(t, u, y + size * NOISE * np.sin(2.0 * t)), None) for size in (0.0, 6.0))
    assert abs(left_by_sensor(true_model, [replace(plain, sigma=NOISE)])["output"]) < 0.06
    assert left_by_sensor(true_model, [replace(slow, sigma=NOISE)])["output"] > 0.085
