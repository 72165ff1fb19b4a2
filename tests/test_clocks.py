"""What happens within a sample, and between samples of a clock that is not even."""

import numpy as np
import pytest

from ers_mj.effects import BY_NAME
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped

COARSE = np.arange(0.0, 4.0, 5e-3)
SERVO = {"a_1": 25.0, "a_2": 50.0, "b": 70.0, "c_1": 135.0, "c_2": 115.0, "theta_0": 0.2625}


def parted(t, u, at):
    """Times with one more within each sample, at a share of it, and the input held across it."""
    return np.insert(t, np.arange(1, t.size), t[:-1] + at * np.diff(t)), np.repeat(u, 2)[:-1]


def test_a_body_that_stops_within_a_sample_and_goes_on_has_stopped():
    """At 2.78 s it is braked to rest from a speed far below that at the sample's end, and held for 2 ms."""
    plant = ReducedModel(lumped({**SERVO, "tau_e": 9e-4, "emf_share": 0.94}))
    u = INPUTS["multisine"](COARSE)
    fine = np.arange(COARSE.size * 50) * 1e-4
    truth = plant.simulate(fine, np.repeat(u, 50)).theta[::50]
    assert np.max(np.abs(plant.simulate(COARSE, u).theta - truth)) < 1e-9


LAWS = {
    "none": [],
    "friction at a place": [("position_dependent_friction", np.array([40.0, 3.0, 0.5, np.inf, np.inf]))],
    "gravity": [("gravity_imbalance", np.array([10.0, 3.0]))],
}


@pytest.mark.parametrize("inductance", [9e-4, 0.0])
@pytest.mark.parametrize("law", LAWS)
def test_a_clock_that_jitters_is_followed(law, inductance):
    """By maps between those of a shorter and a longer sample; what parts each sample goes through it by events."""
    jitter = np.clip(1e-4 * np.random.default_rng(3).standard_normal(COARSE.size), -1.2e-4, 1.2e-4)
    t = COARSE + jitter - jitter[0]
    u = INPUTS["multisine"](COARSE)
    effects = [(n, np.concatenate([v, BY_NAME[n].absent()[v.size :]])) for n, v in LAWS[law]]
    plant = ReducedModel(lumped({**SERVO, "tau_e": inductance, "emf_share": 0.94}), effects)
    fine, held = parted(t, u, 0.3)
    truth = plant.simulate(fine, held).theta[::2]
    assert np.max(np.abs(plant.simulate(t, u).theta - truth)) < 1e-6


@pytest.mark.parametrize("tau", [2e-5, 1e-4, 1e-3])
def test_a_falling_inductance_far_shorter_than_a_sample_is_near_one_that_is_gone_through_finely(tau):
    plant = ReducedModel(lumped({**SERVO, "tau_e": 0.0, "emf_share": 0.94}), [("inductance", np.array([tau, 300.0]))])
    t = np.arange(0.0, 1.0, 1e-3)
    u = INPUTS["multisine"](t)
    assert np.max(np.abs(plant.simulate(t, u).theta - plant.simulate(t, u, refine=4).theta)) < 2e-5


LEANING = {
    "nothing else": [],
    "a law": [("stribeck", {"dF_s": 60.0, "v_s": 0.5})],
    "a law and a delay": [("stribeck", {"dF_s": 60.0, "v_s": 0.5}), ("input_delay", {"T_d": 0.006})],
    "a push that comes and goes": [("periodic_gust", {"A": 40.0, "f": 3.0})],
}


@pytest.mark.parametrize("inductance", [5e-3, 0.0])
@pytest.mark.parametrize("beside", LEANING)
def test_a_body_that_leans_on_a_stop_through_long_samples_is_followed(beside, inductance):
    """At rest it takes a whole sample at once; each sample parted, its segments go through it."""
    t = np.arange(0.0, 8.0, 0.02)
    u = 12.0 * np.sign(np.sin(2.0 * t)) * (1.0 + 0.3 * np.sin(9.0 * t))
    stops = ("end_stop", {"lower": 0.1, "upper": 0.5, "f_stop": 40.0, "zeta": 0.5})
    effects = [
        (n, np.array([v.get(p.name, p.absent) for p in BY_NAME[n].parameters])) for n, v in [stops, *LEANING[beside]]
    ]
    plant = ReducedModel(lumped({**SERVO, "tau_e": inductance, "emf_share": 0.94}), effects)
    fine, held = parted(t, u, 0.3)
    motion, truth = plant.simulate(t, u), plant.simulate(fine, held)
    at_rest = np.mean((motion.omega == 0.0) & ((motion.theta < 0.1) | (motion.theta > 0.5)))
    assert np.max(np.abs(motion.theta - truth.theta[::2])) < 2e-5
    assert at_rest > 0.2
