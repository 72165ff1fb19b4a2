"""A servo with a position loop of its own in `ers trial` and `ers frequency`: its firmware is the controller."""

import json
import math

import numpy as np
import pytest

import ers_mj as ers
from ers_mj.cli import main
from ers_mj.control.frequency.firmware import FirmwareLoop, study_firmware
from ers_mj.control.trial import Conditions, try_out
from ers_mj.servo.datasheet import read_datasheet

MODEL = """
[lumped]
a_1 = 0.0
a_2 = {a_2}
c_2 = {c_2}
[recording]
output_unit = "{unit}"
input_unit = "{unit}"
[baseline]
{effect}
[loop]
kind = "PI"
sensor = "{sensor}"
K = {K}
I = {I}
L = {L}
tau_s = 0.004
"""
PLAY = """
[[effect]]
name = "backlash"
parameters = {gap=0.01, rho=0.5, f_contact=40.0, zeta=0.3, phi=0.5}
"""


@pytest.fixture
def model(tmp_path):
    def write(effect="", sensor="load", unit="rad", **numbers):
        file = tmp_path / "model.toml"
        values = {"a_2": 25.0, "c_2": 1.0, "I": 0.0, "K": 900.0, "L": 300.0} | numbers
        text = MODEL.format(effect=effect, sensor=sensor, unit=unit, **values)
        file.write_text(text.replace("I = 0.0\n", "").replace('"PI"', '"P"') if not values["I"] else text)
        return file

    return write


def test_a_trial_runs_the_firmware_on_both_plants_alike(model, capsys):
    asked = [
        "trial",
        str(model(L=100.0)),
        "--plant",
        "reduced,mujoco",
        "--case",
        "step,square",
        "--rate-hz",
        "1000",
        "--json",
    ]
    assert main(asked) == 0
    told = json.loads(capsys.readouterr().out)
    assert {t["controller"] for t in told["trials"]} == {"firmware"}
    step, square = [[t for t in told["trials"] if t["case"] == case] for case in ("step", "square")]
    for reduced, multibody in (step, square):
        assert multibody["rmse_rad"] == pytest.approx(reduced["rmse_rad"], rel=0.02)
    assert step[0]["peak_u_V"] is None and step[0]["energy_J"] is None
    assert 0.0 < step[0]["saturated_share"] < 0.1
    assert "own loop" in told["sentence"] and "no voltage" in told["notes"][0]


def test_a_step_begins_where_it_rested(model):
    conditions = Conditions(rate_hz=1000.0, start=math.radians(20.0))
    (trial,) = try_out(read_datasheet(model()), ["firmware"], ["reduced"], ["step"], conditions)
    assert np.degrees(trial.run.theta[0]) == pytest.approx(20.0)
    assert np.degrees(trial.run.theta[-1]) == pytest.approx(30.0, abs=0.3)  # the friction holds the rest
    assert trial.run.theta[2] == trial.run.theta[0]  # the latency


@pytest.mark.parametrize(
    ("option", "value"),
    [("--umax-V", "12"), ("--controller", "pid"), ("--gap", "1"), ("--effect", "backlash:gap=0.01"), ("--plants", "3")],
)
def test_what_a_loop_has_no_place_for_is_refused(model, option, value, capsys):
    assert main(["trial", str(model()), option, value]) == 2
    assert option in capsys.readouterr().err


def test_a_travel_is_refused_beside_cases_that_are_angles(model, capsys):
    for command in (["trial", str(model(unit="m"))], ["frequency", "--datasheet", str(model(unit="m"))]):
        assert main(command) == 2
        assert "in m" in capsys.readouterr().err


def test_margins_are_those_of_the_linear_loop(model):
    """K / (s (s + a_2)) crosses 1 where w^2 (w^2 + a_2^2) = K^2."""
    conditions = Conditions(start=0.0, rate_hz=10_000.0)
    found = study_firmware(read_datasheet(model(c_2=0.0)), ["reduced", "mujoco"], conditions)
    w = math.sqrt(0.5 * (math.sqrt(25.0**4 + 4.0 * 900.0**2) - 25.0**2))
    for loop in found.loops:
        assert loop.gain_crossover_hz == pytest.approx(w / (2.0 * math.pi), rel=0.01)
        assert loop.phase_margin_deg == pytest.approx(math.degrees(math.atan2(25.0, w)), abs=0.5)
        assert loop.stable


def test_too_much_integral_is_unstable(model):
    """s^3 + a_2 s^2 + K s + I is stable up to I = a_2 K."""
    stable = [
        study_firmware(read_datasheet(model(c_2=0.0, I=share * 25.0 * 900.0)), ["reduced"], Conditions(start=0.0))
        .loops[0]
        .stable
        for share in (0.9, 1.1)
    ]
    assert stable == [True, False]


def test_a_play_that_a_load_s_sensor_sees_hunts(model):
    """Integral and play make a cycle that is predicted and seen, on both plants; seen by the motor's side it rests."""
    conditions, hunts = Conditions(start=0.0, rate_hz=1000.0), {"K": 1600.0, "I": 8000.0, "a_2": 20.0}
    hunting = study_firmware(read_datasheet(model(PLAY, **hunts)), ["reduced", "mujoco"], conditions).cycles[0]
    seen = [cycle.f_hz for cycle in hunting.seen.values()]
    assert seen[1] == pytest.approx(seen[0], rel=0.05)
    assert any(cycle.lasting and 0.5 < cycle.f_hz / seen[0] < 2.0 for cycle in hunting.predicted)
    resting = study_firmware(read_datasheet(model(PLAY, "motor", **hunts)), ["reduced"], conditions).cycles[0]
    assert resting.seen == {"reduced": None}


def test_a_play_is_closed_and_friction_shared_by_both_bodies(model):
    """Stiff contact: both bodies move as one, whichever carries the friction."""
    f_hz = np.array([1.0, 3.0])
    one = FirmwareLoop.of(read_datasheet(model()), "reduced")
    expected, _ = one.bodies(f_hz, 0.0, one.friction(0.02, f_hz))
    stiff = PLAY.replace("40.0", "150.0")
    for name in ("reduced", "mujoco"):
        loop = FirmwareLoop.of(read_datasheet(model(stiff)), name)
        for side in loop.bodies(f_hz, 0.0, loop.friction(0.02, f_hz)):
            np.testing.assert_allclose(side, expected, rtol=0.03)


def test_a_recording_of_the_model_is_the_model_s(model, tmp_path, capsys):
    t = np.arange(0.0, 20.0, 0.002)
    file = model(c_2=0.0, L=1e9)
    r = 0.2 * np.sin(2.0 * np.pi * (0.2 * t + 0.25 * t**2))
    theta = ers.simulate(file, input=(t, r), noise_deg=0.01).theta
    recording = tmp_path / "run.csv"
    np.savetxt(recording, np.c_[t, r, theta], delimiter=",", header="t_s,theta_ref_rad,theta_rad", comments="")
    asked = ["frequency", str(recording), "--datasheet", str(file), "--rate-hz", "2000", "--json"]
    assert main(asked) == 0
    told = json.loads(capsys.readouterr().out)
    gap = told["recordings"][0]["gaps"]["reduced, slipping"]
    assert gap["rms_db"] < 0.1 and gap["rms_deg"] < 1.0
    assert told["bandwidth_hz"] == pytest.approx(told["loops"][0]["bandwidth_hz"])


def test_a_recording_of_volts_is_refused_beside_a_loop(model, tmp_path, capsys):
    recording = tmp_path / "volts.csv"
    t = np.arange(0.0, 5.0, 0.01)
    np.savetxt(recording, np.c_[t, np.sin(t), np.sin(t)], delimiter=",", header="t_s,u_V,theta_rad", comments="")
    assert main(["frequency", str(recording), "--datasheet", str(model())]) == 2
    assert "position command" in capsys.readouterr().err
