"""Signals that were logged on clocks of their own, put on one: that of the output, the others held until their next
value.

No signal is interpolated: between two samples nothing is known but the last one. What was measured is the last value at
each time. A command is the one that holds for most of the step that follows: a loop sends its command shortly after it
has read the output, and the last one before would be late by a step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa

from ers_mj.data.columns import COLUMNS
from ers_mj.data.formats.base import Loaded
from ers_mj.data.tables import listed
from ers_mj.errors import InputError

COMMANDS = ("u", "reference", "direction", "enable")  # fields
MOST = 0.49  # of a step: whether a command that comes at its middle is the step's or the next one's is left to rounding


@dataclass(frozen=True, eq=False)
class Signal:
    """One signal: times [s] and values, (N,) each, and its unit where the file says one."""

    name: str
    t: np.ndarray
    values: np.ndarray
    unit: str = ""

    @property
    def is_numeric(self) -> bool:
        """Whether it holds numbers, and any."""
        return bool(self.t.size) and self.values.dtype.kind in "biuf"


def on_one_clock(signals: Sequence[Signal], wanted: Mapping[str, str], name: str, notes: Sequence[str] = ()) -> Loaded:
    """The signals as a table with a column t_s, from the first moment at which all that are wanted are known.

    Raises:
        InputError: there is no signal with numbers.
    """
    known = _named_apart([s for s in signals if s.is_numeric])
    if not known:
        raise InputError(f"{name}: holds no signals with numbers")
    base = _base(known, wanted)
    order = np.argsort(base.t, kind="stable")
    times, first = np.unique(base.t[order], return_index=True)
    others = [s for s in known if s is not base and not np.array_equal(s.t, base.t)]
    begin = max((s.t[0] for s in others if _is_wanted(s, wanted)), default=times[0])
    keep = times >= begin if times[-1] >= begin else np.ones(times.size, bool)
    times, rows = times[keep], order[first][keep]
    columns = {"t_s": times - times[0]}
    for s in known:
        values = s.values[rows].astype(float) if s is base else _at(s, times, wanted)
        columns["t_s of the file" if s.name == "t_s" else s.name] = values
    told = [*notes, *_told(base, others, base.t.size - first.size)]
    return Loaded(pa.table(columns), tuple(told), {s.name: s.unit for s in known if s.unit}, _no_numbers(signals))


def _no_numbers(signals: Sequence[Signal]) -> dict[str, str]:
    """Signals that are no columns, and why."""
    return {s.name: "holds no numbers" for s in signals if not s.is_numeric}


def _told(base: Signal, others: Sequence[Signal], doubled: int) -> list[str]:
    """What was done about clocks, in words."""
    told = [f"{base.name} has {doubled} values under stamps that it had, which are left out"] if doubled else []
    if others:
        told.append(
            f"the time is that of {base.name}; {len(others)} signal{'s'[: len(others) > 1]} on other clocks"
            f" ({listed((s.name for s in others), 6)}) hold their last value, commands that of most of a step"
        )
    return told


def _named_apart(signals: Sequence[Signal]) -> list[Signal]:
    """Signals of one name get a number from the second on."""
    seen: dict[str, int] = {}
    found = []
    for s in signals:
        seen[s.name] = seen.get(s.name, 0) + 1
        found.append(s if seen[s.name] == 1 else Signal(f"{s.name}@{seen[s.name]}", s.t, s.values, s.unit))
    return found


def _base(signals: Sequence[Signal], wanted: Mapping[str, str]) -> Signal:
    """The output, by mapping or by name; the signal with most samples where none is told."""
    outputs = [text for contract, text in wanted.items() if contract in COLUMNS and COLUMNS[contract].field == "y"]
    asked = [s for text in outputs for s in signals if s.name in text]
    named = [s for s in signals if s.name in COLUMNS and COLUMNS[s.name].field == "y"]
    if asked:
        return max(asked, key=lambda s: len(s.name))
    return named[0] if named else max(signals, key=lambda s: s.t.size)


def _is_wanted(signal: Signal, wanted: Mapping[str, str]) -> bool:
    return signal.name in COLUMNS or any(signal.name in text for text in wanted.values())


def _is_command(signal: Signal, wanted: Mapping[str, str]) -> bool:
    """Whether it is sent to the servo, not measured there."""
    names = [signal.name, *(contract for contract, text in wanted.items() if signal.name in text)]
    return any(name in COLUMNS and COLUMNS[name].field in COMMANDS for name in names)


def _steps(times: np.ndarray) -> np.ndarray:
    """From each time to the next (N,), in a gap and at the end the ordinary one."""
    if times.size < 2:
        return np.zeros(times.size)
    dt = np.diff(times)
    return np.append(np.minimum(dt, np.median(dt)), np.median(dt))


def _at(signal: Signal, times: np.ndarray, wanted: Mapping[str, str]) -> np.ndarray:
    """What a signal holds at the times (N,), a command for most of the step that follows."""
    return _held(signal, times + MOST * _steps(times) if _is_command(signal, wanted) else times)


def _held(signal: Signal, times: np.ndarray) -> np.ndarray:
    """The last value at each of the times; NaN before the first."""
    order = np.argsort(signal.t, kind="stable")
    last = np.searchsorted(signal.t[order], times, side="right") - 1
    values = signal.values[order][np.maximum(last, 0)].astype(float)
    return np.where(last >= 0, values, np.nan)
