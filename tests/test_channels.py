"""What current, speed and motor angle add to the output: parameters that the output alone cannot tell, and where an effect sits."""

import numpy as np
import pytest

from ers_mj.baseline import baseline
from ers_mj.datasheet import read_datasheet
from ers_mj.diagnosis import diagnose
from ers_mj.identification import residuals
from ers_mj.model import OBSERVER_RATE
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.recording import from_arrays
from ers_mj.traces import Blocks, trace_of

T = np.arange(0.0, 4.0, 1e-3)
TRUTH = {"a_1": 25.0, "a_2": 50.0, "b": 70.0, "c_1": 135.0, "c_2": 115.0, "theta_0": 0.2625, "tau_e": 1.1e-3, "emf_share": 0.9}
AMPERE = 110.0  # n K_t / J [rad/s^2 per A]
NOISE = {"theta": 1.5e-4, "current": 0.02, "speed": 0.05, "motor": 3e-3}
RATIO, ZERO = 22.26, 0.7  # of the motor's encoder


def recordings(effects=(), *channels):
    """Three recordings of a servo that is not quite Table 1's, with these further channels."""
    out = []
    for k, name in enumerate(("multisine", "steps", "chirp")):
        u, rng = np.round(INPUTS[name](T), 4), np.random.default_rng(k)
        motion = ReducedModel(lumped(TRUTH), effects).simulate(T, u)
        seen = {"current": motion.drive / AMPERE, "speed": motion.omega, "motor": RATIO * motion.theta_m + ZERO}
        noisy = {kind: seen[kind] + NOISE[kind] * rng.standard_normal(T.size) for kind in channels}
        fields = {{"speed": "omega", "motor": "theta_m"}.get(kind, kind): x for kind, x in noisy.items()}
        out.append(from_arrays(T, u, motion.measured + NOISE["theta"] * rng.standard_normal(T.size), name=f"{name}.csv", **fields))
    return out


def test_the_current_tells_the_torque_constant_and_the_back_emf():
    traces = [trace_of(r, None) for r in recordings((), "current")]
    values = baseline(traces, read_datasheet("table1"), True).fit.model.values
    assert values["ampere"] == pytest.approx(AMPERE, rel=0.01)
    assert values["emf_share"] == pytest.approx(TRUTH["emf_share"], abs=0.01)


def test_every_channel_is_explained_to_its_noise():
    traces = [trace_of(r, None) for r in recordings((), "current", "speed", "motor")]
    assert all({c.kind for c in t.channels} == {"current", "speed", "motor"} for t in traces)
    start = baseline(traces, read_datasheet("table1"), True)
    misfit = Blocks.of(start.traces).misfit(residuals(start.fit.model, start.traces, OBSERVER_RATE))
    assert misfit.size == 4 * sum(t.counts.size for t in traces) == start.fit.misfit.size
    assert np.median(misfit) == pytest.approx(1.0, abs=0.1) and misfit.max() < 2.0


@pytest.mark.parametrize("name, size", [("sensor_lag", [1.5e-3, np.inf]), ("sensor_lag", [1e-4, 3e-3]), ("input_delay", [1.5e-3])])
def test_the_current_says_on_which_side_of_the_motor_a_delay_lies(name, size):
    document = diagnose(recordings([(name, np.array(size))], "current"), read_datasheet("table1")).document
    assert document["missing"][0]["effect"] == name
    assert document["missing"][0]["alternatives"] == []
    assert "n K_t/J" in document["parameters"]
