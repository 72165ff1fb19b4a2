"""Plants one sample at a time: the same motion as in one go, on either plant."""

import numpy as np
import pytest

from ers_mj.control.trial import sampled
from ers_mj.plants.inputs import INPUTS
from ers_mj.servo.datasheet import read_datasheet
from ers_mj.servo.simulation import build_plant, parse_effect

SHEET = read_datasheet("table1")
RATE, N = 1000.0, 1200
T = np.arange(N) / RATE


def stepped(plant, u):
    """(theta, omega, drive before u acts), each (N,), of a plant that gets u (N,) sample by sample."""
    loop, rows = sampled(plant, RATE, (SHEET.parameters["theta_0"], 0.0)), np.empty((N, 2))
    for k, v in enumerate(plant.terminal(u)):
        rows[k] = loop.theta, loop.omega
        loop.hold(float(v))
    return rows.T


@pytest.mark.parametrize(
    ("effect", "options", "within"),
    [
        (None, {}, 1e-11),
        (None, {"inductance": True}, 1e-11),
        (None, {"gap": 0.009}, 1e-6),
        ("input_delay:T_d=0.0023", {}, 1e-11),
        ("end_stop:upper=0.4,lower=0.1", {}, 1e-11),
        ("voltage_saturation:u_max=3.5", {}, 1e-11),
        ("presliding:x_s=0.002,zeta=0.5", {}, 3e-6),
        ("stribeck:dF_s=0.1,v_s=0.2", {}, 3e-5),
        ("current_limit:tau_max=1.2", {}, 1e-3),
    ],
)
def test_the_reduced_model_moves_as_in_one_go(effect, options, within):
    plant = build_plant(SHEET, effects=[parse_effect(effect)] if effect else (), **options)
    u = INPUTS["steps"](T)
    whole = plant.simulate(T, u)
    theta, omega = stepped(plant, u)
    assert np.ptp(whole.theta) > 0.05
    assert np.abs(theta - whole.theta).max() < within


def test_two_bodies_beside_a_bristle_move_as_in_one_go():
    plant = build_plant(
        SHEET,
        effects=[
            parse_effect("shaft_compliance:f_shaft=30"),
            parse_effect("presliding:x_s=0.002,zeta=0.5"),
            parse_effect("input_delay:T_d=0.0023"),
        ],
    )
    u = INPUTS["steps"](T)
    assert np.abs(stepped(plant, u)[0] - plant.simulate(T, u).theta).max() < 1e-11


@pytest.mark.parametrize(
    ("effect", "options"),
    [
        (None, {}),
        (None, {"inductance": True}),
        (None, {"gap": 0.009}),
        (None, {"linkage": "rod"}),
        ("input_delay:T_d=0.00232", {}),
        ("stribeck:dF_s=0.1,v_s=0.2", {}),
    ],
)
def test_the_mujoco_plant_moves_as_in_one_go(effect, options):
    plant = build_plant(SHEET, plant="mujoco", effects=[parse_effect(effect)] if effect else (), **options)
    u = INPUTS["steps"](T)
    whole = plant.simulate(T, u)
    theta, omega = stepped(plant, u)
    np.testing.assert_allclose(theta, whole.theta, atol=1e-9)
    np.testing.assert_allclose(omega, whole.omega, atol=1e-6)


@pytest.mark.parametrize("inductance", [False, True])
def test_the_drive_is_told_with_the_voltage_that_acts(inductance):
    for kind in ("reduced", "mujoco"):
        plant = build_plant(SHEET, plant=kind, inductance=inductance)
        loop, lumped = sampled(plant, RATE, (SHEET.parameters["theta_0"], 0.0)), SHEET.to_lumped()
        assert loop.drive(2.0) == pytest.approx(0.0 if inductance else 2.0 * lumped["b"])
        for _ in range(20):
            loop.hold(2.0)  # held by friction and preload: no back-EMF
        assert loop.drive(2.0) == pytest.approx(2.0 * lumped["b"], rel=1e-6)
