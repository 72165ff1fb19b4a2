"""Which effects a search asks for, round by round."""

from dataclasses import replace

import numpy as np
import pytest
from servo import TRUTH, recorded, started

from ers_mj.decisions.explained import score
from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import fit
from ers_mj.selection import moves as reviews
from ers_mj.selection import stepwise as selection
from ers_mj.selection.comparison import Candidate, judged
from ers_mj.selection.stepwise import (
    GOOD_PART,
    _asked,
    _asked_for,
    _bending_and_twisting,
    _beside_a_rival,
    _gains_that_matter,
    _in_its_place,
    _reconsidered,
    _taken,
)


def test_a_round_whose_effect_became_needless_is_given_again_once(pushed):
    one = replace(pushed.fit, model=pushed.fit.model.with_effect("bias_torque", np.array([0.06])))
    assert _taken(pushed.fit, []) == 0 and [_taken(one, [()] * rounds) for rounds in (1, 2, 3)] == [1, 1, 2]
    assert _taken(replace(one, model=one.model.with_state("friction_level", 3)), [(), ()]) == 1


@pytest.mark.parametrize(
    "newest, gain, kept",
    [
        ("drive_dead_zone", 400.0, ("drive_dead_zone",)),
        ("drive_dead_zone", 50.0, ("load_disturbance", "drive_dead_zone")),
        ("periodic_gust", 400.0, ("load_disturbance", "periodic_gust")),
    ],
)
def test_a_knock_that_a_later_law_outweighs_is_looked_for_again(pushed, newest, gain, kept):
    """It was found in what the law had bent; beside another one with a clock of its own it stays."""
    start, tau = pushed.fit, 1.0
    model = start.model
    for name in ("load_disturbance", newest):
        model = model.with_effect(name, BY_NAME[name].starts(replace(model.scales, hot=((0, 1.0, 0.1),)))[0])
    rounds = [
        (Candidate(name, start, won, 3.0, 0.0, 1.0),) for name, won in (("load_disturbance", 20.0), (newest, gain))
    ]
    found, left = _reconsidered(replace(start, model=model), rounds, pushed.traces, tau)
    assert found.model.names == kept and tuple(ranked[0].name for ranked in left) == kept


@pytest.mark.parametrize(
    "gain, z, lost, asked",
    [
        (8.8, 1.6, 2.0, True),
        (8.8, 1.6, 3.0, False),
        (5.0, 1.6, 1.2, False),
        (5.0, 1.8, 1.2, True),
        (2.9, 4.0, 0.0, False),
    ],
)
def test_what_acts_in_few_blocks_may_lose_more_where_it_wins_much(pushed, gain, z, lost, asked):
    """As a stop that one recording reaches does, whose z-score cannot be large."""
    assert _asked_for(Candidate("end_stop", pushed.fit, gain, z, lost, 4.0), 3.0, 1.7, False) is asked


@pytest.mark.parametrize("gain, named", [(9.9, "drive_dead_zone"), (4.9, "load_disturbance")])
def test_a_knock_gives_way_to_a_law_that_explains_more(pushed, gain, named):
    """The law loses too much elsewhere to be asked for by itself; that something is missing the knock has shown."""
    model = pushed.fit.model
    knocked = replace(
        pushed.fit,
        model=model.with_effect(
            "load_disturbance", BY_NAME["load_disturbance"].starts(replace(model.scales, hot=((0, 1.0, 0.1),)))[0]
        ),
    )
    dead = replace(
        pushed.fit, model=model.with_effect("drive_dead_zone", BY_NAME["drive_dead_zone"].starts(model.scales)[0])
    )
    ranked = [
        Candidate("drive_dead_zone", dead, gain, 1.7, 0.4 * gain, 3.0),
        Candidate("load_disturbance", knocked, 4.4, 1.0, 0.1, 4.0),
    ]
    assert (
        selection._knocks_beside(dead, ranked[::-1])
        and not selection._knocks_beside(dead, ranked)
        and not selection._knocks_beside(pushed.fit, ranked[::-1])
    )
    assert _asked(ranked, dead, (4.0, 1.5), 2.0, False).name == named
    assert _asked(ranked[:1], dead, (4.0, 1.5), 2.0, False) is None


@pytest.mark.parametrize("gain, named", [(8.1, "voltage_saturation"), (8.3, "load_disturbance")])
def test_a_knock_gives_way_to_a_law_that_is_asked_for_as_well(pushed, gain, named):
    """It chooses its moment, so that it must be well ahead; not where nothing is named yet, since what has no law may
    look like both.
    """
    delayed = replace(pushed.fit, model=pushed.fit.model.with_effect("input_delay", np.array([7e-3])))
    ranked = [
        Candidate("load_disturbance", delayed, gain, 1.4, 0.0, 3.0),
        Candidate("end_stop", delayed, 5.3, 1.0, 4.0, 3.0),
        Candidate("voltage_saturation", delayed, 5.2, 1.5, 0.1, 3.0),
    ]
    assert _asked(ranked, delayed, (4.0, 1.5), 2.0, False).name == named
    assert _asked(ranked, pushed.fit, (3.0, 3.0), 1.7, False).name == "load_disturbance"


@pytest.mark.parametrize(
    "name, gain, z, asked",
    [
        ("drive_dead_zone", 3.6, 3.3, True),
        ("drive_dead_zone", 3.6, 2.7, False),
        ("drive_dead_zone", 2.8, 4.0, False),
        ("gain", 3.6, 3.3, False),
    ],
)
def test_beside_an_effect_a_law_may_buy_less_where_it_buys_it_nearly_everywhere(pushed, name, gain, z, asked):
    """A rival buys nearly as much, so that it does not stand alone; what differs between recordings is no law."""
    dead = replace(
        pushed.fit,
        model=pushed.fit.model.with_effect(
            "drive_dead_zone", BY_NAME["drive_dead_zone"].starts(pushed.fit.model.scales)[0]
        ),
    )
    ranked = [
        Candidate(name, dead, gain, z, 0.5, 0.4),
        Candidate("stribeck", replace(dead, misfit=dead.misfit + 1.0), 0.9 * gain, 2.0, 0.5, 0.4),
    ]
    assert (_asked(ranked, dead, (4.0, 1.5), 2.0, False) is ranked[0]) is asked
    assert _asked(ranked, pushed.fit, (4.0, 4.0), 1.7, False) is None


def test_where_the_model_stays_wrong_a_third_effect_must_take_a_good_part(pushed):
    """Of 100 C that are left a tenth is enough in order, and a good part out of it; of hardly any what is more than
    chance.
    """
    wrong = replace(
        pushed.fit,
        misfit=np.full(100, np.e - 1.0) * 2.0,
        model=pushed.fit.model.with_effect("quadratic_drag", np.array([1.0, np.inf])),
    )
    left = float(score(wrong.misfit, 1.0).sum())
    assert _gains_that_matter(wrong, 1.0, True) == (pytest.approx(0.1 * left), pytest.approx(0.1 * left))
    assert _gains_that_matter(wrong, 1.0, False) == (pytest.approx(GOOD_PART * left), pytest.approx(GOOD_PART * left))


def test_the_way_out_of_a_dent_is_no_effects_gain_wherever_it_was_found(pushed, monkeypatch):
    """A sweep finds a drag that stands for nothing: its servo has left a place where another rested."""
    name, good = "quadratic_drag", fit(pushed.fit.model.with_effect("bias_torque", np.array([0.06])), pushed.traces)
    aside = replace(good.model, values={**good.model.values, "c_2": 1.002 * good.model.values["c_2"]})
    rested = fit(aside, pushed.traces, steps=0)
    found = [judged(name, fit(good.model.with_effect(name, np.array([1e-3, np.inf])), pushed.traces), rested, 1.0)]
    assert selection.LATER_GAIN < found[0].gain < selection.MODEST
    monkeypatch.setattr(selection, "candidates", lambda *_: [])
    monkeypatch.setattr(selection, "_is_cheap_and_wrong", lambda *_: True)
    monkeypatch.setattr(reviews, "swept", lambda *_: found[:1] and [found.pop()])
    chosen = selection.select(rested, pushed.traces).chosen
    assert not found and chosen.model.names == ("bias_torque",) and chosen.cost == pytest.approx(good.cost, abs=0.1)


@pytest.mark.parametrize("all_of_it", [True, False])
def test_behind_a_coarse_converter_nothing_is_swept_beside_what_explains_all(pushed, monkeypatch, all_of_it):
    started, found = (
        [],
        judged(
            "bias_torque",
            fit(pushed.fit.model.with_effect("bias_torque", np.array([0.06])), pushed.traces),
            pushed.fit,
            1.0,
        ),
    )
    found = (
        replace(found, gain=10.0, z=9.0)
        if all_of_it
        else replace(found, gain=10.0, z=9.0, fit=replace(found.fit, misfit=np.full(found.fit.misfit.size, 2.0)))
    )
    monkeypatch.setattr(selection, "candidates", lambda current, *_: [] if current.model.names else [found])
    monkeypatch.setattr(selection, "_is_rough_and_wrong", lambda current, _: not current.model.names)
    monkeypatch.setattr(selection, "_is_cheap_and_wrong", lambda *_: False)
    monkeypatch.setattr(selection, "_way_back", lambda *_: None)
    monkeypatch.setattr(reviews, "swept", lambda current, *_: started.append(current.model.names) or [])
    chosen = selection.select(pushed.fit, pushed.traces).chosen
    assert chosen.model.names == ("bias_torque",) and (() in started) is not all_of_it


def test_a_third_effect_must_take_a_sixth(pushed):
    two = pushed.fit.model.with_effect("quadratic_drag", np.array([1.0, np.inf])).with_effect(
        "bias_torque", np.array([0.06])
    )
    wrong = replace(pushed.fit, misfit=np.full(100, np.e - 1.0) * 2.0, model=two)
    assert _gains_that_matter(wrong, 1.0, True)[0] == pytest.approx(float(score(wrong.misfit, 1.0).sum()) / 6)


@pytest.mark.parametrize("doubtful", [True, False])
def test_where_forks_do_not_account_for_what_is_left_thresholds_are_tried_as_they_are(pushed, monkeypatch, doubtful):
    """No secant shows them; laws in proportion to a number are seen by theirs."""
    tried = []
    monkeypatch.setattr(selection, "candidates", lambda *_: [])
    monkeypatch.setattr(selection, "_is_cheap_and_wrong", lambda *_: False)
    monkeypatch.setattr(reviews, "is_doubtful", lambda *_: doubtful)
    monkeypatch.setattr(
        reviews, "swept", lambda current, ranked, traces, tau, exclude, *_: tried.extend({*BY_NAME} - {*exclude}) or []
    )
    selection.select(pushed.fit, pushed.traces, exclude=["end_stop"])
    assert {"drive_dead_zone", "voltage_saturation"} <= {*tried} if doubtful else not tried
    assert not {*tried} & {"end_stop", "bias_torque", "supply_sag"}


@pytest.mark.parametrize("much, dear, longer", [(True, False, True), (False, False, False), (True, True, False)])
def test_what_forks_do_not_account_for_is_looked_at_longer(pushed, monkeypatch, much, dear, longer):
    """Beside a bristle alone, where a round may take minutes, it is not."""
    tried = []
    monkeypatch.setattr(selection, "LAST_BEGUN", 0)
    monkeypatch.setattr(selection, "candidates", lambda *_: tried.append(True) or [])
    monkeypatch.setattr(selection, "_is_cheap_and_wrong", lambda *_: False)
    monkeypatch.setattr(reviews, "leaves_more_than_forks", lambda *_: much)
    monkeypatch.setattr(selection, "is_dear", lambda _: dear)
    monkeypatch.setattr(reviews, "swept", lambda *_: [])
    selection.select(pushed.fit, pushed.traces)
    assert bool(tried) is longer


def test_what_bends_and_twists_takes_longest(pushed):
    model = pushed.fit.model
    beside = {
        name: _bending_and_twisting(model.with_effect(name, BY_NAME[name].starts(model.scales)[0]))
        for name in ("presliding", "backlash", "stribeck")
    }
    assert beside == {"presliding": ["backlash", "shaft_compliance"], "backlash": ["presliding"], "stribeck": []}


def test_what_a_refit_turns_into_another_effect_gives_way_to_it(pushed):
    def found(name, p, gain):
        return replace(
            judged(name, replace(pushed.fit, model=pushed.fit.model.with_effect(name, np.array(p))), pushed.fit, 1.0),
            gain=gain,
        )

    shaft, winding = (
        found("shaft_compliance", [50.0, 0.7, 0.4, 0.0, np.inf], 21.0),
        found("inductance", [2e-3, np.inf], 0.0),
    )
    for rho, first in ((0.2, "inductance"), (0.4, None)):
        now = pushed.fit.model.with_effect("shaft_compliance", np.array([50.0, 0.7, rho, 0.0, np.inf]))
        other = _in_its_place(replace(pushed.fit, model=now), pushed.fit, (shaft, winding), 1.0)
        assert other is None if first is None else other[0].name == first and len(other) == 2


def test_a_lone_shaft_that_leaves_much_gives_way_to_two_effects_of_one_body():
    """A drive that delays and sleeps: a springy shaft does a part of both."""
    values = {**TRUTH, "c_2": 85.0}
    truth = {"drive_dead_zone": np.array([0.95, np.inf]), "input_delay": np.array([0.0157])}
    start = started(recorded(list(truth.items()), values=values), values)

    def alone(name, p):
        return judged(name, fit(start.fit.model.with_effect(name, p), start.traces, steps=6), start.fit, 1.0)

    delay = alone("input_delay", truth["input_delay"])
    shaft = replace(
        alone("shaft_compliance", BY_NAME["shaft_compliance"].starts(start.fit.model.scales)[0]), gain=delay.gain
    )
    others = [name for name in BY_NAME if name not in (*truth, "shaft_compliance", "quadratic_drag")]
    found, rounds = _beside_a_rival(shaft.fit, [(shaft, delay), ()], start.traces, 1.0, others, 1)
    assert set(found.model.names) == set(truth) and [ranked[0].name for ranked in rounds] == [
        "input_delay",
        "drive_dead_zone",
    ]
    assert _beside_a_rival(shaft.fit, [(shaft,), ()], start.traces, 1.0, others, 1) is None
    assert _beside_a_rival(delay.fit, [(delay, shaft), ()], start.traces, 1.0, others, 1) is None
