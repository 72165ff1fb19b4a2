"""Inputs that go wrong, drawn by hypothesis: damaged files of every format, odd columns, odd clocks; and what a reader
may do with them: read, or refuse in one sentence.
"""

import io
import json
from functools import cache
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet
import scipy.io
from hypothesis import strategies as st
from mcap.writer import Writer
from nptdms import ChannelObject, TdmsWriter

from ers_mj.data.formats import READERS
from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_columns, read_recording
from ers_mj.errors import ErsError

ROWS = 130
T = 0.01 * np.arange(ROWS)
COLUMNS = {"t_s": T, "u_V": 4.0 * np.sin(6.0 * T), "theta_rad": 0.3 * np.sin(6.0 * T - 0.4) + 1e-3 * np.sin(977.0 * T)}
LONGEST = 300  # characters of a sentence
ODD_NAMES = (
    *("t_s", "u_V", "theta_rad", "theta_deg", "omega_rad_s", "i_A", "kp", "run", "episode", "direction"),
    *("torque_enable", "x_m", "theta_ref_rad", "temp_C", "vin_V", "T_L_Nm", "t_s [ms]", "theta [deg]"),
    *("", " ", "a" * 400, "<b>", '"onload="x', "{0}", "%s", "(?P<", "\\1", "\n", "é", "𝛉", "\x00", "Time [parsec]"),
)
ODD_CELLS = (
    *("", "nan", "inf", "-inf", "1e308", "-1e-320", "1e999", "0x10", "1_000", "1,5", "abc", '"', "'", "#", "\t", "1;2"),
    *("∞", "12:00:00", "2026-01-01T00:00:00", "9999999999999999999999", "true", "NULL", "\x00", "1e-5e3", "+5", "--5"),
)


# -- files ------------------------------------------------------------------------------------------------------------


def _csv(sign: str = ",", comma: str = ".", top: str = "", end: str = "") -> bytes:
    rows = (sign.join(f"{x:.6g}".replace(".", comma) for x in row) + end for row in zip(*COLUMNS.values()))
    return "\n".join([*filter(None, [top]), sign.join(COLUMNS), *rows, ""]).encode()


def _parquet() -> bytes:
    sink = io.BytesIO()
    pa.parquet.write_table(pa.table(COLUMNS), sink)
    return sink.getvalue()


def _arrow() -> bytes:
    sink, table = io.BytesIO(), pa.table(COLUMNS)
    with pa.ipc.new_file(sink, table.schema) as writer:
        writer.write_table(table)
    return sink.getvalue()


def _saved(save, **columns: np.ndarray) -> bytes:
    sink = io.BytesIO()
    save(sink, **columns)
    return sink.getvalue()


def _hdf5() -> bytes:
    sink = io.BytesIO()
    with h5py.File(sink, "w") as root:
        for name, x in COLUMNS.items():
            root[name] = x
    return sink.getvalue()


def _mcap() -> bytes:
    sink = io.BytesIO()
    writer = Writer(sink)
    writer.start()
    schema = writer.register_schema("servo", "jsonschema", b"{}")
    channel = writer.register_channel("servo", "json", schema)
    for k, (t, u, theta) in enumerate(zip(*COLUMNS.values())):
        stamp = round(1e9 * t)
        text = json.dumps({"u_V": u, "theta_rad": theta}).encode()
        writer.add_message(channel, log_time=stamp, publish_time=stamp, data=text, sequence=k)
    writer.finish()
    return sink.getvalue()


def _tdms() -> bytes:
    sink = io.BytesIO()
    with TdmsWriter(sink) as writer:
        writer.write_segment([ChannelObject("servo", name, x) for name, x in COLUMNS.items()])
    return sink.getvalue()


@cache
def files() -> dict[str, tuple[bytes, ...]]:
    """Suffix -> whole small files; of formats whose writers are heavy what their readers take for a beginning."""
    plain = {name: x.tolist() for name, x in COLUMNS.items()}
    rows = [dict(zip(COLUMNS, map(float, row))) for row in zip(*COLUMNS.values())]
    made = {
        ".csv": (_csv(), _csv(";", ","), _csv("\t"), _csv(top="# made by hand\nservo"), _csv(end=",")),
        ".parquet": (_parquet(),),
        ".feather": (_arrow(),),
        ".npz": (_saved(np.savez, **COLUMNS),),
        ".npy": (_saved(lambda sink: np.save(sink, np.rec.fromarrays(COLUMNS.values(), names=list(COLUMNS)))),),
        ".mat": (_saved(lambda sink: scipy.io.savemat(sink, COLUMNS)), _hdf5()),
        ".h5": (_hdf5(),),
        ".json": (json.dumps(plain).encode(), json.dumps(rows).encode()),
        ".jsonl": ("\n".join(map(json.dumps, rows)).encode(),),
        ".mcap": (_mcap(),),
        ".tdms": (_tdms(),),
        ".asc": (b"date Mon Jan 1 00:00:00.000 am 2026\nbase hex  timestamps absolute\n0.01 1 123 Rx d 2 01 02\n",),
        ".log": (b"(1700000000.000000) can0 123#0102\n(1700000000.010000) can0 123#0203\n",),
        ".blf": (b"LOGG" + bytes(140),),
        ".mf4": (b"MDF     4.10    " + bytes(200),),
        ".ulg": (b"ULog\x01\x12\x35\x01" + bytes(100),),
        ".bin": (bytes([163, 149, 128, 128, 89]) + bytes(100),),
        ".bag": (b"#ROSBAG V2.0\n" + bytes(100),),
    }
    return {suffix: (*made.get(suffix, ()), b"") for suffix in READERS}


def _cut(draw, content: bytes) -> bytes:
    return content[: draw(st.integers(0, len(content)))]


def _struck(draw, content: bytes) -> bytes:
    """With some bytes replaced."""
    changed = bytearray(content)
    for _ in range(draw(st.integers(1, 6)) if content else 0):
        changed[draw(st.integers(0, len(content) - 1))] = draw(st.integers(0, 255))
    return bytes(changed)


def _filled(draw, content: bytes) -> bytes:
    at = draw(st.integers(0, len(content)))
    return content[:at] + draw(st.binary(max_size=40)) + content[at:]


def _folded(draw, content: bytes) -> bytes:
    a, b = sorted(draw(st.tuples(*[st.integers(0, len(content))] * 2)))
    return content[:b] + content[a:]


def _celled(draw, content: bytes) -> bytes:
    """With some cells of a text replaced."""
    cells = content.split(b",")
    for _ in range(draw(st.integers(1, 4))):
        cells[draw(st.integers(0, len(cells) - 1))] = draw(st.sampled_from(ODD_CELLS)).encode()
    return b",".join(cells)


@st.composite
def damaged_files(draw, suffixes: tuple[str, ...] = tuple(READERS)) -> tuple[str, bytes]:
    """(suffix, content) of a file that was whole once, or never."""
    suffix = draw(st.sampled_from(suffixes))
    content = draw(st.sampled_from(files()[suffix]))
    for damage in draw(st.lists(st.sampled_from((_cut, _struck, _filled, _folded, _celled)), max_size=2)):
        content = damage(draw, content)
    return suffix, content or draw(st.binary(max_size=200))


# -- columns and clocks -----------------------------------------------------------------------------------------------

NUMBERS = st.floats(allow_nan=True, allow_infinity=True)
SMALL = st.floats(-1e6, 1e6)


@st.composite
def clocks(draw) -> np.ndarray:
    """Times (ROWS,) that rise, mostly, in some unit, with jumps."""
    t = T * draw(st.sampled_from((1.0, 1.0, 1e3, 1e6, 1e9, 1e-9, 60.0))) + draw(st.sampled_from((0.0, 1.7e9, -5.0)))
    for _ in range(draw(st.integers(0, 4))):
        t[draw(st.integers(1, ROWS - 1)) :] += draw(st.sampled_from((1e9, 1e6, 10.0, 0.1, -1e-3, 1e300)))
    return t


@st.composite
def signals(draw) -> np.ndarray:
    """Values (ROWS,): a plausible signal scaled, coarse, held, blank or with odd values in it, or constant."""
    x = COLUMNS["theta_rad"] * draw(st.sampled_from((1.0, 1e-30, 1e-300, 1e20, 1e200, 57.3, 0.0)))
    step = draw(st.sampled_from((0.0, 0.0, 1e-3, 0.1, 1.0)))
    x = np.round(x / step) * step if step else x.copy()
    if draw(st.booleans()):
        x = np.repeat(x[:: draw(st.integers(2, 20))], 20)[:ROWS]
        x = np.resize(x, ROWS)
    for _ in range(draw(st.integers(0, 3))):
        x[draw(st.integers(0, ROWS - 1)) :][: draw(st.integers(1, 40))] = draw(NUMBERS)
    return x


def _odd_cells(kind: str) -> list:
    """ROWS cells of a kind that is no number."""
    return {
        "lists": [[1.0, 2.0]] * ROWS,
        "ragged": [[1.0], []] * (ROWS // 2),
        "text": ["x", "1.5"] * (ROWS // 2),
        "bytes": [b"\xff\xfe", b"1"] * (ROWS // 2),
        "none": [None] * ROWS,
        "flags": [True, False] * (ROWS // 2),
        "records": [{"a": 1.0}] * ROWS,
        "large": [2**62 + k for k in range(ROWS)],
        "stamps": list(np.arange(ROWS).astype("datetime64[ms]")),
    }[kind]


KINDS = ("lists", "ragged", "text", "bytes", "none", "flags", "records", "large", "stamps")


@st.composite
def tables(draw) -> dict[str, object]:
    """Columns by name, most of them those of a recording, some odd, some under odd names."""
    found: dict[str, object] = {"t_s": draw(clocks()), "u_V": draw(signals()), "theta_rad": draw(signals())}
    for _ in range(draw(st.integers(0, 3))):
        name = draw(st.sampled_from(ODD_NAMES))
        odd = st.sampled_from(KINDS).map(_odd_cells)
        found[name] = draw(st.one_of(signals(), odd, SMALL.map(lambda x: np.full(ROWS, x))))
    return found


def written(table: dict[str, object], suffix: str) -> bytes | None:
    """A table as a file; None where its writer does not take it."""
    if suffix == ".csv":
        cells = [[str(x) for x in column] for column in table.values()]
        return "\n".join([",".join(table), *map(",".join, zip(*cells))]).encode("utf-8", "surrogatepass")
    try:
        made = pa.table({name: pa.array(list(x)) for name, x in table.items()})
    except (pa.ArrowException, ValueError, TypeError):
        return None
    sink = io.BytesIO()
    pa.parquet.write_table(made, sink)
    return sink.getvalue()


# -- what a reader may do ---------------------------------------------------------------------------------------------


def survived(path: Path, content: bytes) -> str:
    """Read a file as far as a fit does: "read", or "refused".

    Raises:
        AssertionError: the sentence is none.
        Exception: what the reader should not have raised.
    """
    path.write_bytes(content)
    try:
        return _used(read_recording(path))
    except ErsError as error:
        return _sentence(error, path.name)
    finally:
        path.unlink()


def survived_columns(table: dict[str, object]) -> str:
    """As :func:`survived`, of columns that were never in a file."""
    try:
        arrays = {name: np.array(x, object) if isinstance(x, list) else x for name, x in table.items()}
        return _used(from_columns(arrays))
    except ErsError as error:
        return _sentence(error, "array")


def _used(recording) -> str:
    recording.inspect().to_dict()
    if recording.input_kind != "position":
        trace = trace_of(recording, None)
        assert trace.block[-1] <= max(4 * trace.t.size, trace.t.size + 10 / 0.25), "memory follows time"
    told = [len(sentence) for sentence in recording.problems]
    assert all(length <= 2 * LONGEST for length in told), "a note that nobody reads"
    return "read"


def _sentence(error: ErsError, name: str) -> str:
    text = str(error)
    assert "\n" not in text and 0 < len(text) <= LONGEST, f"{len(text)} characters: {text}"
    assert text.isprintable(), f"controls a terminal: {text!r}"
    assert name[:20] in text, f"does not name {name}: {text}"
    return "refused"
