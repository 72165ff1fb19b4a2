"""What a simulation leaves over frequency: linear gaps, distortions and noise are told apart, on made signals and on
servos.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter, welch

from ers_mj.data.prepared import Signals, make_trace, trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.diagnosis.localisation import LOCAL_RATE, gather, over_frequency, places
from ers_mj.diagnosis.mismatch_spectrum import mismatch, observed_noise
from ers_mj.estimation.baseline import baseline
from ers_mj.plants.inputs import INPUTS
from ers_mj.servo.datasheet import read_datasheet
from ers_mj.servo.simulation import simulate_recording

H, SIGMA = 1e-3, 1e-3
SHEET = read_datasheet("table1")


def made(error, seed=0, n=8000, holes=slice(0, 0)):
    """A trace whose motion x is slow noise, and its error: ``error(x)`` and white noise."""
    random = np.random.default_rng(seed)
    u = random.standard_normal(n)
    x = lfilter([0.02], [1.0, -0.98], u)
    e = error(x) + SIGMA * random.standard_normal(n)
    valid = np.ones(n, bool)
    valid[holes] = False
    return make_trace("made", Signals(H * np.arange(n), u, x + e, valid), SIGMA), e[valid]


def told(error, rate=1e-9, **options):
    return mismatch(*zip(*(made(error, seed, **options) for seed in (1, 2))), rate)


def late(x):
    """What an output that comes 5 ms later adds."""
    return np.concatenate([np.zeros(5), x[:-5]]) - x


def test_a_delay_is_linear_and_measured():
    found = told(late)
    assert found.kind == "linear" and found.linear_share > 0.97
    assert " 5 ms later" in found.sentence


def test_a_cube_is_a_distortion_but_for_its_slope():
    found = told(lambda x: 3.0 * x * (x**2 - 3.0 * x.var()))
    assert found.kind == "distortion" and found.linear_share < 0.1 and "no linear change" in found.sentence


def test_the_shares_add_as_they_were_mixed():
    """A gain of 10 % and an error independent of it, of equal power: half and half."""
    other = lfilter([0.02], [1.0, -0.98], np.random.default_rng(9).standard_normal(8000))
    found = told(lambda x: 0.1 * x + 0.1 * other)
    assert found.kind == "both" and found.linear_share == pytest.approx(0.5, abs=0.1)


def test_the_band_is_where_the_error_was_put():
    tone = np.sin(2 * np.pi * 17.0 * H * np.arange(8000))
    found = told(lambda x: 0.02 * tone)
    assert (
        found.region[0] < 17.0 < found.region[1] < 1.2 * 17.0
        and found.share_of_error > 0.6
        and found.share_of_motion < 0.1
    )


def test_a_sweep_that_passes_a_line_once_is_not_called_linear_for_that():
    """A gain that changes at random every 0.1 s: one frame alone is always explained, its neighbours are not."""
    t = H * np.arange(8000)
    x = np.sin(2 * np.pi * (2.0 * t + 3.0 * t**2))
    gain = np.repeat(np.random.default_rng(5).standard_normal(80), 100)
    for error, kind in ((0.1 * gain * x, "distortion"), (late(x), "linear")):
        error = error + SIGMA * np.random.default_rng(6).standard_normal(t.size)
        assert (
            mismatch([make_trace("sweep", Signals(t, x, x + error, np.ones(t.size, bool)), SIGMA)], [error], 1e-9).kind
            == kind
        )


@pytest.mark.parametrize("seed", range(4))
def test_noise_alone_says_nothing(seed):
    found = mismatch(*zip(*(made(np.zeros_like, 10 * seed + k) for k in range(3))), 1e-9)
    assert found.region is None and found.kind is None


def test_holes_are_bridged_and_short_recordings_refused():
    assert told(late, holes=slice(2000, 2100)).kind == "linear"
    assert told(late, n=200) is None


def test_what_the_observer_makes_of_noise():
    """Against the observer itself, corrected every 5 ms from white noise."""
    n, every, g = np.random.default_rng(0).standard_normal(400_000), 5, 1.0 - np.exp(-LOCAL_RATE * 5 * H)
    a = np.roll(np.repeat(lfilter([g], [1.0, g - 1.0], n[::every]), every), 1)  # a sample is judged before it corrects
    f, density = welch(n - a, 1.0 / H, nperseg=4000)
    low = (f > 0.5) & (f < 60.0)
    assert density[low] == pytest.approx(observed_noise(f, H, every, 1.0, LOCAL_RATE)[low], rel=0.35)
    assert density[low].mean() == pytest.approx(observed_noise(f, H, every, 1.0, LOCAL_RATE)[low].mean(), rel=0.03)


# -- servos
# --------------------------------------------------------------------------------------------------------------


def located(effects=(), plant="reduced"):
    """The places and the spectrum of a servo that is not quite Table 1's, behind the refitted baseline."""
    truth = replace(
        SHEET, parameters={**SHEET.parameters, "J": 1.1 * SHEET.parameters["J"], "F_c": 0.9 * SHEET.parameters["F_c"]}
    )
    t, traces = np.arange(4000) * H, []
    for k, name in enumerate(("multisine", "chirp", "steps")):
        columns = simulate_recording(
            truth, t, INPUTS[name](t), noise=np.radians(0.01), seed=k, effects=effects, plant=plant, inductance=True
        )
        traces.append(
            trace_of(
                from_arrays(columns["t_s"], columns["u_V"], columns["theta_rad"], name=name), SHEET.parameters["J"]
            )
        )
    start = baseline(traces, SHEET, True)
    samples = gather(start.fit.model, start.fit.model, start.traces)
    spectrum = over_frequency(samples, start.traces)
    return places(samples, start.traces, (), start.fit.cost, (), "rad", "V", spectrum), spectrum


@pytest.mark.parametrize(
    ("effect", "kind"),
    [
        (("sensor_lag", {"T": 0.003}), ("linear",)),
        (("input_delay", {"T_d": 0.003}), ("linear",)),
        (
            ("shaft_compliance", {"f_shaft": 20.0, "zeta": 0.1, "rho": 0.55, "phi": 0.15}),
            ("both", "linear"),
        ),  # its friction bends it: about 0.6 of it is linear
        (("stribeck", {"dF_s": 0.08, "v_s": 0.15}), ("distortion",)),
        (("backlash", {"gap": 0.008, "rho": 0.6, "f_contact": 80.0, "zeta": 0.3}), ("distortion",)),
    ],
)
def test_a_concealed_effect_is_linear_or_a_distortion(effect, kind):
    found, spectrum = located([effect])
    place = next(p for p in found if p.axis == "frequency")
    assert (place.label, place.unit, place.region) == (spectrum.kind, "Hz", spectrum.region) and spectrum.kind in kind
    assert place.sentence.startswith(f"{place.share_of_error:.0%} of the error beyond the noise lies at")


@pytest.mark.parametrize("plant", ["reduced", "mujoco"])
def test_a_servo_without_missing_physics_is_silent(plant):
    found, spectrum = located(plant=plant)
    assert spectrum.region is None and all(p.axis != "frequency" for p in found)
