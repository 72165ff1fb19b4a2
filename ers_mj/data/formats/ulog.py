"""PX4's ULog, by pyulog: `topic.field` (`topic_1.field` of a second instance), each topic on its own stamps."""

from __future__ import annotations

import io

import numpy as np

from ers_mj.data.formats.base import File, Loaded, library
from ers_mj.data.formats.clocks import Signal, on_one_clock
from ers_mj.data.tables import reason
from ers_mj.errors import InputError

MICRO = 1e-6


def load(file: File) -> Loaded:
    """The topics of a log."""
    pyulog = library("pyulog", "pyulog", "ulog", file.name)
    if not file.content.startswith(b"ULog\x01\x12\x35"):
        raise InputError(f"{file.name}: is no ULog file (it does not begin as one)")
    try:
        log = pyulog.ULog(io.BytesIO(file.content))
    except Exception as error:  # pyulog raises what it meets in a broken file
        raise InputError(f"{file.name}: is not a readable ULog file ({reason(error)})") from None
    signals = []
    for topic in log.data_list:
        name = f"{topic.name}_{topic.multi_id}" if topic.multi_id else topic.name
        t = np.asarray(topic.data["timestamp"], float) * MICRO
        signals += [
            Signal(f"{name}.{field}", t, np.asarray(x)) for field, x in topic.data.items() if field != "timestamp"
        ]
    lost = sum(drop.duration for drop in log.dropouts)
    notes = [f"the log lost {lost / 1000:.4g} s in {len(log.dropouts)} dropouts"] if log.dropouts else []
    return on_one_clock(signals, file.wanted, file.name, notes)
