"""Units as servo logs write them, and the factors to those that a recording holds.

A table of our own: general libraries read several of these strings as something else (`Nm` as a count of yarn, `C` as
coulomb, 4096 `counts` as radians) without complaint. What is not in the table is unknown, never guessed.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple


class Unit(NamedTuple):
    """A unit: its dimension, and SI value = factor * x + offset."""

    dimension: str
    factor: float
    offset: float = 0.0


TURN, MINUTE = 2.0 * math.pi, 60.0  # [rad], [s]
POUND, GRAVITY, INCH, FOOT = 0.45359237, 9.80665, 0.0254, 0.3048  # [kg], [m/s^2], [m], [m], by definition
OUNCE = POUND / 16.0  # [kg]

TABLE: dict[str, tuple[str, float]] = {  # dimension: as `BASE` names it; factor to it
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), ("time", 1.0)),
    **dict.fromkeys(("ms", "msec", "millis", "millisecond", "milliseconds"), ("time", 0.001)),
    **dict.fromkeys(("us", "usec", "micros", "microsecond", "microseconds"), ("time", 1e-06)),
    **dict.fromkeys(("ns", "nsec", "nanos", "nanosecond", "nanoseconds"), ("time", 1e-09)),
    **dict.fromkeys(("min", "minute", "minutes"), ("time", MINUTE)),
    **dict.fromkeys(("rad", "radian", "radians"), ("angle", 1.0)),
    "mrad": ("angle", 1e-3),
    **dict.fromkeys(("deg", "degree", "degrees", "°"), ("angle", TURN / 360)),
    **dict.fromkeys(("mdeg", "m°"), ("angle", TURN / 360000.0)),
    **dict.fromkeys(("cdeg", "centideg"), ("angle", TURN / 36000.0)),
    "arcmin": ("angle", TURN / 21600),
    "arcsec": ("angle", TURN / 1296000),
    "gon": ("angle", TURN / 400),
    **dict.fromkeys(("rev", "revs", "turn", "turns", "rot", "rotations"), ("angle", TURN)),
    **dict.fromkeys(("m", "meter", "metre"), ("length", 1.0)),
    "cm": ("length", 1e-2),
    "mm": ("length", 1e-3),
    **dict.fromkeys(("um", "micron"), ("length", 1e-06)),
    **dict.fromkeys(("in", "inch"), ("length", INCH)),
    **dict.fromkeys(("rad/s", "rad/sec"), ("speed", 1.0)),
    "mrad/s": ("speed", 1e-3),
    **dict.fromkeys(("deg/s", "deg/sec", "dps", "°/s", "degps"), ("speed", TURN / 360)),
    **dict.fromkeys(("rpm", "1/min", "min-1", "min^-1", "rev/min", "r/min", "u/min"), ("speed", TURN / MINUTE)),
    **dict.fromkeys(("rev/s", "rps", "turn/s", "turns/s", "r/s"), ("speed", TURN)),
    **dict.fromkeys(("v", "volt", "volts"), ("voltage", 1.0)),
    "mv": ("voltage", 1e-3),
    "kv": ("voltage", 1e3),
    **dict.fromkeys(("a", "amp", "amps", "ampere"), ("current", 1.0)),
    "ma": ("current", 1e-3),
    "ua": ("current", 1e-6),
    **dict.fromkeys(("nm", "newtonmeter", "newtonmetre"), ("torque", 1.0)),
    "mnm": ("torque", 1e-3),
    "unm": ("torque", 1e-6),
    "knm": ("torque", 1e3),
    "ncm": ("torque", 1e-2),
    "nmm": ("torque", 1e-3),
    **dict.fromkeys(("kgm", "kgfm", "kpm"), ("torque", GRAVITY)),
    **dict.fromkeys(("kgcm", "kgfcm", "kg/cm", "kpcm"), ("torque", GRAVITY * 0.01)),
    **dict.fromkeys(("gcm", "gfcm"), ("torque", GRAVITY * 1e-05)),
    **dict.fromkeys(("ozin", "ozfin", "inoz"), ("torque", OUNCE * GRAVITY * INCH)),
    **dict.fromkeys(("lbin", "lbfin", "inlb", "inlbf"), ("torque", POUND * GRAVITY * INCH)),
    **dict.fromkeys(("lbft", "lbfft", "ftlb", "ftlbf"), ("torque", POUND * GRAVITY * FOOT)),
    **dict.fromkeys(("%", "pct", "percent", "prozent"), ("share", 1.0)),
    **dict.fromkeys(("pu", "p.u.", "fraction", "ratio", "0..1"), ("share", 100.0)),
    "permille": ("share", 0.1),
    **dict.fromkeys(("kg", "kilogram"), ("mass", 1.0)),
    "g": ("mass", 1e-3),
    "lb": ("mass", POUND),
    "oz": ("mass", OUNCE),
    **dict.fromkeys(("-", "1", "none", "bool", "boolean"), ("none", 1.0)),
    **dict.fromkeys(("nm/a", "vs", "vs/rad", "v/(rad/s)", "v*s/rad"), ("constant", 1.0)),
    "mnm/a": ("constant", 1e-3),
    "ozin/a": ("constant", OUNCE * GRAVITY * INCH),
    **dict.fromkeys(("v/krpm", "v/1000rpm", "mv/rpm"), ("constant", MINUTE / TURN * 0.001)),
    "v/rpm": ("constant", MINUTE / TURN),
    **dict.fromkeys(("kgm2", "kgm^2"), ("inertia", 1.0)),
    **dict.fromkeys(("kgcm2", "kgcm^2"), ("inertia", 0.0001)),
    **dict.fromkeys(("gcm2", "gcm^2"), ("inertia", 1e-07)),
    **dict.fromkeys(("ozin2", "ozin^2"), ("inertia", OUNCE * INCH**2)),
    **dict.fromkeys(("ozins2", "ozins^2", "ozinsec2"), ("inertia", OUNCE * GRAVITY * INCH)),
    **dict.fromkeys(("ohm", "ohms", "Ω"), ("resistance", 1.0)),
    "mohm": ("resistance", 1e-3),
    **dict.fromkeys(("h", "henry"), ("inductance", 1.0)),
    "mh": ("inductance", 1e-3),
    "uh": ("inductance", 1e-6),
    "hz": ("frequency", 1.0),
    "khz": ("frequency", 1e3),
}
TEMPERATURES = {
    **{name: Unit("temperature", 1.0) for name in ("c", "°c", "degc", "celsius")},
    **{name: Unit("temperature", 1.0, -273.15) for name in ("k", "kelvin")},
    **{name: Unit("temperature", 5 / 9, -160 / 9) for name in ("f", "°f", "degf", "fahrenheit")},
}
COUNTS = ("count", "counts", "cnt", "cnts", "tick", "ticks", "lsb", "inc", "incs", "increments", "steps", "raw")
WORDS = ("in", "min", "rev", "rot", "turn", "none", "bool", "ratio", "second")  # as the end of a name
MEGA = ("MNm", "MN m", "MV", "MA", "MH", "MOhm")  # in lower case these would be thousandths
BASE = {  # the unit of a recording -> dimension, and what of the table's unit it is
    "s": ("time", 1.0),
    "rad": ("angle", 1.0),
    "m": ("length", 1.0),
    "rad/s": ("speed", 1.0),
    "V": ("voltage", 1.0),
    "A": ("current", 1.0),
    "N m": ("torque", 1.0),
    "pct": ("share", 1.0),
    "kg": ("mass", 1.0),
    "degC": ("temperature", 1.0),
    "-": ("none", 1.0),
}


def unit_named(text: str) -> Unit | None:
    """The unit that a string of a log means; None where the table has no such string."""
    text = text.strip().strip("[]()").strip()
    if text in MEGA:
        return None
    plain = text.replace("µ", "u").replace("μ", "u").replace("º", "°").replace("²", "2").lower()
    squeezed = re.sub(r"(?<=[a-z2])[\s.\-*·⋅]+(?=[a-z])", "", plain)  # N m, N.m, N-m, oz-in: one unit
    for form in (plain, squeezed, re.sub(r"\s+", "", plain)):
        if form in TEMPERATURES:
            return TEMPERATURES[form]
        if form in TABLE:
            return Unit(*TABLE[form])
    return None


def counts_per_turn(text: str) -> float | None:
    """N of "counts/4096", "4096 counts", "cpr 4096": what makes a turn; None where the text says no such thing."""
    words = "|".join(COUNTS)
    found = re.fullmatch(rf"\s*(?:(?:{words})\s*/\s*|cpr\s*|ppr\s*)(\d+(?:\.\d*)?)\s*", text.lower())
    found = found or re.fullmatch(rf"\s*(\d+(?:\.\d*)?)\s*(?:{words}|cpr|ppr)\s*", text.lower())
    return float(found[1]) if found and float(found[1]) > 0.0 else None


def conversion(text: str, target: str) -> Unit | None:
    """From the unit in a text to ``target``, one of BASE; None where the text is no unit of that dimension."""
    turn = counts_per_turn(text)
    if turn is not None and BASE[target][0] == "angle":
        return Unit("angle", TURN / turn)
    unit = unit_named(text)
    return unit if unit is not None and unit.dimension == BASE[target][0] else None


def is_unit(text: str) -> bool:
    """Whether a text is a unit, or counts, as logs write them."""
    return unit_named(text) is not None or counts_per_turn(text) is not None or text.strip().lower() in COUNTS


def suffix_of(name: str) -> str | None:
    """The unit that a name ends in: "pos_mm", "speed_rpm"; None where it ends in none, or in what may be a word or a
    letter of the field.
    """
    suffix = name.rpartition("_")[2] if "_" in name else ""
    return suffix if len(suffix) > 1 and suffix.lower() not in WORDS and unit_named(suffix) is not None else None


def split_header(header: str) -> tuple[str, str | None]:
    """Name and unit of "Time [ms]", "Angle (deg)" or "Speed, rpm"; no unit where none is understood."""
    found = re.fullmatch(r"\s*(.+?)\s*[\[(]\s*([^\[\]()]+?)\s*[\])]\s*", header) or re.fullmatch(
        r"\s*(.+?)\s*[,;/]\s*([^,;/]+?)\s*", header
    )
    return (found[1], found[2]) if found and is_unit(found[2]) else (header, None)
