"""Linear plants over frequency, against the reduced model and MuJoCo's own derivatives."""

import math
from dataclasses import replace

import control
import numpy as np
import pytest

from ers_mj.control.frequency.linear import at, linearised
from ers_mj.servo.datasheet import read_datasheet
from ers_mj.servo.simulation import build_plant, parse_effect

SHEET = read_datasheet("table1")
FREE = replace(SHEET, parameters={**SHEET.parameters, "F_c": 0.0, "T_LH": 0.0})
HOME = SHEET.parameters["theta_0"]
F_HZ = np.geomspace(0.5, 100.0, 12)


@pytest.mark.parametrize(
    ("effects", "options"),
    [
        ([], {}),
        ([], {"inductance": True}),
        (["input_delay:T_d=0.0023"], {}),
        (["input_delay:T_d=0.0023"], {"inductance": True}),
        (["shaft_compliance:f_shaft=20,zeta=0.1,rho=0.5,phi=0.0"], {}),
    ],
)
def test_the_linear_plant_moves_as_the_reduced_model(effects, options):
    """From a speed, under voltages that slip all the way."""
    plant = build_plant(FREE, effects=[parse_effect(text) for text in effects], **options)
    u = np.r_[np.zeros(10), np.repeat([0.5, -1.0, 0.2, 0.0], 50)]
    t = np.arange(u.size) / 1000.0
    whole = plant.simulate(t, u, (HOME, 0.3)).theta - HOME
    held = linearised(plant, 1000.0, HOME).held
    x = np.zeros(held.nstates)
    x[[1, 3] if "shaft" in str(effects) else [1]] = 0.3
    np.testing.assert_allclose(
        control.forced_response(held, t, u, x).y[0], whole, atol=1e-7 if "shaft" in str(effects) else 1e-10
    )


def test_a_sensors_lag_is_in_it():
    plain, late = (
        linearised(build_plant(FREE, effects=effects), 1000.0, HOME) for effects in ((), [("sensor_lag", {"T": 0.004})])
    )
    np.testing.assert_allclose(
        late.response(F_HZ) / plain.response(F_HZ), 1 / (1 + 2j * np.pi * F_HZ * 0.004), rtol=0.04
    )  # the reading takes the angle as straight between samples
    later = linearised(build_plant(FREE, effects=[("sensor_lag", {"T": 0.004, "T_d": 0.0033})]), 1000.0, HOME)
    np.testing.assert_allclose(
        later.response(F_HZ) / late.response(F_HZ), np.exp(-2j * np.pi * F_HZ * 0.0033), rtol=0.05
    )
    load = [at(x.load, F_HZ) for x in (late, later)]
    np.testing.assert_allclose(load[1] / load[0], np.exp(-2j * np.pi * F_HZ * 0.0033), rtol=0.05)


@pytest.mark.parametrize(
    ("effects", "options"),
    [
        ([], {}),
        ([], {"inductance": True}),
        ([], {"gap": math.radians(0.5)}),
        (["hinge_moment_cubic:k_3=5"], {}),
        (["input_delay:T_d=0.0023"], {}),
    ],
)
def test_mujocos_own_derivatives_agree(effects, options):
    """Two roads, one answer; MuJoCo's angle is half a step, 25 us, early, with inductance a whole one: 0.9 and 1.8 deg
    at 100 Hz.
    """
    pair = [
        linearised(
            build_plant(SHEET, plant=kind, effects=[parse_effect(text) for text in effects], **options),
            1000.0,
            HOME + 0.17,
        )
        for kind in ("reduced", "mujoco")
    ]
    ratio = pair[1].response(F_HZ) / pair[0].response(F_HZ)
    assert np.abs(20 * np.log10(np.abs(ratio))).max() < 0.1 and np.abs(np.degrees(np.angle(ratio))).max() < (
        1.9 if options.get("inductance") else 1.0
    )
    loads = pair[1].load_response(F_HZ) / pair[0].load_response(F_HZ)
    assert np.abs(loads - 1).max() < 0.02


@pytest.mark.parametrize("effects", [(), ("presliding:x_s=0.001,zeta=0.5",)])
def test_a_lumped_servo_that_turns_the_other_way_has_mujocos_derivatives_too(effects):
    sheet = replace(
        SHEET, parameters={}, lumped={"a_1": 28.0, "a_2": 56.0, "b": -81.0, "c_1": 10.0, "c_2": 20.0, "theta_0": 0.1}
    )
    pair = [
        linearised(build_plant(sheet, plant=kind, effects=[parse_effect(text) for text in effects]), 1000.0, 0.3)
        for kind in ("reduced", "mujoco")
    ]
    np.testing.assert_allclose(pair[1].response(F_HZ) / pair[0].response(F_HZ), np.ones(F_HZ.size), atol=0.04)


def test_effects_that_no_linear_plant_has_are_named():
    plant = build_plant(
        SHEET,
        plant="mujoco",
        effects=[parse_effect(text) for text in ("stribeck:dF_s=0.1,v_s=0.2", "voltage_saturation:u_max=9")],
    )
    assert linearised(plant, 1000.0, HOME + 0.1).left_out == ("voltage_saturation", "stribeck")
    slope = linearised(build_plant(SHEET, effects=[parse_effect("stribeck:dF_s=0.1,v_s=0.5")]), 1000.0, HOME + 0.1, 0.4)
    plain = linearised(build_plant(SHEET), 1000.0, HOME + 0.1, 0.4)
    assert abs(slope.load_response(np.array([1.0]))[0]) > 1.1 * abs(
        plain.load_response(np.array([1.0]))[0]
    )  # friction that falls undamps
