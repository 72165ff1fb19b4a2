"""What to record next: within the limits, the same every time, and telling what it promises."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ers_mj.data.excitation import SHARES, WAVES, Limits, excitations, signal
from ers_mj.data.prepared import Signals, make_trace, trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.door.diagnosing import input_table
from ers_mj.estimation.baseline import baseline
from ers_mj.estimation.fit import descend, fit
from ers_mj.estimation.initial_state import with_starts
from ers_mj.experiment_design.discriminating_inputs import SETTLED
from ers_mj.experiment_design.next_recording import next_recording
from ers_mj.experiment_design.refits import drawn
from ers_mj.experiment_design.wording import said, widened
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.selection.posterior import isolability, probabilities
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.model import OBSERVER_RATE

T = np.arange(0.0, 3.0, 1e-3)
TRUTH = {
    "a_1": 25.0,
    "a_2": 50.0,
    "b": 70.0,
    "c_1": 135.0,
    "c_2": 115.0,
    "theta_0": 0.2625,
    "tau_e": 9e-4,
    "emf_share": 0.94,
}
NOISE = 3e-4


def traces_of(effects, names=("ramp", "steps")):
    """Recordings of a servo in which these effects act."""
    out = []
    for k, name in enumerate(names):
        u = INPUTS[name](T)
        y = ReducedModel(lumped(TRUTH), effects).simulate(T, u).measured + NOISE * np.random.default_rng(
            k
        ).standard_normal(T.size)
        out.append(trace_of(from_arrays(T, u, y, name=name), None))
    return out


def explained(traces, *starts):
    """The traces, at rest when they begin, and the best fit of each effect begun at a start and carried on to its
    valley's floor, beside the baseline's letters and beside the servo's own.
    """
    sheet = Datasheet(
        lumped={k: TRUTH[k] for k in ("a_1", "a_2", "b", "c_1", "c_2", "theta_0")},
        baseline={k: TRUTH[k] for k in ("tau_e", "emf_share")},
    )
    start = baseline(traces, sheet, True, 1)
    traces = [replace(t, start=(TRUTH["theta_0"], 0.0)) for t in start.traces]
    base = start.fit.model
    models = base, replace(base, values={**base.values, **{k: TRUTH[k] for k in sheet.lumped}})
    ends = {
        name: min(
            (fit(m.with_effect(name, np.array(at)), traces, steps=40) for m in models), key=lambda found: found.cost
        )
        for name, *at in starts
    }
    return traces, {name: descend(found.model, traces, OBSERVER_RATE, 1.0, 40, 1e-4) for name, found in ends.items()}


@pytest.fixture(scope="module")
def late():
    return explained(
        traces_of([("sensor_lag", np.array([1.5e-3, np.inf]))]), ("input_delay", 1.5e-3), ("sensor_lag", 1.5e-3, np.inf)
    )


@pytest.fixture(scope="module")
def pushed():
    return explained(
        traces_of([("bias_torque", np.array([8.0]))], ("multisine", "steps", "chirp")),
        ("bias_torque", 6.0),
        ("asymmetric_friction", -6.0, 0.01, np.inf, np.inf),
    )


def advised(case, leader, *rivals):
    traces, fits = case
    return next_recording((leader, fits[leader]), [(name, fits[name], 0.4) for name in rivals], traces, "V", "rad")


# -- probabilities ---------------------------------------------------------------------------------------------------


def test_probabilities_sum_to_one_and_do_not_depend_on_the_order(late):
    _, fits = late
    one, other = probabilities(fits), probabilities(dict(reversed(fits.items())))
    assert sum(one.values()) == pytest.approx(1.0)
    assert all(one[name] == pytest.approx(other[name]) for name in fits)


def test_one_explanation_told_twice_is_as_probable_as_itself(late):
    _, fits = late
    twice = probabilities({"a": fits["sensor_lag"], "b": fits["sensor_lag"]})
    assert twice["a"] == pytest.approx(0.5)


def test_distances_are_nothing_to_oneself_and_small_between_what_these_recordings_confuse(pushed):
    traces, fits = pushed
    same, other = isolability(fits["bias_torque"], [fits["bias_torque"], fits["asymmetric_friction"]], traces)
    assert same.sigmas == 0.0 and same.cost == 0.0 and same.probability == pytest.approx(0.5)
    assert other.sigmas < 1.0 and 0.2 < other.probability < 0.6


# -- excitations -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ends", [(-5.0, 5.0), (0.0, 8.0)], ids=["both ways", "one way"])
@pytest.mark.parametrize("rate", [1000.0, 50.0])
def test_every_excitation_can_be_rebuilt_and_stays_within_the_input(ends, rate):
    limits = Limits(*ends, -0.5, 0.8, rate, 6.0, 0.1)
    listed = [e for shape in excitations(limits, SHARES) for e in shape]
    assert {e["kind"] for e in listed} == set(WAVES)
    for e in listed:
        t, u = signal(e)
        assert t.size == 6.0 * rate and np.ptp(u) > 0.2 * e["amplitude"]
        assert u.min() >= ends[0] - 1e-9 and u.max() <= ends[1] + 1e-9 and np.max(np.abs(u)) <= e["peak_u"] + 1e-9
        assert e.get("to_hz", 0.0) <= 0.2 * rate


# -- advice ----------------------------------------------------------------------------------------------------------


def test_delay_and_lag_are_told_apart_by_a_band_that_reaches_high_frequencies(late):
    traces, fits = late
    at_hand = isolability(fits["input_delay"], [fits["sensor_lag"]], traces)[0]
    advice = advised(late, "input_delay", "sensor_lag")
    excitation, against = advice["excitation"], advice["checked"]["against"]["sensor_lag"]
    assert (
        excitation["kind"] in ("multisine", "chirp")
        and excitation["to_hz"] >= 30.0
        or excitation.get("period_s", 1.0) < 0.1
    )
    assert against["rms_sigma"] > 2 * at_hand.sigmas and against["cost"] > 2 * abs(at_hand.cost)
    assert advice["separates"] == ["input_delay", "sensor_lag"]


def test_what_is_advised_settles_it(late):
    """Both explanations are played in turn: the refit of the right one wins by about what was promised."""
    traces, fits = late
    advice = advised(late, "input_delay", "sensor_lag")
    promised = advice["checked"]["against"]["sensor_lag"]["cost"]
    t, u = signal(advice["excitation"])
    for true, wrong in (("input_delay", "sensor_lag"), ("sensor_lag", "input_delay")):
        y = fits[true].model.plant().theta(t, u, (advice["excitation"]["start"], 0.0)) + NOISE * np.random.default_rng(
            9
        ).standard_normal(t.size)
        new = make_trace("next", Signals(t, u, y, np.ones(t.size, bool)), traces[0].sigma)
        both = [*traces, *with_starts(fits[true].model, [new])]
        again = {name: fit(found.model, both, steps=15) for name, found in fits.items()}
        won = again[wrong].cost - again[true].cost
        assert won == pytest.approx(promised, rel=0.5, abs=1.0)
        assert promised < SETTLED or probabilities(again)[true] > 0.9


def test_a_constant_torque_and_coulomb_asymmetry_are_said_to_be_one(pushed):
    advice = advised(pushed, "bias_torque", "asymmetric_friction")
    assert advice["separates"] == [] and advice["excitation"] == {} and advice["channel"] is None
    assert advice["expected_sigmas"] < 1.5 and "change of the rig" in advice["sentence"]
    assert max(advice["checked"]["against"]["asymmetric_friction"]["channels_sigmas"].values()) < 1.5


def test_a_wider_travel_is_told_with_what_to_record_there():
    limits = SimpleNamespace(low=-0.2, high=0.3)
    found = SimpleNamespace(
        cost=8.0,
        excitation={
            "kind": "chirp",
            "from_hz": 1.0,
            "to_hz": 9.0,
            "amplitude": 6.0,
            "offset": 0.0,
            "duration_s": 7.0,
            "rate_hz": 500.0,
        },
    )
    told = widened(
        "backlash",
        ["shaft_compliance", "gravity_imbalance"],
        {"shaft_compliance": found},
        limits,
        {"input_unit": "V", "output_unit": "rad"},
    )
    assert "record a chirp from 1 to 9 Hz" in told[0] and "at 4 sigmas" in told[0]
    assert told[1] == "Only a change of the rig can tell backlash and gravity imbalance apart."


def test_the_limits_are_kept(late):
    traces, fits = late
    excitation = advised(late, "input_delay", "sensor_lag")["excitation"]
    t, u = signal(excitation)
    assert np.max(np.abs(u)) <= max(np.max(np.abs(x.u)) for x in traces) + 1e-9
    low, high = min(x.y.min() for x in traces), max(x.y.max() for x in traces)
    for found in fits.values():
        theta = found.model.plant().theta(t, u, (excitation["start"], 0.0))
        assert theta.min() > low - 0.06 * (high - low) and theta.max() < high + 0.06 * (high - low)


def test_the_same_advice_every_time_and_within_its_budget(late):
    one, other = (advised(late, "input_delay", "sensor_lag") for _ in range(2))
    assert one == other and one["checked"]["simulations"] < 600


def test_without_a_rival_the_weakest_number_is_narrowed(late):
    advice = advised(late, "sensor_lag")
    assert advice["separates"] == [] and 0.0 < advice["checked"]["interval_ratio"]["T"] < 1.0
    assert "T of the sensor lag" in advice["sentence"]


def test_the_input_is_written_as_a_table(late):
    excitation = advised(late, "input_delay", "sensor_lag")["excitation"]
    lines = input_table(excitation).splitlines()
    t, u = signal(excitation)
    assert lines[0] == "t_s,u_V" and len(lines) == t.size + 1
    assert np.allclose([float(line.split(",")[1]) for line in lines[1:]], u, rtol=1e-5, atol=1e-9)


def test_a_richer_rival_that_further_numbers_alone_set_apart_is_told():
    told = {"backlash": {"recordings_needed": None, "channels_sigmas": {}, "rms_over_left": 0.3, "cost": 2.0 * SETTLED}}
    (words,) = said("shaft_compliance", told, None, {}, 50, "the noise")
    assert "tells shaft compliance and backlash apart" in words


def test_numbers_are_drawn_as_widely_as_they_are_known():
    """A curvature whose inverse has no root any more: one direction is known 1e9 times as well as the other."""
    turn = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    draws = drawn(turn @ np.diag([1e18, 1.0]) @ turn.T, np.random.default_rng(0).standard_normal((4000, 2)))
    assert np.all(np.isfinite(draws)) and np.std(draws @ turn[:, 0]) < 1e-4
    draws = drawn(turn @ np.diag([1e6, 4.0]) @ turn.T, np.random.default_rng(0).standard_normal((4000, 2)))
    assert np.std(draws @ turn, axis=0) == pytest.approx([1e-3, 0.5], rel=0.05)
