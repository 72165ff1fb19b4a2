"""Frequency responses of recordings: a known system found again, noise and distortion told apart, and the gap of a
model.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from ers_mj.control.frequency.linear import linearised
from ers_mj.data.frequency_response import find_period, frequency_response, gap
from ers_mj.data.recording import from_arrays
from ers_mj.errors import InputError
from ers_mj.plants.inputs import INPUTS
from ers_mj.servo.datasheet import read_datasheet
from ers_mj.servo.simulation import build_plant, simulate_recording

SHEET = read_datasheet("table1")
FREE = replace(SHEET, parameters={**SHEET.parameters, "F_c": 0.0, "T_LH": 0.0})
RATE = 1000.0


def recorded(duration, *, datasheet=FREE, noise=np.radians(0.01), name="multisine", seed=1, **options):
    t = np.arange(round(duration * RATE)) / RATE
    columns = simulate_recording(datasheet, t, INPUTS[name](t), noise=noise, seed=seed, **options)
    return from_arrays(columns["t_s"], columns["u_V"], columns["theta_rad"], name=name)


def model(response, datasheet=FREE, **options):
    return linearised(build_plant(datasheet, **options), RATE, SHEET.parameters["theta_0"] + 0.2).response(
        response.f_hz
    )


@pytest.mark.parametrize(
    ("duration", "plant"), [(10.0, "reduced"), (10.0, "mujoco"), (15.0, "reduced"), (30.0, "reduced")]
)
def test_a_multisine_finds_the_linear_model(duration, plant):
    """The bar: 0.5 dB and 3 deg wherever the coherence is above 0.95."""
    response = frequency_response(recorded(duration, plant=plant))
    found = gap(response, model(response))
    assert response.kind == "periodic" and found.lines == response.f_hz.size == 20
    assert found.max_db < 0.5 and found.max_deg < 3.0 and not found.linear and "leave open" in found.sentence


def test_a_delay_that_the_model_lacks_is_a_linear_gap_at_the_top():
    response = frequency_response(recorded(10.0, effects=[("input_delay", {"T_d": 0.003})]))
    found = gap(response, model(response))
    assert found.linear and found.band_hz[0] > 15.0 and found.max_deg == pytest.approx(360 * 0.003 * 40, rel=0.1)
    mended = gap(response, model(response, effects=[("input_delay", {"T_d": 0.003})]))
    assert not mended.linear and mended.max_deg < 3.0


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(
    ("name", "duration"), [("chirp", 10.0), ("chirp", 4.0), ("steps", 7.0), ("steps", 4.0), ("square", 4.0)]
)
def test_any_other_input_finds_it_too_within_its_stated_error(name, duration, seed):
    """The multisine's bar for a sweep, steps and pulses, at every line that is told; the error is neither much smaller
    nor much larger than stated.
    """
    response = frequency_response(recorded(duration, name=name, seed=seed))
    found = gap(response, model(response))
    assert response.kind == "local" and found.lines == response.f_hz.size >= 6 and np.isnan(response.distortion).all()
    assert found.max_db < 0.5 and found.max_deg < 3.0 and not found.linear
    deviations = np.abs(model(response) / response.g - 1.0) / response.error
    assert 0.4 < np.sqrt(np.mean(deviations**2)) < 2.5


def test_a_sweep_tells_a_delay_that_the_model_lacks():
    response = frequency_response(recorded(10.0, name="chirp", effects=[("input_delay", {"T_d": 0.003})]))
    found = gap(response, model(response))
    assert found.linear and found.max_deg == pytest.approx(360 * 0.003 * response.f_hz[-1], rel=0.1)


def periodic(periods, *, cubic=0.0, noise=0.0, n=2000):
    """u and y of y = u + cubic u^3 behind a low-pass, over whole periods of a multisine with odd lines left out at
    random.
    """
    random = np.random.default_rng(3)
    lines = np.arange(5, 200, 6)
    t = np.arange(n)
    u = np.cos(2 * np.pi * np.multiply.outer(t, lines) / n + random.uniform(0, 2 * np.pi, lines.size)).sum(axis=1)
    u = np.tile(u / u.std(), periods)
    y = lfilter([0.2], [1.0, -0.8], u + cubic * u**3)
    times = np.arange(u.size) / RATE
    return from_arrays(times, u, y + noise * random.standard_normal(u.size), name="made")


def test_noise_and_distortion_are_told_apart():
    quiet, noisy = (frequency_response(periodic(9, cubic=x, noise=0.05)) for x in (0.0, 0.1))
    expected = 2 * 0.05 / np.sqrt(2000)  # the amplitude of white noise at one line of one period
    for response in (quiet, noisy):
        assert np.sqrt(np.mean(response.noise**2)) == pytest.approx(expected, rel=0.15) and response.periods == 8
    assert (
        np.median(noisy.distortion) > 5 * np.median(quiet.distortion) and noisy.coherence.min() < quiet.coherence.min()
    )


def test_the_best_linear_approximation_of_a_cube_is_its_slope_for_gaussian_motion():
    response = frequency_response(periodic(4, cubic=0.03))
    z = np.exp(-2j * np.pi * response.f_hz / RATE)
    ratio = response.g / (0.2 / (1 - 0.8 * z))
    assert np.median(ratio.real) == pytest.approx(1 + 3 * 0.03, abs=0.02)


def test_a_period_is_found_where_there_is_one():
    t = np.arange(10_000) / RATE
    assert find_period(INPUTS["multisine"](t)) is None
    assert find_period(INPUTS["multisine"](np.arange(13_000) / RATE)) == 10_000
    assert find_period(np.tile(np.random.default_rng(0).standard_normal(700), 5)) == 700
    assert find_period(np.random.default_rng(0).standard_normal(3000)) is None


def test_what_has_no_response_is_refused():
    t = np.arange(1000) / RATE
    y = np.sin(5 * t)
    with pytest.raises(InputError, match="input is constant"):
        frequency_response(from_arrays(t, np.ones(1000), y))
    with pytest.raises(InputError, match="even spacing"):
        frequency_response(from_arrays(np.r_[t[:500], t[500:] + 0.1], np.sin(9 * t), y))


def test_an_input_that_excites_no_band_is_refused():
    t = np.arange(3000) / RATE
    with pytest.raises(InputError, match="excites no band of frequencies"):
        frequency_response(from_arrays(t, 0.1 * t, np.sin(5 * t)))


def test_where_nothing_is_coherent_no_gap_is_told():
    random = np.random.default_rng(1)
    t = np.arange(4000) / RATE
    response = frequency_response(from_arrays(t, random.standard_normal(4000), random.standard_normal(4000)))
    assert gap(response, response.g) is None
