"""Values that are those of another unit than their column's name."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ers_mj.data.consistency.motion import likeness, speed
from ers_mj.data.consistency.sheet import Found, Sheet
from ers_mj.errors import InputError


@dataclass(frozen=True)
class Scales:
    """Which values no servo has in the unit that is named."""

    whole_travel: float = 7.0  # rad or m in whole numbers: counts or degrees
    whole_volts: float = 100.0  # V in whole numbers: counts
    full_duty: float = 100.5  # %
    alike: float = 0.9  # correlation of a speed with the output's, from which their ratio counts
    near: float = 0.1  # of a ratio, by which it may miss that of two units


SCALES = Scales()
DEGREES, RPM = 180.0 / math.pi, 30.0 / math.pi


def whole_numbers(sheet: Sheet) -> Found:
    """Refuse an output, or volts, in whole numbers far beyond what they would be in their unit."""
    for field, contract, most in (("y", "rad", SCALES.whole_travel), ("y", "m", SCALES.whole_travel)):
        x = sheet.fields[field][np.isfinite(sheet.fields[field])]
        if sheet.units[field] == contract and _whole(x) and np.ptp(x) >= most:
            _doubt(sheet, field, f"moves in whole numbers from {x.min():.6g} to {x.max():.6g}, as counts or degrees do")
    if sheet.units["u"] == "V" and _whole(sheet.u) and np.max(np.abs(sheet.u)) >= SCALES.whole_volts:
        _doubt(sheet, "u", f"holds whole numbers up to {np.max(np.abs(sheet.u)):.6g}, as the counts of a PWM are")
    return sheet, []


def _whole(x: np.ndarray) -> bool:
    return bool(np.all(x == np.rint(x)))


def duty_counts(sheet: Sheet) -> Found:
    """Refuse a duty beyond 100 %."""
    most = float(np.max(np.abs(sheet.u)))
    if sheet.kind == "duty" and most > SCALES.full_duty:
        _doubt(sheet, "u", f"reaches {most:.6g} %, a duty ends at 100 %: these look like counts of a PWM")
    return sheet, []


def speed_unit(sheet: Sheet) -> Found:
    """A recorded speed that is the output's in another unit is left out; one that says that the output is in another
    unit, refused.
    """
    if "omega" not in sheet.fields or {"y", "omega"} & sheet.sure or sheet.units["y"] != "rad":
        return sheet, []
    slope, alike = likeness(speed(sheet), sheet.fields["omega"])
    if alike < SCALES.alike:
        return sheet, []
    if abs(slope * DEGREES - 1.0) < SCALES.near:
        _doubt(sheet, "y", f"moves {DEGREES:.1f} times as fast as {sheet.labels['omega']} says, as degrees would")
    for unit, ratio in (("deg/s", DEGREES), ("rpm", RPM)):
        if abs(slope / ratio - 1.0) < SCALES.near:
            column = sheet.labels["omega"]
            sentence = (
                f"{column} is {slope:.3g} times the output's speed and looks like {unit}: it is not used (give"
                f' --map "omega_rad_s={column} [{unit}]")'
            )
            whole = np.isfinite(sheet.fields["omega"])
            return sheet.without("omega"), [sheet.fault("unit", "omega", whole, sentence)]
    return sheet, []


def _doubt(sheet: Sheet, field: str, what: str) -> None:
    """Refuse a field whose unit nobody has insisted on."""
    if field in sheet.sure:
        return
    column, unit = sheet.labels[field], {"pct": "%"}.get(sheet.units[field], sheet.units[field])
    contract = {"rad": "theta_rad", "m": "x_m", "V": "u_V", "%": "u_duty_pct"}[unit]
    hint = {"rad": f"{column} [deg]", "m": f"{column} [mm]", "V": f"{column}*24/255", "%": f"{column}*100/255"}[unit]
    raise InputError(
        f'{sheet.name}: {column} {what}: give its unit or factor, as in --map "{contract}={hint}", or insist with'
        f' --map "{contract}={column} [{unit}]"'
    )
