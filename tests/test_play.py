"""The play that a bare gap stands for, against two rigid masses; Eq. (4) as printed, against what it says."""

import sys
from pathlib import Path

import numpy as np
import pytest

from ers_mj.plants.bare_gap import MOTOR_SHARE, stiff_play
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.printed_play import PrintedPlay
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.servo.datasheet import read_datasheet

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "analysis"))
SHEET = read_datasheet("table1")
T = np.arange(0.0, 3.0, 1e-3)
MODELS = {"off": lumped(SHEET.to_lumped() | {"tau_e": 0.0}), "on": lumped(SHEET.to_lumped())}


def rms_deg(x):
    return float(np.degrees(np.sqrt(np.mean(np.square(x)))))


@pytest.mark.parametrize("inductance", MODELS)
@pytest.mark.parametrize("name", INPUTS)
def test_the_reduced_models_play_is_that_of_two_rigid_masses(name, inductance):
    two_mass = pytest.importorskip("independent_two_mass", reason="analysis/ is not beside the tests")
    u, gap = INPUTS[name](T), np.radians(0.5)
    truth = two_mass.simulate(SHEET.parameters, gap, MOTOR_SHARE, T, u, inductance=inductance == "on")
    model = ReducedModel(stiff_play(MODELS[inductance], gap))
    assert rms_deg(model.simulate(T, u).theta - truth) < 0.01


@pytest.mark.parametrize("inductance", MODELS)
@pytest.mark.parametrize("name", INPUTS)
def test_without_threshold_eq_4_is_the_model_without_play(name, inductance):
    u, c = INPUTS[name](T), MODELS[inductance]
    assert rms_deg(PrintedPlay(c, 0.0).simulate(T, u).theta - ReducedModel(c).simulate(T, u).theta) < 0.005


def test_eq_4_transmits_at_a_distance_and_rests_in_between():
    c, threshold = MODELS["off"], 20.0
    u = INPUTS["multisine"](T)
    motion = PrintedPlay(c, threshold).simulate(T, u)
    motor = c.b * u - c.a_emf * motion.omega
    lag = motor[:-1] - motion.drive[1:]  # the torque that acted over the sample, against what went through
    inside = np.abs(lag) < 0.98 * threshold
    assert np.abs(lag).max() < 1.2 * threshold and 0.02 < inside.mean() < 0.9
    assert np.abs(np.diff(motion.drive)).min() == 0.0
