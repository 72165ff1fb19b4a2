"""Which effects a selection asks for, round by round, and what it tells of its way."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from servo import SPARSE, all_but, alone, having, recorded, started

from ers_mj.decisions.thresholds import POLICY
from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import fit
from ers_mj.selection import stepwise
from ers_mj.selection.budget import Budget
from ers_mj.selection.comparison import judged
from ers_mj.selection.moves import rounds_that_count
from ers_mj.selection.stepwise import select

SURE = replace(POLICY, mismatch=np.inf)  # nothing that is left is more than noise


def test_a_round_whose_effect_became_needless_is_given_again_once(pushed):
    one = having(pushed.fit, "bias_torque").model
    assert [rounds_that_count(rounds, one) for rounds in (1, 2, 3)] == [1, 1, 2]
    assert rounds_that_count(0, pushed.fit.model) == 0
    assert rounds_that_count(2, one.with_state("friction_level", 3)) == 1


@pytest.fixture(scope="module")
def dragged():
    """A selection beside a drag that hides a friction of 1 % of the drive's torque."""
    laws = [("quadratic_drag", np.array([1.0, np.inf])), ("load_dependent_friction", np.array([0.01, *4 * [np.inf]]))]
    start, told = started(recorded(laws)), []
    others = all_but(*(name for name, _ in laws), "stribeck", "inductance")
    return select(
        start.fit, start.traces, exclude=others, progress=lambda text, share: told.append((text, share))
    ), told


def test_a_faint_law_beside_an_effect_must_stand_alone(dragged):
    found, _ = dragged
    assert found.chosen.model.names == ("quadratic_drag", "load_dependent_friction")
    assert POLICY.faint_gain < found.rounds[1][0].gain < POLICY.later_gain


def test_the_trail_tells_every_move(dragged):
    found, progress = dragged
    accepted = [move for move in found.trail if move.accepted]
    added = [move for move in accepted if move.kind == "add"]
    assert [{*move.after} - {*move.before} for move in added] == [{"quadratic_drag"}, {"load_dependent_friction"}]
    assert [move.gain for move in added] == [ranked[0].gain for ranked in found.rounds[:2]]
    assert {move.kind for move in found.trail} <= {
        "add",
        "drop",
        "swap",
        "pair",
        "part",
        "sweep",
        "widen",
        "narrow",
        "restart",
    }
    assert found.trail[0].before == () and found.trail[-1].after == found.chosen.model.names
    assert all(one.after == other.before for one, other in pairwise(accepted))  # each begins where the last has led
    last = found.trail[-1]
    assert (last.kind, last.accepted, last.before) == ("add", False, last.after) and "no effect" in last.because
    assert all(move.because and move.kind in str(move) for move in found.trail)
    assert str(added[0]).startswith("add: baseline -> quadratic_drag, robust cost -") and " stays, " in str(last)
    assert [text for text, _ in progress] == [f"round {k}: comparing effects" for k in range(1, len(found.rounds) + 1)]


def test_the_way_out_of_a_dent_is_no_effects_gain_wherever_it_was_found(pushed, monkeypatch):
    """A sweep finds a drag that stands for nothing: its servo has left a place where another rested."""
    good = fit(having(pushed.fit, "bias_torque", [0.06]).model, pushed.traces)
    aside = replace(good.model, values={**good.model.values, "c_2": 1.002 * good.model.values["c_2"]})
    rested = fit(aside, pushed.traces, steps=0)
    drag = fit(having(good, "quadratic_drag", [1e-3, np.inf]).model, pushed.traces)
    found = [judged("quadratic_drag", drag, rested, 1.0)]
    assert POLICY.later_gain < found[0].gain < POLICY.modest
    monkeypatch.setattr(stepwise, "candidates", lambda *_: [])
    monkeypatch.setattr(stepwise, "swept", lambda *_: found[:1] and [found.pop()])
    selection = select(rested, pushed.traces, policy=replace(POLICY, mismatch=-np.inf))
    assert not found and selection.chosen.model.names == ("bias_torque",)
    assert selection.chosen.cost == pytest.approx(good.cost, abs=0.1)
    assert [(move.kind, move.accepted) for move in selection.trail] == [("restart", True), ("add", False)]


@pytest.mark.parametrize("all_of_it", [True, False])
def test_behind_a_coarse_converter_nothing_is_swept_beside_what_explains_all(pushed, monkeypatch, all_of_it):
    torque, swept = replace(alone(pushed, "bias_torque", [0.06]), gain=10.0, z=9.0), []
    left = torque.fit.misfit if all_of_it else np.full(torque.fit.misfit.size, 2.0)
    torque = replace(torque, fit=replace(torque.fit, misfit=left))
    monkeypatch.setattr(stepwise, "candidates", lambda bench, base, *_: [] if base.model.names else [torque])
    monkeypatch.setattr(stepwise, "is_beyond_rounding", lambda model, *_: not model.names)
    monkeypatch.setattr(stepwise, "swept", lambda bench, base, *_: swept.append(base.model.names) or [])
    chosen = select(pushed.fit, pushed.traces, policy=replace(SURE, modest=-np.inf)).chosen  # no way back is looked for
    assert chosen.model.names == ("bias_torque",) and (() in swept) is not all_of_it


@pytest.mark.parametrize("doubtful", [True, False])
def test_where_forks_do_not_account_for_what_is_left_thresholds_are_tried_as_they_are(pushed, monkeypatch, doubtful):
    """No secant shows them; laws in proportion to a number are seen by theirs."""
    tried = []
    monkeypatch.setattr(stepwise, "candidates", lambda *_: [])
    monkeypatch.setattr(stepwise, "swept", lambda bench, *_: tried.extend({*BY_NAME} - {*bench.exclude}) or [])
    current = having(pushed.fit, "quadratic_drag", [1e-3, np.inf])
    policy = replace(SURE, forked=-np.inf if doubtful else np.inf)
    monkeypatch.setattr(stepwise, "reviewed", lambda *_: None)
    select(current, pushed.traces, exclude=["end_stop"], policy=policy)
    assert {"drive_dead_zone", "voltage_saturation"} <= {*tried} if doubtful else not tried
    assert not {*tried} & {"end_stop", "bias_torque", "supply_sag"}


@pytest.mark.parametrize(
    "name, forked, longer",
    [("quadratic_drag", -np.inf, True), ("quadratic_drag", np.inf, False), ("presliding", -np.inf, False)],
)
def test_what_forks_do_not_account_for_is_looked_at_longer(pushed, monkeypatch, name, forked, longer):
    """Beside a bristle alone, where a round may take minutes, it is not."""
    tried, budget = [], Budget(pushed.traces)
    budget.last = 0
    monkeypatch.setattr(stepwise, "candidates", lambda *_: tried.append(True) or [])
    monkeypatch.setattr(stepwise, "swept", lambda *_: [])
    select(having(pushed.fit, name), pushed.traces, policy=replace(SURE, forked=forked), budget=budget)
    assert bool(tried) is longer


def test_where_nothing_is_missing_nothing_is_named(plain):
    found = select(plain.fit, plain.traces, exclude=all_but("bias_torque", "quadratic_drag", "drive_dead_zone"))
    assert found.chosen.model.names == () and found.base.model.names == ()
    assert [(move.kind, move.accepted, move.after) for move in found.trail] == [("add", False, ())]
    assert found.rounds == ((),) or found.rounds[0][0].gain < POLICY.least_gain


def test_an_effect_that_is_excluded_is_not_named(pushed):
    push = np.array([6.0])
    start = started(recorded([("bias_torque", push)], names=("multisine", "steps"), t=SPARSE))
    for excluded, name in (((), "bias_torque"), (("bias_torque",), "quadratic_drag")):
        others = [*all_but("bias_torque", "quadratic_drag"), *excluded]
        found = select(start.fit, start.traces, exclude=others)
        assert ("bias_torque" in found.chosen.model.names) is (name == "bias_torque")
