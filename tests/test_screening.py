"""Which effects are refitted, and from where."""

from dataclasses import replace

import numpy as np
import pytest

from ers_mj import race, reviews, screening, selection
from ers_mj.baseline import baseline
from ers_mj.datasheet import Datasheet, read_datasheet
from ers_mj.effects import BY_NAME
from ers_mj.errors import InputError
from ers_mj.identification import fit, residuals, residuals_in, run_of, score, tau_of
from ers_mj.isolability import probabilities
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import EFFORT, ReducedModel, lumped
from ers_mj.race import LEAST_GAIN, _more_starts, _other_forms, _other_waves, _wider, candidates
from ers_mj.ranking import Candidate, judged, likeliest_first, stands_alone
from ers_mj.recording import from_arrays
from ers_mj.reviews import _begun_anew, exchanged, of_one_body, other_way_round, paired, reviewed, swept
from ers_mj.screening import Begin, Screened, _between, _first_order, _hopeful, _hot, _promise, _Surroundings, _targets, screen, stands_out
from ers_mj.selection import GOOD_PART, _bending_and_twisting, _gains_that_matter, _in_its_place, _reconsidered, _taken
from ers_mj.traces import trace_of

T = np.arange(0.0, 3.0, 1e-3)
TRUTH = {"a_1": 25.0, "a_2": 50.0, "b": 70.0, "c_1": 135.0, "c_2": 115.0, "theta_0": 0.2625}


@pytest.fixture(scope="module")
def pushed():
    """The refitted baseline of a servo that a torque of 0.05 % of its friction pushes."""
    traces = []
    for k, name in enumerate(("multisine", "steps", "chirp")):
        u = INPUTS[name](T)
        y = ReducedModel(lumped(TRUTH), [("bias_torque", np.array([0.06]))]).simulate(T, u).measured
        traces.append(trace_of(from_arrays(T, u, y + 1.5e-4 * np.random.default_rng(k).standard_normal(T.size), name=name), None))
    return baseline(traces, Datasheet(lumped=TRUTH), True, 1)


def test_a_place_far_from_the_data_takes_no_candidate_from_one_near_it(pushed):
    near, far = pushed.fit.model, replace(pushed.fit.model, values={**pushed.fit.model.values, "b": 60.0})
    alone, both = (screen(places, pushed.traces, 1.0, (), False, False) for places in ([near], [near, far]))
    assert "bias_torque" in alone.promising() and set(alone.promising()) <= set(both.promising())
    assert all(len(both.begins[name]) == 2 for name in both.promising() if not BY_NAME[name].dear)


def test_where_much_is_missing_what_promises_least_is_not_screened_from_every_place(pushed):
    near, far = pushed.fit.model, replace(pushed.fit.model, values={**pushed.fit.model.values, "b": 60.0})
    alone, both = (screen(places, pushed.traces, 1.0, (), True, False) for places in ([near], [near, far]))
    bar = screening.LESS * max(alone.promises.values())
    again = {name: len(both.begins[name]) for name in alone.begins if not (BY_NAME[name].dear or BY_NAME[name].once)}
    assert again == {name: 1 + (alone.promises[name] >= bar) for name in again} and set(again.values()) == {1, 2}


def test_a_round_whose_effect_became_needless_is_given_again_once(pushed):
    one = replace(pushed.fit, model=pushed.fit.model.with_effect("bias_torque", np.array([0.06])))
    assert _taken(pushed.fit, []) == 0 and [_taken(one, [()] * rounds) for rounds in (1, 2, 3)] == [1, 1, 2]
    assert _taken(replace(one, model=one.model.with_state("friction_level", 3)), [(), ()]) == 1


def test_a_search_that_is_given_up_still_tells_the_cost_that_was_asked_for(pushed):
    far = replace(pushed.fit.model, values={**pushed.fit.model.values, "a_1": 2.5, "b": 7.0})
    left = fit(far, pushed.traces, tau=1.0, steps=1, ceiling=pushed.fit.misfit)
    assert float(np.exp(np.mean(np.log(left.misfit + 1.0)))) > 10.0  # it ended at a stage far above
    assert left.cost == pytest.approx(float(score(left.misfit, 1.0).sum()))


def test_a_small_wave_is_promised_by_a_large_start():
    """Cogging of 1 % of the friction: a start that is 30 times as large throws the rudder elsewhere, and tells only how small to try again."""
    cog, traces = np.array([1.0, 2 * np.pi / 267, 1.3, np.inf, np.inf]), []
    for k, name in enumerate(("multisine", "ramp")):
        y = ReducedModel(lumped(TRUTH), [("cogging", cog)]).simulate(T, INPUTS[name](T)).measured
        traces.append(trace_of(from_arrays(T, INPUTS[name](T), y + 1e-4 * np.random.default_rng(k).standard_normal(T.size), name=name), None))
    start = baseline(traces, Datasheet(lumped=TRUTH), True, 1)
    place, traces = start.fit.model, start.traces
    e = residuals(place, traces, 5.0)
    share, model = _promise(place, BY_NAME["cogging"], np.array([30.0, cog[1], 0.0, np.inf, np.inf]), e, _targets(place, e, traces, 1.0)[1], traces)
    A, _, phase = dict(model.effects)["cogging"][:3]
    assert share > 0.3 and abs(A * np.exp(1j * phase) - np.exp(1.3j)) < 0.3


def test_a_play_begins_anew_beside_what_was_found_since(pushed):
    model = pushed.fit.model
    anew = _begun_anew("backlash", model.with_effect("quadratic_drag", np.array([0.5])))
    assert [m.names for m in anew] == [("quadratic_drag", "backlash")] * len(BY_NAME["backlash"].starts(model.scales))
    assert not _begun_anew("quadratic_drag", model)
    assert not _begun_anew("backlash", model.with_effect("shaft_compliance", np.array([80.0, 0.2, 0.6, 0.2, np.inf])))
    assert not _begun_anew("backlash", model.with_effect("presliding", np.array([1e-3, 0.5, np.inf, np.inf])))


def test_a_shaft_that_twists_by_less_than_the_noise_is_none(pushed):
    """At 756 Hz 115 rad/s^2 of friction twist it by 5 urad, where the noise is 150."""
    stiff, soft = (replace(pushed.fit, model=pushed.fit.model.with_effect("shaft_compliance", np.array([f, 0.4, 0.3, 0.6, np.inf]))) for f in (756.0, 90.0))
    assert not race.shows(judged("shaft_compliance", stiff, pushed.fit, 1.0)) and race.shows(judged("shaft_compliance", soft, pushed.fit, 1.0))
    assert race.shows(judged("friction_level", pushed.fit, pushed.fit, 1.0))


def test_a_tangent_that_runs_away_promises_nothing(pushed, monkeypatch):
    """Beside a stiff bristle a law's tangent may leave all bounds: the start is passed over, and the other ones are compared."""
    model, effect = pushed.fit.model, BY_NAME["load_dependent_friction"]
    run = run_of(model, pushed.traces, 5.0)
    starts = [size * effect.starts(model.scales)[0] for size in (1.0, 1.1, 1.2, 1.3, 1.4)]
    targets, changes = _targets(model, run.left, pushed.traces, 1.0)[1], type(model).changes
    assert len(_first_order(run, effect, starts, targets, pushed.traces)) == 5
    monkeypatch.setattr(type(model), "changes", lambda *a: changes(*a) + np.where(np.arange(len(starts)) == lost, size, 0.0))
    for lost, size in ((0, np.inf), (0, np.nan), (2, 1e200)):
        shares = _first_order(run, effect, starts, targets, pushed.traces)
        assert shares[lost] == 0.0 < np.min(np.delete(shares, lost)) and len(some := _hopeful(starts, shares, 3)) == 3
        assert all(start is not starts[lost] for start in some)


def test_a_bristle_is_begun_with_damping_that_fades_where_it_was_lost(pushed):
    scales, effect = pushed.fit.model.scales, BY_NAME["presliding"]
    lasting, fading = (np.array([1e-3, 0.1, w_d, np.inf]) for w_d in (10.0 * scales.speed, 0.1 * scales.speed))
    assert [p[0] == 1e-3 and p[2] < scales.speed for p in effect.grown("presliding", lasting, scales)] == [True, False, False]
    assert not any(p[2] < np.inf for p in effect.grown("presliding", fading, scales))


def test_a_promise_that_failed_is_no_measure_for_the_others():
    promises = {"load_disturbance": 3.0, "load_dependent_friction": 0.97, "cogging": 0.4, "input_delay": 0.18, "gravity": 0.02}
    found = Screened(promises, dict.fromkeys(promises, ()), 0.0, 4)
    assert found.promising() == ["load_disturbance", "load_dependent_friction", "cogging"]
    assert found.promising({"load_dependent_friction"}) == ["load_disturbance", "load_dependent_friction", "cogging", "input_delay"]


def test_a_wider_effect_begins_where_its_limit_ended(pushed):
    model, traces = pushed.fit.model, pushed.traces
    twisting = np.array([80.0, 0.2, 0.6, 0.2, np.inf])
    starts = BY_NAME["backlash"].grown("shaft_compliance", twisting, model.scales)
    one, other = (residuals(model.with_effect(name, p), traces, 5.0) for name, p in (("shaft_compliance", twisting), ("backlash", starts[0])))
    apart = np.sqrt(np.mean((one - other) ** 2))
    assert apart < 0.2 * np.sqrt(np.mean((one - residuals(model, traces, 5.0)) ** 2))
    assert not BY_NAME["backlash"].grown("bias_torque", np.array([0.5]), model.scales)


def test_a_shaft_may_harden_once_it_is_there(pushed):
    shaft = replace(pushed.fit, model=pushed.fit.model.with_effect("shaft_compliance", np.array([80.0, 0.2, 0.6, 0.2, np.inf])))
    grown = [begin.model for name, begin in _wider({"shaft_compliance": shaft}, ("backlash",)) if name == "shaft_compliance"]
    assert len(grown) == 1 and 0.0 < dict(grown[0].effects)["shaft_compliance"][4] < np.inf
    assert not _wider({"shaft_compliance": replace(shaft, model=grown[0])}, ("backlash",))


def test_other_laws_wave_with_the_period_that_leads(pushed):
    """Not those of its class, which are told apart by their periods, nor beside what does not wave."""
    model = pushed.fit.model
    period = 0.4 * (model.scales.high - model.scales.low)
    wave, dent = (replace(pushed.fit, model=model.with_effect("position_dependent_friction", np.array(p)))
                  for p in ([0.5, np.inf, np.inf, period, 0.3], [0.5, 0.1, 0.05, np.inf, np.inf]))
    begun = _other_waves({"position_dependent_friction": wave}, ())
    assert {name for name, _ in begun} >= {"sensor_nonlinearity", "transmission_ripple"} and not {name for name, _ in begun} & {"position_dependent_friction", "periodic_gust"}
    assert all(period in dict(begin.model.effects)[name] and begin.model.names == (name,) for name, begin in begun)
    assert "sensor_nonlinearity" not in {name for name, _ in _other_waves({"position_dependent_friction": wave}, ("sensor_nonlinearity",))}
    assert not _other_waves({"position_dependent_friction": dent}, ()) and not _other_waves({"gain": pushed.fit}, ())
    ripple = replace(pushed.fit, model=model.with_effect("transmission_ripple", np.array([0.05, period, 0.0, np.inf, np.inf, np.inf])))
    assert "cogging" not in {name for name, _ in _other_waves({"transmission_ripple": ripple}, ())}


def test_forms_are_compared_at_the_end(pushed):
    """Of a supply that sags, the law by duty beside that by current, whichever was ahead after a few steps; each form once."""
    model = pushed.fit.model
    ways = [np.array([bridge, whole, np.inf, T_c, 14.0, 24.0]) for bridge, whole, T_c in
            ((np.inf, 0.2, 0.1), (0.2, np.inf, 0.1), (0.3, np.inf, 0.1), (0.2, np.inf, np.inf))]
    begins = [Begin(model.with_effect("supply_sag", p), {}) for p in ways]
    found = replace(pushed.fit, model=begins[0].model)
    assert [begin for _, begin in _other_forms({"supply_sag": found, "gain": pushed.fit}, {"supply_sag": begins})] == [begins[1], begins[3]]


def test_of_two_alike_the_one_without_play_is_likelier(pushed):
    """One has the other as its limit: it must do better, and not as well, to be named."""
    wide, narrow, none = (replace(pushed.fit, model=pushed.fit.model.with_effect(name, np.array(p))) for name, p in
                          (("backlash", [1e-4, 0.6, 0.2, 80.0, 0.2]), ("shaft_compliance", [80.0, 0.2, 0.6, 0.2, np.inf]), ("bias_torque", [0.1])))
    alike = probabilities({"backlash": wide, "shaft_compliance": narrow})
    assert alike["shaft_compliance"] == pytest.approx(1 / (1 + np.exp(-0.75)), abs=0.01)
    assert probabilities({"backlash": wide, "bias_torque": none})["backlash"] == pytest.approx(0.5, abs=0.01)
    better = replace(wide, misfit=wide.misfit * 0.8)
    assert probabilities({"backlash": better, "shaft_compliance": narrow})["backlash"] > 0.8
    seen = replace(wide, model=pushed.fit.model.with_effect("backlash", np.array([5e-4, 0.6, 0.2, 80.0, 0.2])))  # wider than its contact gives way
    assert probabilities({"backlash": seen, "shaft_compliance": narrow})["backlash"] == pytest.approx(1 / (1 + np.exp(-0.75)), abs=0.01)


def test_a_play_less_wide_than_its_contact_gives_way_is_a_shaft(pushed):
    """115 rad/s^2 of friction push a contact of 80 Hz in by 0.46 mrad."""
    def found(name, p, gain):
        return replace(judged(name, replace(pushed.fit, model=pushed.fit.model.with_effect(name, np.array(p))), pushed.fit, 1.0), gain=gain)

    shaft = found("shaft_compliance", [60.0, 0.1, 0.6, 0.2, np.inf], 16.0)
    for gap, gain, first in ((1e-4, 20.0, "shaft_compliance"), (1e-3, 20.0, "backlash"), (1e-4, 40.0, "backlash")):
        play = found("backlash", [gap, 0.6, 0.2, 80.0, 0.1], gain)
        assert likeliest_first([play, shaft])[0].name == first
    assert not BY_NAME["backlash"].grown("shaft_compliance", np.array([80.0, 0.7, 0.6, 0.2, np.inf]), pushed.fit.model.scales)


def test_two_effects_are_found_from_either(pushed):
    """A drive that delays and sleeps: where the delay comes first, the friction takes the sleep's place and leaves it none."""
    values, traces = {**TRUTH, "c_2": 85.0}, []
    truth = [("drive_dead_zone", np.array([0.95, np.inf])), ("input_delay", np.array([0.0157]))]
    for k, name in enumerate(("multisine", "steps", "chirp")):
        y = ReducedModel(lumped(values), truth).simulate(T, INPUTS[name](T)).measured
        traces.append(trace_of(from_arrays(T, INPUTS[name](T), y + 1.5e-4 * np.random.default_rng(k).standard_normal(T.size), name=name), None))
    start = baseline(traces, Datasheet(lumped=values), True, 1)
    first, second = (judged(name, fit(start.fit.model.with_effect(name, p), start.traces), start.fit, 1.0) for name, p in (truth[1], truth[0]))
    ranked = other_way_round(first.fit, [first, second], [], start.traces, 1.0, 1)
    assert [c.name for c in ranked] == ["drive_dead_zone"] and set(ranked[0].fit.model.names) == {"drive_dead_zone", "input_delay"}
    found = dict(ranked[0].fit.model.effects)
    assert found["drive_dead_zone"][0] == pytest.approx(0.95, rel=0.02) and found["input_delay"][0] == pytest.approx(0.0157, rel=0.02)


def test_a_faint_law_beside_an_effect_must_stand_alone():
    """A friction of 1 % of the drive's torque beside a drag that leaves twenty times as much, and what no law of the servo offers more than another."""
    traces = []
    for k, name in enumerate(("multisine", "steps", "chirp")):
        u, laws = INPUTS[name](T), [("quadratic_drag", np.array([1.0])), ("load_dependent_friction", np.array([0.01]))]
        y = ReducedModel(lumped(TRUTH), laws).simulate(T, u).measured
        traces.append(trace_of(from_arrays(T, u, y + 1.5e-4 * np.random.default_rng(k).standard_normal(T.size), name=name), None))
    start = baseline(traces, Datasheet(lumped=TRUTH), True, 1)
    found = selection.select(start.fit, start.traces, jobs=1)
    assert found.chosen.model.names == ("quadratic_drag", "load_dependent_friction")
    assert selection.FAINT_GAIN < found.rounds[1][0].gain < selection.LATER_GAIN
    first, second = replace(found.rounds[1][0], gain=2.0), replace(found.rounds[0][1], name="stribeck", gain=1.5)
    assert stands_alone(first, (first, replace(second, gain=1.2))) and not stands_alone(first, (first, second))
    assert stands_alone(first, (first, replace(first, name="stribeck")))  # which leaves the same in all blocks
    assert not stands_alone(replace(first, name="periodic_gust"), (first,))
    torque = replace(first, name="bias_torque")
    assert stands_alone(torque, (torque, replace(second, name="asymmetric_friction")))  # which is one with it


def test_beside_a_shaft_the_starts_of_a_wave_are_chosen_along_the_motion_of_one_body(pushed):
    """A cog of a motor that a shaft of 20 Hz parts from the rudder: the start of the nearest period is among the few that are simulated."""
    period, shaft = 0.03, ("shaft_compliance", np.array([20.0, 0.1, 0.5, 0.2, np.inf]))
    traces = []
    for k, name in enumerate(("multisine", "steps", "chirp")):
        y = ReducedModel(lumped(TRUTH), [shaft, ("cogging", np.array([12.0, period, 0.4, np.inf, np.inf]))]).simulate(T, u := INPUTS[name](T)).measured
        traces.append(trace_of(from_arrays(T, u, y + 1.5e-4 * np.random.default_rng(k).standard_normal(T.size), name=name), None))
    model = replace(pushed.fit.model, values={**pushed.fit.model.values, **TRUTH}).with_effect(*shaft)
    run, effect = run_of(model, traces, 5.0), BY_NAME["cogging"]
    starts, targets = effect.starts(model.scales), _targets(model, run.left, traces, 1.0)[1]
    chosen = [start[1] for start in _hopeful(starts, _first_order(run, effect, starts, targets, traces), 3)]
    assert len(chosen) == 3 and min((start[1] for start in starts), key=lambda p: abs(1.0 / p - 1.0 / period)) in chosen


def test_one_block_stands_out_among_bad_ones():
    misfit = np.concatenate([np.ones(150), np.full(50, 30.0)])
    assert not stands_out(misfit, 1.0) and not stands_out(np.append(misfit, 500.0), 1.0) and stands_out(np.append(misfit, 1000.0), 1.0)


def test_of_rivals_that_tie_the_likelier_class_stays_once_the_rest_is_known(pushed, monkeypatch):
    """A constant torque and its asymmetric form are one; gravity, a third that does as well, is beaten by the two together."""
    base, traces = pushed.fit, pushed.traces
    ranked = tuple(judged(name, fit(base.model.with_effect(name, np.array(p)), traces), base, 1.0) for name, p in
                   (("gravity_imbalance", [0.06, 0.0]), ("bias_torque", [0.06]), ("asymmetric_friction", [-0.06, 0.0])))
    newest = (replace(ranked[0], name="stribeck"),)
    rounds = [ranked, newest]
    found = exchanged(ranked[0].fit, rounds, traces, 1.0, 1)
    assert found.model.names == ("bias_torque",) and [c.name for c in rounds[0]][0] == "bias_torque" and len(rounds[0]) == 3
    alone = [ranked]
    assert exchanged(ranked[0].fit, alone, traces, 1.0, 1).model.names == ("gravity_imbalance",)  # its round has compared it with its rivals just so
    monkeypatch.setattr(reviews, "is_rough", lambda traces: True)  # but behind a coarse converter it has told anew where the recordings begin
    assert exchanged(ranked[0].fit, alone, traces, 1.0, 1).model.names == ("bias_torque",)
    monkeypatch.undo()
    unlike = [(ranked[0], replace(ranked[1], gain=0.0), replace(ranked[2], gain=0.0)), newest]
    assert exchanged(ranked[0].fit, unlike, traces, 1.0, 1).model.names == ("gravity_imbalance",)


def test_a_rival_is_exchanged_from_the_servo_that_it_was_fitted_with_as_well(pushed, monkeypatch):
    """What leads may have bent the servo further from a rival's than a few steps lead back; a rival of a round whose earlier effect has gone has no such place."""
    def one(name, b, *others):
        model = replace(pushed.fit.model, values={**pushed.fit.model.values, "b": b})
        for other in (*others, name):
            model = model.with_effect(other, BY_NAME[other].starts(model.scales)[0])
        return Candidate(name, replace(pushed.fit, model=model), 10.0, 3.0, 0.0, 1.0)

    leader, rival, later = one("bias_torque", 70.0), one("quadratic_drag", 60.0), one("hinge_moment_cubic", 65.0, "bias_torque")
    seen = []
    monkeypatch.setattr(reviews, "fit", lambda model, *_, **__: (seen.append(model), replace(pushed.fit, model=model, cost=1e6))[1])
    stale = one("asymmetric_friction", 50.0, "end_stop")
    rounds = [(leader, rival), (later, stale)]
    assert exchanged(later.fit, rounds, pushed.traces, 1.0, 1) is later.fit
    assert [(set(model.names), model.values["b"]) for model in seen] == [({"hinge_moment_cubic", "quadratic_drag"}, b) for b in (65.0, 60.0)]


def test_a_knock_on_a_resting_rudder_is_found_where_it_acts(pushed):
    u = np.where(T < 1.0, INPUTS["multisine"](T), 0.0)
    knock = np.array([-300.0, 2.24, 0.08, 0.0])
    y = ReducedModel(lumped(TRUTH), [("load_disturbance", knock)]).simulate(T, u).measured
    still = trace_of(from_arrays(T, u, y + 1.5e-4 * np.random.default_rng(9).standard_normal(T.size), name="still"), None)
    model = replace(pushed.fit.model, values={**pushed.fit.model.values, **TRUTH}, scales=replace(pushed.fit.model.scales, recordings=1))
    (begins,) = screen([model], [still], 1.0, (), False, True).begins["load_disturbance"]
    size, begin, length, record = dict(begins[0].model.effects)["load_disturbance"]
    assert size == pytest.approx(-300.0, rel=0.3) and begin == pytest.approx(2.24, abs=0.02) and length == pytest.approx(0.08, rel=0.3) and record == 0


def test_a_knock_is_tried_in_its_surroundings(pushed):
    """What begins in the run's own state gains there what it gains in all of the recording; beside a memory all of it is simulated."""
    run, trace = run_of(pushed.fit.model, pushed.traces, 5.0), pushed.traces[1]
    near = _Surroundings(run, pushed.traces, 1.0)
    for moment in (0.02, 1.4, 2.95):
        gains = []
        knocked = run.model.with_effect("load_disturbance", np.array([300.0, moment, 0.08, 1.0]))
        part, _, (level, without) = near.of(1, moment)
        assert level == 1.0
        for some in (part, trace):
            before, after = (float(np.sum(score(near.misfit(some, residuals_in(model, some, 1, 5.0)), 1.0))) for model in (run.model, knocked))
            assert some is trace or before == pytest.approx(without, abs=1e-9)
            gains.append(before - after)
        assert gains[0] == pytest.approx(gains[1], rel=0.02, abs=0.02) and abs(gains[0]) > 0.5
    assert near.of(1, 2.95)[0].t.size < 0.25 * trace.t.size and near.of(1, 0.02)[0].t.size < trace.t.size
    warm = run.model.with_effect("thermal_drift", BY_NAME["thermal_drift"].starts(run.model.scales)[0])
    assert _Surroundings(run_of(warm, pushed.traces, 5.0), pushed.traces, 1.0).of(1, 1.4)[0] is trace


def test_a_knock_is_sought_on_to_where_it_throws_the_rudder():
    """A shaft twists under less, which gains a little; what moves the rudder lies in a window of a sixth above its friction."""
    def gain(push):
        return 0.05 if push[0] < 60.0 else 9.0 if push[0] < 70.0 else -14.0

    pushes = [(gain([size]), np.array([size, 0.8, 0.1, 0.0])) for size in (3.0, 11.0, 33.0, 110.0)]
    tried = _between(gain, pushes)
    assert max(won for won, _ in tried) == 9.0 and all(33.0 < push[0] < 110.0 for _, push in tried)
    assert not _between(gain, pushes[:3]) and not _between(gain, pushes[3:])


def test_knocks_are_looked_for_where_a_recording_leaves_enough(pushed):
    noise = 0.9 * np.random.default_rng(1).standard_normal(sum(t.rows for t in pushed.traces))
    assert _hot(noise, pushed.traces, 1.0) == ()
    noise[pushed.traces[0].rows + 1000:][:60] += 10.0
    assert {(record, begin) for record, begin, _ in _hot(noise, pushed.traces, 1.0)} <= {(1, 0.75), (1, 1.0), *((1, 0.25 * k) for k in range(12))} != set()


@pytest.mark.parametrize("newest, gain, kept", [("drive_dead_zone", 400.0, ("drive_dead_zone",)), ("drive_dead_zone", 50.0, ("load_disturbance", "drive_dead_zone")),
                                                ("periodic_gust", 400.0, ("load_disturbance", "periodic_gust"))])
def test_a_knock_that_a_later_law_outweighs_is_looked_for_again(pushed, newest, gain, kept):
    """It was found in what the law had bent; beside another one with a clock of its own it stays."""
    start, tau = pushed.fit, 1.0
    model = start.model
    for name in ("load_disturbance", newest):
        model = model.with_effect(name, BY_NAME[name].starts(replace(model.scales, hot=((0, 1.0, 0.1),)))[0])
    rounds = [(Candidate(name, start, won, 3.0, 0.0, 1.0),) for name, won in (("load_disturbance", 20.0), (newest, gain))]
    found, left = _reconsidered(replace(start, model=model), rounds, pushed.traces, tau)
    assert found.model.names == kept and tuple(ranked[0].name for ranked in left) == kept


def test_what_a_parameter_at_its_bound_cannot_follow_is_left_to_an_effect():
    """A winding of three times the datasheet's time constant: the baseline's own may rise to twice that."""
    traces, t = [], T[::4]
    for k, name in enumerate(("multisine", "steps", "chirp")):
        u = INPUTS[name](t)
        y = ReducedModel(lumped({**TRUTH, "tau_e": 1.1e-3}), [("inductance", np.array([2.0e-3, np.inf]))]).simulate(t, u).measured
        traces.append(trace_of(from_arrays(t, u, y + 1.5e-4 * np.random.default_rng(k).standard_normal(t.size), name=name), None))
    start = baseline(traces, read_datasheet("table1"), True, 1)
    model = start.fit.model
    assert [f.name for f in model.layout() if model.at_bound(f)] == ["tau_e"]
    promises = screen([model], start.traces, 1.0, (), True, False).promises
    assert max(promises, key=promises.get) == "inductance"


def test_a_sweep_finds_what_secants_miss(pushed):
    """From its own start, whatever that makes worse on the way; no more is returned than the screening found."""
    others = [name for name in BY_NAME if name not in ("bias_torque", "quadratic_drag", "hinge_moment_cubic")]
    found = swept(pushed.fit, [], pushed.traces, 1.0, others, 1)
    best = max(found, key=lambda c: c.gain)
    (size,) = dict(best.fit.model.effects)["bias_torque"]
    assert best.name == "bias_torque" and size == pytest.approx(0.06, rel=0.3) and best.gain > 2.0
    assert not [c for c in swept(pushed.fit, [best], pushed.traces, 1.0, others, 1) if c.name == "bias_torque" and c.gain > best.gain + 0.1]


def test_a_start_that_a_secant_made_too_small_is_no_end(pushed):
    """Of laws with few starts these count as they are as well, promised or not, of what happens once or takes long none; what is found does not hang on the secant's size."""
    small = {(name, 0): [Begin(pushed.fit.model.with_effect(name, np.array([1e-3])), {})] for name in ("bias_torque", "quadratic_drag")}
    names = ["bias_torque", "quadratic_drag", "position_dependent_friction", "load_disturbance", "presliding"]
    begun = _more_starts(pushed.fit.model, names, ["bias_torque", "load_disturbance"], small)
    own = {name: BY_NAME[name].starts(pushed.fit.model.scales)[0][0] for name in ("bias_torque", "quadratic_drag")}
    assert [(name, dict(b.model.effects)[name][0]) for name, b in begun] == [("bias_torque", 1e-3), ("bias_torque", own["bias_torque"]), ("quadratic_drag", own["quadratic_drag"])]


def test_the_kin_of_a_law_that_leads_is_refitted_though_its_secant_promises_nothing(monkeypatch):
    """A limit does nothing until it is passed; what sags does much of what it does, and leads."""
    traces = []
    for k, name in enumerate(("multisine", "steps", "chirp")):
        y = ReducedModel(lumped(TRUTH), [("current_limit", np.array([300.0, np.inf]))]).simulate(T, INPUTS[name](T)).measured
        traces.append(trace_of(from_arrays(T, INPUTS[name](T), y + 1.5e-4 * np.random.default_rng(k).standard_normal(T.size), name=name), None))
    start, seen = baseline(traces, Datasheet(lumped=TRUTH), True, 1), screening.screen
    monkeypatch.setattr(race, "screen", lambda places, traces, tau, exclude, *more, **settings: seen(places, traces, tau, [*exclude, "current_limit"], *more, **settings))
    monkeypatch.setattr(race, "_more_starts", lambda *_: [])
    others = [name for name in BY_NAME if name not in ("supply_sag", "current_limit")]
    assert candidates(start.fit, start.traces, 1.0, 1, others)[0].name == "current_limit"


def test_two_rivals_take_the_place_of_what_does_much_of_what_both_do():
    """A friction along the travel beside a spring that hardens, told as a gear that varies and a bent scale."""
    truth = {"position_dependent_friction": np.array([25.0, np.inf, np.inf, 0.5, 1.4]), "hinge_moment_cubic": np.array([400.0])}
    traces = []
    for k, name in enumerate(("multisine", "steps", "chirp")):
        y = ReducedModel(lumped(TRUTH), list(truth.items())).simulate(T, INPUTS[name](T)).measured
        traces.append(trace_of(from_arrays(T, INPUTS[name](T), y + 1.5e-4 * np.random.default_rng(k).standard_normal(T.size), name=name), None))
    start = baseline(traces, Datasheet(lumped=TRUTH), True, 1)

    def alone(name, p):
        return judged(name, fit(start.fit.model.with_effect(name, p), start.traces), start.fit, 1.0)

    leader = alone("variable_ratio", np.array([0.01, -1.0, 0.5]))
    wrong = fit(leader.fit.model.with_effect("quadratic_drag", np.array([1.0])), start.traces)
    rivals = [alone(name, p) for name, p in truth.items()]
    found, rounds = paired(wrong, [(leader, *rivals), ()], start.traces, 1.0, 1)
    assert set(found.model.names) == set(truth) and [ranked[0].name for ranked in rounds] == list(truth)
    for name, p in found.model.effects:
        assert p[0] == pytest.approx(truth[name][0], rel=0.1)
    assert paired(found, [(rivals[0], leader, rivals[1]), ()], start.traces, 1.0, 1) is None

    def blown(found):
        """The fit beside a gust of a thousandth of its start."""
        gust = BY_NAME["periodic_gust"].starts(found.model.scales)[0]
        return replace(found, model=found.model.with_effect("periodic_gust", np.append(1e-3 * gust[:1], gust[1:])))

    first = judged("periodic_gust", blown(start.fit), start.fit, 1.0)
    later = tuple(replace(c, fit=blown(c.fit)) for c in (leader, *rivals))
    found, rounds = paired(blown(wrong), [(first,), later, ()], start.traces, 1.0, 1)  # what has a clock of its own stays
    assert set(found.model.names) == {"periodic_gust", *truth} and [ranked[0].name for ranked in rounds] == ["periodic_gust", *truth]


def test_an_effect_that_leaves_much_gives_way_to_what_a_sweep_finds(pushed):
    others = [name for name in BY_NAME if name not in ("bias_torque", "quadratic_drag", "hinge_moment_cubic")]
    model = pushed.fit.model.with_effect("quadratic_drag", BY_NAME["quadratic_drag"].starts(pushed.fit.model.scales)[0])
    drag = judged("quadratic_drag", fit(model, pushed.traces, tau=1.0), pushed.fit, 1.0)
    found, rounds = reviewed(drag.fit, [(drag,), ()], pushed.traces, 1.0, others, 1)
    assert found.model.names == ("bias_torque",) and [[c.name for c in ranked] for ranked in rounds] == [["bias_torque", "quadratic_drag"]]
    assert reviewed(found, rounds, pushed.traces, 1.0, others, 1) is None


def test_a_sweep_ends_when_enough_has_been_simulated(pushed):
    others = [name for name in BY_NAME if name not in ("bias_torque", "backlash")]
    before = EFFORT.spent
    assert not swept(pushed.fit, [], pushed.traces, 1.0, others, 1, before) and EFFORT.spent == before
    assert [c.name for c in swept(pushed.fit, [], pushed.traces, 1.0, others, 1, before + 1)] == ["bias_torque"]  # one body first


def test_a_race_ends_when_enough_has_been_simulated():
    traces = []
    for k, name in enumerate(("multisine", "steps")):
        y = ReducedModel(lumped(TRUTH), [("input_delay", np.array([0.012]))]).simulate(T, INPUTS[name](T)).measured
        traces.append(trace_of(from_arrays(T, INPUTS[name](T), y + 1.5e-4 * np.random.default_rng(k).standard_normal(T.size), name=name), None))
    start = baseline(traces, Datasheet(lumped=TRUTH), True, 1)
    tau, efforts, told = tau_of(start.fit.misfit), [], []
    for last in (np.inf, 0.0):
        before = EFFORT.spent
        told.append(candidates(start.fit, start.traces, tau, 1, (), (), LEAST_GAIN, last))
        efforts.append(EFFORT.spent - before)
    assert efforts[1] < 0.8 * efforts[0]
    assert told[1] and told[1][0].gain > 0.5 * told[0][0].gain > LEAST_GAIN  # what was begun is told


def test_where_the_model_stays_wrong_a_third_effect_must_take_a_good_part(pushed):
    """Of 100 C that are left a tenth is enough in order, and a good part out of it; of hardly any what is more than chance."""
    wrong = replace(pushed.fit, misfit=np.full(100, np.e - 1.0) * 2.0, model=pushed.fit.model.with_effect("quadratic_drag", np.array([1.0])))
    left = float(score(wrong.misfit, 1.0).sum())
    assert _gains_that_matter(wrong, 1.0, True) == (pytest.approx(0.1 * left), pytest.approx(0.1 * left))
    assert _gains_that_matter(wrong, 1.0, False) == (pytest.approx(GOOD_PART * left), pytest.approx(GOOD_PART * left))


def test_what_bends_and_twists_takes_longest(pushed):
    model = pushed.fit.model
    beside = {name: _bending_and_twisting(model.with_effect(name, BY_NAME[name].starts(model.scales)[0])) for name in ("presliding", "backlash", "stribeck")}
    assert beside == {"presliding": ["backlash", "shaft_compliance"], "backlash": ["presliding"], "stribeck": []}


def test_a_second_sweep_leaves_two_bodies_out(pushed, monkeypatch):
    tried = []
    monkeypatch.setattr(reviews, "fit", lambda model, *_, **__: tried.append(model.names) or pushed.fit)
    others = [name for name in BY_NAME if name not in ("bias_torque", "backlash", "shaft_compliance")]
    for kinds, names in (({}, {("bias_torque",), ("backlash",), ("shaft_compliance",)}), ({"kinds": of_one_body}, {("bias_torque",)})):
        tried.clear()
        swept(pushed.fit, [], pushed.traces, 1.0, others, 1, **kinds)
        assert set(tried) == names


def test_a_torque_too_slow_for_cogging_is_the_gears(pushed):
    """Behind a gear of 20 a motor that cogs thrice a turn has a period of 0.105 rad at the output; without a gear any period may be its own."""
    scales = replace(pushed.fit.model.scales, low=-0.3, high=0.3, cog=2 * np.pi / 60.0)
    cogs, gears = ([p for p in BY_NAME[name].starts(scales)] for name in ("cogging", "transmission_ripple"))
    torques = [p for p in gears if np.isfinite(p[3])]
    assert max(p[1] for p in cogs) <= scales.cog < min(p[1] for p in torques) and len(torques) < len(gears)
    assert not any(np.isfinite(p[3]) for p in BY_NAME["transmission_ripple"].starts(replace(scales, cog=np.inf)))


def test_a_torque_that_returns_must_be_seen_to_return(pushed):
    """Less than a period of it is any smooth torque; with a second harmonic even a whole one is. A friction that changes along the travel may be slower."""
    model, ripple = pushed.fit.model, BY_NAME["transmission_ripple"]
    travel = 2.0 * model.scales.position
    longest = {name: next(f.upper for f in model.with_effect(name, p).layout() if (f.owner, f.name) == (name, "period")) / travel for name, p in
               (("cogging", [1.0, 0.1, 0.0, np.inf, np.inf]), ("transmission_ripple", [np.inf, 0.1, 0.0, 1.0, np.inf, np.inf]),
                ("position_dependent_friction", [1.0, np.inf, np.inf, 0.1, 0.0]))}
    assert longest["cogging"] == longest["transmission_ripple"] == pytest.approx(1 / 0.95) and longest["position_dependent_friction"] == pytest.approx(1.25)
    assert [len(ripple.grown(ripple.name, np.array([np.inf, turns * travel, 0.0, 1.0, np.inf, np.inf]), model.scales)) for turns in (0.9, 1.03)] == [2, 0]


def test_a_shaft_whose_motor_bears_nothing_is_a_filter_in_the_drive(pushed):
    def found(name, p, gain):
        return replace(judged(name, replace(pushed.fit, model=pushed.fit.model.with_effect(name, np.array(p))), pushed.fit, 1.0), gain=gain)

    winding = found("inductance", [2e-3, np.inf], 17.0)
    for rho, first in ((0.2, "inductance"), (0.4, "shaft_compliance")):
        assert likeliest_first([found("shaft_compliance", [50.0, 0.7, rho, 0.0, np.inf], 21.0), winding])[0].name == first
    assert not BY_NAME["shaft_compliance"].grown("shaft_compliance", np.array([50.0, 0.7, 0.2, 0.0, np.inf]), pushed.fit.model.scales)


def test_what_a_refit_turns_into_another_effect_gives_way_to_it(pushed):
    def found(name, p, gain):
        return replace(judged(name, replace(pushed.fit, model=pushed.fit.model.with_effect(name, np.array(p))), pushed.fit, 1.0), gain=gain)

    shaft, winding = found("shaft_compliance", [50.0, 0.7, 0.4, 0.0, np.inf], 21.0), found("inductance", [2e-3, np.inf], 0.0)
    for rho, first in ((0.2, "inductance"), (0.4, None)):
        now = pushed.fit.model.with_effect("shaft_compliance", np.array([50.0, 0.7, rho, 0.0, np.inf]))
        other = _in_its_place(replace(pushed.fit, model=now), pushed.fit, (shaft, winding), 1.0)
        assert other is None if first is None else other[0].name == first and len(other) == 2


def test_a_stop_that_is_touched_once_is_no_knock(monkeypatch):
    """Only the steps reach it, and the rudder sticks there. Where its secant, taken from a stop too early, promises nothing, a knock explains as much."""
    values, traces, t = {**TRUTH, "c_2": 60.0}, [], T[::5]
    free = {name: ReducedModel(lumped(values)).simulate(t, INPUTS[name](t)).theta for name in ("multisine", "steps", "chirp")}
    upper = free["steps"].max() - 0.01
    for k, name in enumerate(free):
        u = INPUTS[name](t)
        y = ReducedModel(lumped(values), [("end_stop", np.array([-np.inf, upper, 60.0, 0.3]))]).simulate(t, u).measured
        traces.append(trace_of(from_arrays(t, u, y + 1e-4 * np.random.default_rng(k).standard_normal(t.size), name=name), None))
    start = baseline(traces, Datasheet(lumped=values), True, 1)

    def knocks(*arguments, **options):
        found = screen(*arguments, **options)
        return replace(found, promises={"load_disturbance": found.promises["load_disturbance"]})

    monkeypatch.setattr(race, "screen", knocks)
    ranked = candidates(start.fit, start.traces, tau_of(start.fit.misfit), 1, (), (), LEAST_GAIN)
    assert ranked[0].name == "end_stop" and dict(ranked[0].fit.model.effects)["end_stop"][1] == pytest.approx(upper, abs=1e-3)
    assert "load_disturbance" in [c.name for c in ranked]


def test_a_datasheets_gear_bounds_the_period_of_cogging(pushed):
    sheet = Datasheet(parameters={"n": 20.0}, lumped=TRUTH)
    assert baseline(pushed.traces, sheet, True, 1).fit.model.scales.cog == pytest.approx(2 * np.pi / 60.0)
    assert pushed.fit.model.scales.cog == np.inf


def test_an_uneven_gears_torque_is_the_one_of_a_cog():
    u, c = INPUTS["multisine"](T), lumped(TRUTH)
    wave = [5.0, 0.2, 0.4, 0.3, 1.0]
    gear, cog = (ReducedModel(c, [(name, np.array(p))]).simulate(T, u).theta for name, p in
                 (("transmission_ripple", [np.inf, 0.2, 0.4, 5.0, 0.3, 1.0]), ("cogging", wave)))
    assert np.allclose(gear, cog, atol=1e-9)
    with pytest.raises(InputError, match="ripple and A are both given"):
        ReducedModel(c, [("transmission_ripple", np.array([0.1, 0.2, 0.4, 5.0, np.inf, np.inf]))]).simulate(T, u)
