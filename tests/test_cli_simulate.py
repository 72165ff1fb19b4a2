"""`ers simulate`: the recording that it writes, of either plant."""

import json

import numpy as np
import pytest
from command_files import T, lay_out

from ers_mj import cli
from ers_mj.data.recording import read_recording
from ers_mj.door.simulating import simulate
from ers_mj.servo.datasheet import read_datasheet


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lay_out(tmp_path)


def test_simulate_writes_a_recording_in_the_contracts_format(place, capsys):
    assert (
        cli.main(
            "simulate --plant reduced --input multisine --rate-hz 500 --duration 4 --noise-deg 0.01 --seed 3 --out"
            " new.csv --json".split()
        )
        == 0
    )
    summary = json.loads(capsys.readouterr().out)
    recording = read_recording(place / "new.csv")
    assert (place / "new.csv").read_text().startswith("t_s,u_V,theta_rad\n")
    assert recording.t.size == summary["samples"] == 2000 and recording.rate_hz == pytest.approx(500)
    assert np.degrees(recording.y.std()) > 2
    first = (place / "new.csv").read_bytes()
    again = "simulate --input multisine --rate-hz 500 --duration 4 --noise-deg 0.01 --seed 3 --out new.csv --force"
    assert cli.main(again.split()) == 0
    assert (place / "new.csv").read_bytes() == first


def test_simulate_keeps_the_users_times_and_voltages(place):
    assert cli.main("simulate --input volts.csv --out deep/new.csv".split()) == 0
    recording = read_recording(place / "deep/new.csv")
    np.testing.assert_array_equal(recording.t, T)
    np.testing.assert_array_equal(recording.u, 8 * np.sin(3 * T))
    assert recording.y[0] == pytest.approx(np.radians(15), abs=1e-12)


def test_a_magnitude_takes_its_sign_from_the_direction(place):
    u = 8 * np.sin(3 * T)
    table = np.column_stack([T, np.abs(u), u >= 0.0])
    np.savetxt("signs.csv", table, delimiter=",", header="t_s,u_V,direction", comments="", fmt="%.17g")
    assert cli.main("simulate --input signs.csv --out new.csv".split()) == 0
    np.testing.assert_array_equal(read_recording(place / "new.csv").u, u)


def simulated(place, options: str) -> np.ndarray:
    """theta (N,) [rad] of the file that a call of simulate writes."""
    assert cli.main(f"simulate --input steps --out new.csv --force {options}".split()) == 0
    return read_recording(place / "new.csv").y


def rms_deg(x: np.ndarray) -> float:
    return float(np.degrees(np.sqrt(np.mean(x**2))))


@pytest.mark.parametrize("inductance", ["off", "on"])
@pytest.mark.parametrize("gap", ["0", "0.5"])
def test_a_gap_is_the_same_play_on_both_plants(gap, inductance, place):
    options = f"--duration 2 --gap {gap} --inductance {inductance}"
    reduced, mujoco = simulated(place, options), simulated(place, f"--plant mujoco {options}")
    assert rms_deg(reduced - mujoco) < 0.02
    if gap != "0":
        assert rms_deg(reduced - simulated(place, "--duration 2")) > 0.1


def test_mujoco_simulates_rods_lumped_models_and_effects(place):
    short = "--duration 1 --plant mujoco"
    assert rms_deg(simulated(place, f"{short} --linkage rod") - simulated(place, short)) > 0.1
    lumped = simulated(place, f"lumped.toml {short}"), simulated(place, "lumped.toml --duration 1")
    assert rms_deg(lumped[0] - lumped[1]) < 0.01
    stopped = [
        simulated(place, f"--duration 1 {plant} --effect end_stop:upper=0.6,f_stop=80")
        for plant in ("", "--plant mujoco")
    ]
    assert stopped[0].max() < 0.7 and rms_deg(stopped[0] - stopped[1]) < 0.02


def test_play_as_printed_is_another_motion(place):
    printed, plain = simulated(place, "--duration 2 --gap 5 --play printed"), simulated(place, "--duration 2")
    assert 0.05 < rms_deg(printed - plain) < 5


def test_effects_act_in_si(place):
    def theta(options: str) -> np.ndarray:
        return simulated(place, options)

    plain = theta("")
    stopped = theta("--effect end_stop:upper=0.6,f_stop=80")
    assert plain.max() > 0.8 and 0.6 < stopped.max() < 0.68
    np.testing.assert_array_equal(theta("--gap 0"), plain)
    assert np.abs(theta("--inductance on") - plain).max() > 1e-6
    strong = theta("--effect bias_torque:tau_0=0.9")  # above F_c + T_LH = 0.8 N m: moves off without voltage
    weak = theta("--effect bias_torque:tau_0=0.7")
    assert strong[200] > strong[0] + 1e-3 and weak[200] == weak[0]
    steps = theta("--effect sensor_quantisation:step=0.01 --noise-deg 0.1") / 0.01
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)


def test_a_model_simulates_with_its_own_effects(place):
    (place / "model.toml").write_text(
        read_text_of_table1() + '[[effect]]\nname = "end_stop"\n[effect.parameters]\nupper = 0.6\n'
    )
    assert cli.main("simulate model.toml --input steps --out new.csv".split()) == 0
    assert read_recording(place / "new.csv").y.max() < 0.7


def read_text_of_table1() -> str:
    return "[parameters]\n" + "".join(f"{key} = {x!r}\n" for key, x in read_datasheet("table1").parameters.items())


@pytest.mark.parametrize(
    ("input_unit", "output_unit", "columns"),
    [("N m", "rad", "tau_cmd_Nm,theta_rad"), ("%", "V", "u_duty_pct,y_sensor_V"), ("V", "m", "u_V,x_m")],
)
def test_a_recording_has_the_units_of_its_model(tmp_path, capsys, input_unit, output_unit, columns):
    model, signal, out = tmp_path / "model.toml", tmp_path / "in.csv", tmp_path / "out.csv"
    model.write_text(
        "[lumped]\na_2 = 5.0\nb = 2.0\nc_2 = 0.1\n"
        f'[recording]\noutput_unit = "{output_unit}"\ninput_unit = "{input_unit}"\n'
    )
    signal.write_text(f"t_s,{columns.split(',')[0]}\n" + "".join(f"{0.01 * k},1.0\n" for k in range(200)))
    assert cli.main(["simulate", str(model), "--input", str(signal), "--out", str(out)]) == 0
    assert out.read_text().splitlines()[0] == f"t_s,{columns}"
    assert ("deg" if output_unit == "rad" else f" {output_unit},") in capsys.readouterr().out
    assert read_recording(out).output_unit == output_unit and read_recording(out).input_unit in (input_unit, "pct")
    named = ["simulate", str(model), "--input", "steps", "--out", str(tmp_path / "named.csv")]
    assert cli.main(named) == (0 if input_unit == "V" else 2)
    turned = [*named, "--noise-deg", "1"]
    assert output_unit == "rad" or cli.main(turned) == 2


def test_friction_that_creeps_comes_back_from_a_file(tmp_path):
    """Without the bristle that it has not."""
    model = tmp_path / "model.toml"
    model.write_text(
        '[lumped]\na_2 = 5.0\nb = 2.0\nc_2 = 2.0\n[[effect]]\nname = "presliding"\n'
        "[effect.parameters]\nv_c = 0.005\nT_c = 0.01\n"
    )
    t = 0.001 * np.arange(1000)
    creeping = simulate(model, (t, np.full(t.size, 0.9)), plant="reduced").theta
    held = simulate({"lumped": {"a_2": 5.0, "b": 2.0, "c_2": 2.0}}, (t, np.full(t.size, 0.9))).theta
    assert held[-1] == 0.0 and 1e-3 < creeping[-1] < 0.01
