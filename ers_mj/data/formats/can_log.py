"""CAN logs, by python-can, read with a DBC by cantools: `Message.Signal`, each message on its own stamps."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from ers_mj.data.formats.base import File, Loaded, library
from ers_mj.data.formats.clocks import Signal, on_one_clock
from ers_mj.data.tables import listed, reason
from ers_mj.errors import InputError

FORMAT = "CAN log"


def load(file: File) -> Loaded:
    """The signals of the messages that the DBC knows."""
    can = library("can", "python-can", "can", file.name)
    cantools = library("cantools", "cantools", "can", file.name)
    if not file.beside:
        raise InputError(f"{file.name}: is a CAN log, whose signals a DBC tells: give --dbc FILE.dbc")
    try:
        base = cantools.database.load_file(str(file.beside[0]))
    except Exception as error:  # cantools raises what its parsers meet
        raise InputError(f"{file.beside[0].name}: is not a readable DBC ({reason(error)})") from None
    rows: dict[tuple[Any, str], tuple[list[float], list[float]]] = {}  # by channel and name
    short: Counter[str] = Counter()
    strange: Counter[str] = Counter()
    frames = 0
    with can.LogReader(file.path) as reader:
        for message in reader:
            frames += 1
            _take(message, base, rows, short, strange)
    if not frames:
        raise InputError(f"{file.name}: holds no frames, a CAN log was expected")
    if not rows:
        told = f", its identifiers are {listed(strange)}" if strange else ""
        raise InputError(f"{file.name}: holds no whole message that {file.beside[0].name} knows{told}")
    units = {f"{m.name}.{s.name}": s.unit or "" for m in base.messages for s in m.signals}
    buses = sorted({bus for bus, _ in rows}, key=str)
    signals = [
        Signal(name, np.array(t), np.array(x), units.get(name, ""))
        for (_, name), (t, x) in sorted(rows.items(), key=lambda item: buses.index(item[0][0]))
    ]
    notes = [f"{sum(short.values())} frames of {listed(short)} are too short and left out"] if short else []
    notes += [f"{sum(strange.values())} frames that the DBC does not know are left out"] if strange else []
    if len(buses) > 1:
        notes.append(f"the log is of the channels {listed(buses)}: NAME@2 is NAME on the second one that has it")
    return on_one_clock(signals, file.wanted, file.name, notes)


def _take(message: Any, base: Any, rows: dict, short: Counter, strange: Counter) -> None:
    """One frame; a frame that is cut off would give zeros for what it lacks, and is left out."""
    if message.is_error_frame or message.is_remote_frame:
        return
    try:
        known = base.get_message_by_frame_id(message.arbitration_id)
    except KeyError:
        strange[f"0x{message.arbitration_id:X}"] += 1
        return
    if len(message.data) < known.length:
        short[known.name] += 1
        return
    for name, x in known.decode(bytes(message.data), decode_choices=False).items():
        times, values = rows.setdefault((message.channel, f"{known.name}.{name}"), ([], []))
        times.append(float(message.timestamp))
        values.append(float(x))
