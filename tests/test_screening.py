"""What the secants promise, and from where a refit begins."""

from dataclasses import replace

import numpy as np
import pytest
from servo import TRUTH, T, bench_of, recorded, started

from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.decisions.explained import score, stands_out
from ers_mj.effects import BY_NAME
from ers_mj.estimation.baseline import baseline
from ers_mj.estimation.objective import Run, residuals, residuals_in, run_of
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.selection import screening, secants
from ers_mj.selection.impulse_search import NEARING, Surroundings, between, brought_nearer
from ers_mj.selection.screening import Screened, hot_spans, screen
from ers_mj.selection.search import SEARCH
from ers_mj.selection.secants import first_order, hopeful, promise, view_of
from ers_mj.servo.datasheet import read_datasheet


def seen_from(model, traces):
    """What a model shows of the traces."""
    return view_of(run_of(model, traces, 5.0), traces, 1.0)[0]


def test_a_place_far_from_the_data_takes_no_candidate_from_one_near_it(pushed):
    near, far = pushed.fit.model, replace(pushed.fit.model, values={**pushed.fit.model.values, "b": 60.0})
    alone, both = (screen(bench_of(pushed.traces), places, False, False) for places in ([near], [near, far]))
    assert "bias_torque" in alone.promising() and set(alone.promising()) <= set(both.promising())
    best = [name for name in both.promising() if both.promises[name] >= 0.5 * max(both.promises.values())]
    assert "bias_torque" in best and all(len(both.begins[name]) == 2 for name in best if not BY_NAME[name].dear)


def test_where_much_is_missing_what_promises_least_is_not_screened_from_every_place(pushed):
    near, far = pushed.fit.model, replace(pushed.fit.model, values={**pushed.fit.model.values, "b": 60.0})
    alone, both = (screen(bench_of(pushed.traces), places, True, False) for places in ([near], [near, far]))
    bar = SEARCH.less * max(alone.promises.values())
    again = {name: len(both.begins[name]) for name in alone.begins if not (BY_NAME[name].dear or BY_NAME[name].once)}
    assert all(count == 1 for name, count in again.items() if alone.promises[name] < bar) and set(again.values()) == {
        1,
        2,
    }
    assert all(again[name] == 2 for name in again if alone.promises[name] >= 0.5 * max(alone.promises.values()))


def test_a_small_wave_is_promised_by_a_large_start():
    """Cogging of 1 % of the friction: a start that is 30 times as large throws the rudder elsewhere, and tells only how
    small to try again.
    """
    cog, traces = np.array([1.0, 2 * np.pi / 267, 1.3, np.inf, np.inf]), []
    for k, name in enumerate(("multisine", "ramp")):
        y = ReducedModel(lumped(TRUTH), [("cogging", cog)]).simulate(T, INPUTS[name](T)).measured
        traces.append(
            trace_of(
                from_arrays(T, INPUTS[name](T), y + 1e-4 * np.random.default_rng(k).standard_normal(T.size), name=name),
                None,
            )
        )
    start = started(traces)
    view = seen_from(start.fit.model, start.traces)
    share, model = promise(view, BY_NAME["cogging"], np.array([30.0, cog[1], 0.0, np.inf, np.inf]), 1.0)
    A, _, phase = dict(model.effects)["cogging"][:3]
    assert share > 0.3 and abs(A * np.exp(1j * phase) - np.exp(1.3j)) < 0.3


def test_a_tangent_that_runs_away_promises_nothing(pushed, monkeypatch):
    """Beside a stiff bristle a law's tangent may leave all bounds: the start is passed over, and the other ones are
    compared.
    """
    model, effect = pushed.fit.model, BY_NAME["load_dependent_friction"]
    view, changes = seen_from(model, pushed.traces), type(model).changes
    starts = [size * effect.starts(model.scales)[0] for size in (1.0, 1.1, 1.2, 1.3, 1.4)]
    assert len(first_order(view, effect, starts)) == 5
    for lost, size in ((0, np.inf), (0, np.nan), (2, 1e200)):
        astray = np.where(np.arange(len(starts)) == lost, size, 0.0)
        monkeypatch.setattr(type(model), "changes", lambda *a, astray=astray: changes(*a) + astray)
        told = first_order(view, effect, starts)
        shares = [share for share, _ in told]
        assert shares[lost] == 0.0 < np.min(np.delete(shares, lost))
        assert len(some := hopeful(effect, starts, told, 3)) == 3
        assert all(start is not starts[lost] for start, _ in some)


def test_the_first_order_tells_the_size_at_which_a_secant_is_taken(pushed, monkeypatch):
    """A drag of 20 times what acts, or half of it, is simulated once, at nearly the size that acts."""
    effect, tried = BY_NAME["quadratic_drag"], []
    acts = np.append(0.5, np.full(len(effect.parameters) - 1, np.inf))
    model, traces = (
        replace(pushed.fit.model, values={**pushed.fit.model.values, **TRUTH}),
        recorded([("quadratic_drag", acts)]),
    )
    view = seen_from(model, traces)
    monkeypatch.setattr(
        secants, "residuals", lambda m, *a: tried.append(dict(m.effects)["quadratic_drag"][0]) or residuals(m, *a)
    )
    for times in (0.5, 1.0, 20.0):
        start = np.append(times * acts[0], acts[1:])
        ((share, size),) = first_order(view, effect, [start])
        promised, found = promise(view, effect, start, size)
        assert share > 0.3 and promised > 0.3 and 0.5 < dict(found.effects)["quadratic_drag"][0] / acts[0] < 2.0
    assert len(tried) == 3 and np.ptp(tried) < 0.05 * np.mean(tried)


def test_waves_are_told_apart_by_half_the_samples(pushed):
    """The shares of gusts from samples 2 ms apart are those from all, 1 ms apart."""
    gust, effect = (
        ("periodic_gust", np.array([8.0, 3.1, 0.4, np.inf, np.inf, np.inf, np.inf])),
        BY_NAME["periodic_gust"],
    )
    traces = recorded([("periodic_gust", np.append(gust[1][:3], np.full(len(effect.parameters) - 3, np.inf)))])
    model = replace(pushed.fit.model, values={**pushed.fit.model.values, **TRUTH})
    whole = seen_from(model, traces)
    sparse, starts = whole.sparse(), effect.starts(model.scales)
    assert traces[0].sample_time < 0.0015 < 0.0019 < sparse.traces[0].sample_time
    all_told, told = ([share for share, _ in first_order(some, effect, starts)] for some in (whole, sparse))
    assert np.argmax(told) == np.argmax(all_told) and np.max(np.abs(np.subtract(told, all_told))) < 0.1 * max(all_told)


def test_what_promises_next_to_nothing_to_first_order_is_not_simulated(pushed, monkeypatch):
    """Beside a bias of the torque neither a slow sensor nor a dead zone is, and what is follows from the best
    starts.
    """
    tried = []
    monkeypatch.setattr(
        screening, "promise", lambda view, effect, *a: tried.append(effect.name) or promise(view, effect, *a)
    )
    found = screen(bench_of(pushed.traces), [pushed.fit.model], False, False)
    assert "bias_torque" in tried and "bias_torque" in found.promising()
    assert (
        not {"sensor_lag", "drive_dead_zone"} & {*tried}
        and found.promises["sensor_lag"] < 0.1 * found.promises["bias_torque"]
    )


def test_a_promise_that_failed_is_no_measure_for_the_others():
    promises = {
        "load_disturbance": 3.0,
        "load_dependent_friction": 0.97,
        "cogging": 0.4,
        "input_delay": 0.18,
        "gravity": 0.02,
    }
    found = Screened(promises, dict.fromkeys(promises, ()), 0.0, 4)
    assert found.promising() == ["load_disturbance", "load_dependent_friction", "cogging"]
    assert found.promising({"load_dependent_friction"}) == [
        "load_disturbance",
        "load_dependent_friction",
        "cogging",
        "input_delay",
    ]


def test_beside_a_shaft_the_starts_of_a_wave_are_chosen_along_the_motion_of_one_body(pushed):
    """A cog of a motor that a shaft of 20 Hz parts from the rudder: the start of the nearest period is among the few
    that are simulated.
    """
    period, shaft = 0.03, ("shaft_compliance", np.array([20.0, 0.1, 0.5, 0.2, np.inf]))
    traces = recorded([shaft, ("cogging", np.array([12.0, period, 0.4, np.inf, np.inf]))])
    model = replace(pushed.fit.model, values={**pushed.fit.model.values, **TRUTH}).with_effect(*shaft)
    view, effect = seen_from(model, traces), BY_NAME["cogging"]
    starts = effect.starts(model.scales)
    told = first_order(view.sparse(), effect, starts)
    chosen = [start[1] for start, _ in hopeful(effect, starts, told, 3)]
    assert len(chosen) == 3 and min((start[1] for start in starts), key=lambda p: abs(1.0 / p - 1.0 / period)) in chosen


def test_one_block_stands_out_among_bad_ones():
    misfit = np.concatenate([np.ones(150), np.full(50, 30.0)])
    assert (
        not stands_out(misfit, 1.0)
        and not stands_out(np.append(misfit, 500.0), 1.0)
        and stands_out(np.append(misfit, 1000.0), 1.0)
    )


def test_a_knock_on_a_resting_rudder_is_found_where_it_acts(pushed):
    u = np.where(T < 1.0, INPUTS["multisine"](T), 0.0)
    knock = np.array([-300.0, 2.24, 0.08, 0.0, np.inf])
    y = ReducedModel(lumped(TRUTH), [("load_disturbance", knock)]).simulate(T, u).measured
    still = trace_of(
        from_arrays(T, u, y + 1.5e-4 * np.random.default_rng(9).standard_normal(T.size), name="still"), None
    )
    model = replace(
        pushed.fit.model,
        values={**pushed.fit.model.values, **TRUTH},
        scales=replace(pushed.fit.model.scales, recordings=1),
    )
    (begins,) = screen(bench_of([still], only=["load_disturbance"]), [model], False, True).begins["load_disturbance"]
    size, begin, length, record, fade = dict(begins[0].model.effects)["load_disturbance"]
    assert (
        size == pytest.approx(-300.0, rel=0.3)
        and begin == pytest.approx(2.24, abs=0.02)
        and length == pytest.approx(0.08, rel=0.3)
        and record == 0
    )


@pytest.mark.parametrize("size, fade", [(-300.0, 0.1), (-600.0, 0.05)])
def test_a_knock_that_fades_is_found_where_it_throws_a_resting_rudder(pushed, size, fade):
    """Any other push leaves much of it: less throws the rudder not at all, and what ends leaves it elsewhere."""
    u = np.where(T < 1.0, INPUTS["multisine"](T), 0.0)
    knock = np.array([size, 2.24, np.inf, 0.0, fade])
    y = ReducedModel(lumped(TRUTH), [("load_disturbance", knock)]).simulate(T, u).measured
    still = trace_of(
        from_arrays(T, u, y + 1.5e-4 * np.random.default_rng(9).standard_normal(T.size), name="still"), None
    )
    model = replace(
        pushed.fit.model,
        values={**pushed.fit.model.values, **TRUTH},
        scales=replace(pushed.fit.model.scales, recordings=1),
    )
    (begins,) = screen(bench_of([still], only=["load_disturbance"]), [model], False, True).begins["load_disturbance"]
    found = [dict(begin.model.effects)["load_disturbance"] for begin in begins]
    fading = next(p for p in found if np.isfinite(p[4]))
    assert (
        fading[0] == pytest.approx(size, rel=0.3)
        and fading[1] == pytest.approx(2.24, abs=0.02)
        and fading[4] == pytest.approx(fade, rel=0.3)
    )


def test_a_knock_is_tried_in_its_surroundings(pushed):
    """What begins in the run's own state gains there what it gains in all of the recording; beside a memory all of it
    is simulated.
    """
    run, trace = run_of(pushed.fit.model, pushed.traces, 5.0), pushed.traces[1]
    near = Surroundings(run, pushed.traces, 1.0)
    for moment in (0.02, 1.4, 2.95):
        gains = []
        knocked = run.model.with_effect("load_disturbance", np.array([300.0, moment, 0.08, 1.0, np.inf]))
        part, (level, without), *_ = near.of(1, moment)
        assert level == 1.0
        for some in (part, trace):
            before, after = (
                float(np.sum(score(near.misfit(some, residuals_in(model, some, 1, 5.0)), 1.0)))
                for model in (run.model, knocked)
            )
            assert some is trace or before == pytest.approx(without, abs=1e-9)
            gains.append(before - after)
        assert gains[0] == pytest.approx(gains[1], rel=0.02, abs=0.02) and abs(gains[0]) > 0.5
    assert near.of(1, 2.95)[0].t.size < 0.25 * trace.t.size and near.of(1, 0.02)[0].t.size < trace.t.size
    warm = run.model.with_effect("thermal_drift", BY_NAME["thermal_drift"].starts(run.model.scales)[0])
    assert Surroundings(run_of(warm, pushed.traces, 5.0), pushed.traces, 1.0).of(1, 1.4)[0] is trace


def test_a_knock_is_sought_on_to_where_it_throws_the_rudder():
    """A shaft twists under less, which gains a little; what moves the rudder lies in a window of a sixth above its
    friction.
    """

    def gain(push):
        return 0.05 if push[0] < 60.0 else 9.0 if push[0] < 70.0 else -14.0

    pushes = [(gain([size]), np.array([size, 0.8, 0.1, 0.0])) for size in (3.0, 11.0, 33.0, 110.0)]
    tried = between(gain, pushes)
    assert max(won for won, _ in tried) == 9.0 and all(33.0 < push[0] < 110.0 for _, push in tried)
    assert not between(gain, pushes[:3]) and not between(gain, pushes[3:])


def test_a_knock_is_brought_nearer_within_its_bounds_and_no_longer_than_it_pays():
    """One that gains the more, the faster it fades, which has a least time; and one that gains nothing anywhere."""
    effect, tried = BY_NAME["load_disturbance"], []
    start = np.array([10.0, 0.8, np.inf, 0.0, 0.05])

    def gain(push):
        tried.append(push[4])
        return 1.0 / push[4]

    fade = effect.parameters[4]
    assert (
        brought_nearer(gain, effect, start)[4] == fade.lower and fade.lower <= min(tried) and max(tried) <= fade.upper
    )
    tried.clear()
    brought_nearer(lambda push: tried.append(push[4]) or 0.0, effect, start)
    assert len(tried) < NEARING.simulations / 4


def test_knocks_are_looked_for_where_a_recording_leaves_enough(pushed):
    noise = 0.9 * np.random.default_rng(1).standard_normal(sum(t.rows for t in pushed.traces))

    def hot():
        return {(record, begin) for record, begin, _ in hot_spans(run, bench_of(pushed.traces))}

    run, struck = Run(pushed.fit.model, noise, ()), noise[pushed.traces[0].rows + 1000 :][:60]
    assert hot() == set()
    struck += 10.0
    assert hot() == set()  # half of what an impulse must buy is more than that
    struck += 10.0
    assert (1, 1.0) in hot() and {record for record, _ in hot()} == {1}


def test_what_a_parameter_at_its_bound_cannot_follow_is_left_to_an_effect():
    """A winding of three times the datasheet's time constant: the baseline's own may rise to twice that."""
    traces, t = [], T[::4]
    for k, name in enumerate(("multisine", "steps", "chirp")):
        u = INPUTS[name](t)
        y = (
            ReducedModel(lumped({**TRUTH, "tau_e": 1.1e-3}), [("inductance", np.array([2.0e-3, np.inf]))])
            .simulate(t, u)
            .measured
        )
        traces.append(
            trace_of(from_arrays(t, u, y + 1.5e-4 * np.random.default_rng(k).standard_normal(t.size), name=name), None)
        )
    start = baseline(traces, read_datasheet("table1"), True, 1)
    model = start.fit.model
    assert [f.name for f in model.layout() if model.at_bound(f)] == ["tau_e"]
    promises = screen(bench_of(start.traces), [model], True, False).promises
    assert max(promises, key=promises.get) == "inductance"
