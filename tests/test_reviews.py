"""What was named is looked at again."""

from dataclasses import replace

import numpy as np
import pytest
from servo import TRUTH, bench_of, recorded, started

from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import fit
from ers_mj.selection import swap
from ers_mj.selection.bench import Bench
from ers_mj.selection.comparison import Candidate, judged
from ers_mj.selection.pair import paired
from ers_mj.selection.search import SEARCH, Budget
from ers_mj.selection.swap import begun_anew, exchanged, other_way_round, reviewed, widened
from ers_mj.selection.sweep import SIZED, of_one_body, swept

PROPORTIONAL = "bias_torque", "quadratic_drag", "hinge_moment_cubic"


def test_a_play_begins_anew_beside_what_was_found_since(pushed):
    model = pushed.fit.model
    anew = begun_anew("backlash", model.with_effect("quadratic_drag", np.array([0.5, np.inf])))
    assert [m.names for m in anew] == [("quadratic_drag", "backlash")] * len(BY_NAME["backlash"].starts(model.scales))
    assert not begun_anew("quadratic_drag", model)
    assert not begun_anew("backlash", model.with_effect("shaft_compliance", np.array([80.0, 0.2, 0.6, 0.2, np.inf])))
    assert not begun_anew("backlash", model.with_effect("presliding", np.array([1e-3, 0.5, np.inf, np.inf])))


def test_two_effects_are_found_from_either(pushed):
    """A drive that delays and sleeps: where the delay comes first, the friction takes the sleep's place and leaves it
    none.
    """
    values = {**TRUTH, "c_2": 85.0}
    truth = [("drive_dead_zone", np.array([0.95, np.inf])), ("input_delay", np.array([0.0157]))]
    start = started(recorded(truth, values=values), values)
    first, second = (
        judged(name, fit(start.fit.model.with_effect(name, p), start.traces), start.fit, 1.0)
        for name, p in (truth[1], truth[0])
    )
    ranked = other_way_round(bench_of(start.traces), first.fit, [first, second], [])
    assert [c.name for c in ranked] == ["drive_dead_zone"] and set(ranked[0].fit.model.names) == {
        "drive_dead_zone",
        "input_delay",
    }
    found = dict(ranked[0].fit.model.effects)
    assert found["drive_dead_zone"][0] == pytest.approx(0.95, rel=0.02) and found["input_delay"][0] == pytest.approx(
        0.0157, rel=0.02
    )


def test_a_form_that_another_effect_hid_is_found_beside_it():
    """A current that builds up late hides that the cog has a second harmonic, until it has a name itself."""
    truth = [("cogging", np.array([1.5, 0.12, 0.4, 0.5, 1.0])), ("inductance", np.array([0.004, np.inf]))]
    start = started(recorded(truth))
    plain = start.fit.model.with_effect("cogging", np.array([1.5, 0.12, 0.4, np.inf, np.inf])).with_effect(
        "inductance", truth[1][1]
    )
    current = fit(plain, start.traces)
    found = widened(bench_of(start.traces), current, "inductance")
    assert found.cost < current.cost - 10 and dict(found.model.effects)["cogging"][3] == pytest.approx(0.5, rel=0.1)
    assert set(found.model.names) == {"cogging", "inductance"}
    assert widened(bench_of(start.traces), found, "inductance") is found  # nothing wider is left
    assert (
        widened(bench_of(start.traces), current, "cogging").cost > found.cost + 10
    )  # the newest was tried in all its forms when it was found


def test_of_rivals_that_tie_the_likelier_class_stays_once_the_rest_is_known(pushed, monkeypatch):
    """A constant torque and its asymmetric form are one; gravity, a third that does as well, is beaten by the two
    together.
    """
    base, traces = pushed.fit, pushed.traces
    ranked = tuple(
        judged(name, fit(base.model.with_effect(name, np.array(p)), traces), base, 1.0)
        for name, p in (
            ("gravity_imbalance", [0.06, 0.0]),
            ("bias_torque", [0.06]),
            ("asymmetric_friction", [-0.06, 0.0, np.inf, np.inf]),
        )
    )
    newest = (replace(ranked[0], name="stribeck"),)
    rounds = [ranked, newest]
    found = exchanged(bench_of(traces), ranked[0].fit, rounds)
    assert (
        found.model.names == ("bias_torque",)
        and next(c.name for c in rounds[0]) == "bias_torque"
        and len(rounds[0]) == 3
    )
    assert rounds[0][0].beside is found and all(
        c.beside is not None for c in rounds[0]
    )  # by which its probability is told, in case.py
    alone = [ranked]
    assert exchanged(bench_of(traces), ranked[0].fit, alone).model.names == (
        "gravity_imbalance",
    )  # its round has compared it with its rivals just so
    # but behind a coarse converter it has told anew where the recordings begin
    monkeypatch.setattr(swap, "is_rough", lambda traces: True)
    assert exchanged(bench_of(traces), ranked[0].fit, alone).model.names == ("bias_torque",)
    monkeypatch.undo()
    unlike = [(ranked[0], replace(ranked[1], gain=0.0), replace(ranked[2], gain=0.0)), newest]
    assert exchanged(bench_of(traces), ranked[0].fit, unlike).model.names == ("gravity_imbalance",)


def test_a_rival_is_exchanged_from_the_servo_that_it_was_fitted_with_as_well(pushed, monkeypatch):
    """What leads may have bent the servo further from a rival's than a few steps lead back; a rival of a round whose
    earlier effect has gone has no such place.
    """

    def one(name, b, *others):
        model = replace(pushed.fit.model, values={**pushed.fit.model.values, "b": b})
        for other in (*others, name):
            model = model.with_effect(other, BY_NAME[other].starts(model.scales)[0])
        return Candidate(name, replace(pushed.fit, model=model), 10.0, 3.0, 0.0, 1.0)

    leader, rival, later = (
        one("bias_torque", 70.0),
        one("quadratic_drag", 60.0),
        one("hinge_moment_cubic", 65.0, "bias_torque"),
    )
    seen = []

    def far(bench, model, *_, **__):
        seen.append(model)
        return replace(pushed.fit, model=model, cost=1e6)

    monkeypatch.setattr(Bench, "fit", far)
    stale = one("asymmetric_friction", 50.0, "end_stop")
    rounds = [(leader, rival), (later, stale)]
    assert exchanged(bench_of(pushed.traces), later.fit, rounds) is later.fit
    assert [(set(model.names), model.values["b"]) for model in seen] == [
        ({"hinge_moment_cubic", "quadratic_drag"}, b) for b in (65.0, 60.0)
    ]


def test_a_sweep_finds_what_secants_miss(pushed):
    """From its own start, whatever that makes worse on the way; no more is returned than the screening found."""
    bench = bench_of(pushed.traces, only=PROPORTIONAL)
    found = swept(bench, pushed.fit)
    best = max(found, key=lambda c: c.gain)
    (size,) = dict(best.fit.model.effects)["bias_torque"]
    assert best.name == "bias_torque" and size == pytest.approx(0.06, rel=0.3) and best.gain > 2.0
    again = swept(bench, pushed.fit, [best])
    assert not [c for c in again if c.name == "bias_torque" and c.gain > best.gain + 0.1]


def test_a_sweep_goes_on_from_the_best_starts_only(pushed, monkeypatch):
    """Of eight dead zones two: the others are left after a glance. What waves is not swept where a secant would have
    shown it.
    """
    tried = []

    def glanced(bench, model, steps, **_):
        tried.append((model, steps))
        return replace(pushed.fit, model=model, cost=abs(dict(model.effects)["drive_dead_zone"][0] - 1.0))

    monkeypatch.setattr(Bench, "fit", glanced)
    swept(bench_of(pushed.traces, only=["drive_dead_zone"]), pushed.fit)
    starts = list(BY_NAME["drive_dead_zone"].starts(pushed.fit.model.scales))
    looked, gone_on = tried[: len(starts)], tried[len(starts) : len(starts) + 2]
    assert [steps for _, steps in looked] == [SEARCH.sweep_glance] * len(starts)
    assert [steps for _, steps in gone_on] == [SEARCH.sweep - SEARCH.sweep_glance] * 2
    nearest = sorted(abs(p[0] - 1.0) for p in starts)[:2]
    assert sorted(abs(dict(model.effects)["drive_dead_zone"][0] - 1.0) for model, _ in gone_on) == nearest
    assert {"sensor_nonlinearity", "periodic_gust", "quadratic_drag"} <= {*SIZED} and "drive_dead_zone" not in SIZED


def test_two_rivals_take_the_place_of_what_does_much_of_what_both_do():
    """A friction along the travel beside a spring that hardens, told as a gear that varies and a bent scale."""
    truth = {
        "position_dependent_friction": np.array([25.0, np.inf, np.inf, 0.5, 1.4]),
        "hinge_moment_cubic": np.array([400.0, np.inf]),
    }
    start = started(recorded(list(truth.items())))

    def alone(name, p):
        return judged(name, fit(start.fit.model.with_effect(name, p), start.traces), start.fit, 1.0)

    leader = alone("variable_ratio", np.array([0.01, -1.0, 0.5]))
    wrong = fit(leader.fit.model.with_effect("quadratic_drag", np.array([1.0, np.inf])), start.traces)
    rivals = [alone(name, p) for name, p in truth.items()]
    bench = bench_of(start.traces)
    found, rounds = paired(bench, wrong, [(leader, *rivals), ()])
    assert set(found.model.names) == set(truth) and [ranked[0].name for ranked in rounds] == list(truth)
    for name, p in found.model.effects:
        assert p[0] == pytest.approx(truth[name][0], rel=0.1)
    assert paired(bench, found, [(rivals[0], leader, rivals[1]), ()]) is None

    def blown(found):
        """The fit beside a gust of a thousandth of its start."""
        gust = BY_NAME["periodic_gust"].starts(found.model.scales)[0]
        return replace(found, model=found.model.with_effect("periodic_gust", np.append(1e-3 * gust[:1], gust[1:])))

    first = judged("periodic_gust", blown(start.fit), start.fit, 1.0)
    later = tuple(replace(c, fit=blown(c.fit)) for c in (leader, *rivals))
    # what has a clock of its own stays
    found, rounds = paired(bench, blown(wrong), [(first,), later, ()])
    assert set(found.model.names) == {"periodic_gust", *truth} and [ranked[0].name for ranked in rounds] == [
        "periodic_gust",
        *truth,
    ]


def test_an_effect_that_leaves_much_gives_way_to_what_a_sweep_finds(pushed):
    bench = bench_of(pushed.traces, only=PROPORTIONAL)
    model = pushed.fit.model.with_effect("quadratic_drag", BY_NAME["quadratic_drag"].starts(pushed.fit.model.scales)[0])
    drag = judged("quadratic_drag", fit(model, pushed.traces, tau=1.0), pushed.fit, 1.0)
    found, rounds = reviewed(bench, drag.fit, [(drag,), ()])
    assert found.model.names == ("bias_torque",) and [[c.name for c in ranked] for ranked in rounds] == [
        ["bias_torque", "quadratic_drag"]
    ]
    assert reviewed(bench, found, rounds) is None


def test_a_sweep_ends_when_enough_has_been_simulated(pushed):
    budget = Budget(pushed.traces)
    base = replace(pushed.fit, model=replace(pushed.fit.model, effort=budget.effort))
    bench = bench_of(pushed.traces, only=("bias_torque", "backlash"), budget=budget)
    assert not swept(bench, base, end=0) and budget.spent == 0
    assert [c.name for c in swept(bench, base, end=1)] == ["bias_torque"]  # one body first


def test_a_second_sweep_leaves_two_bodies_out(pushed, monkeypatch):
    tried = []
    monkeypatch.setattr(
        Bench, "fit", lambda bench, model, *_, **__: tried.append(model.names) or replace(pushed.fit, model=model)
    )
    bench = bench_of(pushed.traces, only=("bias_torque", "backlash", "shaft_compliance"))
    for kinds, names in (
        ({}, {("bias_torque",), ("backlash",), ("shaft_compliance",)}),
        ({"kinds": of_one_body}, {("bias_torque",)}),
    ):
        tried.clear()
        swept(bench, pushed.fit, **kinds)
        assert set(tried) == names
