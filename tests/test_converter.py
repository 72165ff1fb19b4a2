"""What a coarse converter tells beyond its rounding: when its thresholds were passed."""

from dataclasses import replace

import numpy as np
import pytest
from test_observer import TRUTH
from test_reduced import SCALES

from ers_mj.data.prepared import counted, trace_of
from ers_mj.data.quantisation import Converter
from ers_mj.data.recording import from_arrays
from ers_mj.decisions.thresholds import POLICY
from ers_mj.estimation import baseline
from ers_mj.estimation.baseline import Start, sharpened
from ers_mj.estimation.fit import fit
from ers_mj.estimation.initial_state import with_starts
from ers_mj.estimation.jacobian import step_of
from ers_mj.estimation.objective import residuals, run_of
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.selection.comparison import Candidate
from ers_mj.selection.finishing import is_within_a_step
from ers_mj.selection.whiteness import is_beyond_rounding
from ers_mj.servo.model import OBSERVER_RATE, Model

T = np.arange(0.0, 4.0, 1e-3)
STEP, NOISE = np.radians(0.5), 1e-4
OFF = 0.3 * STEP  # [rad] from the middle of the step in which it begins
FREE = ("a_2", "b", "c_2", "a_1", "c_1", "theta_0")


def recorded(effects=(), name="multisine", seed=0):
    """A recording behind a converter of half a degree, begun off the middle of a step."""
    truth = {**TRUTH, "theta_0": STEP * round(TRUTH["theta_0"] / STEP) + OFF}
    u = INPUTS[name](T)
    y = ReducedModel(lumped(truth), effects).simulate(T, u).theta + NOISE * np.random.default_rng(seed).standard_normal(
        T.size
    )
    return trace_of(from_arrays(T, u, STEP * np.round(y / STEP), name=name), None), truth


def test_only_a_step_that_is_coarse_for_the_travel_counts():
    trace, _ = recorded()
    travel = float(np.ptp(trace.y))
    assert counted([trace], travel)[0].converter == Converter(trace.quantum, trace.sigma)
    assert counted([trace], 301 * trace.quantum)[0].converter is None


def test_deviations_are_weighed_and_weighed_back():
    converter, x = Converter(STEP, STEP / np.sqrt(12)), np.linspace(-3 * STEP, 3 * STEP, 1001)
    e = converter.weighed(x)
    assert np.allclose(converter.plain(e) * converter.sigma, x)
    inside = np.abs(x) < 0.5 * STEP
    assert np.abs(e[inside]).max() < 0.2 and np.abs(e[np.abs(x) > 0.6 * STEP]).min() > 10.0
    smooth = np.abs(np.abs(0.5 * (x[1:] + x[:-1])) - 0.5 * STEP) > 0.01 * STEP
    assert np.allclose(
        (np.diff(e) / np.diff(x) * converter.sigma)[smooth], converter.slope(0.5 * (x[1:] + x[:-1]))[smooth]
    )


def test_the_noise_that_is_sure_is_that_of_noise_ahead():
    converter, random = Converter(STEP, STEP / np.sqrt(12)), np.random.default_rng(0)
    theta = STEP * random.random(200_000)
    read = STEP * np.round((theta + converter.ahead * random.standard_normal(theta.size)) / STEP)
    assert np.sqrt(np.mean(converter.beyond(read - theta) ** 2)) == pytest.approx(converter.sure_noise, rel=0.05)


def test_between_thresholds_the_way_is_known_and_at_a_turn_it_is_not():
    t = np.arange(0.0, 2.0, 1e-3)
    y = 20 * STEP * np.sin(np.pi * t)
    path = Converter(STEP, STEP / np.sqrt(12)).path(t, STEP * np.round(y / STEP))
    known = np.isfinite(path)
    assert 0.6 < known.mean() < 0.95
    assert np.abs(path - y)[known].max() < 0.2 * STEP and np.sqrt(np.mean((path - y)[known] ** 2)) < 0.04 * STEP
    assert not known[480:520].any()


def test_a_missing_sample_is_no_threshold():
    y = np.repeat(np.arange(10.0), 10)
    y[34:37] = np.nan
    path = Converter(1.0, 0.3).path(0.001 * np.arange(100), y)
    assert np.isnan(path[34:37]).all() and np.nanmax(np.abs(path - y)) <= 0.5


def test_the_first_thresholds_tell_where_within_a_step_it_began():
    trace, truth = recorded()
    (coarse,) = with_starts(model(truth), counted([trace], float(np.ptp(trace.y))))
    assert abs(trace.start[0] - truth["theta_0"]) == pytest.approx(OFF, rel=0.01)
    assert abs(coarse.start[0] - truth["theta_0"]) < 0.1 * STEP


@pytest.mark.parametrize("name", ["multisine", "square"])
def test_slopes_along_the_motion_are_those_of_the_thresholds(name):
    """Tangents against differences, where both look at the same samples."""
    trace, truth = recorded(name=name)
    traces = with_starts(model(truth), counted([trace], float(np.ptp(trace.y))))
    here = model({**truth, "b": 1.02 * truth["b"]})
    layout = here.layout()
    z, k = here.vector(layout), [f.name for f in layout].index("b")
    other, run = here.at(layout, z + step_of(here) * np.eye(z.size)[k]), run_of(here, traces, OBSERVER_RATE)
    tangent = -here.changes(traces, OBSERVER_RATE, [other], 1.0 / step_of(here), run.motions)[:, 0]
    secant = (residuals(other, traces, OBSERVER_RATE) - run.left) / step_of(here)
    assert np.corrcoef(tangent, secant)[0, 1] > 0.9 and 0.8 < np.std(tangent) / np.std(secant) < 1.25


def test_what_is_smaller_than_a_step_shows():
    """A gust that moves the rudder by a seventh of a step: hidden in the rounding, plain to the thresholds."""
    gust = [("periodic_gust", np.array([0.9, 1.8, 0.5, *[np.inf] * 4]))]
    trace, truth = recorded(gust)
    quiet, _ = recorded()
    with_it, without = (ReducedModel(lumped(truth), some).simulate(T, trace.u).theta for some in (gust, ()))
    assert np.std(with_it - without) < STEP / 7
    gains = []
    for traces in (counted([trace], float(np.ptp(trace.y))), [trace], counted([quiet], float(np.ptp(quiet.y)))):
        traces = with_starts(model(truth), traces)
        without = fit(model(truth), traces)
        gains.append(without.cost - fit(without.model.with_effect(*gust[0]), traces).cost)
    assert gains[0] > 6.0 and gains[0] > 4.0 * gains[1] and gains[2] < 1.0, gains


@pytest.mark.parametrize("torque, wrong", [(0.0, False), (8.0, True)])
def test_a_model_further_from_the_readings_than_their_rounding_is_wrong(torque, wrong):
    """Where no screening would tell, the sweep begins: not of a finer converter, nor beside what is simulated
    slowly.
    """
    trace, truth = recorded([("bias_torque", np.array([torque]))] if torque else ())
    coarse = counted([trace], float(np.ptp(trace.y)))
    found = fit(model(truth), with_starts(model(truth), coarse))
    assert is_beyond_rounding(found.model, coarse) is wrong and not is_beyond_rounding(found.model, [trace])
    bristle = found.model.with_effect("presliding", np.array([1e-3, 0.2, *4 * [np.inf]]))
    assert not is_beyond_rounding(bristle, coarse)


def test_a_baseline_that_is_far_is_not_led_astray():
    """The thresholds sharpen a fit that found its valley without them."""
    trace, truth = recorded()
    start = Start(fit(model({**truth, "b": 1.2 * truth["b"], "c_2": 0.8 * truth["c_2"]}), [trace]), [trace])
    travel = float(np.ptp(trace.y))
    sharp = sharpened(start, travel)
    assert sharpened(start, 301 * trace.quantum).fit is start.fit
    assert (
        abs(sharp.fit.model.values["b"] / truth["b"] - 1.0) < 0.01
        and abs(sharp.fit.model.values["c_2"] / truth["c_2"] - 1.0) < 0.02
    )
    assert np.mean(sharp.fit.misfit) < 1.5


def test_a_baseline_that_rests_in_a_dent_is_tried_with_other_inertias(monkeypatch):
    trace, truth = recorded()
    heavy = {**truth, **{name: 0.68 * truth[name] for name in FREE if name != "theta_0"}}

    def rests(model, traces, **settings):
        return fit(model, traces, **settings | ({"steps": 0} if model.values["b"] == pytest.approx(heavy["b"]) else {}))

    monkeypatch.setattr(baseline, "fit", rests)
    start = Start(rests(model(heavy), [trace]), [trace])
    assert abs(sharpened(start, float(np.ptp(trace.y))).fit.model.values["b"] / truth["b"] - 1.0) < 0.01
    monkeypatch.setattr(baseline, "INERTIAS", ())
    assert sharpened(start, float(np.ptp(trace.y))).fit.model.values["b"] == pytest.approx(heavy["b"])


def model(values):
    return Model(values, FREE, scales=replace(SCALES, recordings=1))


@pytest.mark.parametrize("torque, within", [(0.02, True), (20.0, False)])
def test_what_moves_the_reading_by_less_than_half_a_coarse_step_is_nothing_to_name(torque, within):
    """Of a finer converter, which is not counted, the smallest torque stays a candidate."""
    fine, truth = recorded()
    coarse = counted([fine], float(np.ptp(fine.y)))
    model = Model({**truth, "tau_e": 0.0, "emf_share": 0.0, "ampere": 1.0}, FREE, scales=SCALES).with_effect(
        "bias_torque", np.array([torque])
    )
    candidate = Candidate("bias_torque", replace(fit(model, coarse, steps=1), model=model), 10.0, 3.0, 0.0, 1.0)
    assert is_within_a_step(candidate, coarse, POLICY) is within and not is_within_a_step(candidate, [fine], POLICY)
    # many thresholds tell together what is much smaller than a step
    assert not is_within_a_step(replace(candidate, gain=90.0), coarse, POLICY)
