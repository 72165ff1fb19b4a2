"""MDF and MF4, by asammdf: channels as they were logged, each on the clock of its group."""

from __future__ import annotations

import io

import numpy as np

from ers_mj.data.formats.base import File, Loaded, library
from ers_mj.data.formats.clocks import Signal, on_one_clock
from ers_mj.errors import InputError

FORMAT = "MDF file"


def load(file: File) -> Loaded:
    """The channels of all groups. asammdf's own rasters ramp some channels and hold others: none is used."""
    asammdf = library("asammdf", "asammdf", "mf4", file.name)
    if not file.content.startswith((b"MDF ", b"UnFinMF ")):
        raise InputError(f"{file.name}: is no MDF file (it does not begin as one)")
    with asammdf.MDF(io.BytesIO(file.content)) as mdf:
        return on_one_clock(_signals(mdf), file.wanted, file.name)


def _signals(mdf) -> list[Signal]:
    found = []
    for number, group in enumerate(mdf.groups):
        master = mdf.masters_db.get(number)
        for index, channel in enumerate(group.channels):
            if index == master:
                continue
            signal = mdf.get(group=number, index=index, raw=True)  # a table of texts would come as texts
            signal = signal.physical(copy=False, ignore_value2text_conversions=True)
            if signal.samples.ndim == 1:
                times, values = np.asarray(signal.timestamps, float), np.asarray(signal.samples)
                found.append(Signal(channel.name, times, values, signal.unit or ""))
    return found
