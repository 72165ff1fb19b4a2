"""Which candidate leads, and what is another's form."""

from dataclasses import replace

import numpy as np
import pytest
from servo import having

from ers_mj.decisions.thresholds import POLICY
from ers_mj.effects import BY_NAME
from ers_mj.selection.comparison import judged, likeliest, likeliest_first, paired_z, rivals_of, shows, stands_alone


@pytest.fixture
def found(pushed):
    """A candidate with these numbers and this gain, as if it had been fitted."""
    return lambda name, p, gain: replace(judged(name, having(pushed.fit, name, p), pushed.fit, 1.0), gain=gain)


def test_a_shaft_that_twists_by_less_than_the_noise_is_none(pushed, found):
    """At 756 Hz 115 rad/s^2 of friction twist it by 5 urad, where the noise is 150."""
    assert not shows(found("shaft_compliance", [756.0, 0.4, 0.3, 0.6, np.inf], 9.0))
    assert shows(found("shaft_compliance", [90.0, 0.4, 0.3, 0.6, np.inf], 9.0))
    assert shows(judged("friction_level", pushed.fit, pushed.fit, 1.0))


def test_what_a_fit_has_won_is_told_block_by_block(pushed):
    misfit = pushed.fit.misfit.copy()
    misfit[:3], misfit[3] = 2.0 * (1.0 + misfit[:3]) - 1.0, 0.5 * (1.0 + misfit[3]) - 1.0
    one = judged("bias_torque", pushed.fit, replace(pushed.fit, misfit=misfit), 1.0)
    ln2 = np.log(2.0)
    assert (one.gain, one.lost, one.best) == (pytest.approx(2 * ln2), pytest.approx(ln2), pytest.approx(ln2))
    assert one.z == paired_z(pushed.fit.misfit, misfit, 1.0) > 0.0
    assert one.worth == pytest.approx(one.gain - POLICY.parameter_price * pushed.fit.size)
    offer = one.offer
    assert offer.is_effect and not (offer.once or offer.clocked)
    assert offer.kin == {"bias_torque", "asymmetric_friction"}
    level = judged("friction_level", pushed.fit, pushed.fit, 1.0).offer
    assert level.clocked and not level.is_effect and judged("load_disturbance", pushed.fit, pushed.fit, 1.0).offer.once


def test_a_torque_that_bends_along_the_travel_is_gravity(pushed):
    """Its slope is the spring's and costs nothing; how it bends follows from its size, so that it must do better than
    what is constant, and not as well.
    """
    models = {
        name: having(pushed.fit, name).model for name in ("bias_torque", "asymmetric_friction", "gravity_imbalance")
    }
    fits = {name: replace(pushed.fit, model=some, hessian=np.eye(len(some.layout()))) for name, some in models.items()}
    bent = fits["gravity_imbalance"]
    assert likeliest(fits) == "bias_torque"
    for better, first in ((0.9, "bias_torque"), (1.1, "gravity_imbalance")):
        share = POLICY.curved ** (-better / bent.misfit.size)
        fits["gravity_imbalance"] = replace(bent, misfit=(1.0 + bent.misfit) * share - 1.0)
        assert likeliest(fits) == first


def test_a_play_less_wide_than_its_contact_gives_way_is_a_shaft(pushed, found):
    """115 rad/s^2 of friction push a contact of 80 Hz in by 0.46 mrad."""
    shaft = found("shaft_compliance", [60.0, 0.1, 0.6, 0.2, np.inf], 16.0)
    for gap, gain, first in ((1e-4, 20.0, "shaft_compliance"), (1e-3, 20.0, "backlash"), (1e-4, 40.0, "backlash")):
        play = found("backlash", [gap, 0.6, 0.2, 80.0, 0.1], gain)
        assert likeliest_first([play, shaft])[0].name == first
    hard = np.array([80.0, 0.7, 0.6, 0.2, np.inf])
    assert not BY_NAME["backlash"].grown("shaft_compliance", hard, pushed.fit.model.scales)


def test_a_shaft_whose_motor_bears_nothing_is_a_filter_in_the_drive(pushed, found):
    winding = found("inductance", [2e-3, np.inf], 17.0)
    for rho, first in ((0.2, "inductance"), (0.4, "shaft_compliance")):
        shaft = found("shaft_compliance", [50.0, 0.7, rho, 0.0, np.inf], 21.0)
        assert likeliest_first([shaft, winding])[0].name == first
    light = np.array([50.0, 0.7, 0.2, 0.0, np.inf])
    assert not BY_NAME["shaft_compliance"].grown("shaft_compliance", light, pushed.fit.model.scales)


def test_what_leaves_the_same_in_all_blocks_is_no_other_offer(pushed, found):
    torque = found("load_dependent_friction", [0.01, *4 * [np.inf]], 2.0)
    same, other = (
        replace(found("stribeck", None, 1.9), fit=replace(torque.fit, misfit=m))
        for m in (torque.fit.misfit, torque.fit.misfit + np.linspace(0.0, 0.5, torque.fit.misfit.size))
    )
    assert stands_alone(torque, [torque, same]) and not stands_alone(torque, [torque, other])
    assert stands_alone(torque, [torque, replace(other, gain=1.2)])
    assert not stands_alone(found("periodic_gust", None, 2.0), [])
    assert rivals_of([torque, same, replace(other, gain=0.9)]) == 2
