"""Something else in the place of what was named."""

from dataclasses import replace

import numpy as np
import pytest
from servo import SPARSE, TRUTH, Watched, all_but, alone, bench_of, having, recorded, started

from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import fit
from ers_mj.selection import swap
from ers_mj.selection.comparison import Candidate, judged
from ers_mj.selection.swap import (
    as_what_it_is,
    begun_anew,
    exchanged,
    in_its_place,
    narrowed,
    other_way_round,
    reviewed,
    widened,
)


def test_a_play_begins_anew_beside_what_was_found_since(pushed):
    model = pushed.fit.model
    anew = begun_anew("backlash", having(pushed.fit, "quadratic_drag").model)
    assert [m.names for m in anew] == [("quadratic_drag", "backlash")] * len(BY_NAME["backlash"].starts(model.scales))
    assert not begun_anew("quadratic_drag", model)
    for name in ("shaft_compliance", "presliding"):
        assert not begun_anew("backlash", having(pushed.fit, name).model)


def test_two_effects_are_found_from_either(delayed):
    """Where the delay comes first, the friction takes the sleep's place and leaves it none."""
    start, truth = delayed
    first, second = (alone(start, name, truth[name]) for name in ("input_delay", "drive_dead_zone"))
    ranked = other_way_round(bench_of(start), first.fit, [first, second], [])
    assert [c.name for c in ranked] == ["drive_dead_zone"] and {*ranked[0].fit.model.names} == {*truth}
    for name, p in ranked[0].fit.model.effects:
        assert p[0] == pytest.approx(truth[name][0], rel=0.02)


def test_a_form_that_another_effect_hid_is_found_beside_it():
    """A current that builds up late hides that the cog has a second harmonic, until it has a name itself."""
    cog, winding = np.array([1.5, 0.12, 0.4, 0.5, 1.0]), np.array([0.004, np.inf])
    start = started(recorded([("cogging", cog), ("inductance", winding)]))
    plain = start.fit.model.with_effect("cogging", np.array([*cog[:3], np.inf, np.inf]))
    current, bench = fit(plain.with_effect("inductance", winding), start.traces), bench_of(start)
    found = widened(bench, current, "inductance")
    assert found.cost < current.cost - 10 and dict(found.model.effects)["cogging"][3] == pytest.approx(0.5, rel=0.1)
    assert set(found.model.names) == {"cogging", "inductance"}
    assert widened(bench, found, "inductance") is found  # nothing wider is left
    # the newest was tried in all its forms when it was found
    assert widened(bench, current, "cogging").cost > found.cost + 10


@pytest.fixture(scope="module")
def tied(pushed):
    """A constant torque and its asymmetric form are one; gravity, a third that does as well, is beaten by the two
    together, and led its round.
    """
    torques = {
        "gravity_imbalance": [0.06, 0.0],
        "bias_torque": [0.06],
        "asymmetric_friction": [-0.06, 0, np.inf, np.inf],
    }
    return tuple(alone(pushed, name, p) for name, p in torques.items())


def test_of_rivals_that_tie_the_likelier_class_stays_once_the_rest_is_known(pushed, tied, monkeypatch):
    bench, newest = bench_of(pushed), (replace(tied[0], name="stribeck"),)
    rounds = [tied, newest]
    found = exchanged(bench, tied[0].fit, rounds)
    assert found.model.names == ("bias_torque",)
    assert len(rounds[0]) == 3 and rounds[0][0].name == "bias_torque" and rounds[0][0].beside is found
    assert all(c.beside is not None for c in rounds[0])  # by which their probabilities are told
    # its round has compared it with its rivals just so
    assert exchanged(bench, tied[0].fit, [tied]).model.names == ("gravity_imbalance",)
    unlike = [(tied[0], *(replace(c, gain=0.0) for c in tied[1:])), newest]
    assert exchanged(bench, tied[0].fit, unlike).model.names == ("gravity_imbalance",)
    # but behind a coarse converter it has told anew where the recordings begin
    monkeypatch.setattr(swap, "is_rough", lambda traces: True)
    assert exchanged(bench, tied[0].fit, [tied]).model.names == ("bias_torque",)


def test_a_rival_is_exchanged_from_the_servo_that_it_was_fitted_with_as_well(pushed):
    """What leads may have bent the servo further from a rival's than a few steps lead back; a rival of a round whose
    earlier effect has gone has no such place.
    """

    def one(name, b, *others):
        found = replace(pushed.fit, model=replace(pushed.fit.model, values={**pushed.fit.model.values, "b": b}))
        for other in (*others, name):
            found = having(found, other)
        return Candidate(name, found, 10.0, 3.0, 0.0, 1.0)

    leader, rival = one("bias_torque", 70.0), one("quadratic_drag", 60.0)
    later, stale = one("hinge_moment_cubic", 65.0, "bias_torque"), one("asymmetric_friction", 50.0, "end_stop")
    bench = Watched(pushed.traces, 1.0, answer=lambda model: replace(pushed.fit, model=model, cost=1e6))
    assert exchanged(bench, later.fit, [(leader, rival), (later, stale)]) is later.fit
    assert [({*model.names}, model.values["b"]) for model, _ in bench.asked] == [
        ({"hinge_moment_cubic", "quadratic_drag"}, b) for b in (65.0, 60.0)
    ]


def test_an_effect_that_leaves_much_gives_way_to_what_a_sweep_finds(pushed):
    bench = bench_of(pushed, exclude=all_but("bias_torque", "quadratic_drag"))
    drag = alone(pushed, "quadratic_drag", BY_NAME["quadratic_drag"].starts(pushed.fit.model.scales)[0])
    found, rounds = reviewed(bench, drag.fit, [(drag,), ()])
    assert found.model.names == ("bias_torque",)
    assert [[c.name for c in ranked] for ranked in rounds] == [["bias_torque", "quadratic_drag"]]
    assert reviewed(bench, found, rounds) is None
    assert reviewed(bench, pushed.fit, [(drag,), ()]) is None  # nothing is named


@pytest.mark.parametrize("rho, first", [(0.2, "inductance"), (0.4, None)])
def test_what_a_refit_turns_into_another_effect_gives_way_to_it(pushed, rho, first):
    """A shaft whose motor bears nothing is a winding."""

    def found(name, p, gain):
        return replace(judged(name, having(pushed.fit, name, p), pushed.fit, 1.0), gain=gain)

    shaft = found("shaft_compliance", [50.0, 0.7, 0.4, 0.0, np.inf], 21.0)
    winding = found("inductance", [2e-3, np.inf], 0.0)
    now = having(pushed.fit, "shaft_compliance", [50.0, 0.7, rho, 0.0, np.inf])
    other = in_its_place(bench_of(pushed), now, pushed.fit, (shaft, winding))
    assert (other and other[0].name) == first and (other is None or len(other) == 2)


def test_a_late_reading_without_a_lag_gives_way_to_the_delay_that_it_is():
    start = started(recorded([("input_delay", np.array([0.006]))]))
    late = start.fit.model.with_effect("sensor_lag", np.array([1e-6, 0.006]))
    current, bench = fit(late, start.traces), bench_of(start)
    ranked = (judged("sensor_lag", current, start.fit, bench.tau),)
    found, rounds = as_what_it_is(bench, current, [ranked])
    assert found.model.names == ("input_delay",) and rounds[0][0].name == "input_delay"
    assert dict(found.model.effects)["input_delay"][0] == pytest.approx(0.006, rel=0.02)
    assert as_what_it_is(bench, found, rounds) is None


@pytest.mark.parametrize("law, p, is_flat", [("bias_torque", [6.0], True), ("gravity_imbalance", [5.0, -6.0], False)])
def test_a_weight_whose_torque_does_not_change_along_the_travel_is_a_constant_torque(law, p, is_flat):
    free = {**TRUTH, "a_1": 0.0, "c_1": 0.0, "theta_0": 0.0}
    start = started(recorded([(law, np.array(p))], values=free, names=("multisine", "chirp"), t=SPARSE), values=free)
    bench, weight = bench_of(start), alone(start, "gravity_imbalance", [0.5, -6.0])
    other = as_what_it_is(bench, weight.fit, [(weight,)])
    assert (other is not None) == is_flat
    if is_flat:
        assert dict(other[0].model.effects)["bias_torque"][0] == pytest.approx(6.0, rel=0.01)


def test_an_effect_ends_in_the_narrowest_form_that_does_as_well():
    name = "quadratic_drag"
    concealed = [(name, np.array([1.5, np.inf]))]
    start = started(recorded(concealed, t=SPARSE))
    bench = bench_of(start)
    wide, plain = (alone(start, name, p, steps=20).fit for p in ([1.0, 2.4], [1.0, np.inf]))
    found = narrowed(bench, wide)
    assert not np.isfinite(dict(found.model.effects)[name][1])
    assert abs(bench.cost(found) - bench.cost(plain)) < 0.1
    assert narrowed(bench, found) is found  # no number is left that may go


def test_an_effect_stays_as_wide_as_it_is_where_that_pays():
    name = "quadratic_drag"
    start = started(recorded([(name, np.array([12.0, 3.2]))], t=SPARSE))
    wide = alone(start, name, [1.0, 3.0], steps=25).fit
    assert narrowed(bench_of(start), wide) is wide
