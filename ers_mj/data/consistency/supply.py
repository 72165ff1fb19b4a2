"""Readings of the supply that no battery gives, and spans in which the drive was off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ers_mj.data.consistency.sheet import Found, Sheet


@dataclass(frozen=True)
class Supply:
    """When a reading of the supply is none."""

    off: float = 0.3  # of the median, by which it misses it
    longest: int = 3  # samples in a row: a sag lasts longer


SUPPLY = Supply()


def off_median(sheet: Sheet) -> Found:
    """Single readings far off the median take the value before."""
    if "vin" not in sheet.fields:
        return sheet, []
    x = sheet.fields["vin"]
    median = float(np.median(x))
    far = np.abs(x - median) > SUPPLY.off * abs(median)
    edges = np.flatnonzero(np.diff(np.r_[False, far, False].astype(int)))
    short = np.zeros(x.size, bool)
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        short[begin:end] = end - begin <= SUPPLY.longest
    if not short.any():
        return sheet, []
    good = np.flatnonzero(~short)
    last = np.maximum(np.searchsorted(good, np.arange(x.size), side="right") - 1, 0)
    sentence = (
        f"{sheet.labels['vin']} reads far off its median of {median:.4g} V in {np.count_nonzero(short)} samples, which"
        " are taken as the last value before"
    )
    return sheet.changed(vin=x[good[last]]), [sheet.fault("supply", "vin", short, sentence)]


def drive_off(sheet: Sheet) -> Found:
    """Tell where the drive was off: the model lets the servo go there."""
    off = ~sheet.fields["enable"] if "enable" in sheet.fields else np.zeros(0, bool)
    if not off.any():
        return sheet, []
    sentence = (
        f"{sheet.labels['enable']} says that the drive is off in {np.count_nonzero(off)} samples"
        f" ({np.mean(off):.0%}): no torque is taken to act there"
    )
    return sheet, [sheet.fault("torque_off", "enable", off, sentence)]
