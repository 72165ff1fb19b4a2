"""ArduPilot's logs (.bin), by pymavlink: `MESSAGE.Field` (`MESSAGE[1].Field` of a second instance), in the units that
the log itself declares.
"""

from __future__ import annotations

import contextlib
import io
import re
from typing import Any

import numpy as np

from ers_mj.data.formats.base import File, Loaded, library
from ers_mj.data.formats.clocks import Signal, on_one_clock
from ers_mj.data.units import is_unit
from ers_mj.errors import InputError

FORMAT = "log of ArduPilot"
MICRO = 1e-6
PREFIXES = {"d": 1e-1, "c": 1e-2, "m": 1e-3, "u": 1e-6, "n": 1e-9, "k": 1e3}
ABOUT = ("FMT", "FMTU", "UNIT", "MULT", "PARM", "MSG", "FILE", "MODE")


def load(file: File) -> Loaded:
    """The messages of a log that carry TimeUS."""
    reading = library("pymavlink.DFReader", "pymavlink", "ardupilot", file.name)
    if file.content[:2] != b"\xa3\x95":
        raise InputError(f"{file.name}: is no log of ArduPilot (it does not begin as one)")
    with contextlib.redirect_stderr(io.StringIO()) as complaints:
        log = reading.DFReader_binary(str(file.path), zero_time_base=True)
        try:
            rows, units = _rows(log)
        finally:
            log.data_map.close()
            log.filehandle.close()
    signals = [Signal(name, np.array(t), np.array(x), units.get(name, "")) for name, (t, x) in rows.items()]
    notes = ["the log is damaged, what could be read of it is taken"] if complaints.getvalue() else []
    return on_one_clock(signals, file.wanted, file.name, notes)


def _rows(log: Any) -> tuple[dict[str, tuple[list[float], list[float]]], dict[str, str]]:
    """Times and values by signal, and units; a multiplier that pymavlink leaves within the unit ("0.01 deg") goes into
    the values.
    """
    rows: dict[str, tuple[list[float], list[float]]] = {}
    units: dict[str, str] = {}
    scales: dict[str, float] = {}
    while (message := log.recv_msg()) is not None:
        kind = message.get_type()
        if kind in ABOUT or not hasattr(message, "TimeUS"):
            continue
        instance = getattr(message, message.fmt.instance_field) if message.fmt.instance_field else 0
        path = f"{kind}[{instance}]" if instance else kind
        for field in message.fmt.columns:
            x = getattr(message, field)
            if field == "TimeUS" or not isinstance(x, (int, float)):
                continue
            name = f"{path}.{field}"
            if name not in scales:
                scales[name], units[name] = _scale(message.fmt.get_unit(field) or "")
            times, values = rows.setdefault(name, ([], []))
            times.append(MICRO * message.TimeUS)
            values.append(float(x) * scales[name])
    return rows, units


def _scale(unit: str) -> tuple[float, str]:
    """Factor and unit of "0.01 deg" and of "cA"."""
    if found := re.fullmatch(r"([\d.]+(?:e[+-]?\d+)?)\s+(.*)", unit):
        return float(found[1]), found[2]
    if not is_unit(unit) and unit[:1] in PREFIXES and is_unit(unit[1:]):
        return PREFIXES[unit[0]], unit[1:]
    return 1.0, unit
