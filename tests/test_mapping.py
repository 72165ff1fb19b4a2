"""What a person says of the columns of a file: other names, units, factors, arithmetic; and what headers say."""

import math

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from ers_mj import cli
from ers_mj.data.mapping import read_map_file
from ers_mj.data.recording import read_recording
from ers_mj.data.units import conversion, counts_per_turn, split_header, unit_named
from ers_mj.errors import InputError

N = 300
T = 0.01 * np.arange(N)
U = np.sin(3 * T) + 0.2
THETA = 0.4 * np.sin(2 * T)


@pytest.fixture
def put(tmp_path):
    def write(columns, name="rec.csv"):
        lines = [",".join(columns), *(",".join(map(repr, row)) for row in zip(*(x.tolist() for x in columns.values())))]
        (tmp_path / name).write_text("\n".join(lines) + "\n")
        return str(tmp_path / name)

    return write


MAPPED = {
    "another name": ({"clock": T, "v": U, "angle": THETA}, {"t_s": "clock", "u_V": "v", "theta_rad": "angle"}),
    "a unit": (
        {"clock": 1e3 * T, "v": 1e3 * U, "angle": np.degrees(THETA)},
        {"t_s": "clock [ms]", "u_V": "v [mV]", "theta_rad": "angle [deg]"},
    ),
    "a unit that stands in the header": (
        {"Time [ms]": 1e3 * T, "v": U, "Angle (deg)": np.degrees(THETA)},
        {"t_s": "Time [ms]", "u_V": "v", "theta_rad": "Angle (deg)"},
    ),
    "a unit that names end in": (
        {"time_ms": 1e3 * T, "cmd_mV": 1e3 * U, "joint_deg": np.degrees(THETA)},
        {"t_s": "time_ms", "u_V": "cmd_mV", "theta_rad": "joint_deg"},
    ),
    "names that end in words and letters": (
        {"t_min": T, "v_in": U, "angle_rot": THETA},
        {"t_s": "t_min", "u_V": "v_in", "theta_rad": "angle_rot"},
    ),
    "the column's name less the unit of its header": (
        {"Time": 1e3 * T, "v": U, "angle": np.degrees(THETA)},
        {"t_s": "Time [ms]", "u_V": "v", "theta_deg": "angle"},
    ),
    "counts a turn": (
        {"t_s": T, "u_V": U, "enc": THETA * 4096 / (2 * np.pi)},
        {"theta_rad": "enc:counts/4096"},
    ),
    "arithmetic": (
        {"t_s": T, "pwm": (U - 0.2) * 255 / 24 + 3, "raw": -THETA, "zero": np.full(N, 0.5)},
        {"u_V": "(pwm - 3) * 24/255 + 2e-1", "theta_rad": "zero - raw - zero"},
    ),
    "a name that looks like arithmetic": ({"t_s": T, "a-b/2": U, "x y": THETA}, {"u_V": "a-b/2", "theta_rad": "x y*1"}),
    "arithmetic with a unit": ({"t_s": T, "u_V": U, "a": THETA - 1}, {"theta_rad": "a + 1 [rad]"}),
}


@pytest.mark.parametrize(("columns", "mapping"), MAPPED.values(), ids=MAPPED)
def test_a_mapping_brings_columns_to_the_recordings_units(put, columns, mapping):
    record = read_recording(put(columns), mapping)
    for found, expected in ((record.t, T), (record.u, U), (record.y, THETA)):
        np.testing.assert_allclose(found, expected, atol=1e-12)


def test_what_was_assumed_is_told_and_what_was_given_is_not_doubted(put):
    columns = {"t_s": T, "u_V": U, "enc": np.rint(np.degrees(THETA) * 40)}
    record = read_recording(put(columns), {"theta_rad": "enc [rad]"})
    assert "theta_rad is enc in rad" in record.problems
    assert record.faults == ()
    slow = read_recording(put(columns | {"t_s": 1000 * T, "enc": THETA}), {"t_s": "t_s [s]", "theta_rad": "enc"})
    assert slow.sample_time == pytest.approx(10.0)


def test_headers_with_units_need_no_mapping(put):
    record = read_recording(put({"Time [ms]": 1e3 * T, "Voltage [mV]": 1e3 * U, "Angle [deg]": np.degrees(THETA)}))
    np.testing.assert_allclose(record.y, THETA)
    np.testing.assert_allclose(record.u, U)
    np.testing.assert_allclose(record.t, T)
    assert "t_s is Time [ms], in ms as its header says" in record.problems


REFUSED = {
    "no such column": ({"u_V": "volts*2"}, r"--map asks for the column 'volts\*2', the columns are t_s, v, theta_rad"),
    "an unknown unit": ({"u_V": "v [furlong]"}, "u_V is given in 'furlong', which is no unit that is known"),
    "a unit of something else": ({"u_V": "v [mA]"}, "u_V is given in 'mA', which measures something else"),
    "counts without their number": ({"theta_rad": "theta_rad [counts]"}, "how many make a turn, as in counts/4096"),
    "half an expression": ({"u_V": "v*(2+"}, r"--map gives 'v\*\(2\+', which cannot be worked out"),
    "a division by zero": ({"u_V": "v/0"}, "a division by zero"),
    "code": ({"u_V": "__import__('os')"}, "--map asks for the column"),
    "deep brackets": ({"u_V": "(" * 999 + "v" + ")" * 999}, "cannot be worked out"),
    "signs without end": ({"u_V": "-" * 9999 + "v"}, "cannot be worked out"),
}


@pytest.mark.parametrize(("mapping", "words"), REFUSED.values(), ids=REFUSED)
def test_a_mapping_that_means_nothing_is_refused(put, mapping, words):
    with pytest.raises(InputError, match=words):
        read_recording(put({"t_s": T, "v": U, "theta_rad": THETA}), {"u_V": "v"} | mapping)


UNITS = {
    "Nm": 1.0,
    "N m": 1.0,
    "N.m": 1.0,
    "N·m": 1.0,
    "mNm": 1e-3,
    "kgf.cm": 0.0980665,
    "kg-cm": 0.0980665,
    "oz-in": 0.00706155,
    "ozf·in": 0.00706155,
    "lb-ft": 1.3558179,
    "rpm": math.pi / 30,
    "1/min": math.pi / 30,
    "min-1": math.pi / 30,
    "deg/s": math.pi / 180,
    "°/s": math.pi / 180,
    "rev/s": 2 * math.pi,
    "µs": 1e-6,
    "V/krpm": 0.0095493,
    "kgcm2": 1e-4,
    "kg cm^2": 1e-4,
    "oz-in-s^2": 0.00706155,
    "mNm/A": 1e-3,
    "Ohm": 1.0,
    "mH": 1e-3,
    "%": 1.0,
}


@pytest.mark.parametrize(("text", "factor"), UNITS.items())
def test_the_units_of_servo_logs_mean_what_they_mean_there(text, factor):
    assert unit_named(text).factor == pytest.approx(factor, rel=1e-5)


def test_what_is_no_unit_stays_none():
    assert [unit_named(text) for text in ("furlong", "", "MNm", "theta", "Nm/rad/s")] == [None] * 5
    assert conversion("Nm", "A") is None
    assert conversion("C", "degC").offset == 0.0
    assert conversion("K", "degC").offset == -273.15
    assert counts_per_turn("counts/0") is None
    assert split_header("Angle") == ("Angle", None)
    assert split_header("state[3]") == ("state[3]", None)


def test_elements_of_lists_and_episodes(tmp_path):
    state = np.column_stack([THETA, 2 * THETA, 3 * THETA])
    table = pa.table(
        {
            "timestamp": np.r_[T, T],
            "action": pa.array(list(np.r_[U, U][:, None]), pa.list_(pa.float64(), 1)),
            "observation.state": pa.array(list(np.r_[state, -state])),
            "episode_index": np.repeat([0, 1], N),
            "frame_index": np.tile(np.arange(N), 2),
        }
    )
    parquet.write_table(table, tmp_path / "episodes.parquet")
    file = str(tmp_path / "episodes.parquet")
    names = {"t_s": "timestamp", "theta_ref_rad": "action[0]", "theta_rad": "observation.state[1]"}
    record = read_recording(file, names, episode=1)
    np.testing.assert_allclose(record.y, -2 * THETA)
    assert any("frame / fps" in problem for problem in record.problems)
    with pytest.raises(InputError, match=r"#run=0 and the episode 1 were both given"):
        read_recording(f"{file}#run=0", names, episode=1)
    with pytest.raises(InputError, match=r"choose one as in episodes.parquet#run=0"):
        read_recording(file, names)
    with pytest.raises(InputError, match=r"have 3 elements, there is no observation.state\[3\]"):
        read_recording(file, names | {"theta_rad": "observation.state[3]"}, episode=0)
    with pytest.raises(InputError, match=r"holds lists, choose an element as in --map NAME=observation.state\[0\]"):
        read_recording(file, names | {"theta_rad": "observation.state"}, episode=0)
    with pytest.raises(InputError, match=r"choose an element|asks for an element"):
        read_recording(file, names | {"t_s": "timestamp[0]"}, episode=0)


def test_a_mapping_is_kept_in_a_file(put, tmp_path, capsys):
    kept = tmp_path / "rig.toml"
    kept.write_text('input = "u_V"\n[map]\nt_s = "clock [ms]"\nu_V = "v"\ntheta_rad = "angle"\n')
    assert read_map_file(kept)["map"]["t_s"] == "clock [ms]"
    file = put({"clock": 1e3 * T, "v": U, "angle": np.full(N, 1.0)})
    assert cli.main(["diagnose", file, "--map-file", str(kept), "--json"]) == 2
    assert "the output angle is constant" in capsys.readouterr().err
    kept.write_text('maps = "u"\n')
    assert cli.main(["diagnose", file, "--map-file", str(kept), "--json"]) == 2
    assert "rig.toml: holds maps, known are map, input, second, episode, dbc" in capsys.readouterr().err
