"""Recordings in files of every kind, each made by its ecosystem's own writer (or after its published format).

A writer puts columns (time first) into a folder and gives the file with what a person would say of it.
"""

import importlib
import json
import os
import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import feather, parquet

N = 400
T = 0.01 * np.arange(N)
U = np.sin(3 * T) + 0.2
THETA = 0.4 * np.sin(2 * T) + 1e-4 * np.random.default_rng(5).normal(size=N)
COLUMNS = {"t_s": T, "u_V": U, "theta_rad": THETA}
BEGUN = 1000  # [s] of clocks that do not begin at zero


def needs(module: str):
    """A library that a format's files are read or written with: skipped without it, but where CI must have it."""
    return importlib.import_module(module) if os.environ.get("CI") else pytest.importorskip(module)


class Made(NamedTuple):
    """A file, and what is said of it: contract name -> column, and the DBC."""

    path: Path
    mapping: Mapping[str, str] = MappingProxyType({})
    dbc: Path | None = None

    @property
    def arguments(self) -> list[str]:
        """As the command line takes it."""
        said = [word for name, column in self.mapping.items() for word in ("--map", f"{name}={column}")]
        return [str(self.path), *said, *(["--dbc", str(self.dbc)] if self.dbc else [])]


# -- arrays by name ----------------------------------------------------------------------------------------------------


def csv(folder: Path, columns: Mapping) -> Made:
    rows = zip(*(np.asarray(x).tolist() for x in columns.values()))
    text = "\n".join([",".join(columns), *(",".join(map(str, row)) for row in rows)]) + "\n"
    (folder / "rec.csv").write_text(text)
    return Made(folder / "rec.csv")


def npz(folder: Path, columns: Mapping) -> Made:
    np.savez(folder / "rec.npz", **columns)
    return Made(folder / "rec.npz")


def mat(folder: Path, columns: Mapping) -> Made:
    from scipy.io import savemat

    savemat(folder / "rec.mat", {"run": {name: np.asarray(x)[:, None] for name, x in columns.items()}})
    return Made(folder / "rec.mat", {name: f"run.{name}" for name in columns})


def mat_73(folder: Path, columns: Mapping, build: Callable = lambda root: None) -> Made:
    """As MATLAB -v7.3 writes it: HDF5 behind a block of text, arrays turned."""
    with needs("h5py").File(folder / "rec.mat", "w", userblock_size=512) as root:
        for name, x in columns.items():
            kind, cells = ("char", [ord(c[0]) for c in x]) if np.asarray(x).dtype.kind == "U" else ("double", x)
            root.create_dataset(name, data=np.asarray(cells)[None, :]).attrs["MATLAB_class"] = np.bytes_(kind)
        build(root)
    with open(folder / "rec.mat", "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM")
    return Made(folder / "rec.mat")


def hdf5(folder: Path, columns: Mapping) -> Made:
    with needs("h5py").File(folder / "rec.h5", "w") as root:
        for name, x in columns.items():
            root[f"bench/{name}"] = x if np.asarray(x).dtype.kind != "U" else np.asarray(x, "S")
    return Made(folder / "rec.h5", {name: f"bench/{name}" for name in columns})


def parquets(folder: Path, columns: Mapping) -> Made:
    parquet.write_table(pa.table({name: np.asarray(x) for name, x in columns.items()}), folder / "rec.parquet")
    return Made(folder / "rec.parquet")


def arrow(folder: Path, columns: Mapping) -> Made:
    feather.write_feather(pa.table({name: np.asarray(x) for name, x in columns.items()}), folder / "rec.feather")
    return Made(folder / "rec.feather")


def json_records(folder: Path, columns: Mapping) -> Made:
    rows = zip(*(np.asarray(x).tolist() for x in columns.values()))
    (folder / "rec.json").write_text(json.dumps([dict(zip(columns, row)) for row in rows]))
    return Made(folder / "rec.json")


def tdms(folder: Path, columns: Mapping) -> Made:
    nptdms = needs("nptdms")
    with nptdms.TdmsWriter(str(folder / "rec.tdms")) as writer:
        writer.write_segment([nptdms.ChannelObject("bench", name, np.asarray(x)) for name, x in columns.items()])
    return Made(folder / "rec.tdms")


# -- signals on clocks of their own: the first column gives their stamps -----------------------------------------------


def stamped(columns: Mapping) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    t, *rest = columns
    return np.asarray(columns[t]) + BEGUN, {name: np.asarray(columns[name]) for name in rest}


def mf4(folder: Path, columns: Mapping) -> Made:
    asammdf = needs("asammdf")
    t, signals = stamped(columns)
    with asammdf.MDF(version="4.10") as mdf:
        for name, x in signals.items():
            texts = {"encoding": "utf-8"} if x.dtype.kind == "U" else {}
            mdf.append([asammdf.Signal(x.astype("S") if texts else x, t, name=name, **texts)])
        mdf.save(folder / "rec.mf4")
    return Made(folder / "rec.mf4")


def mcap(folder: Path, columns: Mapping) -> Made:
    """JSON under a topic for each signal."""
    writing = needs("mcap.writer")
    t, signals = stamped(columns)
    with open(folder / "rec.mcap", "wb") as file:
        writer = writing.Writer(file)
        writer.start()
        for name, x in signals.items():
            schema = writer.register_schema(name=name, encoding="jsonschema", data=b"{}")
            topic = writer.register_channel(topic=f"/{name}", message_encoding="json", schema_id=schema)
            for k, value in enumerate(x.tolist()):
                stamp = round(1e9 * t[k])
                writer.add_message(topic, stamp, json.dumps({"data": value}).encode(), stamp)
        writer.finish()
    return Made(folder / "rec.mcap", {name: f"/{name}.data" for name in signals})


def ros_bag(folder: Path, columns: Mapping, storage: str = "mcap") -> Made:
    """A bag of ROS 2: the output as a joint's position, the others as Float64 (or String)."""
    writing, typesys = needs("rosbags.rosbag2"), needs("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    t, signals = stamped(columns)
    joint = next((name for name in signals if name.startswith("theta_rad")), None)
    plugin = {"sqlite3": writing.StoragePlugin.SQLITE3, "mcap": writing.StoragePlugin.MCAP}[storage]
    with writing.Writer(folder / "bag", version=8, storage_plugin=plugin) as writer:
        for name, x in signals.items():
            kind = "sensor_msgs/msg/JointState" if name == joint else f"std_msgs/msg/{_ros_type(x)}"
            connection = writer.add_connection(f"/{name}", kind, typestore=store)
            for k, value in enumerate(x.tolist()):
                stamp = round(1e9 * t[k])
                message = joint_state(store, stamp, [0.0, value]) if name == joint else store.types[kind](data=value)
                writer.write(connection, stamp, store.serialize_cdr(message, kind))
    return Made(
        folder / "bag",
        {name: f"/{name}.position[elbow]" if name == joint else f"/{name}.data" for name in signals},
    )


def _ros_type(x: np.ndarray) -> str:
    return "String" if x.dtype.kind == "U" else "Float64"


def joint_state(store, stamp: int, position: list[float]):
    """Of the joints wrist and elbow, with an effort of another length, as drivers without torque sensors publish it."""
    make = lambda kind, **fields: store.types[kind](**fields)
    time = make("builtin_interfaces/msg/Time", sec=stamp // 10**9, nanosec=stamp % 10**9)
    return make(
        "sensor_msgs/msg/JointState",
        header=make("std_msgs/msg/Header", stamp=time, frame_id=""),
        name=["wrist", "elbow"],
        position=np.array(position),
        velocity=np.zeros(0),
        effort=np.zeros(1),
    )


def ulog(folder: Path, columns: Mapping) -> Made:
    """After its format: header, formats, subscriptions, data."""
    needs("pyulog")
    t, signals = stamped(columns)
    out = [b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)]

    def message(kind, body):
        out.append(struct.pack("<HB", len(body), ord(kind)) + body)

    message("B", bytes(40))
    for name, x in signals.items():
        kind = "char[8]" if x.dtype.kind == "U" else "float"
        message("F", f"{name}:uint64_t timestamp;{kind} value;".encode())
    for number, name in enumerate(signals):
        message("A", struct.pack("<BH", 0, number) + name.encode())
    for number, x in enumerate(signals.values()):
        for stamp, value in zip(t, x.tolist()):
            cell = value.encode().ljust(8, b"\0") if isinstance(value, str) else struct.pack("<f", value)
            message("D", struct.pack("<HQ", number, round(1e6 * stamp)) + cell)
    (folder / "rec.ulg").write_bytes(b"".join(out))
    return Made(folder / "rec.ulg", {name: f"{name}.value" for name in signals})


DBC = """VERSION ""
NS_ :
BS_:
BU_: ECU
BO_ 256 Drive: 4 ECU
 SG_ Volts : 0|32@1- (1,0) [-100|100] "V" ECU
BO_ 257 Encoder: 8 ECU
 SG_ Angle : 0|32@1- (0.000001,0) [-10|10] "rad" ECU
 SG_ State : 32|8@1+ (1,0) [0|3] "" ECU
VAL_ 257 State 0 "off" 1 "on" ;
SIG_VALTYPE_ 256 Volts : 1;
"""  # the voltage a float, the angle an integer
FRAMES = {"u_V": ("Drive", "Volts"), "theta_rad": ("Encoder", "Angle")}


def can_log(folder: Path, columns: Mapping, suffix: str = ".asc", **frame) -> Made:
    """Frames of both messages at each row; ``frame`` says more of them (channel, is_fd)."""
    can, cantools = needs("can"), needs("cantools")
    (folder / "rig.dbc").write_text(DBC)
    base = cantools.database.load_file(str(folder / "rig.dbc"))
    t, signals = stamped(columns)
    told = {"is_extended_id": False, "channel": 0} | frame
    with can.Logger(str(folder / f"rec{suffix}")) as log:
        for k in range(t.size):
            for name, x in signals.items():
                message, signal = FRAMES[name]
                said = {signal: float(x[k])} | ({"State": 1} if message == "Encoder" else {})
                known = base.get_message_by_name(message)
                log(can.Message(t[k], known.frame_id, data=known.encode(said), **told))
    mapping = {name: ".".join(FRAMES[name]) for name in signals}
    return Made(folder / f"rec{suffix}", mapping, folder / "rig.dbc")


def ardupilot(folder: Path, columns: Mapping) -> Made:
    """After its format: each signal a message of its own; the output in hundredths of a degree, with the multiplier
    that its reader leaves to the unit.
    """
    needs("pymavlink")
    t, signals = stamped(columns)
    names = {"u_V": "VOL", "theta_rad": "ENC"}
    formats = {
        128: ("FMT", "BBnNZ", "Type,Length,Name,Format,Columns", 89),
        129: ("UNIT", "QbZ", "TimeUS,Id,Label", 76),
        130: ("MULT", "Qbd", "TimeUS,Id,Mult", 20),
        131: ("FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds", 44),
        132: ("VOL", "Qf", "TimeUS,V", 15),
        133: ("ENC", "Qi", "TimeUS,Ang", 15),
    }
    head = lambda kind: b"\xa3\x95" + bytes([kind])
    out = [
        head(128) + struct.pack("<BB4s16s64s", kind, size, name.encode(), form.encode(), fields.encode())
        for kind, (name, form, fields, size) in formats.items()
    ]
    for mark, label in (("s", "s"), ("v", "V"), ("d", "deg")):
        out.append(head(129) + struct.pack("<Qb64s", 0, ord(mark), label.encode()))
    for mark, factor in (("F", 1e-6), ("0", 1.0), ("B", 1e-2)):
        out.append(head(130) + struct.pack("<Qbd", 0, ord(mark), factor))
    for kind, units, factors in ((132, b"sv", b"F0"), (133, b"sd", b"FB")):
        out.append(head(131) + struct.pack("<QB16s16s", 0, kind, units, factors))
    for k in range(t.size):
        stamp = round(1e6 * t[k])
        if "u_V" in signals:
            out.append(head(132) + struct.pack("<Qf", stamp, signals["u_V"][k]))
        if "theta_rad" in signals:
            out.append(head(133) + struct.pack("<Qi", stamp, round(100 * np.degrees(signals["theta_rad"][k]))))
    (folder / "rec.bin").write_bytes(b"".join(out))
    return Made(folder / "rec.bin", {name: f"{names[name]}.{'V' if name == 'u_V' else 'Ang'}" for name in signals})


BY_NAME = {
    "CSV": csv,
    "npz": npz,
    "MAT": mat,
    "MAT 7.3": mat_73,
    "HDF5": hdf5,
    "Parquet": parquets,
    "Arrow": arrow,
    "JSON": json_records,
    "TDMS": tdms,
}
BY_STAMP = {
    "MF4": mf4,
    "MCAP": mcap,
    "ROS bag": ros_bag,
    "ULog": ulog,
    "CAN": can_log,
    "ArduPilot": ardupilot,
}
WRITERS: dict[str, Callable[[Path, Mapping], Made]] = BY_NAME | BY_STAMP
