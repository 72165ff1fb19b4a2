"""A round: who is refitted, from where, and who leads at its end."""

from dataclasses import replace

import numpy as np
import pytest
from servo import NAMES, TRUTH, T, bench_of, recorded, started

from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.decisions.explained import cost
from ers_mj.decisions.policy import POLICY
from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import fit
from ers_mj.estimation.objective import residuals, tau_of
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.selection import candidates as race
from ers_mj.selection import finishing, overlooked
from ers_mj.selection.bench import Bench
from ers_mj.selection.candidates import candidates
from ers_mj.selection.multistart import more_starts, other_forms, other_waves, wider
from ers_mj.selection.refits import Refits
from ers_mj.selection.screening import Begin, screen
from ers_mj.selection.search import Budget


def test_a_wider_effect_begins_where_its_limit_ended(pushed):
    model, traces = pushed.fit.model, pushed.traces
    twisting = np.array([80.0, 0.2, 0.6, 0.2, np.inf])
    starts = BY_NAME["backlash"].grown("shaft_compliance", twisting, model.scales)
    one, other = (
        residuals(model.with_effect(name, p), traces, 5.0)
        for name, p in (("shaft_compliance", twisting), ("backlash", starts[0]))
    )
    apart = np.sqrt(np.mean((one - other) ** 2))
    assert apart < 0.2 * np.sqrt(np.mean((one - residuals(model, traces, 5.0)) ** 2))
    assert not BY_NAME["backlash"].grown("bias_torque", np.array([0.5]), model.scales)


def test_a_shaft_may_harden_once_it_is_there(pushed):
    shaft = replace(
        pushed.fit, model=pushed.fit.model.with_effect("shaft_compliance", np.array([80.0, 0.2, 0.6, 0.2, np.inf]))
    )
    grown = [
        begin.model for name, begin in wider({"shaft_compliance": shaft}, ("backlash",)) if name == "shaft_compliance"
    ]
    assert len(grown) == 1 and 0.0 < dict(grown[0].effects)["shaft_compliance"][4] < np.inf
    assert not wider({"shaft_compliance": replace(shaft, model=grown[0])}, ("backlash",))


def test_other_laws_wave_with_the_period_that_leads(pushed):
    """Not those of its class, which are told apart by their periods, nor beside what does not wave."""
    model = pushed.fit.model
    period = 0.4 * (model.scales.high - model.scales.low)
    wave, dent = (
        replace(pushed.fit, model=model.with_effect("position_dependent_friction", np.array(p)))
        for p in ([0.5, np.inf, np.inf, period, 0.3], [0.5, 0.1, 0.05, np.inf, np.inf])
    )
    begun = other_waves({"position_dependent_friction": wave}, ())
    assert {name for name, _ in begun} >= {"sensor_nonlinearity", "transmission_ripple"} and not {
        name for name, _ in begun
    } & {"position_dependent_friction", "periodic_gust"}
    assert all(period in dict(begin.model.effects)[name] and begin.model.names == (name,) for name, begin in begun)
    assert "sensor_nonlinearity" not in {
        name for name, _ in other_waves({"position_dependent_friction": wave}, ("sensor_nonlinearity",))
    }
    assert not other_waves({"position_dependent_friction": dent}, ()) and not other_waves({"gain": pushed.fit}, ())
    ripple = replace(
        pushed.fit,
        model=model.with_effect("transmission_ripple", np.array([0.05, period, 0.0, np.inf, np.inf, np.inf])),
    )
    assert "cogging" not in {name for name, _ in other_waves({"transmission_ripple": ripple}, ())}


def test_further_forms_are_fitted_to_the_end_where_a_few_steps_bring_them_near(pushed):
    """Of two starts of a form the better one, and none of a law that a few steps leave far behind."""
    traces = recorded([("bias_torque", np.array([6.0]))])
    base = fit(pushed.fit.model, traces)
    refits = Refits(bench_of(traces, tau=tau_of(base.misfit)), base)
    begun = [
        (name, Begin(base.model.with_effect(name, np.array(p)), {}))
        for name, p in (("bias_torque", [4.0]), ("bias_torque", [-60.0]), ("sensor_lag", [0.002, np.inf]))
    ]
    ((_, kept),) = refits.finished(begun[:1])
    found = finishing.finished_if_near(refits, begun, {"bias_torque": kept})
    assert refits.won(kept) > 10.0 * POLICY.least_gain
    assert [name for name, _ in found] == ["bias_torque"] and refits.total(found[0][1]) < refits.total(kept) + 0.1


def test_forms_are_compared_at_the_end(pushed):
    """Of a supply that sags, the law by duty beside that by current, whichever was ahead after a few steps; each form
    once.
    """
    model = pushed.fit.model
    ways = [
        np.array([bridge, whole, np.inf, T_c, 14.0, 24.0])
        for bridge, whole, T_c in ((np.inf, 0.2, 0.1), (0.2, np.inf, 0.1), (0.3, np.inf, 0.1), (0.2, np.inf, np.inf))
    ]
    begins = [Begin(model.with_effect("supply_sag", p), {}) for p in ways]
    found = replace(pushed.fit, model=begins[0].model)
    assert [begin for _, begin in other_forms({"supply_sag": found, "gain": pushed.fit}, {"supply_sag": begins})] == [
        begins[1],
        begins[3],
    ]


def test_a_start_that_a_secant_made_too_small_is_no_end(pushed):
    """Of laws with few starts these count as they are as well, promised or not, of what happens once or takes long
    none; what is found does not hang on the secant's size.
    """
    small = {
        (name, 0): [Begin(pushed.fit.model.with_effect(name, np.array([1e-3])), {})]
        for name in ("bias_torque", "quadratic_drag")
    }
    names = ["bias_torque", "quadratic_drag", "position_dependent_friction", "load_disturbance", "presliding"]
    begun = more_starts(pushed.fit.model, names, ["bias_torque", "load_disturbance"], small)
    own = {name: BY_NAME[name].starts(pushed.fit.model.scales)[0][0] for name in ("bias_torque", "quadratic_drag")}
    assert [(name, dict(b.model.effects)[name][0]) for name, b in begun] == [
        ("bias_torque", 1e-3),
        ("bias_torque", own["bias_torque"]),
        ("quadratic_drag", own["quadratic_drag"]),
    ]


def test_the_kin_of_a_law_that_leads_is_refitted_though_its_secant_promises_nothing(monkeypatch):
    """A limit does nothing until it is passed; what sags does much of what it does, and leads."""
    traces = recorded([("current_limit", np.array([300.0, np.inf]))])
    start = started(traces)
    monkeypatch.setattr(
        race, "screen", lambda bench, *more, **settings: screen(bench.without(["current_limit"]), *more, **settings)
    )
    monkeypatch.setattr(overlooked, "more_starts", lambda *_: [])
    bench = bench_of(start.traces, only=("supply_sag", "current_limit"))
    assert candidates(bench, start.fit)[0].name == "current_limit"


def test_a_race_ends_when_enough_has_been_simulated():
    start = started(recorded([("input_delay", np.array([0.012]))], names=("multisine", "steps")))
    efforts, told = [], []
    for last in (np.inf, 0.0):
        budget = Budget(start.traces)
        base = replace(start.fit, model=replace(start.fit.model, effort=budget.effort))
        bench = Bench(start.traces, tau_of(base.misfit), budget=budget)
        told.append(candidates(bench, base, (), POLICY.least_gain, last))
        efforts.append(budget.spent)
    assert efforts[1] < 0.8 * efforts[0]
    assert told[1] and told[1][0].gain > 0.5 * told[0][0].gain > POLICY.least_gain  # what was begun is told


def test_a_stop_that_is_touched_once_is_no_knock(monkeypatch):
    """Only the steps reach it, and the rudder sticks there. Where its secant, taken from a stop too early, promises
    nothing, a knock explains as much.
    """
    values, traces, t = {**TRUTH, "c_2": 60.0}, [], T[::5]
    free = {
        name: ReducedModel(lumped(values)).simulate(t, INPUTS[name](t)).theta
        for name in ("multisine", "steps", "chirp")
    }
    upper = free["steps"].max() - 0.01
    for k, name in enumerate(free):
        u = INPUTS[name](t)
        y = ReducedModel(lumped(values), [("end_stop", np.array([-np.inf, upper, 60.0, 0.3]))]).simulate(t, u).measured
        traces.append(
            trace_of(from_arrays(t, u, y + 1e-4 * np.random.default_rng(k).standard_normal(t.size), name=name), None)
        )
    start = started(traces, values)

    def knocks(*arguments, **options):
        found = screen(*arguments, **options)
        return replace(found, promises={"load_disturbance": found.promises["load_disturbance"]})

    monkeypatch.setattr(race, "screen", knocks)
    ranked = candidates(Bench(start.traces, tau_of(start.fit.misfit)), start.fit, (), POLICY.least_gain)
    assert ranked[0].name == "end_stop" and dict(ranked[0].fit.model.effects)["end_stop"][1] == pytest.approx(
        upper, abs=1e-3
    )
    assert "load_disturbance" in [c.name for c in ranked]


def test_a_search_that_is_given_up_still_tells_the_cost_that_was_asked_for(pushed):
    far = replace(pushed.fit.model, values={**pushed.fit.model.values, "a_1": 2.5, "b": 7.0})
    left = fit(far, pushed.traces, tau=1.0, steps=1, ceiling=pushed.fit.misfit)
    assert float(np.exp(np.mean(np.log(left.misfit + 1.0)))) > 10.0  # it ended at a stage far above
    assert left.cost == pytest.approx(cost(left.misfit, 1.0))


def test_a_soft_knee_is_found_that_a_plain_clip_does_little_of(monkeypatch):
    """A drive that gives in long before its supply is told from the first as what it is: a clip does too little of it
    to be carried on.
    """
    knee = max(float(np.max(np.abs(INPUTS[name](T)))) for name in NAMES)
    traces = recorded([("voltage_saturation", np.array([knee, 6.0]))])
    start = started(traces)
    monkeypatch.setattr(finishing, "wider", lambda *_: [])
    found = candidates(bench_of(start.traces, only=["voltage_saturation"]), start.fit)[0]
    assert dict(found.fit.model.effects)["voltage_saturation"] == pytest.approx([knee, 6.0], rel=0.1)


def test_a_hinge_moment_that_grows_more_slowly_is_told_as_one():
    """Begun as a plain cubic; one that stays one gets no second number."""
    for truth in ([300.0, 0.5], [300.0, np.inf]):
        start = started(recorded([("hinge_moment_cubic", np.array(truth))]))
        found = candidates(bench_of(start.traces, only=["hinge_moment_cubic"]), start.fit)[0]
        assert dict(found.fit.model.effects)["hinge_moment_cubic"] == pytest.approx(truth, rel=0.1)


def test_a_drag_may_have_an_exponent_of_its_own():
    start = started(recorded([("quadratic_drag", np.array([1.0, 2.4]))]))
    found = candidates(bench_of(start.traces, only=["quadratic_drag"]), start.fit)[0]
    assert dict(found.fit.model.effects)["quadratic_drag"] == pytest.approx([1.0, 2.4], rel=0.1)
