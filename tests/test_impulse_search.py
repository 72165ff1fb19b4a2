"""An impulse is found where it acts, in its surroundings, and brought nearer."""

from dataclasses import replace

import numpy as np
import pytest
from servo import NOISE, TRUTH, T, all_but, bench_of, having

from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.decisions.explained import score
from ers_mj.effects import BY_NAME
from ers_mj.estimation.objective import residuals_in, run_of
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.selection.impulse_search import NEARING, Surroundings, between, brought_nearer
from ers_mj.selection.screening import hot_spans, screen

IMPULSE = BY_NAME["load_disturbance"]


@pytest.mark.parametrize("size, width, fade", [(-300.0, 0.08, np.inf), (-300.0, np.inf, 0.1), (-600.0, np.inf, 0.05)])
def test_an_impulse_on_a_resting_rudder_is_found_where_it_acts(pushed, size, width, fade):
    """It ends, or fades. Any other push leaves much of it: less throws the rudder not at all."""
    u = np.where(T < 1.0, INPUTS["multisine"](T), 0.0)
    impulse = np.array([size, 2.24, width, 0.0, fade])
    y = ReducedModel(lumped(TRUTH), [("load_disturbance", impulse)]).simulate(T, u).measured
    y += NOISE * np.random.default_rng(9).standard_normal(T.size)
    model = pushed.fit.model
    model = replace(model, values={**model.values, **TRUTH}, scales=replace(model.scales, recordings=1))
    bench = replace(
        bench_of(pushed, exclude=all_but("load_disturbance")),
        traces=[trace_of(from_arrays(T, u, y, name="still"), None)],
    )
    (begins,) = screen(bench, [model], False, True).begins["load_disturbance"]
    found = [dict(begin.model.effects)["load_disturbance"] for begin in begins]
    best = next(p for p in found if np.isfinite(p[4]) == np.isfinite(fade))
    assert best[0] == pytest.approx(size, rel=0.3) and best[1] == pytest.approx(2.24, abs=0.02) and best[3] == 0
    assert np.fmin(best[2], best[4]) == pytest.approx(np.fmin(width, fade), rel=0.3)


def test_an_impulse_is_tried_in_its_surroundings(pushed):
    """What begins in the run's own state gains there what it gains in all of the recording; beside a memory all of it
    is simulated.
    """
    run, trace = run_of(pushed.fit.model, pushed.traces, 5.0), pushed.traces[1]
    near = Surroundings(run, pushed.traces, 1.0)
    for moment in (0.02, 1.4, 2.95):
        gains = []
        struck = run.model.with_effect("load_disturbance", np.array([300.0, moment, 0.08, 1.0, np.inf]))
        part, (level, without), *_ = near.of(1, moment)
        assert level == 1.0
        for some in (part, trace):
            before, after = (
                float(np.sum(score(near.misfit(some, residuals_in(model, some, 1, 5.0)), 1.0)))
                for model in (run.model, struck)
            )
            assert some is trace or before == pytest.approx(without, abs=1e-9)
            gains.append(before - after)
        assert gains[0] == pytest.approx(gains[1], rel=0.02, abs=0.02) and abs(gains[0]) > 0.5
    assert near.of(1, 2.95)[0].t.size < 0.25 * trace.t.size and near.of(1, 0.02)[0].t.size < trace.t.size
    warm = having(pushed.fit, "thermal_drift").model
    assert Surroundings(run_of(warm, pushed.traces, 5.0), pushed.traces, 1.0).of(1, 1.4)[0] is trace


def test_an_impulse_is_sought_on_to_where_it_throws_the_rudder():
    """A shaft twists under less, which gains a little; what moves the rudder lies in a window of a sixth above its
    friction.
    """

    def gain(push):
        return 0.05 if push[0] < 60.0 else 9.0 if push[0] < 70.0 else -14.0

    pushes = [(gain([size]), np.array([size, 0.8, 0.1, 0.0])) for size in (3.0, 11.0, 33.0, 110.0)]
    tried = between(gain, pushes)
    assert max(won for won, _ in tried) == 9.0 and all(33.0 < push[0] < 110.0 for _, push in tried)
    assert not between(gain, pushes[:3]) and not between(gain, pushes[3:])


def test_an_impulse_is_brought_nearer_within_its_bounds_and_no_longer_than_it_pays():
    """One that gains the more, the faster it fades, which has a least time; and one that gains nothing anywhere."""
    tried, start, fade = [], np.array([10.0, 0.8, np.inf, 0.0, 0.05]), IMPULSE.parameters[4]

    def gain(push):
        tried.append(push[4])
        return 1.0 / push[4]

    assert brought_nearer(gain, IMPULSE, start)[4] == fade.lower <= min(tried) and max(tried) <= fade.upper
    tried.clear()
    brought_nearer(lambda push: tried.append(push[4]) or 0.0, IMPULSE, start)
    assert len(tried) < NEARING.simulations / 4


def test_impulses_are_looked_for_where_a_recording_leaves_enough(pushed):
    bench = bench_of(pushed)
    run = run_of(pushed.fit.model, pushed.traces, 5.0)
    noise = 0.9 * np.random.default_rng(1).standard_normal(run.left.size)
    assert hot_spans(replace(run, left=noise), bench) == ()
    noise[pushed.traces[0].rows + 1000 :][:60] += 20.0
    spans = {(record, begin) for record, begin, _ in hot_spans(replace(run, left=noise), bench)}
    assert (1, 1.0) in spans and {record for record, _ in spans} == {1}
