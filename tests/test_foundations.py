"""What a diagnosis stands on before anything is missed: what holds the output, the sense of the input, the loads of the
recordings, the back-EMF's share; and the laws of friction that hang on these.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from servo import SPARSE, TRUTH, recorded, started

from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.door.simulating import simulate
from ers_mj.effects import BY_NAME
from ers_mj.estimation.baseline import Start, baseline, unsprung
from ers_mj.estimation.fit import fit
from ers_mj.estimation.initial_guess import guesses
from ers_mj.estimation.objective import run_of, tau_of
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.selection.bench import Bench
from ers_mj.selection.cross_validation import scored
from ers_mj.selection.foundation import held_instead, hung
from ers_mj.selection.loads import under_loads
from ers_mj.selection.measure import FREE_RUN, measure_of
from ers_mj.selection.spectrum import waves_of
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.model import OBSERVER_RATE

T = np.arange(0.0, 6.0, 5e-3)
ARM = {"a_1": 0.0, "a_2": 4.0, "b": 14.0, "c_1": 0.0, "c_2": 3.0, "theta_0": 0.0, "emf_share": 0.7}
PULL = np.array([40.0, 8.0])
NOISE = 3e-4


def swung(k, laws=(), values=ARM, pull=PULL, sense=1.0, held=1):
    """An arm that is pushed about, with gravity, as a recording of its angle."""
    f = (0.23, 0.61, 1.1)[k % 3]
    u = 2.6 * np.sin(2 * np.pi * f * T + k) + 1.4 * np.sign(np.sin(2 * np.pi * 0.31 * T + 2 * k))
    plant = ReducedModel(lumped(values), [("gravity_imbalance", pull), *laws])
    y = plant.simulate(T, u, (-math.atan2(pull[1], pull[0]), 0.0)).measured
    y = y + NOISE * np.random.default_rng(k).standard_normal(T.size)
    return trace_of(from_arrays(T, sense * u, y[held * (np.arange(T.size) // held)], name=f"arm {k}"), None)


@pytest.fixture(scope="module")
def arm():
    return baseline([swung(k) for k in range(3)], None, True)


def test_one_regression_tells_an_arm_under_gravity_from_a_spring():
    """The arm's own regression is the better one, and near the truth; where gravity is not asked for, there is none."""
    traces = [swung(k) for k in range(3)]
    best = guesses(traces, [BY_NAME["gravity_imbalance"]])[0]
    assert best.held_by == "gravity_imbalance"
    assert np.allclose(best.effects[0][1], PULL, atol=6.0) and abs(best.values["b"] - 14.0) < 3.0
    assert not any(guess.effects for guess in guesses(traces))


def test_an_arm_is_a_rival_of_the_springs(arm):
    """It is fitted to the noise from a start of its own, and takes the spring's place."""
    held = arm.held.fit.model
    assert held.names == ("gravity_imbalance",) and held.values["a_1"] == 0.0
    assert np.allclose(held.effects[0][1], PULL, rtol=0.01, atol=0.1)
    bench = Bench(arm.traces, tau_of(arm.fit.misfit))
    _, _, one = held_instead(bench, arm.fit, arm.held)
    assert one is not None and one.gain > 10.0


def test_what_a_sensor_holds_between_its_readings_bends_nothing(arm):
    """Read anew at every fifth sample, under an input that never rests: the same arm, down to its noise."""
    slow = baseline([swung(k, held=5) for k in range(3)], None, True).held.fit
    assert np.allclose(slow.model.effects[0][1], PULL, rtol=0.001, atol=0.01)
    assert slow.cost / slow.misfit.size < arm.held.fit.cost / arm.held.fit.misfit.size - 0.3


def test_where_a_spring_is_the_better_one_it_stays():
    values = {**ARM, "a_1": 40.0, "c_1": 3.0, "theta_0": 0.1}
    start = baseline([swung(k, values=values, pull=np.array([1e-9, 0.0])) for k in range(2)], None, True)
    assert start.fit.model.values["a_1"] == pytest.approx(40.0, rel=0.02)
    if start.held is not None:
        assert held_instead(Bench(start.traces, 1.0), start.fit, start.held)[2] is None


@pytest.mark.parametrize("place, stays", [(9.0, False), (0.1, True)])
def test_a_preload_that_has_the_whole_travel_on_one_side_is_a_constant_torque(place, stays):
    """It is no spring then, and what it stood for is to be named."""
    free = {**TRUTH, "a_1": 0.0, "c_1": 0.0, "theta_0": 0.0}
    traces = recorded([("bias_torque", np.array([6.0]))], values=free, names=("multisine", "chirp"), t=SPARSE)
    model = started(traces, values=free).fit.model
    values = {**model.values, "c_1": 6.0, "theta_0": place}
    start = Start(fit(replace(model, values=values, free=("a_2", "b", "c_2", "c_1")), traces), traces)
    found = unsprung(start, 1).fit.model.values
    assert (found["c_1"] > 0) == stays and found["b"] == pytest.approx(TRUTH["b"], rel=0.05)


@pytest.mark.parametrize("sheet", [None, {"a_2": 4.4, "b": 13.0, "c_2": 3.3}])
def test_an_input_that_acts_the_other_way(sheet):
    """Without a datasheet, or against what it says."""
    datasheet = Datasheet(lumped=sheet) if sheet else None
    held = baseline([swung(k, sense=-1.0) for k in range(2)], datasheet, True).held.fit.model
    assert held.values["b"] == pytest.approx(-14.0, rel=0.02)


def test_the_back_emf_is_free_where_an_effect_tells_it(arm):
    """A friction that follows the motor's torque shows which part of the damping is the back-EMF's; without one that
    share is not fitted, nor under a torque command.
    """
    laws = [("load_dependent_friction", np.array([0.3, np.inf, 0.5, np.inf, np.inf]))]
    traces = [swung(k, laws) for k in range(3)]
    held = replace(arm.held.fit.model, scales=arm.held.fit.model.scales)
    assert "emf_share" not in [f.name for f in held.layout()]
    found = fit(held.with_effect("load_dependent_friction", np.array([0.1, np.inf, 0.5, np.inf, np.inf])), traces).model
    mu, _, side = dict(found.effects)["load_dependent_friction"][:3]
    assert found.values["emf_share"] == pytest.approx(0.7, abs=0.1)
    assert (mu, side) == (pytest.approx(0.3, rel=0.05), pytest.approx(0.5, abs=0.05))
    under_torque = baseline([replace(trace, input_kind="torque") for trace in traces[:1]], None, True)
    assert under_torque.fit.model.values["emf_share"] == 0.0


def test_load_friction_follows_what_the_gear_carries():
    """At rest under its own weight an arm is held by a friction that the weight itself makes, where the load's side
    counts; by the Coulomb friction alone where the motor's does.
    """
    falls = []
    for side in (0.0, 0.9):
        law = "load_dependent_friction", np.array([0.5, np.inf, side, np.inf, np.inf])
        plant = ReducedModel(lumped({**ARM, "c_2": 1.0}), [law, ("gravity_imbalance", np.array([2.0, 0.0]))])
        falls.append(abs(plant.simulate(T, np.zeros(T.size), (1.0, 0.0)).theta[-1] - 1.0))
    assert falls[0] > 0.1 and falls[1] == 0.0


@pytest.mark.parametrize("T_c", [0.0106, math.inf])
def test_friction_that_creeps(T_c):
    """Below the level the output creeps at v_c times the share of the level that pulls; beyond it slides."""
    law = "presliding", np.array([*4 * [np.inf], 0.004, T_c])
    plant = ReducedModel(lumped({**ARM, "a_2": 0.0, "b": 1.0, "c_2": 4.0}), [law])
    for push, speed in ((2.0, 0.002), (-3.0, -0.003)):
        assert plant.simulate(T, np.full(T.size, push)).omega[-1] == pytest.approx(speed, rel=1e-3)
    assert plant.simulate(T, np.full(T.size, 5.0)).omega[-1] == pytest.approx(6.0, rel=0.02)


def test_creep_in_its_own_words_and_as_good_as_dry():
    effect = BY_NAME["presliding"]
    assert "creeps" in effect.describe({"x_s": "none", "v_c": "4 mrad/s"})
    dry = ReducedModel(lumped({**ARM, "c_2": 4.0}), [("presliding", np.array([*4 * [np.inf], 1e-5, np.inf]))])
    assert np.ptp(dry.simulate(T, np.full(T.size, 0.2)).theta) == 0.0


def test_loads_are_told_before_anything_is_missed():
    """Two arms' lengths in one set: inertia by 1.5, gravity by 2: the recordings fall into groups."""
    heavy = {**ARM, **{name: ARM[name] / 1.5 for name in ("a_2", "b", "c_2")}}
    traces = [swung(k, values=(ARM, heavy)[k % 2], pull=PULL * (1.0, 2.0 / 1.5)[k % 2]) for k in range(4)]
    start = baseline(traces, None, True)
    bench = Bench(start.held.traces, tau_of(start.held.fit.misfit))
    states = under_loads(bench, start.held.fit).model.states
    assert states["load"] == pytest.approx([1.0, 1.5, 1.0, 1.5], rel=0.03)
    assert states["weight"] == pytest.approx([1.0, 2.0 / 1.5, 1.0, 2.0 / 1.5], rel=0.03)


def test_one_load_is_not_told_as_several(arm):
    assert under_loads(Bench(arm.held.traces, 1.0), arm.held.fit) is None


def test_a_spectrum_over_the_angle_finds_a_wave_finer_than_any_start(arm):
    """A torque of 61 periods within the travel."""
    travel = arm.fit.model.scales.high - arm.fit.model.scales.low
    traces = [swung(k, [("cogging", np.array([6.0, travel / 61, 0.3, np.inf, np.inf]))]) for k in range(3)]
    found = [period for kind, period in waves_of(run_of(arm.held.fit.model, traces, OBSERVER_RATE), traces)]
    assert any(travel / period == pytest.approx(61, abs=1.0) for period in found)


def test_an_arm_that_hangs_is_run_freely_and_one_that_swings_over_in_windows(arm):
    """What holds its place forgets its start; the error of what does not adds up, whatever its cause."""
    held = arm.held.fit.model
    low = replace(swung(0), y=0.3 * np.sin(T))
    assert measure_of(held, [low]).name == "free_run"
    over = replace(swung(0), y=4.0 * np.sin(T))
    assert measure_of(held, [over]).name == "windows"
    bare = held.without_effect("gravity_imbalance")
    assert measure_of(bare, [low]).name == "windows"
    for a_1, c_1, theta_0, name in (
        (20.0, 0.0, 0.0, "free_run"),
        (0.01, 0.0, 0.0, "windows"),  # friction leaves it anywhere
        (0.0, 1.0, 0.0, "free_run"),
        (0.0, 1.0, 9.0, "windows"),  # beyond the travel a preload is a constant torque
    ):
        sprung = replace(bare, values={**bare.values, "a_1": a_1, "c_1": c_1, "theta_0": theta_0})
        assert measure_of(sprung, [low]).name == name


def test_windows_leave_the_noise_where_the_model_is_right():
    """And what they leave of a wrong one does not hang on how long the recording is."""
    free = {**ARM, "c_2": 1.0}
    trace = swung(1, values=free, pull=np.array([1e-9, 0.0]))
    model = baseline([trace], Datasheet(lumped={k: free[k] for k in ("a_1", "a_2", "b", "c_2")}), True).fit.model
    measure = measure_of(model, [trace])
    assert measure.window_s == 2.0
    assert scored(model, trace, measure=measure).rmse == pytest.approx(NOISE, rel=0.15)
    wrong = replace(model, values={**model.values, "b": 1.01 * model.values["b"]})
    windows, run = (scored(wrong, trace, measure=one).rmse for one in (measure, FREE_RUN))
    assert 2.0 * NOISE < windows < run


def test_a_dead_zone_that_is_wider_one_way():
    """It ends at shift + d and shift - d, and is as it was where it is not shifted."""
    effect, u = BY_NAME["drive_dead_zone"], np.array([-0.4, -0.25, 0.0, 0.15, 0.4])
    assert effect.command(np.array([0.2, np.inf, 0.1]), u) == pytest.approx([-0.3, -0.15, 0.0, 0.0, 0.1])
    assert effect.command(np.array([0.2, np.inf, np.inf]), u) == pytest.approx([-0.2, -0.05, 0.0, 0.0, 0.2])


def test_a_weight_is_begun_from_the_spring_that_does_nearly_as_well():
    start = baseline([swung(k, pull=6.0 * PULL) for k in range(2)], None, True)
    bench = Bench(start.traces, 1.0)
    found = hung(bench, start.fit)
    assert found.model.names == ("gravity_imbalance",) and "a_1" not in found.model.free
    assert dict(found.model.effects)["gravity_imbalance"] == pytest.approx(6.0 * PULL, rel=0.05)
    loose = replace(start.fit.model, values={**start.fit.model.values, "a_1": 0.0})
    assert hung(bench, replace(start.fit, model=loose)) is None


def test_a_regression_for_the_input_where_hardly_anything_is_left_for_the_acceleration():
    """A plant that follows in 5 ms, at 100 Hz: solved for the acceleration all numbers are a third of what they are."""
    true = {"a_1": 180.0, "a_2": 200.0, "b": 100.0, "c_1": 0.0, "c_2": 480.0, "theta_0": 0.3}
    t = 0.01 * np.arange(2000)
    u = np.repeat(np.random.default_rng(0).uniform(-30.0, 30.0, 100), 20)
    y = simulate({"lumped": true}, (t, u), noise=1e-3).theta
    found = [guess for guess in guesses([trace_of(from_arrays(t, u, y), None)]) if guess.held_by == "spring"]
    first, by_input = (next(guess for guess in found if guess.of_input is way) for way in (False, True))
    assert by_input.misfit < 0.1 * first.misfit and by_input.values["b"] > 1.1 * first.values["b"]
    ratios = [by_input.values[name] / by_input.values["b"] / (true[name] / true["b"]) for name in ("a_1", "a_2", "c_2")]
    assert ratios == pytest.approx([1.0, 1.0, 1.0], abs=0.1)
