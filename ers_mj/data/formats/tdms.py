"""National Instruments' TDMS, by npTDMS: `group/channel`; a waveform on its own clock, other channels row by row.

A file that a logger was started on several times holds several runs, each with a start of its own, of which npTDMS
keeps the last: those before are asked for ahead of it.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ers_mj.data.formats import arrays
from ers_mj.data.formats.base import File, Loaded, library
from ers_mj.data.formats.clocks import Signal, on_one_clock
from ers_mj.errors import InputError

FORMAT = "TDMS file"
STEP, OFFSET, START, UNIT = "wf_increment", "wf_start_offset", "wf_start_time", "unit_string"
LEAD = struct.Struct("<4sIIQQ")  # of a segment: mark, contents, version, bytes to the next segment, bytes to its data
MOST_RUNS = 200  # a file of more is no recording


def load(file: File) -> Loaded:
    """The channels of a file."""
    nptdms = library("nptdms", "npTDMS", "tdms", file.name)
    found = nptdms.TdmsFile.read(io.BytesIO(file.content))
    channels = [channel for group in found.groups() for channel in group.channels()]
    notes, common = _whole(found, channels, file)
    named = [(name, c, np.asarray(c[:common])) for name, c in _named(channels)]
    units = {name: str(c.properties[UNIT]) for name, c, _ in named if c.properties.get(UNIT)}
    if not channels or not all(STEP in c.properties for c in channels):
        return arrays.loaded({name: x for name, _, x in named}, file.name, notes, units)
    runs = [*_earlier(file, nptdms), {c.path: (len(c), c.properties) for c in channels}]
    notes += [f"the file holds {len(runs)} runs, each from its own start"] if len(runs) > 1 else []
    first = min(_stamp(properties) for run in runs for _, properties in run.values())
    signals = [Signal(name, _times(c.path, runs, first)[:common], x, units.get(name, "")) for name, c, x in named]
    return on_one_clock(signals, file.wanted, file.name, notes)


def _whole(found: Any, channels: Sequence[Any], file: File) -> tuple[list[str], int | None]:
    """What is to be told of a file that is cut off, and how many values all its channels have."""
    if not found.file_status.incomplete_final_segment:
        return [], None
    common = min(map(len, channels), default=0)
    if not common:
        raise InputError(f"{file.name}: is cut off, and holds no whole channels")
    return ["the file is cut off, what could be read of it is taken"], common


def _named(channels: Sequence[Any]) -> list[tuple[str, Any]]:
    """Channels by name, with their group's where there are several groups."""
    one_group = len({c.group_name for c in channels}) == 1
    return [(c.name if one_group else f"{c.group_name}/{c.name}", c) for c in channels]


Run = Mapping[str, tuple[int, Mapping[str, Any]]]  # path of a channel -> how many values it has by then, properties


def _earlier(file: File, nptdms: Any) -> Iterator[Run]:
    """The runs but the last, by what npTDMS says of the file up to the next one."""
    begins = [
        at for at, metadata in _segments(file.content) if START.encode() in metadata or OFFSET.encode() in metadata
    ]
    if len(begins) > MOST_RUNS:
        raise InputError(f"{file.name}: holds {len(begins)} runs, at most {MOST_RUNS} are read: split it")
    for stop in begins[1:]:
        part = nptdms.TdmsFile.read_metadata(io.BytesIO(file.content[:stop]))
        yield {c.path: (len(c), c.properties) for group in part.groups() for c in group.channels()}


def _segments(content: bytes) -> Iterator[tuple[int, bytes]]:
    """Where each segment begins, and its metadata."""
    at = 0
    while at + LEAD.size <= len(content):
        mark, _, _, following, data = LEAD.unpack_from(content, at)
        if mark != b"TDSm":
            return
        begin = at + LEAD.size
        yield at, content[begin : begin + data]
        if begin + following > len(content):
            return
        at = begin + following


def _times(path: str, runs: Sequence[Run], first: np.datetime64) -> np.ndarray:
    """When each value of a channel was taken [s since ``first``], run by run."""
    parts, done = [], 0
    for run in runs:
        count, properties = run.get(path, (0, {}))
        if count > done:
            begun = float((_stamp(properties) - first) / np.timedelta64(1, "s")) + float(properties.get(OFFSET, 0.0))
            parts.append(begun + np.arange(count - done) * float(properties[STEP]))
            done = count
    return np.concatenate(parts) if parts else np.zeros(0)


def _stamp(properties: Mapping[str, Any]) -> np.datetime64:
    """The date from which a waveform's offset counts; 1970 where it has none."""
    return np.datetime64(properties.get(START) or 0, "us")
