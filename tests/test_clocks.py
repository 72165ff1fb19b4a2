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
