"""Named inputs move Table 1's rudder through stick and slip, and keep it near home."""

import numpy as np
import pytest

from ers_mj.plants.inputs import DURATION, INPUTS, RATE_HZ
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.servo.datasheet import TABLE_1, Datasheet

T = np.arange(int(DURATION * RATE_HZ)) / RATE_HZ


def test_the_table_holds_the_contracts_names():
    assert list(INPUTS) == ["multisine", "chirp", "ramp", "steps", "square"]


@pytest.mark.parametrize("inductance", [False, True])
@pytest.mark.parametrize("name", INPUTS)
def test_it_moves_the_rudder_through_stick_and_slip(name, inductance):
    values = Datasheet(parameters=TABLE_1).to_lumped()
    model = ReducedModel(lumped(values if inductance else values | {"tau_e": 0.0}))
    motion = model.simulate(T, INPUTS[name](T))
    travel = np.degrees(motion.theta - values["theta_0"])
    stuck = np.mean(motion.omega == 0.0)
    assert travel.std() >= 2.0
    assert np.abs(travel).max() <= 60.0
    assert travel.min() < -2.0 and travel.max() > 2.0, "both directions"
    assert 0.005 <= stuck <= 0.95


@pytest.mark.parametrize("name", INPUTS)
def test_it_is_a_function_of_time_alone(name):
    u = INPUTS[name](T)
    assert u.shape == T.shape and np.isfinite(u).all()
    np.testing.assert_array_equal(u, INPUTS[name](T.copy()))
    np.testing.assert_allclose(INPUTS[name](T[1234:1235]), u[1234:1235], rtol=0, atol=1e-12)
    np.testing.assert_allclose(INPUTS[name](T[:10] + DURATION), u[:10], rtol=0, atol=1e-8)
    assert np.abs(u).max() <= 24.0
