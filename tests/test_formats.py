"""Files of all kinds, each made by its ecosystem's own writer (or after its published format), and their faults."""

import contextlib
import gc
import io
import json
import struct

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import feather

from ers_mj.data.recording import read_recording
from ers_mj.errors import ErsError

N = 400
T = 0.01 * np.arange(N)
U = np.sin(3 * T) + 0.2
THETA = 0.4 * np.sin(2 * T) + 1e-4 * np.random.default_rng(5).normal(size=N)
COLUMNS = {"t_s": T, "u_V": U, "theta_rad": THETA}


def checked(path, mapping=None, atol=1e-9, **asked):
    """The recording of a file, which must hold COLUMNS."""
    record = read_recording(path, mapping, **asked)
    np.testing.assert_allclose(record.t - record.t[0], T[: record.t.size] - T[0], atol=atol)
    np.testing.assert_allclose(record.u, U, atol=max(atol, 1e-9))
    np.testing.assert_allclose(record.y, THETA, atol=max(atol, 1e-9))
    return record


def refusal(path, mapping=None, **asked):
    """The one sentence with which a file is refused."""
    with pytest.raises(ErsError) as found:
        read_recording(path, mapping, **asked)
    assert "\n" not in str(found.value)
    return str(found.value)


# -- arrays by name ----------------------------------------------------------------------------------------------------


def test_arrow_and_feather(tmp_path):
    table = pa.table(COLUMNS)
    feather.write_feather(table, tmp_path / "rec.feather")
    checked(tmp_path / "rec.feather")
    for kind in (pa.ipc.new_file, pa.ipc.new_stream):
        with kind(tmp_path / "rec.arrow", table.schema) as sink:
            sink.write_table(table)
        checked(tmp_path / "rec.arrow")
    (tmp_path / "rec.feather").write_bytes(b"ARROW1" + bytes(50))
    assert "not a readable Arrow file" in refusal(tmp_path / "rec.feather")


def test_npz_with_constants_matrices_and_what_is_left_out(tmp_path):
    state = np.column_stack([THETA, -THETA])
    np.savez(tmp_path / "rec.npz", t=T, u_V=U, state=state, kp=16.0, tail=np.zeros(7), note=np.array("bench"))
    record = checked(tmp_path / "rec.npz", {"t_s": "t", "theta_rad": "state[0]"})
    assert record.kp == 16.0
    assert "arrays of another length than 400 are left out: tail (7)" in record.problems
    fields = np.zeros(N, [(name, float) for name in COLUMNS])
    for name, x in COLUMNS.items():
        fields[name] = x
    np.save(tmp_path / "rec.npy", fields)
    checked(tmp_path / "rec.npy")


def test_npz_that_cannot_be_used(tmp_path):
    np.savez(tmp_path / "a.npz", t_s=np.array([T], object))
    assert "holds Python objects" in refusal(tmp_path / "a.npz")
    np.save(tmp_path / "a.npy", T)
    assert "one array without names" in refusal(tmp_path / "a.npy")
    (tmp_path / "b.npz").write_bytes(b"PK\x03\x04 no archive")
    assert "not a readable numpy file" in refusal(tmp_path / "b.npz")
    np.savez(tmp_path / "c.npz", name=np.array(["a", "b"]))
    assert "no arrays of numbers" in refusal(tmp_path / "c.npz")


def test_json_records_lines_and_columns(tmp_path):
    rows = [{"t_s": t, "u": {"volts": u}, "theta_rad": y} for t, u, y in zip(*(x.tolist() for x in COLUMNS.values()))]
    rows[7]["theta_rad"] = None
    names = {"u_V": "u.volts"}
    (tmp_path / "rec.json").write_text(json.dumps({"samples": rows}))
    record = read_recording(tmp_path / "rec.json", names)
    assert np.flatnonzero(~record.valid).tolist() == [7]
    (tmp_path / "rec.jsonl").write_text("\n".join(map(json.dumps, rows)))
    np.testing.assert_array_equal(read_recording(tmp_path / "rec.jsonl", names).y, record.y)
    (tmp_path / "rec.json").write_text(json.dumps({k: x.tolist() for k, x in COLUMNS.items()}))
    checked(tmp_path / "rec.json")
    (tmp_path / "rec.json").write_text('{"t_s": [0, 1')
    assert "not readable JSON" in refusal(tmp_path / "rec.json")
    (tmp_path / "rec.json").write_text("[1, 2, 3]")
    assert "a list of records, or a record of lists" in refusal(tmp_path / "rec.json")


def test_mat_of_version_5(tmp_path):
    from scipy.io import savemat

    savemat(tmp_path / "rec.mat", {"run": {"t_s": T[:, None], "u_V": U, "theta_rad": THETA, "kp": 8.0}, "empty": []})
    record = checked(tmp_path / "rec.mat", {name: f"run.{name}" for name in (*COLUMNS, "kp")})
    assert record.kp == 8.0
    (tmp_path / "rec.mat").write_bytes(b"MATLAB 5.0 MAT-file" + bytes(200))
    assert "not a readable MAT file" in refusal(tmp_path / "rec.mat")


def mat_73(path, h5py, build):
    """A file as MATLAB -v7.3 writes it: HDF5 behind a block of text, arrays turned."""
    with h5py.File(path, "w", userblock_size=512) as root:
        for name, x in COLUMNS.items():
            root.create_dataset(name, data=x[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
        build(root)
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM")


def test_mat_of_version_7_3_has_empties_that_are_no_data(tmp_path):
    h5py = pytest.importorskip("h5py")

    def build(root):
        empty = root.create_dataset("notes", data=np.array([0, 0], np.uint64))
        empty.attrs["MATLAB_class"], empty.attrs["MATLAB_empty"] = np.bytes_("double"), 1
        root.create_dataset("title", data=np.array([[98], [101]], np.uint16)).attrs["MATLAB_class"] = np.bytes_("char")
        root.create_dataset("state", data=np.vstack([THETA, U])).attrs["MATLAB_class"] = np.bytes_("double")

    mat_73(tmp_path / "rec.mat", h5py, build)
    record = checked(tmp_path / "rec.mat")
    assert not any("notes" in problem for problem in record.problems)
    np.testing.assert_array_equal(read_recording(tmp_path / "rec.mat", {"theta_rad": "state[0]"}).y, THETA)


def test_a_timeseries_of_matlab_is_refused_with_what_to_do(tmp_path):
    h5py = pytest.importorskip("h5py")

    def build(root):
        root.create_dataset("ts", data=np.zeros((1, 6), np.uint32)).attrs["MATLAB_object_decode"] = 3

    mat_73(tmp_path / "rec.mat", h5py, build)
    assert "ts is an object of MATLAB (a timeseries?), save its numbers" in refusal(tmp_path / "rec.mat")


def test_hdf5_with_groups_records_and_units(tmp_path):
    h5py = pytest.importorskip("h5py")
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
    record = checked(tmp_path / "rec.h5", names)
    assert "theta_rad is bench/angle, in deg as its file says" in record.problems
    (tmp_path / "rec.h5").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(90))
    assert "not a readable HDF5 file" in refusal(tmp_path / "rec.h5")


# -- signals on clocks of their own ------------------------------------------------------------------------------------


def slower(every=5):
    """The input as a slower clock has it: each value a little before the row in which it first acts."""
    return T[::every] - 0.002, U[::every]


def held(every=5):
    return U[every * (np.arange(N) // every)]


def test_mf4_holds_an_input_on_a_slower_clock(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as mdf:
        t, u = slower()
        mdf.append([asammdf.Signal(np.degrees(THETA), T + 5.0, name="Angle", unit="deg")])
        mdf.append([asammdf.Signal(u, t + 5.0, name="Volts", unit="V")])
        mdf.save(tmp_path / "rec.mf4")
    record = read_recording(tmp_path / "rec.mf4", {"theta_rad": "Angle", "u_V": "Volts"})
    np.testing.assert_allclose(record.t, T, atol=1e-9)
    np.testing.assert_allclose(record.y, THETA)
    np.testing.assert_array_equal(record.u, held())
    assert any("Volts" in p and "hold their last value" in p for p in record.problems)
    (tmp_path / "rec.mf4").write_bytes(b"MDF")
    assert "is no MDF file" in refusal(tmp_path / "rec.mf4")


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_mf4_that_is_cut_off(tmp_path):
    pytest.importorskip("asammdf")
    (tmp_path / "rec.mf4").write_bytes(b"MDF     4.10    " + bytes(100))
    assert "not a readable MDF file" in refusal(tmp_path / "rec.mf4")
    gc.collect()  # asammdf's destructor fails on what it has not read


def test_mcap_of_json(tmp_path):
    writing = pytest.importorskip("mcap.writer")
    with open(tmp_path / "rec.mcap", "wb") as file:
        writer = writing.Writer(file)
        writer.start()
        ids = {}
        for topic in ("/drive", "/encoder"):
            schema = writer.register_schema(name=topic[1:], encoding="jsonschema", data=b"{}")
            ids[topic] = writer.register_channel(topic=topic, message_encoding="json", schema_id=schema)
        for k in range(N):
            stamp = round((10.0 + T[k]) * 1e9)
            for topic, message in (("/drive", {"u": U[k]}), ("/encoder", {"angle": {"rad": THETA[k]}})):
                data = json.dumps(message).encode()
                writer.add_message(ids[topic], log_time=stamp, publish_time=stamp, data=data)
        writer.finish()
    checked(tmp_path / "rec.mcap", {"u_V": "/drive.u", "theta_rad": "/encoder.angle.rad"}, atol=1e-6)
    assert "the columns are" in refusal(tmp_path / "rec.mcap", {"u_V": "/drive.v", "theta_rad": "/encoder.angle.rad"})
    (tmp_path / "rec.mcap").write_bytes(b"\x89MCAP0\r\n" + bytes(40))
    assert "not a readable log of messages" in refusal(tmp_path / "rec.mcap")


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_bags_of_ros_2_by_joint_name(tmp_path, storage):
    writing = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    make = {
        name.rsplit("/", 1)[1]: kind
        for name, kind in store.types.items()
        if name.startswith(("std", "builtin", "sensor"))
    }
    plugin = {"sqlite3": writing.StoragePlugin.SQLITE3, "mcap": writing.StoragePlugin.MCAP}[storage]
    with writing.Writer(tmp_path / "bag", version=8, storage_plugin=plugin) as writer:
        joints = writer.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=store)
        drive = writer.add_connection("/drive", "std_msgs/msg/Float64", typestore=store)
        for k in range(N):
            log = 100 * 10**9 + round(1e9 * T[k])
            stamp = make["Time"](sec=log // 10**9, nanosec=log % 10**9)
            header = make["Header"](stamp=stamp, frame_id="")
            state = make["JointState"](
                header=header,
                name=["wrist", "elbow"],
                position=np.array([0.0, THETA[k]]),
                velocity=np.zeros(0),
                effort=np.zeros(1),
            )
            writer.write(drive, log, store.serialize_cdr(make["Float64"](data=U[k]), "std_msgs/msg/Float64"))
            writer.write(joints, log + 3_000_000, store.serialize_cdr(state, "sensor_msgs/msg/JointState"))
    names = {"u_V": "/drive.data", "theta_rad": "/joint_states.position[elbow]"}
    record = checked(tmp_path / "bag", names, atol=1e-6)
    assert any("effort" in p and "left out" in p for p in record.problems)
    turned = read_recording(tmp_path / "bag", names | {"theta_rad": "-/joint_states.position[elbow]"})
    np.testing.assert_allclose(turned.y, -THETA, atol=1e-6)
    if storage == "mcap":
        (single,) = (tmp_path / "bag").glob("*.mcap")
        checked(single, names, atol=1e-6)


def ulog(*topics):
    """A ULog after its format: header, formats, subscriptions, data."""
    out = [b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)]

    def message(kind, body):
        out.append(struct.pack("<HB", len(body), ord(kind)) + body)

    message("B", bytes(40))
    for name, _ in topics:
        message("F", f"{name}:uint64_t timestamp;float value;".encode())
    for number, (name, _) in enumerate(topics):
        message("A", struct.pack("<BH", 0, number) + name.encode())
    for number, (_, (times, values)) in enumerate(topics):
        for t, x in zip(times, values):
            message("D", struct.pack("<HQf", number, round(1e6 * (t + 3)), x))
    return b"".join(out)


def test_ulog_of_px4(tmp_path):
    pytest.importorskip("pyulog")
    (tmp_path / "rec.ulg").write_bytes(ulog(("drive", slower()), ("encoder", (T, THETA))))
    record = read_recording(tmp_path / "rec.ulg", {"u_V": "drive.value", "theta_rad": "encoder.value"})
    np.testing.assert_allclose(record.y, THETA, atol=1e-6)
    np.testing.assert_allclose(record.u, held(), atol=1e-6)
    (tmp_path / "rec.ulg").write_bytes(b"no log at all")
    assert "is no ULog file" in refusal(tmp_path / "rec.ulg")


def test_tdms_keeps_the_offset_of_each_waveform(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    begun = np.datetime64("2024-05-01T12:00:00", "us")

    def channel(name, x, step, offset, unit):
        properties = {"wf_start_time": begun, "wf_increment": step, "wf_start_offset": offset, "unit_string": unit}
        return nptdms.ChannelObject("bench", name, x, properties=properties)

    late = 0.005  # the input began that much earlier, so that each row sees its last value
    with nptdms.TdmsWriter(str(tmp_path / "rec.tdms")) as writer:
        writer.write_segment(
            [channel("angle", np.degrees(THETA), 0.01, 2.0, "deg"), channel("volts", U, 0.01, 2.0 - late, "V")]
        )
    record = checked(tmp_path / "rec.tdms", {"theta_rad": "angle", "u_V": "volts"})
    assert any("hold their last value" in p for p in record.problems)
    with nptdms.TdmsWriter(str(tmp_path / "plain.tdms")) as writer:
        writer.write_segment([nptdms.ChannelObject("bench", name, x) for name, x in COLUMNS.items()])
    checked(tmp_path / "plain.tdms")
    (tmp_path / "rec.tdms").write_bytes(b"no such file" * 9)
    assert "not a readable TDMS file" in refusal(tmp_path / "rec.tdms")


DBC = """VERSION ""
NS_ :
BS_:
BU_: ECU
BO_ 256 Drive: 4 ECU
 SG_ Volts : 0|32@1- (0.00001,0) [-100|100] "V" ECU
BO_ 257 Encoder: 8 ECU
 SG_ Angle : 0|32@1- (0.000001,0) [-10|10] "rad" ECU
 SG_ State : 32|8@1+ (1,0) [0|3] "" ECU
VAL_ 257 State 0 "off" 1 "on" ;
"""


@pytest.mark.parametrize("suffix", [".asc", ".blf", ".trc", ".log"])
def test_can_logs_with_a_dbc(tmp_path, suffix):
    can = pytest.importorskip("can")
    cantools = pytest.importorskip("cantools")
    (tmp_path / "rig.dbc").write_text(DBC)
    base = cantools.database.load_file(str(tmp_path / "rig.dbc"))
    with can.Logger(str(tmp_path / f"rec{suffix}")) as log:
        for k in range(N):
            drive = base.encode_message("Drive", {"Volts": U[k]})
            encoder = base.encode_message("Encoder", {"Angle": THETA[k], "State": 1})
            for number, data in ((256, drive), (257, encoder), (257, encoder[:3]), (900, b"\1\2")):
                stamp = 1000.0 + T[k] + (0.001 if len(data) == 3 else 0.0)
                log(can.Message(arbitration_id=number, data=data, timestamp=stamp, is_extended_id=False, channel=0))
    names = {"u_V": "Drive.Volts", "theta_rad": "Encoder.Angle"}
    record = checked(tmp_path / f"rec{suffix}", names, atol=2e-5, dbc=tmp_path / "rig.dbc")
    assert any(f"{N} frames of Encoder are too short" in p for p in record.problems)
    assert any("does not know" in p for p in record.problems)
    assert "give --dbc FILE.dbc" in refusal(tmp_path / f"rec{suffix}", names)
    (tmp_path / "other.dbc").write_text(DBC.replace("256", "300").replace("257", "301"))
    assert "holds no message that other.dbc knows" in refusal(
        tmp_path / f"rec{suffix}", names, dbc=tmp_path / "other.dbc"
    )


def dataflash():
    """A log of ArduPilot after its format, with a multiplier that its reader leaves to the unit."""
    formats = {
        128: ("FMT", "BBnNZ", "Type,Length,Name,Format,Columns", 89),
        129: ("UNIT", "QbZ", "TimeUS,Id,Label", 76),
        130: ("MULT", "Qbd", "TimeUS,Id,Mult", 20),
        131: ("FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds", 44),
        132: ("ENC", "Qfi", "TimeUS,V,Ang", 19),
    }
    head = lambda kind: b"\xa3\x95" + bytes([kind])
    out = [
        head(128) + struct.pack("<BB4s16s64s", kind, size, name.encode(), form.encode(), columns.encode())
        for kind, (name, form, columns, size) in formats.items()
    ]
    for mark, label in (("s", "s"), ("v", "V"), ("d", "deg")):
        out.append(head(129) + struct.pack("<Qb64s", 0, ord(mark), label.encode()))
    for mark, factor in (("F", 1e-6), ("0", 1.0), ("B", 1e-2)):
        out.append(head(130) + struct.pack("<Qbd", 0, ord(mark), factor))
    out.append(head(131) + struct.pack("<QB16s16s", 0, 132, b"svd", b"F0B"))
    for t, u, y in zip(T, U, THETA):
        out.append(head(132) + struct.pack("<Qfi", round(1e6 * (t + 1)), u, round(100 * np.degrees(y))))
    return b"".join(out)


def test_ardupilot_with_a_declared_multiplier(tmp_path):
    pytest.importorskip("pymavlink")
    (tmp_path / "rec.bin").write_bytes(dataflash())
    record = read_recording(tmp_path / "rec.bin", {"u_V": "ENC.V", "theta_rad": "ENC.Ang"})
    np.testing.assert_allclose(record.y, THETA, atol=1e-4)
    np.testing.assert_allclose(record.u, U, atol=1e-6)
    assert "theta_rad is ENC.Ang, in cdeg as its file says" in record.problems
    (tmp_path / "rec.bin").write_bytes(b"no log")
    assert "is no log of ArduPilot" in refusal(tmp_path / "rec.bin")


def test_a_reader_that_is_not_installed_is_named(tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "pyulog", None)
    (tmp_path / "rec.ulg").write_bytes(b"ULog")
    assert "pip install 'ers-mj[ulog]'" in refusal(tmp_path / "rec.ulg")


def test_packed_arrays_and_packed_logs(tmp_path):
    import gzip

    packed = io.BytesIO()
    np.savez(packed, **COLUMNS)
    (tmp_path / "rec.npz.gz").write_bytes(gzip.compress(packed.getvalue()))
    checked(tmp_path / "rec.npz.gz")
    (tmp_path / "rec.asc.gz").write_bytes(gzip.compress(b"date"))
    assert "is packed, unpack it first" in refusal(tmp_path / "rec.asc.gz")


def made(tmp_path):
    """A file of each of some kinds, with its mapping."""
    np.savez(tmp_path / "rec.npz", **COLUMNS)
    yield tmp_path / "rec.npz", None
    (tmp_path / "rec.json").write_text(json.dumps({k: x.tolist() for k, x in COLUMNS.items()}))
    yield tmp_path / "rec.json", None
    feather.write_feather(pa.table(COLUMNS), tmp_path / "rec.feather")
    yield tmp_path / "rec.feather", None
    (tmp_path / "rec.ulg").write_bytes(ulog(("drive", (T, U)), ("encoder", (T, THETA))))
    yield tmp_path / "rec.ulg", {"u_V": "drive.value", "theta_rad": "encoder.value"}
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "rec.h5", "w") as root:
        root.update(COLUMNS)
    yield tmp_path / "rec.h5", None


@pytest.mark.filterwarnings("ignore")  # what libraries say of what they cannot read is theirs
def test_damaged_files_are_read_or_refused_in_one_sentence(tmp_path, capsys):
    rng = np.random.default_rng(11)
    for path, mapping in made(tmp_path):
        whole = path.read_bytes()
        for trial in range(16):
            damaged = bytearray(whole[: int(len(whole) * rng.uniform())] if trial < 6 else whole)
            for place in rng.integers(0, min(len(damaged), 600) or 1, 12 if damaged and trial >= 6 else 0):
                damaged[place] = int(rng.integers(0, 256))
            path.write_bytes(bytes(damaged))
            with contextlib.suppress(ErsError):
                read_recording(path, mapping)
    assert capsys.readouterr().out == ""
