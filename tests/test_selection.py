"""Which effects a search asks for, round by round."""

from dataclasses import replace

import numpy as np
import pytest
from servo import TRUTH, bench_of, recorded, started

from ers_mj.decisions.policy import POLICY
from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import fit
from ers_mj.selection import stepwise as selection
from ers_mj.selection.bench import Bench
from ers_mj.selection.comparison import Candidate, judged
from ers_mj.selection.drop import reconsidered
from ers_mj.selection.pair import beside_a_rival
from ers_mj.selection.search import Budget
from ers_mj.selection.swap import in_its_place


@pytest.fixture
def nothing_left(monkeypatch):
    """A model leaves nothing that memory tells of."""
    monkeypatch.setattr(selection, "left_by_sensor", lambda *_: {"output": 0.0})


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
    start = pushed.fit
    model = start.model
    for name in ("load_disturbance", newest):
        model = model.with_effect(name, BY_NAME[name].starts(replace(model.scales, hot=((0, 1.0, 0.1),)))[0])
    rounds = [
        (Candidate(name, start, won, 3.0, 0.0, 1.0),) for name, won in (("load_disturbance", 20.0), (newest, gain))
    ]
    found, left = reconsidered(bench_of(pushed.traces), replace(start, model=model), rounds)
    assert found.model.names == kept and tuple(ranked[0].name for ranked in left) == kept


def test_the_way_out_of_a_dent_is_no_effects_gain_wherever_it_was_found(pushed, monkeypatch):
    """A sweep finds a drag that stands for nothing: its servo has left a place where another rested."""
    name, good = "quadratic_drag", fit(pushed.fit.model.with_effect("bias_torque", np.array([0.06])), pushed.traces)
    aside = replace(good.model, values={**good.model.values, "c_2": 1.002 * good.model.values["c_2"]})
    rested = fit(aside, pushed.traces, steps=0)
    found = [judged(name, fit(good.model.with_effect(name, np.array([1e-3, np.inf])), pushed.traces), rested, 1.0)]
    assert POLICY.later_gain < found[0].gain < POLICY.modest
    monkeypatch.setattr(selection, "candidates", lambda *_: [])
    monkeypatch.setattr(selection, "left_by_sensor", lambda *_: {"output": 9.0})
    monkeypatch.setattr(selection, "swept", lambda *_: found[:1] and [found.pop()])
    chosen = selection.select(rested, pushed.traces)
    assert not found and chosen.chosen.model.names == ("bias_torque",)
    assert chosen.chosen.cost == pytest.approx(good.cost, abs=0.1)
    assert [(move.kind, move.accepted) for move in chosen.trail] == [("restart", True), ("add", False)]


@pytest.mark.parametrize("all_of_it", [True, False])
def test_behind_a_coarse_converter_nothing_is_swept_beside_what_explains_all(
    pushed, monkeypatch, nothing_left, all_of_it
):
    begun, torque = [], fit(pushed.fit.model.with_effect("bias_torque", np.array([0.06])), pushed.traces)
    found = replace(judged("bias_torque", torque, pushed.fit, 1.0), gain=2.0 * POLICY.modest, z=9.0)
    if not all_of_it:
        found = replace(found, fit=replace(torque, misfit=np.full(torque.misfit.size, 2.0)))
    monkeypatch.setattr(selection, "candidates", lambda bench, current, *_: [] if current.model.names else [found])
    monkeypatch.setattr(selection, "is_rough", lambda _: True)
    monkeypatch.setattr(
        selection, "residuals_in", lambda model, trace, *_: np.full(trace.rows, 0.0 if model.names else 9.0)
    )
    monkeypatch.setattr(selection, "swept", lambda bench, current, *_: begun.append(current.model.names) or [])
    chosen = selection.select(pushed.fit, pushed.traces).chosen
    assert chosen.model.names == ("bias_torque",) and (() in begun) is not all_of_it


@pytest.mark.parametrize("doubtful", [True, False])
def test_where_forks_do_not_account_for_what_is_left_thresholds_are_tried_as_they_are(
    pushed, monkeypatch, nothing_left, doubtful
):
    """No secant shows them; laws in proportion to a number are seen by theirs."""
    tried = []
    monkeypatch.setattr(selection, "candidates", lambda *_: [])
    monkeypatch.setattr(Bench, "is_doubtful", lambda *_: doubtful)
    monkeypatch.setattr(selection, "swept", lambda bench, *_: tried.extend({*BY_NAME} - {*bench.exclude}) or [])
    monkeypatch.setattr(selection, "reviewed", lambda *_: None)
    selection.select(pushed.fit, pushed.traces, exclude=["end_stop"])
    assert {"drive_dead_zone", "voltage_saturation"} <= {*tried} if doubtful else not tried
    assert not {*tried} & {"end_stop", "bias_torque", "supply_sag"}


@pytest.mark.parametrize("much, dear, longer", [(True, False, True), (False, False, False), (True, True, False)])
def test_what_forks_do_not_account_for_is_looked_at_longer(pushed, monkeypatch, nothing_left, much, dear, longer):
    """Beside a bristle alone, where a round may take minutes, it is not."""
    tried = []

    def nearly_spent(traces):
        budget = Budget(traces)
        budget.last = 0
        return budget

    monkeypatch.setattr(selection, "Budget", nearly_spent)
    monkeypatch.setattr(selection, "candidates", lambda *_: tried.append(True) or [])
    monkeypatch.setattr(Bench, "leaves_more_than_forks", lambda *_: much)
    monkeypatch.setattr(selection, "is_dear", lambda _: dear)
    monkeypatch.setattr(selection, "swept", lambda *_: [])
    monkeypatch.setattr(selection, "reviewed", lambda *_: None)
    selection.select(pushed.fit, pushed.traces)
    assert bool(tried) is longer


def test_what_bends_and_twists_takes_longest(pushed):
    model = pushed.fit.model
    beside = {
        name: selection.bending_and_twisting(model.with_effect(name, BY_NAME[name].starts(model.scales)[0]))
        for name in ("presliding", "backlash", "stribeck")
    }
    assert beside == {"presliding": ["backlash", "shaft_compliance"], "backlash": ["presliding"], "stribeck": []}


def test_what_a_refit_turns_into_another_effect_gives_way_to_it(pushed):
    def found(name, p, gain):
        held = replace(pushed.fit, model=pushed.fit.model.with_effect(name, np.array(p)))
        return replace(judged(name, held, pushed.fit, 1.0), gain=gain)

    shaft = found("shaft_compliance", [50.0, 0.7, 0.4, 0.0, np.inf], 21.0)
    winding = found("inductance", [2e-3, np.inf], 0.0)
    for rho, first in ((0.2, "inductance"), (0.4, None)):
        now = pushed.fit.model.with_effect("shaft_compliance", np.array([50.0, 0.7, rho, 0.0, np.inf]))
        other = in_its_place(bench_of(pushed.traces), replace(pushed.fit, model=now), pushed.fit, (shaft, winding))
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
    bench = bench_of(start.traces, only=(*truth, "shaft_compliance", "quadratic_drag"))
    found, rounds = beside_a_rival(bench, shaft.fit, [(shaft, delay), ()])
    assert set(found.model.names) == set(truth)
    assert [ranked[0].name for ranked in rounds] == ["input_delay", "drive_dead_zone"]
    assert beside_a_rival(bench, shaft.fit, [(shaft,), ()]) is None
    assert beside_a_rival(bench, delay.fit, [(delay, shaft), ()]) is None
