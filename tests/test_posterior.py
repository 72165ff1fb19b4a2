"""How probable an explanation is, and how far one is from another on the recordings at hand."""

from dataclasses import replace

import numpy as np
import pytest
from servo import having

from ers_mj.decisions.thresholds import POLICY
from ers_mj.selection.posterior import isolability, probabilities

PREFERRED = 1 / (1 + np.exp(-POLICY.wider_price))


@pytest.fixture(scope="module")
def fits(pushed):
    return {
        "wide": having(pushed.fit, "backlash", [1e-4, 0.6, 0.2, 80.0, 0.2]),
        "narrow": having(pushed.fit, "shaft_compliance", [80.0, 0.2, 0.6, 0.2, np.inf]),
        "torque": having(pushed.fit, "bias_torque", [0.1]),
    }


def test_of_two_alike_the_one_without_play_is_likelier(pushed, fits):
    """One has the other as its limit: it must do better, and not as well, to be named."""
    wide, narrow = fits["wide"], fits["narrow"]
    assert probabilities({"wide": wide, "narrow": narrow})["narrow"] == pytest.approx(PREFERRED, abs=0.01)
    assert probabilities({"wide": wide, "torque": fits["torque"]})["wide"] == pytest.approx(0.5, abs=0.01)
    better = replace(wide, misfit=wide.misfit * 0.8)
    assert probabilities({"wide": better, "narrow": narrow})["wide"] > 0.8
    seen = having(pushed.fit, "backlash", [5e-4, 0.6, 0.2, 80.0, 0.2])  # wider than its contact gives way
    assert probabilities({"wide": seen, "narrow": narrow})["wide"] == pytest.approx(PREFERRED, abs=0.01)


def test_gravity_in_the_place_of_a_spring_costs_nothing(pushed):
    models = [having(pushed.fit, name).model for name in ("bias_torque", "gravity_imbalance")]
    torque, gravity = (replace(pushed.fit, model=some, hessian=np.eye(len(some.layout()))) for some in models)
    assert gravity.size > torque.size
    assert probabilities({"torque": torque, "gravity": gravity})["gravity"] == pytest.approx(0.5)


def test_an_explanation_is_as_far_as_its_motion_and_its_cost(pushed, fits):
    traces = pushed.traces
    (same,) = isolability(fits["torque"], [fits["torque"]], traces)
    assert (same.cost, same.sigmas, same.probability) == (0.0, 0.0, 0.5)
    worse = replace(fits["narrow"], misfit=fits["narrow"].misfit + 0.5)
    (far,) = isolability(fits["torque"], [worse], traces)
    assert far.cost > 3.0 and far.z > 2.0 and far.sigmas > 0.5 and far.probability < 0.05
