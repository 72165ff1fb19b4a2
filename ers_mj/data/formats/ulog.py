"""PX4's ULog, by pyulog: `topic.field` (`topic_1.field` of a second instance), each topic on its own stamps."""

from __future__ import annotations

import io
import struct

import numpy as np

from ers_mj.data.formats.base import File, Loaded, library
from ers_mj.data.formats.clocks import Signal, on_one_clock
from ers_mj.errors import InputError

FORMAT = "ULog file"
MICRO = 1e-6
HEADER, MESSAGE = 16, struct.Struct("<HB")  # bytes of a file's header; size and kind ahead of each message
DEFINITIONS, DATA = b"BFIMPQ", b"ALC"  # kinds ahead of the data, and those with which they begin


def load(file: File) -> Loaded:
    """The topics of a log."""
    pyulog = library("pyulog", "pyulog", "ulog", file.name)
    if not file.content.startswith(b"ULog\x01\x12\x35"):
        raise InputError(f"{file.name}: is no ULog file (it does not begin as one)")
    if not _has_definitions(file.content):
        raise InputError(f"{file.name}: its definitions are damaged, so that nothing of it can be read")
    log = pyulog.ULog(io.BytesIO(file.content))
    signals = []
    for topic in log.data_list:
        name = f"{topic.name}_{topic.multi_id}" if topic.multi_id else topic.name
        t = np.asarray(topic.data["timestamp"], float) * MICRO
        signals += [
            Signal(f"{name}.{field}", t, np.asarray(x)) for field, x in topic.data.items() if field != "timestamp"
        ]
    lost = sum(drop.duration for drop in log.dropouts)
    notes = [f"the log lost {lost / 1000:.4g} s in {len(log.dropouts)} dropouts"] if log.dropouts else []
    notes += ["the log is damaged, what could be read of it is taken"] if log.file_corruption else []
    return on_one_clock(signals, file.wanted, file.name, notes)


def _has_definitions(content: bytes) -> bool:
    """Whether whole definitions lead to the data: pyulog never returns from others."""
    place = HEADER
    while place + MESSAGE.size <= len(content):
        size, kind = MESSAGE.unpack_from(content, place)
        if kind in DATA:
            return True
        if kind not in DEFINITIONS:
            return False
        place += MESSAGE.size + size
    return False
