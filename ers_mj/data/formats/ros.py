"""Messages of robots: MCAP files (JSON or ROS 2 inside) by mcap, and ROS bags by rosbags.

Every number of a message is a signal, `TOPIC.field.field`; of a JointState `TOPIC.position[JOINT]`. The time is that of
a message's header where it has one that agrees with the log's, else the log's.
"""

from __future__ import annotations

import contextlib
import io
import json
import struct
from collections.abc import Iterator
from typing import Any

import numpy as np

from ers_mj.data.formats.base import File, Loaded, library
from ers_mj.data.formats.clocks import Signal, on_one_clock
from ers_mj.data.tables import listed
from ers_mj.errors import InputError

FORMAT = "log of messages"
NANO = 1e-9
APART = 5.0  # [s] between a header's stamp and the log's, from which they are of different clocks
LONGEST = 64  # elements of an array that become signals: an image has more
MAGIC = b"\x89MCAP0\r\n"  # with which an MCAP begins and ends
JOINT = ("position", "velocity", "effort")


class Topics:
    """Gathers numbers by signal as messages come."""

    def __init__(self) -> None:
        self.rows: dict[str, list[tuple[int, int | None, float]]] = {}  # stamps [ns]: floats since 1970 are coarse
        self.first: int | None = None
        self.short: set[str] = set()
        self.texts: set[str] = set()

    def take(self, topic: str, log_ns: int, message: Any) -> None:
        """One message: an object with fields, or a dictionary."""
        self.first = log_ns if self.first is None else self.first
        stamp = _stamp(message)
        for name, x in self._numbers(topic, message):
            self.rows.setdefault(name, []).append((log_ns, stamp, x))

    def _numbers(self, path: str, x: Any) -> Iterator[tuple[str, float]]:
        """The numbers in a message or a part of it, with their names."""
        fields = _fields(x)
        if fields is not None:
            if isinstance(fields.get("name"), (list, tuple)) and set(JOINT) & set(fields):
                yield from self._joints(path, fields)
                return
            for key, value in fields.items():
                yield from () if key in ("header", "__msgtype__") else self._numbers(f"{path}.{key}", value)
        elif isinstance(x, (bool, int, float, np.number)):
            yield path, float(x)
        elif isinstance(x, str):
            self.texts.add(path)
        elif isinstance(x, (list, tuple, np.ndarray)) and len(x) <= LONGEST:
            for k, value in enumerate(x):
                yield from self._numbers(f"{path}[{k}]", value)

    def _joints(self, path: str, fields: dict[str, Any]) -> Iterator[tuple[str, float]]:
        """Positions, velocities and efforts by joint; those that are not as many as the names are not told apart."""
        for kind in JOINT:
            values = fields.get(kind)
            values = [] if values is None else list(values)
            if len(values) == len(fields["name"]):
                yield from ((f"{path}.{kind}[{joint}]", float(v)) for joint, v in zip(fields["name"], values))
            elif values:
                self.short.add(f"{path}.{kind}")

    def signals(self) -> tuple[list[Signal], list[str]]:
        """The signals, and what is to be told."""
        found, notes = [], []
        for name, rows in self.rows.items():
            log = NANO * np.array([row[0] - (self.first or 0) for row in rows])
            stamped = all(row[1] is not None for row in rows)
            stamps = NANO * np.array([(row[1] or 0) - (self.first or 0) for row in rows])
            own = stamped and abs(float(np.median(stamps - log))) < APART
            found.append(Signal(name, stamps if own else log, np.array([row[2] for row in rows])))
            if stamped and not own:
                notes.append(f"the stamps of {name.split('.')[0]} are of another clock than the log's, which is taken")
        found += [Signal(name, np.zeros(0), np.zeros(0, str)) for name in sorted(self.texts - set(self.rows))]
        notes = list(dict.fromkeys(notes))
        if self.short:
            notes.append(f"{', '.join(sorted(self.short))} differ in length from the joints' names and are left out")
        return found, notes


def _fields(x: Any) -> dict[str, Any] | None:
    if isinstance(x, dict):
        return x
    return {k: getattr(x, k) for k in x.__dataclass_fields__} if hasattr(x, "__dataclass_fields__") else None


def _stamp(message: Any) -> int | None:
    """The time of a message's header [ns]; None where there is none or it is zero."""
    fields = _fields(message) or {}
    stamp = _fields((_fields(fields.get("header")) or {}).get("stamp")) or {}
    seconds = stamp.get("sec", stamp.get("secs"))
    nanos = stamp.get("nanosec", stamp.get("nsec", stamp.get("nsecs", 0)))
    return int(seconds) * 10**9 + int(nanos) if seconds is not None and (seconds or nanos) else None


def load(file: File) -> Loaded:
    """The topics of a file, or of a folder that is a bag."""
    topics = Topics()
    notes = _bag(file, topics) if file.path.suffix.lower() != ".mcap" or not file.content else _mcap(file, topics)
    signals, told = topics.signals()
    return on_one_clock(signals, file.wanted, file.name, [*notes, *told])


def _bag(file: File, topics: Topics) -> list[str]:
    reading = library("rosbags.highlevel", "rosbags", "ros", file.name)
    typesys = library("rosbags.typesys", "rosbags", "ros", file.name)
    store = typesys.get_typestore(typesys.Stores.LATEST)
    with reading.AnyReader([file.path], default_typestore=store) as reader:
        unknown = set()
        for connection, stamp, raw in reader.messages():
            try:
                topics.take(connection.topic, stamp, reader.deserialize(raw, connection.msgtype))
            except KeyError:
                unknown.add(connection.topic)
    return [f"topics of unknown types are left out: {listed(sorted(unknown))}"] if unknown else []


def _mcap(file: File, topics: Topics) -> list[str]:
    reading = library("mcap.reader", "mcap", "mcap", file.name)
    cdr = None
    strange: set[str] = set()
    for schema, channel, message in _messages(file, reading):
        if channel.message_encoding == "json":
            topics.take(channel.topic, message.log_time, json.loads(message.data))
        elif channel.message_encoding == "cdr" and schema is not None:
            cdr = cdr or _Cdr(file.name)
            topics.take(channel.topic, message.log_time, cdr.read(schema, message.data))
        else:
            strange.add(f"{channel.topic} ({channel.message_encoding or 'no encoding'})")
    whole = file.content.endswith(MAGIC)
    if strange and not topics.rows:
        raise InputError(f"{file.name}: holds messages that are neither JSON nor ROS 2: {listed(sorted(strange))}")
    if not whole and not topics.rows:
        raise InputError(f"{file.name}: is cut off, and holds no whole message")
    notes = [] if whole else ["the file is cut off, what could be read of it is taken"]
    notes += [f"topics that are neither JSON nor ROS 2 are left out: {listed(sorted(strange))}"] if strange else []
    return notes


def _messages(file: File, reading: Any) -> Iterator[tuple[Any, Any, Any]]:
    """Schema, channel and message of each; of a file that is cut off, up to there."""
    stream = io.BytesIO(file.content)
    if file.content.endswith(MAGIC):
        yield from reading.make_reader(stream).iter_messages()
        return
    if not file.content.startswith(MAGIC):
        raise InputError(f"{file.name}: is no MCAP file (it does not begin as one)")
    ends = library("mcap.exceptions", "mcap", "mcap", file.name)
    with contextlib.suppress(ends.EndOfFile, struct.error):
        yield from reading.NonSeekingReader(stream).iter_messages(log_time_order=False)


class _Cdr:
    """Reads ROS 2 messages by the definitions that an MCAP carries."""

    def __init__(self, name: str):
        self.typesys = library("rosbags.typesys", "rosbags", "ros", name)
        self.store = self.typesys.get_typestore(self.typesys.Stores.EMPTY)
        self.known: set[str] = set()

    def read(self, schema: Any, data: bytes) -> Any:
        kind = schema.name if "/msg/" in schema.name else schema.name.replace("/", "/msg/")
        if kind not in self.known:
            self.store.register(self.typesys.get_types_from_msg(schema.data.decode(), kind))
            self.known.add(kind)
        return self.store.deserialize_cdr(data, kind)
