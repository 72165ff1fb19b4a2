"""Which effects are refitted, and from where."""

from dataclasses import replace

import numpy as np
import pytest
from servo import NAMES, NOISE, TRUTH, T, all_but, bench_of

from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.effects import BY_NAME
from ers_mj.estimation.baseline import baseline
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.selection import screening
from ers_mj.selection.budget import SEARCH
from ers_mj.selection.screening import Screened, screen
from ers_mj.selection.secants import promise
from ers_mj.servo.datasheet import read_datasheet

SOME = all_but(
    *("bias_torque", "quadratic_drag", "asymmetric_friction", "stribeck", "hinge_moment_cubic", "gravity_imbalance"),
    *("sensor_lag", "drive_dead_zone", "input_delay", "load_dependent_friction", "sensor_nonlinearity"),
)


@pytest.fixture(scope="module")
def places(pushed):
    """A place near the data and one far from it."""
    near = pushed.fit.model
    return near, replace(near, values={**near.values, "b": 60.0})


def test_a_place_far_from_the_data_takes_no_candidate_from_one_near_it(pushed, places):
    bench = bench_of(pushed, exclude=SOME)
    alone, both = (screen(bench, some, False, False) for some in (places[:1], places))
    assert "bias_torque" in alone.promising() and set(alone.promising()) <= set(both.promising())
    best = [name for name in both.promising() if both.promises[name] >= 0.5 * max(both.promises.values())]
    assert "bias_torque" in best and all(len(both.begins[name]) == 2 for name in best if not BY_NAME[name].dear)


def test_where_much_is_missing_what_promises_least_is_not_screened_from_every_place(pushed, places):
    bench = bench_of(pushed, exclude=SOME)
    alone, both = (screen(bench, some, True, False) for some in (places[:1], places))
    bar = SEARCH.less * max(alone.promises.values())
    again = {name: len(both.begins[name]) for name in alone.begins if not (BY_NAME[name].dear or BY_NAME[name].once)}
    assert set(again.values()) == {1, 2}
    assert all(count == 1 for name, count in again.items() if alone.promises[name] < bar)
    assert all(again[name] == 2 for name in again if alone.promises[name] >= 0.5 * max(alone.promises.values()))


def test_what_promises_next_to_nothing_to_first_order_is_not_simulated(pushed, monkeypatch):
    """Beside a bias of the torque neither a slow sensor nor a dead zone is, and what is follows from the best
    starts.
    """
    tried = []
    monkeypatch.setattr(
        screening, "promise", lambda view, effect, *a: tried.append(effect.name) or promise(view, effect, *a)
    )
    found = screen(bench_of(pushed, exclude=SOME), [pushed.fit.model], False, False)
    assert "bias_torque" in tried and "bias_torque" in found.promising()
    assert not {"sensor_lag", "drive_dead_zone"} & {*tried}
    assert found.promises["sensor_lag"] < 0.1 * found.promises["bias_torque"]


def test_a_promise_that_failed_is_no_measure_for_the_others():
    promises = {
        "load_disturbance": 3.0,
        "load_dependent_friction": 0.97,
        "cogging": 0.4,
        "input_delay": 0.18,
        "gravity": 0.02,
    }
    found = Screened(promises, dict.fromkeys(promises, ()), 0.0, 4)
    first = ["load_disturbance", "load_dependent_friction", "cogging"]
    assert found.promising() == first
    assert found.promising({"load_dependent_friction"}) == [*first, "input_delay"]


def test_what_a_parameter_at_its_bound_cannot_follow_is_left_to_an_effect():
    """A winding of three times the datasheet's time constant: the baseline's own may rise to twice that."""
    traces, t = [], T[::4]
    plant = ReducedModel(lumped({**TRUTH, "tau_e": 1.1e-3}), [("inductance", np.array([2.0e-3, np.inf]))])
    for k, name in enumerate(NAMES):
        u = INPUTS[name](t)
        y = plant.simulate(t, u).measured + NOISE * np.random.default_rng(k).standard_normal(t.size)
        traces.append(trace_of(from_arrays(t, u, y, name=name), None))
    start = baseline(traces, read_datasheet("table1"), True, 1)
    model = start.fit.model
    assert [f.name for f in model.layout() if model.at_bound(f)] == ["tau_e"]
    promises = screen(bench_of(start), [model], True, False).promises
    assert max(promises, key=promises.get) == "inductance"
