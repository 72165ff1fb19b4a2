"""What a servo is told: which column is the input, of which kind, and what stands beside it."""

import numpy as np
import pytest

from ers_mj import cli
from ers_mj.data.columns import per
from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays, read_recording, write_recording
from ers_mj.errors import InputError

N = 400


@pytest.fixture
def rig():
    """Columns without an input: time, and an output in rad that follows some command."""
    t = 0.01 * np.arange(N)
    return {"t_s": t, "theta_rad": 0.5 * np.sin(2 * t) + 1e-4 * np.random.default_rng(1).normal(size=N)}


@pytest.fixture
def put(tmp_path):
    def write(name="rec.csv", **columns):
        write_recording(tmp_path / name, columns)
        return str(tmp_path / name)

    return write


def command(columns, factor=1.0):
    return factor * np.sin(2 * columns["t_s"] + 0.3)


@pytest.mark.parametrize(
    ("column", "kind", "unit"),
    [
        ("u_V", "voltage", "V"),
        ("u_duty_pct", "duty", "pct"),
        ("tau_cmd_Nm", "torque", "N m"),
        ("i_cmd_A", "current", "A"),
        ("theta_ref_rad", "position", "rad"),
    ],
)
def test_the_column_tells_the_kind_of_input(rig, put, column, kind, unit):
    record = read_recording(put(**rig, **{column: command(rig)}))
    assert (record.input_kind, record.input_unit) == (kind, unit)
    np.testing.assert_array_equal(record.u, command(rig))
    assert column in record.columns()
    if kind != "position":
        assert trace_of(record, None).input_kind == kind


def test_a_position_command_comes_in_the_outputs_unit(rig, put):
    record = read_recording(put(**rig, theta_ref_deg=command(rig, 60.0)))
    assert (record.input_kind, record.input_unit, record.reference) == ("position", "rad", None)
    np.testing.assert_allclose(record.u, np.radians(command(rig, 60.0)))


def test_a_reference_beside_another_input_stays_a_reference(rig, put):
    record = read_recording(put(**rig, u_V=command(rig), theta_ref_rad=command(rig, 0.5)))
    assert record.input_kind == "voltage"
    np.testing.assert_array_equal(record.reference, command(rig, 0.5))


def test_input_chooses_and_second_is_kept_beside(rig, put):
    file = put(**rig, u_V=command(rig), u_duty_pct=command(rig, 50.0), theta_ref_rad=command(rig, 0.5))
    with pytest.raises(InputError, match="u_V, u_duty_pct are all inputs, choose one with --input"):
        read_recording(file)
    assert read_recording(file, input_column="u_duty_pct").input_kind == "duty"
    record = read_recording(file, input_column="theta_ref_rad", second="u_duty_pct")
    assert (record.input_kind, record.second_name, record.second_unit) == ("position", "u_duty_pct", "pct")
    np.testing.assert_array_equal(record.second, command(rig, 50.0))


def test_a_second_signal_leaves_the_position_command_the_input(rig, put):
    record = read_recording(put(**rig, u_V=command(rig), theta_ref_rad=command(rig, 0.5)), second="u_V")
    assert (record.input_kind, record.second_name) == ("position", "u_V")
    assert {"u_V", "theta_ref_rad"} < set(record.columns())


def test_columns_of_another_name_are_asked_for_by_either_name(rig, put):
    file = put(**rig, pwm=command(rig, 40.0), goal=command(rig))
    names = {"u_duty_pct": "pwm", "theta_ref_rad": "goal"}
    for second in ("pwm", "u_duty_pct"):
        assert read_recording(file, names, input_column="goal", second=second).second_name == "u_duty_pct"


def test_further_columns_and_constants_are_kept(rig, put):
    beside = {"vin_V": 12.0 + 0 * rig["t_s"], "direction": np.sign(command(rig)), "temp_C": 30.0 + rig["t_s"]}
    constants = {"kp": np.full(N, 32.0), "load_kg": np.full(N, 0.5), "arm_m": np.full(N, 0.1)}
    record = read_recording(put(**rig, u_V=command(rig), **beside, **constants))
    assert (record.kp, record.load_kg, record.arm_m) == (32.0, 0.5, 0.1)
    np.testing.assert_array_equal(record.direction, beside["direction"])
    np.testing.assert_array_equal(record.columns()["kp"], constants["kp"])


REFUSED = {
    "an input that is not there": ({"input_column": "i_A"}, "--input asks for 'i_A', there are u_V, theta_ref_rad"),
    "an output as the input": ({"input_column": "theta_rad"}, "there are u_V, theta_ref_rad"),
    "a second that is not there": ({"second": "duty"}, "--second asks for 'duty'"),
    "one column twice": ({"input_column": "u_V", "second": "u_V"}, "u_V is the input"),
}


@pytest.mark.parametrize(("asked", "words"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_chosen_is_refused(rig, put, asked, words):
    with pytest.raises(InputError, match=words):
        read_recording(put(**rig, u_V=command(rig), theta_ref_rad=command(rig)), **asked)


def test_a_position_command_in_another_unit_than_the_outputs_is_refused(rig, put):
    with pytest.raises(InputError, match=r"x_ref_m is in m and the output theta_rad in rad"):
        read_recording(put(**rig, x_ref_m=command(rig)))
    with pytest.raises(InputError, match="command is in m and the output in rad"):
        from_arrays(rig["t_s"], command(rig), rig["theta_rad"], input_unit="m")


def test_a_constant_that_changes_is_refused(rig, put):
    with pytest.raises(InputError, match="kp changes in data row 201, one value a recording"):
        read_recording(put(**rig, u_V=command(rig), kp=np.where(np.arange(N) < 200, 8.0, 16.0)))


def test_kinds_of_input_are_not_mixed(rig, put, capsys):
    volts, torques = put("a.csv", **rig, u_V=command(rig)), put("b.csv", **rig, tau_cmd_Nm=command(rig))
    assert cli.main(["diagnose", volts, torques, "--json"]) == 2
    assert "b.csv: its input is a torque and that of a.csv a voltage" in capsys.readouterr().err


def test_a_product_below_a_stroke_stands_in_brackets():
    assert [per(unit) for unit in ("V", "N m")] == ["V", "(N m)"]


def test_arrays_tell_their_kind_by_the_unit(rig):
    t, y = rig["t_s"], rig["theta_rad"]
    assert from_arrays(t, command(rig), y, input_unit="rad", kp=16.0).input_kind == "position"
    assert from_arrays(t, command(rig), y, input_unit="N m").input_kind == "torque"
