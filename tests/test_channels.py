"""What current, speed and motor angle add to the output: parameters that the output alone cannot tell, and where an
effect sits.
"""

from dataclasses import replace

import numpy as np
import pytest

from ers_mj.data.prepared import Blocks, trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.decisions.thresholds import POLICY
from ers_mj.diagnosis.pipeline import diagnose
from ers_mj.effects import BY_NAME
from ers_mj.estimation.baseline import baseline
from ers_mj.estimation.objective import residuals
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.selection.bench import Bench
from ers_mj.selection.budget import QUICK
from ers_mj.selection.candidates import candidates
from ers_mj.selection.posterior import probabilities
from ers_mj.servo.datasheet import read_datasheet
from ers_mj.servo.model import OBSERVER_RATE

T = np.arange(0.0, 4.0, 2e-3)
ONE = replace(POLICY, most_effects=1)  # one round of the selection tells
TRUTH = {
    "a_1": 25.0,
    "a_2": 50.0,
    "b": 70.0,
    "c_1": 135.0,
    "c_2": 115.0,
    "theta_0": 0.2625,
    "tau_e": 1.1e-3,
    "emf_share": 0.9,
}
AMPERE = 110.0  # n K_t / J [rad/s^2 per A]
NOISE = {"theta": 1.5e-4, "current": 0.02, "speed": 0.05, "motor": 3e-3}
RATIO, ZERO = 22.26, 0.7  # of the motor's encoder


def recordings(effects=(), *channels):
    """Three recordings of a servo that is not quite Table 1's, with these further channels."""
    out = []
    for k, name in enumerate(("multisine", "steps", "chirp")):
        u, rng = np.round(INPUTS[name](T), 4), np.random.default_rng(k)
        motion = ReducedModel(lumped(TRUTH), effects).simulate(T, u)
        seen = {"current": motion.drive / AMPERE, "speed": motion.omega, "motor": RATIO * motion.theta_m + ZERO}
        noisy = {kind: seen[kind] + NOISE[kind] * rng.standard_normal(T.size) for kind in channels}
        fields = {{"speed": "omega", "motor": "theta_m"}.get(kind, kind): x for kind, x in noisy.items()}
        out.append(
            from_arrays(
                T, u, motion.measured + NOISE["theta"] * rng.standard_normal(T.size), name=f"{name}.csv", **fields
            )
        )
    return out


def test_the_current_tells_the_torque_constant_and_the_back_emf():
    traces = [trace_of(r, None) for r in recordings((), "current")]
    values = baseline(traces, read_datasheet("table1"), True).fit.model.values
    assert values["ampere"] == pytest.approx(AMPERE, rel=0.01)
    assert values["emf_share"] == pytest.approx(TRUTH["emf_share"], abs=0.01)


def test_every_channel_is_explained_to_its_noise():
    traces = [trace_of(r, None) for r in recordings((), "current", "speed", "motor")]
    assert all({c.kind for c in t.channels} == {"current", "speed", "motor"} for t in traces)
    start = baseline(traces, read_datasheet("table1"), True)
    misfit = Blocks.of(start.traces).misfit(residuals(start.fit.model, start.traces, OBSERVER_RATE))
    assert misfit.size == 4 * sum(t.counts.size for t in traces) == start.fit.misfit.size
    assert np.median(misfit) == pytest.approx(1.0, abs=0.1) and misfit.max() < 2.0


@pytest.mark.parametrize(
    "name, size", [("sensor_lag", [1.5e-3, np.inf]), ("sensor_lag", [1e-4, 3e-3]), ("input_delay", [1.5e-3])]
)
def test_the_current_says_on_which_side_of_the_motor_a_delay_lies(name, size):
    traces = [trace_of(r, None) for r in recordings([(name, np.array(size))], "current")]
    start = baseline(traces, read_datasheet("table1"), True)
    alike = ("sensor_lag", "input_delay", "inductance")
    bench = Bench(start.traces, 1.0, exclude=[other for other in BY_NAME if other not in alike])
    ranked = [c for c in candidates(bench, start.fit) if c.name in BY_NAME]
    assert ranked[0].name == name and probabilities({c.name: c.fit for c in ranked})[name] > 0.98


def test_the_current_of_a_command_that_was_not_recorded_is_no_evidence():
    """Of a dead time, the first of which follows what was asked for before the recording began."""
    trace = trace_of(recordings((), "current")[1], None)
    model = baseline([trace], read_datasheet("table1"), True).fit.model.with_effect("input_delay", np.array([0.0205]))
    left = residuals(model, [trace], OBSERVER_RATE)[T.size :]
    assert not left[:11].any() and np.all(left[11:] != 0.0)


def sagging(told):
    """Three recordings of a servo whose supply sinks with what it draws and with time; ``told`` is what is written down
    as the input and the supply.
    """
    out = []
    for k, name in enumerate(("multisine", "steps", "chirp")):
        u, rng = np.round(INPUTS[name](T), 4), np.random.default_rng(k)
        supply = 1.0 - 0.02 * np.abs(u) / np.max(np.abs(u)) - 0.01 * T - 0.02 * (np.sin(3.0 * T + k) > 0.3)
        motion = ReducedModel(lumped(TRUTH)).simulate(T, u * supply)
        u, vin = told(u, 24.0 * supply + 0.02 * rng.standard_normal(T.size))
        out.append(
            from_arrays(
                T, u, motion.measured + NOISE["theta"] * rng.standard_normal(T.size), name=f"{name}.csv", vin=vin
            )
        )
    return out


def test_a_measured_supply_is_what_the_motor_sees():
    search = replace(QUICK, in_mujoco=True)
    given = sagging(lambda u, vin: (u, vin)), read_datasheet("table1")
    document = diagnose(*given, jobs=1, policy=ONE, search=search).document
    (found,) = document["missing"]
    assert found["effect"] == "supply_sag" and found["subsystem"] == "drive" and "measured changes" in found["sentence"]
    assert found["parameters"]["measured"]["value"] == pytest.approx(1.0, abs=0.1)
    assert document["fit"]["heldout_rmse_after_rad"] < 1.3 * NOISE["theta"] < document["fit"]["heldout_rmse_before_rad"]
    assert document["fit"]["mujoco_heldout_rmse_after_rad"] < 0.5 * document["fit"]["mujoco_heldout_rmse_before_rad"]


def test_a_supply_that_the_input_holds_already_is_no_effect():
    document = diagnose(sagging(lambda u, vin: (u * vin / 24.0, vin)), read_datasheet("table1"), jobs=1).document
    assert document["missing"] == [] and not document["remainder"]["significant"]


def test_a_supply_that_is_steady_or_hardly_known_is_left_out():
    t, u = T, INPUTS["multisine"](T)
    steady, holed = 24.0 + 0.01 * np.sin(t), np.where(np.sin(9.0 * t) > 0.0, np.nan, 24.0 + np.sin(t))
    assert all(
        trace_of(from_arrays(t, u, np.sin(t), vin=vin), None).supply is None
        for vin in (steady, holed, -24.0 + np.sin(t))
    )
    seen = trace_of(from_arrays(t, u, np.sin(t), vin=np.where(t == 1.0, np.nan, 24.0 + np.sin(t))), None)
    assert (
        np.isfinite(seen.supply).all()
        and seen.part(10, 90).supply.size == 80
        and seen.without([slice(3, 5)]).supply is seen.supply
    )
