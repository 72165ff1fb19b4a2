"""Files of all kinds are read whole, each made by its ecosystem's own writer (or after its published format)."""

import contextlib
import gzip
import io
import json
import sys

import numpy as np
import pyarrow as pa
import pytest
from files_made import BY_STAMP, COLUMNS, THETA, WRITERS, N, T, U, needs

from ers_mj.data.recording import read_recording
from ers_mj.errors import ErsError

NEAR = {"ArduPilot": 1e-4, "CAN": 2e-6, "ULog": 1e-6}  # what a format's own numbers resolve


def checked(made, atol=1e-9):
    """The recording of a file, which must hold COLUMNS."""
    record = read_recording(made.path, made.mapping, dbc=made.dbc)
    np.testing.assert_allclose(record.t - record.t[0], T, atol=max(atol, 1e-6))
    np.testing.assert_allclose(record.u, U, atol=atol)
    np.testing.assert_allclose(record.y, THETA, atol=atol)
    return record


def read(path, mapping=None):
    return read_recording(path, mapping)


@pytest.mark.parametrize("kind", WRITERS)
def test_a_file_of_each_kind_is_read(tmp_path, kind):
    checked(WRITERS[kind](tmp_path, COLUMNS), NEAR.get(kind, 1e-9))


@pytest.mark.parametrize("kind", [pa.ipc.new_file, pa.ipc.new_stream])
def test_both_forms_of_arrow(tmp_path, kind):
    table = pa.table(COLUMNS)
    with kind(tmp_path / "rec.arrow", table.schema) as sink:
        sink.write_table(table)
    np.testing.assert_array_equal(read(tmp_path / "rec.arrow").y, THETA)


def test_npz_with_constants_matrices_and_what_is_left_out(tmp_path):
    state = np.column_stack([THETA, -THETA])
    np.savez(tmp_path / "rec.npz", t=T, u_V=U, state=state, kp=16.0, tail=np.zeros(7), note=np.array("bench"))
    record = read(tmp_path / "rec.npz", {"t_s": "t", "theta_rad": "state[0]"})
    np.testing.assert_array_equal(record.y, THETA)
    assert record.kp == 16.0
    assert "arrays of another length than 400 are left out: tail (7)" in record.problems


def test_npy_with_fields(tmp_path):
    fields = np.zeros(N, [(name, float) for name in COLUMNS])
    for name, x in COLUMNS.items():
        fields[name] = x
    np.save(tmp_path / "rec.npy", fields)
    np.testing.assert_array_equal(read(tmp_path / "rec.npy").y, THETA)


def refusal(path, mapping=None):
    with pytest.raises(ErsError) as found:
        read(path, mapping)
    return str(found.value)


def test_npz_that_cannot_be_used(tmp_path):
    np.savez(tmp_path / "a.npz", t_s=np.array([T], object))
    assert "holds Python objects" in refusal(tmp_path / "a.npz")
    np.save(tmp_path / "a.npy", T)
    assert "one array without names" in refusal(tmp_path / "a.npy")
    np.savez(tmp_path / "c.npz", name=np.array(["a", "b"]))
    assert "no arrays of numbers" in refusal(tmp_path / "c.npz")
    np.savez(tmp_path / "d.npz", **COLUMNS | {"u_V": U[:-3]})
    assert "u_V cannot be used, it has 397 values and others 400" in refusal(tmp_path / "d.npz")


def test_json_records_lines_and_columns(tmp_path):
    rows = [{"t_s": t, "u": {"volts": u}, "theta_rad": y} for t, u, y in zip(*(x.tolist() for x in COLUMNS.values()))]
    rows[7]["theta_rad"] = None
    names = {"u_V": "u.volts"}
    (tmp_path / "rec.json").write_text(json.dumps({"samples": rows}))
    record = read(tmp_path / "rec.json", names)
    assert np.flatnonzero(~record.valid).tolist() == [7]
    lines = "\n".join(map(json.dumps, rows))
    for text in (lines, lines + '\n{"t_s": 4.'):  # the last one cut off, as a logger that was stopped leaves it
        (tmp_path / "rec.jsonl").write_text(text)
        np.testing.assert_array_equal(read(tmp_path / "rec.jsonl", names).y, record.y)
    (tmp_path / "rec.json").write_text(json.dumps({k: x.tolist() for k, x in COLUMNS.items()}))
    np.testing.assert_array_equal(read(tmp_path / "rec.json").y, THETA)
    (tmp_path / "rec.json").write_text("[1, 2, 3]")
    assert "a list of records, or a record of lists" in refusal(tmp_path / "rec.json")


def test_a_last_row_that_is_cut_off_is_left_out_and_said(tmp_path):
    made = WRITERS["CSV"](tmp_path, COLUMNS)
    made.path.write_text(made.path.read_text() + "4.0,0.")
    assert "the last row is cut off and left out" in checked(made).problems


def test_hdf5_with_groups_records_and_units(tmp_path):
    h5py = needs("h5py")
    fields = np.zeros(N, [("volts", float), ("flag", bool)])
    fields["volts"] = U
    with h5py.File(tmp_path / "rec.h5", "w") as root:
        root["bench/clock"] = 1e3 * T
        root["bench/clock"].attrs["units"] = "ms"
        root["bench/drive"] = fields
        root["bench/angle"] = np.degrees(THETA)
        root["bench/angle"].attrs["unit"] = "deg"
        root.create_dataset("nothing", data=h5py.Empty("f8"))
    names = {"t_s": "bench/clock", "u_V": "bench/drive.volts", "theta_rad": "bench/angle"}
    record = read(tmp_path / "rec.h5", names)
    np.testing.assert_allclose(record.y, THETA)
    np.testing.assert_allclose(record.t, T)
    assert "theta_rad is bench/angle, in deg as its file says" in record.problems


def test_a_bag_on_sqlite_and_the_mcap_of_a_bag_alone(tmp_path):
    from files_made import ros_bag

    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
    checked(ros_bag(tmp_path / "a", COLUMNS, "sqlite3"))
    bag = ros_bag(tmp_path / "b", COLUMNS)
    (single,) = bag.path.glob("*.mcap")
    checked(bag._replace(path=single))


@pytest.mark.parametrize("suffix", [".blf", ".trc", ".log"])
def test_can_logs_of_all_endings(tmp_path, suffix):
    from files_made import can_log

    checked(can_log(tmp_path, COLUMNS, suffix), 2e-5)


def test_can_frames_that_are_short_or_unknown_are_left_out_and_said(tmp_path):
    made = WRITERS["CAN"](tmp_path, COLUMNS)
    lines = made.path.read_text().splitlines()
    extra = [
        line.replace(" d 8 ", " d 3 ") if k % 2 else line.replace("100 ", "384 ") for k, line in enumerate(lines[-9:-5])
    ]
    made.path.write_text("\n".join([*lines[:-1], *extra, lines[-1]]))
    problems = checked(made, 2e-6).problems
    assert any("frames of Encoder are too short" in p for p in problems)
    assert any("does not know" in p for p in problems)


def test_a_can_log_without_its_dbc_or_with_another(tmp_path):
    made = WRITERS["CAN"](tmp_path, COLUMNS)
    assert "give --dbc FILE.dbc" in refusal(made.path)
    made.dbc.write_text(made.dbc.read_text().replace("256", "300").replace("257", "301"))
    with pytest.raises(ErsError, match=r"no whole message that rig.dbc knows, its identifiers are 0x100, 0x101"):
        read_recording(made.path, made.mapping, dbc=made.dbc)


def test_a_reader_that_is_not_installed_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyulog", None)
    (tmp_path / "rec.ulg").write_bytes(b"ULog")
    assert "pip install 'ers-mj[ulog]'" in refusal(tmp_path / "rec.ulg")


def test_packed_arrays_and_packed_logs(tmp_path):
    packed = io.BytesIO()
    np.savez(packed, **COLUMNS)
    (tmp_path / "rec.npz.gz").write_bytes(gzip.compress(packed.getvalue()))
    np.testing.assert_array_equal(read(tmp_path / "rec.npz.gz").y, THETA)
    (tmp_path / "rec.asc.gz").write_bytes(gzip.compress(b"date"))
    assert "is packed, unpack it first" in refusal(tmp_path / "rec.asc.gz")


@pytest.mark.filterwarnings("ignore")  # what libraries say of what they cannot read is theirs
@pytest.mark.parametrize("kind", ["npz", "JSON", "Arrow", "HDF5", "ULog"])
def test_damaged_files_are_read_or_refused_in_one_sentence(tmp_path, capsys, kind):
    made = WRITERS[kind](tmp_path, COLUMNS)
    rng = np.random.default_rng(11)
    whole = made.path.read_bytes()
    for trial in range(16):
        damaged = bytearray(whole[: int(len(whole) * rng.uniform())] if trial < 6 else whole)
        for place in rng.integers(0, min(len(damaged), 600) or 1, 12 if damaged and trial >= 6 else 0):
            damaged[place] = int(rng.integers(0, 256))
        made.path.write_bytes(bytes(damaged))
        with contextlib.suppress(ErsError):
            read_recording(made.path, made.mapping)
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("kind", BY_STAMP)
def test_rows_out_of_order_are_put_in_order(tmp_path, kind):
    late = np.arange(N)
    late[[200, 201]] = 201, 200
    checked(WRITERS[kind](tmp_path, {name: x[late] for name, x in COLUMNS.items()}), NEAR.get(kind, 1e-9))
