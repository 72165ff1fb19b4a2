"""What held-out data confirms, and what few samples, a converter or any remainder would show."""

import math
from dataclasses import replace

import numpy as np
import pytest
from servo import NAMES, NOISE, SPARSE, having, recorded, started, trace

from ers_mj.effects import BY_NAME
from ers_mj.estimation.baseline import Start
from ers_mj.estimation.fit import fit
from ers_mj.estimation.scales import free_in
from ers_mj.selection.confirmation import confirmed, delta_bic, is_a_converters, is_any_wave, may_be_none
from ers_mj.selection.cross_validation import Score, folds, halves, scored
from ers_mj.selection.stepwise import Selection


def chosen(start: Start, name, p, is_fitted=True) -> Selection:
    """A selection that has named one effect."""
    found = having(start.fit, name, p)
    found = fit(found.model, start.traces) if is_fitted else found
    return Selection(start.fit, found, (), 1.0, start.traces)


@pytest.fixture(scope="module")
def hardening():
    """A servo whose spring hardens, as one wide recording of three shows."""
    laws = [("hinge_moment_cubic", np.array([20.0, np.inf]))]
    calm = [trace(name, laws, gain=0.35, seed=k, t=SPARSE) for k, name in enumerate(("multisine", "chirp"))]
    return started([*calm, trace("multisine", laws, seed=2, t=SPARSE)])


def test_an_effect_that_one_recording_shows_is_judged_within_it(hardening):
    named = chosen(hardening, "hinge_moment_cubic", [20.0, np.inf])
    selection, told = confirmed(hardening, named, [], 1)
    assert selection is named and told.p["hinge_moment_cubic"] < 0.05
    assert "multisine, which teaches most of an effect, by halves as well" in told.sentence
    assert len(told.shown) == len(told.parts) + 1  # of which one in two halves


def test_what_held_out_data_does_not_confirm_is_taken_out_and_told(plain):
    named = chosen(plain, "quadratic_drag", [0.01, np.inf])
    selection, told = confirmed(plain, named, [], 1)
    assert selection.chosen is plain.fit and not told.p
    (move,) = selection.trail
    assert (move.kind, move.before, move.after, move.accepted) == ("drop", ("quadratic_drag",), (), True)
    assert "held-out" in move.because


def test_an_effect_is_judged_on_recordings_of_another_day():
    """A torque of 3 rad/s^2 that the held-out recording has, too, and one that it has not."""
    start = started(recorded([("bias_torque", np.array([3.0]))], names=NAMES[:2], t=SPARSE))
    named = chosen(start, "bias_torque", [3.0])
    for laws, kept in (([("bias_torque", np.array([3.0]))], True), ((), False)):
        selection, told = confirmed(start, named, [trace("chirp", laws, seed=5, t=SPARSE)], 1)
        assert bool(selection.chosen.model.names) is kept and told.parts[0].training is None


def test_what_a_refit_alone_buys_is_not_counted_for_an_effect(plain):
    """A baseline that rests far from its optimum: the answer's own parameters without the effect are the better one."""
    far = replace(plain.fit.model, values={**plain.fit.model.values, "b": 0.7 * plain.fit.model.values["b"]})
    poor = replace(plain, fit=replace(plain.fit, model=far))
    selection, told = confirmed(poor, chosen(plain, "quadratic_drag", [0.01, np.inf]), [], 1)
    assert not selection.chosen.model.names  # all of what it seemed to explain was the refit's
    left = [scored(fit.model, plain.traces[0]).rmse for fit in (told.base, poor.fit)]
    assert left[0] < 0.5 * left[1]


def test_what_holds_the_output_is_judged_against_the_spring_whose_place_it_took(plain):
    """Gravity in the place of a preloaded spring, beside gains that differ: taken out, it leaves the spring."""
    spring = plain.fit.model
    values = {**spring.values, "a_1": 0.0, "c_1": 0.0}
    bare = replace(plain.fit, model=replace(spring, values=values, free=free_in(values, plain.traces)))
    hung = having(bare, "gravity_imbalance", [spring.values["a_1"], 0.0])
    hung = fit(hung.model.with_state("gain", len(plain.traces)), plain.traces)
    selection, _ = confirmed(plain, Selection(plain.fit, hung, (), 1.0, plain.traces), [], 1)
    assert "gravity_imbalance" not in selection.chosen.model.names
    assert selection.chosen.model.values["a_1"] == pytest.approx(spring.values["a_1"], rel=0.1)


def test_folds_and_halves_leave_out_what_is_judged(plain):
    traces = plain.traces
    first, second = halves(traces, 2)
    assert first.known == second.known == [0, 1, 2] and first.held_out.t[-1] < second.held_out.t[0]
    assert [fold.known for fold in folds(traces, [])[0]] == [[1, 2], [0, 2], [0, 1]]


def test_what_a_coarse_converter_rounds_off_is_no_sensors_error(plain):
    """A wave of less than half a step along the travel is the converter's, where it makes the noise; a larger one is
    not, nor any beside a finer converter.
    """
    step = 0.016
    coarse, fine = ([trace("multisine", sensor=lambda y, s=s: s * np.round(y / s))] for s in (step, NOISE))
    small, large = (
        having(plain.fit, "sensor_nonlinearity", [np.inf, np.inf, size * step, 0.043, 0.3]).model for size in (0.3, 0.8)
    )
    assert is_a_converters("sensor_nonlinearity", small, coarse)
    assert not is_a_converters("sensor_nonlinearity", large, coarse)
    assert not is_a_converters("sensor_nonlinearity", small, fine)
    assert not is_a_converters("bias_torque", having(plain.fit, "bias_torque").model, coarse)


@pytest.mark.parametrize(
    "begun, struck, none",
    [
        (2.9, False, True),
        (-0.28, True, True),
        (0.03, True, True),
        (1.0, False, False),
        (1.0, True, False),
        (2.6, True, False),
    ],
)
def test_an_impulse_at_an_edge_whose_torque_may_as_well_be_none_is_taken_out(plain, begun, struck, none):
    """Of a recording where few samples bear it, or while its start is read; within one the interval of what moves a
    rudder that sticks tells little.
    """
    impulse = np.array([40.0, begun, 0.3, 1.0, np.inf])
    start = plain
    if struck:
        first, _, last = recorded()
        start = started([first, trace("steps", [("load_disturbance", impulse)], seed=1), last])
    model = chosen(start, "load_disturbance", impulse).chosen.model
    assert may_be_none("load_disturbance", model, start.traces, 1.0) == none
    assert not may_be_none("bias_torque", having(plain.fit, "bias_torque").model, start.traces, 1.0)


def test_a_wave_of_many_that_does_not_pay_for_its_numbers_is_any_wave(plain):
    """Three numbers among a hundred blocks cost 6.9 of C; a limit, or a bent sensor's wave of few periods, is judged by
    its p-value alone.
    """
    model = plain.fit.model
    names = ("cogging", "transmission_ripple", "periodic_gust", "sensor_nonlinearity", "voltage_saturation")
    for name in names:
        model = model.with_effect(name, BY_NAME[name].starts(model.scales)[-1])
    left, little, much = (Score(1.0, 1, np.full(100, math.expm1(c / 100) + 0.5)) for c in (20.0, 14.0, 8.0))
    for name in names:
        found = [is_any_wave(name, model, after, left) for after in (little, much)]
        assert found == [name in names[:3], False]
        assert delta_bic(name, model, much, left) > delta_bic(name, model, little, left)
