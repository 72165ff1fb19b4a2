"""One pass over all columns of a recording before anything is fitted: data before physics.

    fields as checked -> clock (scale, jumps, lone rows, ticks) -> scales (another unit) -> wraps -> commands (unsigned)
    -> references (the output itself, of another zero or sign, behind a limit) -> supply (readings off, drive off)
    -> blackouts (several columns repeat together, leaps) -> refresh (held samples)
    -> fields, masked or mended, and a fault for each

A member takes a `Sheet` and gives it back with the faults that it found; what it cannot mend it refuses in one
sentence. A sheet without a fault comes back as it is, to the last bit.
"""

from __future__ import annotations

import numpy as np

from ers_mj.data.consistency import blackouts, clock, commands, references, refresh, scales, supply, wraps
from ers_mj.data.consistency.sheet import Fault, Sheet

STEPS = (
    clock.scale,
    clock.jumps,
    clock.pieces,
    clock.lone_rows,
    clock.regular,
    scales.whole_numbers,
    scales.duty_counts,
    scales.speed_unit,
    wraps.unwrapped,
    commands.directed,
    commands.unsigned,
    references.itself,
    references.of_another_kind,
    references.behind_a_limit,
    supply.off_median,
    supply.drive_off,
    blackouts.repeats,
    blackouts.leaps,
    refresh.held,
)


def consistent(sheet: Sheet) -> tuple[Sheet, list[Fault]]:
    """The sheet, masked and mended, and what was found.

    Raises:
        InputError: what was found cannot be mended.
    """
    faults: list[Fault] = []
    for step in STEPS:
        sheet, found = step(sheet)
        faults += found
    if faults:
        sheet = sheet.changed(valid=np.isfinite(sheet.fields["y"]))
    return sheet, faults
