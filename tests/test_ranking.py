"""Which candidate leads, and what is another's form."""

from dataclasses import replace

import numpy as np
import pytest
from servo import recorded, started

from ers_mj.decisions.policy import POLICY
from ers_mj.effects import BY_NAME
from ers_mj.selection.comparison import judged, likeliest, likeliest_first, shows, stands_alone
from ers_mj.selection.posterior import probabilities
from ers_mj.selection.stepwise import select


def test_a_shaft_that_twists_by_less_than_the_noise_is_none(pushed):
    """At 756 Hz 115 rad/s^2 of friction twist it by 5 urad, where the noise is 150."""
    stiff, soft = (
        replace(
            pushed.fit, model=pushed.fit.model.with_effect("shaft_compliance", np.array([f, 0.4, 0.3, 0.6, np.inf]))
        )
        for f in (756.0, 90.0)
    )
    assert not shows(judged("shaft_compliance", stiff, pushed.fit, 1.0)) and shows(
        judged("shaft_compliance", soft, pushed.fit, 1.0)
    )
    assert shows(judged("friction_level", pushed.fit, pushed.fit, 1.0))


def test_of_two_alike_the_one_without_play_is_likelier(pushed):
    """One has the other as its limit: it must do better, and not as well, to be named."""
    wide, narrow, none = (
        replace(pushed.fit, model=pushed.fit.model.with_effect(name, np.array(p)))
        for name, p in (
            ("backlash", [1e-4, 0.6, 0.2, 80.0, 0.2]),
            ("shaft_compliance", [80.0, 0.2, 0.6, 0.2, np.inf]),
            ("bias_torque", [0.1]),
        )
    )
    alike = probabilities({"backlash": wide, "shaft_compliance": narrow})
    assert alike["shaft_compliance"] == pytest.approx(1 / (1 + np.exp(-0.75)), abs=0.01)
    assert probabilities({"backlash": wide, "bias_torque": none})["backlash"] == pytest.approx(0.5, abs=0.01)
    better = replace(wide, misfit=wide.misfit * 0.8)
    assert probabilities({"backlash": better, "shaft_compliance": narrow})["backlash"] > 0.8
    seen = replace(
        wide, model=pushed.fit.model.with_effect("backlash", np.array([5e-4, 0.6, 0.2, 80.0, 0.2]))
    )  # wider than its contact gives way
    assert probabilities({"backlash": seen, "shaft_compliance": narrow})["backlash"] == pytest.approx(
        1 / (1 + np.exp(-0.75)), abs=0.01
    )


def test_a_torque_that_bends_along_the_travel_is_gravity(pushed):
    """Its slope is the spring's and costs nothing; how it bends follows from its size, so that it must do better than
    what is constant, and not as well.
    """
    model = pushed.fit.model
    models = {
        name: model.with_effect(name, BY_NAME[name].starts(model.scales)[0])
        for name in ("bias_torque", "asymmetric_friction", "gravity_imbalance")
    }
    fits = {name: replace(pushed.fit, model=some, hessian=np.eye(len(some.layout()))) for name, some in models.items()}
    alike = probabilities(fits)
    assert alike["gravity_imbalance"] == pytest.approx(alike["bias_torque"]) and likeliest(fits) == "bias_torque"
    for better, first in ((0.9, "bias_torque"), (1.1, "gravity_imbalance")):
        cost = float(np.sum(np.log(1.0 + fits["gravity_imbalance"].misfit)))
        bent = replace(
            fits["gravity_imbalance"],
            misfit=(1.0 + fits["gravity_imbalance"].misfit) * POLICY.curved ** (-better / pushed.fit.misfit.size) - 1.0,
        )
        assert (
            float(np.sum(np.log(1.0 + bent.misfit))) < cost and likeliest({**fits, "gravity_imbalance": bent}) == first
        )


def test_a_play_less_wide_than_its_contact_gives_way_is_a_shaft(pushed):
    """115 rad/s^2 of friction push a contact of 80 Hz in by 0.46 mrad."""

    def found(name, p, gain):
        return replace(
            judged(name, replace(pushed.fit, model=pushed.fit.model.with_effect(name, np.array(p))), pushed.fit, 1.0),
            gain=gain,
        )

    shaft = found("shaft_compliance", [60.0, 0.1, 0.6, 0.2, np.inf], 16.0)
    for gap, gain, first in ((1e-4, 20.0, "shaft_compliance"), (1e-3, 20.0, "backlash"), (1e-4, 40.0, "backlash")):
        play = found("backlash", [gap, 0.6, 0.2, 80.0, 0.1], gain)
        assert likeliest_first([play, shaft])[0].name == first
    assert not BY_NAME["backlash"].grown(
        "shaft_compliance", np.array([80.0, 0.7, 0.6, 0.2, np.inf]), pushed.fit.model.scales
    )


def test_a_faint_law_beside_an_effect_must_stand_alone():
    """A friction of 1 % of the drive's torque beside a drag that leaves twenty times as much, and what no law of the
    servo offers more than another.
    """
    start = started(
        recorded([("quadratic_drag", np.array([1.0, np.inf])), ("load_dependent_friction", np.array([0.01, np.inf]))])
    )
    found = select(start.fit, start.traces, jobs=1)
    assert found.chosen.model.names == ("quadratic_drag", "load_dependent_friction")
    assert POLICY.faint_gain < found.rounds[1][0].gain < POLICY.later_gain
    first, second = replace(found.rounds[1][0], gain=2.0), replace(found.rounds[0][1], name="stribeck", gain=1.5)
    assert stands_alone(first, (first, replace(second, gain=1.2))) and not stands_alone(first, (first, second))
    assert stands_alone(first, (first, replace(first, name="stribeck")))  # which leaves the same in all blocks
    assert not stands_alone(replace(first, name="periodic_gust"), (first,))
    torque = replace(first, name="bias_torque")
    assert stands_alone(torque, (torque, replace(second, name="asymmetric_friction")))  # which is one with it


def test_a_shaft_whose_motor_bears_nothing_is_a_filter_in_the_drive(pushed):
    def found(name, p, gain):
        return replace(
            judged(name, replace(pushed.fit, model=pushed.fit.model.with_effect(name, np.array(p))), pushed.fit, 1.0),
            gain=gain,
        )

    winding = found("inductance", [2e-3, np.inf], 17.0)
    for rho, first in ((0.2, "inductance"), (0.4, "shaft_compliance")):
        assert (
            likeliest_first([found("shaft_compliance", [50.0, 0.7, rho, 0.0, np.inf], 21.0), winding])[0].name == first
        )
    assert not BY_NAME["shaft_compliance"].grown(
        "shaft_compliance", np.array([50.0, 0.7, 0.2, 0.0, np.inf]), pushed.fit.model.scales
    )
