"""The observer form that fits are made of: it passes over its own recording without a correction, and what it leaves
has slopes.
"""

from dataclasses import replace

import numpy as np
import pytest
from test_reduced import SCALES

from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.effects import BY_NAME, EFFECTS
from ers_mj.estimation.jacobian import step_of
from ers_mj.estimation.objective import residuals
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.servo.model import OBSERVER_RATE, Model

T = np.arange(0.0, 3.0, 1e-3)
TRUTH = {
    "a_1": 25.0,
    "a_2": 50.0,
    "b": 70.0,
    "c_1": 135.0,
    "c_2": 115.0,
    "theta_0": 0.2625,
    "tau_e": 1.1e-3,
    "emf_share": 0.9,
    "ampere": 110.0,
}
SHEET = {**TRUTH, "b": 80.0, "c_1": 150.0, "c_2": 105.0, "a_1": 29.0}  # where fits begin: beside the data
NOISE = 3e-4
SOME = [e for e in EFFECTS if e.starts(SCALES) and not e.once]
UNSEEN = {"sensor_quantisation", "sensor_dropout"}  # steps of the reading: no slope by their own numbers


def trace(effects=(), noise=NOISE):
    u = np.round(INPUTS["multisine"](T), 4)
    y = ReducedModel(lumped(TRUTH), effects).simulate(T, u).measured
    return trace_of(from_arrays(T, u, y + noise * np.random.default_rng(0).standard_normal(T.size), name="a.csv"), None)


def model(values, effects):
    return Model(values, ("a_2", "b", "c_2", "a_1", "c_1", "theta_0"), effects=tuple(effects), scales=SCALES)


@pytest.mark.parametrize(
    "bent", [[0.1, 0.3, np.inf, np.inf, np.inf], [np.inf, np.inf, 0.01, 0.3, 1.0]], ids=["polynomial", "wave"]
)
def test_a_bent_sensor_is_taken_off_where_the_run_begins_and_where_it_is_followed(bent):
    bent = [("sensor_nonlinearity", np.array(bent))]
    reading = float(ReducedModel(lumped(TRUTH), bent).read(T[:1], np.array([TRUTH["theta_0"]]))[0])
    e = residuals(model(TRUTH, bent), [replace(trace(bent), start=(reading, 0.0))], OBSERVER_RATE)
    assert np.sqrt(np.mean(e**2)) < 1.05


@pytest.mark.parametrize("effect", [e for e in SOME if e.name not in UNSEEN], ids=lambda e: e.name)
def test_what_a_run_leaves_has_slopes_beside_the_data(effect):
    """Over the step of the differences and over a fifth of it, far from the data: otherwise no search finds its way."""
    here, data = model(SHEET, [(effect.name, effect.starts(SCALES)[0])]), [trace()]
    layout = here.layout()
    z, e = here.vector(layout), residuals(here, data, OBSERVER_RATE)
    row = np.eye(z.size)[[f.name for f in layout].index("c_2")]
    over, within = (
        (residuals(here.at(layout, z + step * row), data, OBSERVER_RATE) - e) / step
        for step in (step_of(here), 0.2 * step_of(here))
    )
    assert np.sqrt(np.mean((over - within) ** 2)) < 0.2 * np.sqrt(np.mean(over**2))


@pytest.mark.parametrize("name", ["supply_sag", "thermal_drift"])
def test_the_windings_current_is_what_the_law_leaves_of_it(name):
    """n K_t i / J along a motion, the law evaluated sample by sample with its memory."""
    effect, c = BY_NAME[name], lumped(TRUTH)
    for p in effect.starts(SCALES):
        motion = ReducedModel(c, [(name, p)]).outputs(T, INPUTS["multisine"](T), (TRUTH["theta_0"], 0.0))[1]
        constants, left = effect.constants(p, c), []
        for t, (theta, w, j, _) in zip(T, motion):
            left.append(j + effect.torque(constants, theta, w, j, t))
            constants[4] = effect.memory(constants, theta, w, j, T[1] - T[0])
        told = ReducedModel(c, [(name, p)]).current(T, motion)
        assert np.max(np.abs(told - left)) < 0.1 * np.max(np.abs(told - motion[:, 2]))
        assert np.max(np.abs(told - motion[:, 2])) > 0.003 * np.max(np.abs(told))
