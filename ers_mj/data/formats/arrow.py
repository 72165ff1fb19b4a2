"""Parquet, Feather and Arrow files, as they lie; LeRobot's data sets among them."""

from __future__ import annotations

import pyarrow as pa

from ers_mj.data.formats.base import File, Loaded, refuse_large, refuse_twice
from ers_mj.data.tables import reason
from ers_mj.errors import InputError

FORMAT = "Parquet or Arrow file"


def load(file: File) -> Loaded:
    """The table of a file."""
    try:
        table = _table(file)
        names = table.column_names
    except (pa.ArrowException, OSError) as error:
        raise InputError(f"{file.name}: is not a readable {_kind(file)} file ({reason(error)})") from None
    except UnicodeDecodeError:
        raise InputError(
            f"{file.name}: the name of a column is no text in UTF-8, rename it where the file was written"
        ) from None
    refuse_twice(names, file.name)
    return Loaded(table, _frames(names))


def _table(file: File) -> pa.Table:
    buffer = pa.BufferReader(file.content)
    if file.path.suffix.lower() == ".parquet":
        from pyarrow import parquet  # here alone: it takes long to import

        _refuse_part(file, b"PAR1", b"PAR1")
        told = parquet.ParquetFile(buffer).metadata
        groups = (told.row_group(k).total_byte_size for k in range(told.num_row_groups))
        refuse_large(file.name, told.num_columns, told.num_rows, sum(groups))
        buffer.seek(0)
        return parquet.read_table(buffer)
    if file.content.startswith(b"\xff\xff\xff\xff"):
        return pa.ipc.open_stream(buffer).read_all()
    _refuse_part(file, b"ARROW1", b"ARROW1")
    return pa.ipc.open_file(buffer).read_all()


def _refuse_part(file: File, begin: bytes, end: bytes) -> None:
    """Raise InputError where a file lacks what every whole one begins or ends with."""
    if not file.content.startswith(begin):
        raise InputError(f"{file.name}: is no {_kind(file)} file (it does not begin as one)")
    if not file.content.endswith(end):
        raise InputError(f"{file.name}: is cut off, a whole {_kind(file)} file ends in {end.decode()}: copy it again")


def _kind(file: File) -> str:
    return "Parquet" if file.path.suffix.lower() == ".parquet" else "Arrow"


def _frames(names: list[str]) -> tuple[str, ...]:
    """What LeRobot's own columns do not say of themselves."""
    if {"timestamp", "frame_index"} <= set(names):
        return (
            "timestamp looks like LeRobot's, frame / fps whatever the loop really ran at: a slow loop reads too fast",
        )
    return ()
