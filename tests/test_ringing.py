"""Bodies that ring, rest twisted, or are read late: what a search begins from, and what a window or an observer has."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.effects import BY_NAME
from ers_mj.estimation.known_model import model_of
from ers_mj.estimation.objective import Run
from ers_mj.plants.mujoco.plant import MechanicalPlant
from ers_mj.plants.reduced import ReducedModel
from ers_mj.selection.measure import Measure
from ers_mj.selection.spectrum import rings_of
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.model import OBSERVER_RATE

T = np.arange(0.0, 6.0, 0.002)
NOISE = 2e-4
U = 4.0 * np.sign(np.sin(2.0 * math.pi * 0.4 * T)) + 2.0 * np.sin(2.0 * math.pi * 1.3 * T)
NUMBERS = {"a_1": 0.0, "a_2": 0.5, "b": 10.0, "c_2": 2.0}
SHAFT = ("shaft_compliance", {"f_shaft": 20.0, "zeta": 0.004, "rho": 0.5, "phi": 0.5})
WEIGHT = ("gravity_imbalance", {"g_s": 40.0, "g_c": 0.0})


def servo(*effects, **numbers):
    """A model, and what its sensor reads with noise under U, as a trace."""
    sheet = Datasheet(lumped={**NUMBERS, **numbers}, effects=effects, name="servo")
    blank = trace_of(from_arrays(T, U, np.random.default_rng(1).standard_normal(T.size)), None)
    plant = model_of(sheet, [blank], True).plant()
    y = plant.theta(T, U, (0.0, 0.0)) + NOISE * np.random.default_rng(2).standard_normal(T.size)
    trace = replace(trace_of(from_arrays(T, U, y), None), start=(0.0, 0.0), sigma=NOISE)
    return model_of(sheet, [trace], True), trace


def test_what_rings_is_told_and_noise_is_not():
    model, trace = servo()
    noise = np.random.default_rng(3).standard_normal(T.size)
    swing = 5.0 * np.exp(-((T % 1.5) / 0.3)) * np.sin(2.0 * math.pi * 43.0 * T)
    drift = 300.0 * np.cumsum(noise) / T.size
    assert rings_of(Run(model, noise + drift, ()), [trace]) == ()
    (told,) = rings_of(Run(model, noise + drift + swing, ()), [trace])
    assert told == pytest.approx(43.0, rel=0.03)
    starts = BY_NAME["shaft_compliance"].starts(replace(model.scales, rings=(43.0,)))
    assert any(p[0] == pytest.approx(21.5) and p[1] < 0.05 for p in starts)


def test_windows_begin_with_the_twist_of_a_shaft_that_rings():
    """Begun untwisted, a window of the right model is several times the noise off."""
    model, trace = servo(SHAFT)
    run = Measure(2.0).run(model, trace)
    assert float(np.sqrt(np.mean((trace.y - run) ** 2))) < 1.1 * NOISE


@pytest.mark.parametrize("effect", [SHAFT, ("backlash", {"gap": 0.02, "rho": 0.5, "f_contact": 60.0, "zeta": 0.2})])
def test_a_servo_at_rest_under_a_weight_begins_twisted_in_both_plants(effect):
    model, trace = servo(WEIGHT, effect)
    still = replace(trace, u=np.full(T.size, 4.0 * math.sin(0.3)), start=(0.3, 0.0))  # what holds the weight
    plant, run = model.staged(still, 0, 0.0, None)
    theta, _, _, twist, over = run["start"]
    assert twist * 0.3 > 0.0 and over == 0.0  # the motor holds the weight up
    parts = [ReducedModel, MechanicalPlant]
    begun = [p(plant.coefficients, plant.effects).simulate(T[:50], still.u[:50], run["start"]) for p in parts]
    moved = [float(np.ptp((m.theta - m.theta_m)[:20])) for m in begun]
    loose = ReducedModel(plant.coefficients, plant.effects).simulate(T[:50], still.u[:50], (theta, 0.0))
    assert max(moved) < 0.2 * float(np.ptp((loose.theta - loose.theta_m)[:20]))


def test_an_observer_behind_a_lag_leaves_noise_where_it_sticks_and_slips():
    """Two ways had left 1.2 times the noise and more."""
    model, trace = servo(("sensor_lag", {"T": 0.015}), a_1=300.0, a_2=60.0, b=120.0, c_2=100.0)
    left = (trace.y - model.predict(trace, 0, OBSERVER_RATE)) / NOISE
    assert float(np.sqrt(np.mean(left**2))) < 1.05


def test_the_scatter_of_a_datasheet_is_what_follows_from_its_letters():
    sheet = Datasheet(parameters={"J": 0.01, "K_t": 0.1, "K_e": 0.1, "R": 2.0, "B": 0.02, "F_c": 0.05}, name="servo")
    told = sheet.to_lumped()
    assert sheet.scatter(told) == 0.0 and sheet.scatter({}) == 0.0
    assert sheet.scatter({"c_2": 1.2 * told["c_2"]}) == pytest.approx(math.log(1.2) / math.sqrt(2.0))
