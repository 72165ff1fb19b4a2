"""National Instruments' TDMS, by npTDMS: `group/channel`; a waveform on its own clock, other channels row by row."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from ers_mj.data.formats import arrays
from ers_mj.data.formats.base import File, Loaded, library
from ers_mj.data.formats.clocks import Signal, on_one_clock

FORMAT = "TDMS file"
STEP, OFFSET, START, UNIT = "wf_increment", "wf_start_offset", "wf_start_time", "unit_string"


def load(file: File) -> Loaded:
    """The channels of a file."""
    nptdms = library("nptdms", "npTDMS", "tdms", file.name)
    found = nptdms.TdmsFile.read(io.BytesIO(file.content))
    channels = [channel for group in found.groups() for channel in group.channels()]
    values = {f"{c.group_name}/{c.name}": np.asarray(c[:]) for c in channels}
    one_group = len({c.group_name for c in channels}) == 1
    named = [(c.name if one_group else key, c, x) for c, (key, x) in zip(channels, values.items())]
    units = {name: str(c.properties[UNIT]) for name, c, _ in named if c.properties.get(UNIT)}
    if not channels or not all(STEP in c.properties for c in channels):
        return arrays.loaded({name: x for name, _, x in named}, file.name, units=units)
    first = min(map(_start, channels))
    signals = [Signal(name, _start(c) - first + _times(c, x), x, units.get(name, "")) for name, c, x in named]
    return on_one_clock(signals, file.wanted, file.name)


def _times(channel: Any, x: np.ndarray) -> np.ndarray:
    return np.arange(x.size) * float(channel.properties[STEP])


def _start(channel: Any) -> float:
    """When a waveform begins [s]: its stamp and the offset that belongs to it."""
    stamp = channel.properties.get(START)
    since = np.datetime64(stamp, "us") - np.datetime64(0, "us") if stamp else np.timedelta64(0, "us")
    return float(since / np.timedelta64(1, "s")) + float(channel.properties.get(OFFSET, 0.0))
