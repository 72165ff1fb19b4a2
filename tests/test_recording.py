"""A recording is read whole and in SI; nothing is passed over in silence."""

import pickle

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from csv_made import N, csv_text, problem, put

from ers_mj.data.recording import from_arrays, read_recording, write_recording
from ers_mj.errors import InputError


def test_a_clean_recording_is_read_exactly_and_has_no_problem(tmp_path, columns):
    record = read_recording(put(tmp_path, csv_text(columns)))
    for field, x in zip("tuy", columns.values(), strict=True):
        np.testing.assert_array_equal(getattr(record, field), x)
    assert record.problems == ()
    assert (record.input_unit, record.output_unit, record.name) == ("V", "rad", "rec.csv")
    assert record.valid.all() and len(record.sha256) == 64
    assert record.duration == pytest.approx(0.399)
    assert record.rate_hz == pytest.approx(1000)


@pytest.mark.parametrize(
    "rewrite",
    [
        lambda text: "\ufeff" + text,
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("t_s,u_V", " t_s , u_V "),
        lambda text: text.replace("t_s,u_V", '"t_s","u_V"'),
        lambda text: text.replace(",", " , "),
        lambda text: text.replace(",", ";").replace(".", ","),
        lambda text: text.replace(",", "\t"),
        lambda text: "\n" + text + "\n\n",
    ],
    ids=["BOM", "CRLF", "header spaces", "quotes", "cell spaces", "semicolons", "tabs", "blank lines"],
)
def test_the_dialects_of_csv_say_the_same(tmp_path, columns, rewrite):
    record = read_recording(put(tmp_path, rewrite(csv_text(columns))))
    np.testing.assert_array_equal(record.y, columns["theta_rad"])
    np.testing.assert_array_equal(record.u, columns["u_V"])


@pytest.mark.parametrize(
    ("name", "factor", "unit"),
    [("theta_rad", 1, "rad"), ("theta_deg", np.pi / 180, "rad"), ("x_m", 1, "m"), ("y_sensor_V", 1, "V")],
)
def test_each_output_is_converted(tmp_path, columns, name, factor, unit):
    theta = columns.pop("theta_rad")
    record = read_recording(put(tmp_path, csv_text(columns | {name: theta})))
    np.testing.assert_array_equal(record.y, theta * factor)
    assert record.output_unit == unit


def test_optional_columns_are_taken_and_foreign_ones_told(tmp_path, columns):
    optional = ["omega_rad_s", "i_A", "theta_m_rad", "vin_V", "T_L_Nm", "temp_C", "theta_ref_deg"]
    more = dict.fromkeys(optional, columns["u_V"]) | {"torque_enable": columns["t_s"] > 0.1}
    more = {name: np.asarray(x, float) for name, x in more.items()} | {"F_N": columns["u_V"]}
    record = read_recording(put(tmp_path, csv_text(columns | more)))
    for field in ("omega", "current", "theta_m", "vin", "load", "temperature"):
        np.testing.assert_array_equal(getattr(record, field), columns["u_V"])
    np.testing.assert_allclose(record.reference, np.radians(columns["u_V"]))
    assert record.enable.dtype == bool and record.enable.sum() == N - 101
    assert problem(record, "ignored").endswith("ignored: F_N")


def test_a_reference_in_another_unit_than_the_output_is_ignored(tmp_path, columns):
    record = read_recording(put(tmp_path, csv_text(columns | {"x_ref_m": columns["u_V"]})))
    assert record.reference is None
    assert "x_ref_m" in problem(record, "ignored")


def test_map_takes_other_names_and_settles_which_output_counts(tmp_path, columns):
    t, u, theta = columns.values()
    text = csv_text({"zeit": t, "u_V": u, "theta_rad": u, "winkel": theta})
    record = read_recording(put(tmp_path, text), {"t_s": "zeit", "theta_rad": "winkel"})
    np.testing.assert_array_equal(record.y, theta)
    assert problem(record, "ignored").endswith(": theta_rad")


def test_time_may_start_anywhere(tmp_path, columns):
    record = read_recording(put(tmp_path, csv_text(columns | {"t_s": columns["t_s"] - 17.0})))
    assert record.t[0] == -17.0
    assert record.problems == ()


@pytest.mark.parametrize("dtype", ["float32", "float64", "string"])
def test_one_run_of_a_parquet_file(tmp_path, columns, dtype):
    twice = {name: np.concatenate([x, x + 1e-3]) for name, x in columns.items()}
    table = {name: pa.array(x).cast(dtype) for name, x in twice.items()} | {"run": np.repeat([3, 17], N)}
    pa.parquet.write_table(pa.table(table), tmp_path / "runs.parquet")
    record = read_recording(f"{tmp_path}/runs.parquet#run=17")
    assert record.name == "runs.parquet#run=17"
    np.testing.assert_allclose(record.y, columns["theta_rad"] + 1e-3, atol=1e-6)
    assert not [p for p in record.problems if "run" in p]


def test_a_record_is_locked_and_leaves_the_callers_arrays_alone(columns):
    given = [x.copy() for x in columns.values()]
    given[1][5] = np.nan
    before = [x.copy() for x in given]
    record = from_arrays(*given, current=given[1])
    for x, y in zip(given, before, strict=True):
        np.testing.assert_array_equal(x, y)
        assert x.flags.writeable
    for copy in (record, pickle.loads(pickle.dumps(record))):
        for x in (copy.t, copy.u, copy.y, copy.valid, copy.current):
            with pytest.raises(ValueError, match="read-only"):
                x[0] = 0


def test_writing_and_reading_is_exact(tmp_path, columns):
    columns["theta_rad"][7] = np.nan
    first = from_arrays(*columns.values(), reference=columns["u_V"], enable=columns["t_s"] > 0.2)
    write_recording(tmp_path / "copy.csv", first.columns())
    second = read_recording(tmp_path / "copy.csv")
    for field in ("t", "u", "y", "valid", "reference", "enable"):
        np.testing.assert_array_equal(getattr(first, field), getattr(second, field))
    assert (tmp_path / "copy.csv").read_text().splitlines()[0] == "t_s,u_V,theta_rad,theta_ref_rad,torque_enable"
    assert [path.name for path in tmp_path.iterdir()] == ["copy.csv"]


def test_a_write_that_fails_leaves_nothing_behind(tmp_path, columns):
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(InputError, match=r"folder\.csv: cannot be written"):
        write_recording(tmp_path / "folder.csv", columns)
    with pytest.raises(InputError, match="one length"):
        write_recording(tmp_path / "b.csv", columns | {"u_V": [1.0]})
    assert [path.name for path in tmp_path.iterdir()] == ["folder.csv"]


def test_a_long_file_is_read_whole(tmp_path):
    t = np.arange(25_000) * 1e-3
    path = tmp_path / "long.csv"
    noise = np.random.default_rng(0).normal(size=(5, t.size))
    names = ["t_s", "u_V", "theta_rad", "i_A", "omega_rad_s", "vin_V"]
    write_recording(path, dict(zip(names, [t, *noise], strict=True)))
    recording = read_recording(path)
    assert all(np.array_equal(x, recording.columns()[name]) for name, x in zip(names, [t, *noise], strict=True))
