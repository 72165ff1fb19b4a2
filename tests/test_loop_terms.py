"""What acts behind or within a firmware's loop: found from starts of its own, and looked for again beside what held-out
data left.
"""

from dataclasses import replace

import numpy as np
import pytest
from test_position_loop import LIMITED, recorded, run_of, steps_of

from ers_mj.data.recording import from_arrays
from ers_mj.effects.backlash import Backlash
from ers_mj.effects.gravity_imbalance import GravityImbalance
from ers_mj.effects.load_dependent_friction import LoadDependentFriction
from ers_mj.effects.position_dependent_friction import PositionDependentFriction
from ers_mj.effects.presliding import Presliding
from ers_mj.effects.rate_limit import RateLimit
from ers_mj.effects.shaft_compliance import ShaftCompliance
from ers_mj.effects.stribeck import Stribeck
from ers_mj.effects.voltage_saturation import VoltageSaturation
from ers_mj.position_loop.closed_form import ClosedForms
from ers_mj.position_loop.fit import fitted
from ers_mj.position_loop.model import LoopModel
from ers_mj.position_loop.runs import runs_of
from ers_mj.position_loop.selection import Selector
from ers_mj.position_loop.terms import is_there, other_forms, parts, terms, without
from ers_mj.position_loop.weak_form import Rough

BEHIND = {
    LoadDependentFriction.name: ({"rubbed": 0.2, "share": 0.1}, [0.25, np.inf, np.inf, np.inf, np.inf]),
    ShaftCompliance.name: ({"rubbed": 0.4}, [4.3, 0.06, 0.65, 0.38, np.inf]),
    Backlash.name: ({"rubbed": 0.3, "grease": 0.1}, [0.03, 0.6, 0.3, 60.0, 0.5]),
    Presliding.name: ({}, [0.15, 0.5, *4 * [np.inf]]),
}


@pytest.mark.parametrize("name", BEHIND)
def test_what_acts_behind_a_loop_is_found_from_a_start_of_its_own(name):
    letters, numbers = BEHIND[name]
    runs = runs_of(recorded(LIMITED | letters, seeds=(2,), effects=((name, np.array(numbers)),)))
    chosen = Selector(runs, True).run().chosen
    assert chosen.model.names == (name,)
    assert chosen.model["K"] == pytest.approx(LIMITED["K"], rel=0.1)


def test_a_limit_is_found_beside_a_model_that_lacks_it_unless_it_was_refused():
    selector = Selector(runs_of(recorded(LIMITED)), True)
    found = selector.run()
    bare = fitted(without(found.chosen.model, VoltageSaturation.name), selector.data)
    lacking = replace(found, chosen=bare, left=())
    again = selector.another(lacking, ())
    assert again is not None and is_there(again.chosen.model, VoltageSaturation.name)
    instead = selector.another(lacking, {frozenset(parts(again.chosen.model))})
    assert instead is None or set(parts(instead.chosen.model)) != set(parts(again.chosen.model))


def test_the_offset_of_a_log_shows_once_the_limit_of_its_reference_is_known():
    """Under a weight, which the loop without that limit lost."""
    given = recorded(LIMITED | {"R": 2.5}, seeds=(1, 2, 3), effects=((GravityImbalance.name, np.array([30.0, 12.0])),))
    logs = [from_arrays(x.t, x.u, x.y + 0.004 * (x is given[2]), name=x.name, input_unit="rad") for x in given]
    selector = Selector(runs_of(logs), True)
    chosen = selector.run().chosen
    assert {GravityImbalance.name, RateLimit.name} <= set(parts(chosen.model)) and chosen.misfit < 1.2
    assert selector.runs[2].y[0] == pytest.approx(given[2].y[0], abs=1e-3)


def test_two_bodies_are_begun_without_what_one_had_late_within_its_loop():
    """Which stands for the second one."""
    runs = runs_of(recorded(LIMITED, seeds=(1,)))
    closed = ClosedForms(runs, True)
    one = closed.begun(Rough({"K": 900.0, "tau_s": 0.01, "a_2": 20.0, "c_2": 8.0, "L": 150.0}, 0.0))
    late = one.lacking("tau_s").having(dead_time_s=0.03, lag_s=0.005)
    shaft = next(term for term in terms(late, runs, 0.01) if term.name == ShaftCompliance.name)
    starts = closed.beside(shaft, late).starts
    assert {start["dead_time_s"] for start in starts} == {0.0, 0.03} and {start["lag_s"] for start in starts} == {
        0.0,
        0.005,
    }


def test_an_effect_goes_with_the_letters_that_only_it_tells():
    play, shaft = np.array([0.02, 0.5, 0.3, 60.0, 0.5]), np.array([8.0, 0.1, 0.6, 0.3, np.inf])
    effects = ((Backlash.name, play), (GravityImbalance.name, np.array([20.0, 0.0])))
    model = LoopModel(LIMITED, tuple(LIMITED), effects).having(grease=0.1, rubbed=0.3)
    assert {"grease", "rubbed"} <= set(without(model, GravityImbalance.name).free)
    assert not {"grease", "rubbed"} & set(without(model, Backlash.name).free)
    both = model.without_effect(Backlash.name).with_effect(ShaftCompliance.name, shaft)
    both = both.having(share=0.2).with_effect(LoadDependentFriction.name, np.array([0.2, *4 * [np.inf]]))
    left = without(both, LoadDependentFriction.name)
    assert "rubbed" in left.free and "share" not in left.free
    assert without(both, Stribeck.name).free == both.free


def test_a_wave_is_begun_in_every_quarter_of_its_period():
    runs = runs_of(recorded(LIMITED, seeds=(1,)))
    model = ClosedForms(runs, True).begun(Rough({"K": 900.0, "tau_s": 0.01, "a_2": 20.0, "c_2": 8.0, "L": 150.0}, 0.0))
    starts = next(term.starts for term in terms(model, runs, 1e-3) if term.name == PositionDependentFriction.name)
    waves = [dict(start.effects)[PositionDependentFriction.name] for start in starts]
    phases = {round(float(x[4]) / (0.5 * np.pi)) for x in waves if np.isfinite(x[4])}
    assert phases == {0, 1, 2, 3}


def test_a_bristle_is_tried_in_its_other_forms_and_load_friction_in_none():
    runs = runs_of(recorded(LIMITED, seeds=(1,)))
    model = ClosedForms(runs, True).begun(Rough({"K": 900.0, "tau_s": 0.01, "a_2": 20.0, "c_2": 8.0, "L": 150.0}, 0.0))
    bent = model.with_effect(Presliding.name, np.array([0.02, 0.5, *4 * [np.inf]]))
    exponents = [dict(other.effects)[Presliding.name][3] for other in other_forms(bent, Presliding.name)]
    assert any(np.isfinite(x) and x > 1.0 for x in exponents)
    rubbing = model.with_effect(LoadDependentFriction.name, np.array([0.2, *4 * [np.inf]]))
    assert other_forms(rubbing, LoadDependentFriction.name) == []


@pytest.mark.parametrize(("size", "loads"), [(0.2, ("sin", "cos")), (1.5, ("hold", "sin", "cos"))])
def test_a_small_travel_has_no_constant_torque_beside_a_weight(size, loads):
    t, r = steps_of(1, size=size)
    runs = [run_of(t, r)]
    assert ClosedForms(runs, True).loads == loads
    assert ClosedForms(runs, False).loads == ("hold", "a_1")
