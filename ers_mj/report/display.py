"""Numbers and units as a reader sees them: degrees for angles, three or four digits, superscripts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

NONE = "—"
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
DEGREES = 180 / math.pi


@dataclass(frozen=True)
class Unit:
    """How a quantity is shown: `factor` takes the document's number to `label`."""

    label: str
    factor: float = 1.0

    def __call__(self, x: float | None, digits: int = 3) -> str:
        """The value with its unit, a dash where there is none."""
        space = "" if self.label == "°" else " "
        return NONE if missing(x) else f"{figure(x * self.factor, digits)}{space}{self.label}".strip()

    def bare(self, x: float | None, digits: int = 3) -> str:
        """The value without its unit."""
        return NONE if missing(x) else figure(x * self.factor, digits)


def missing(x: object) -> bool:
    """Whether x is no finite number."""
    return x is None or isinstance(x, bool | str) or not math.isfinite(x)


def figure(x: float, digits: int = 3) -> str:
    """x to so many significant digits, powers of ten where zeros would pile up."""
    if x == 0:
        return "0"
    exponent = int(f"{x:.{digits - 1}e}".partition("e")[2])
    if not -4 < exponent < 6:
        return f"{x / 10.0**exponent:.{digits - 1}f}×10{str(exponent).translate(SUPERSCRIPT)}".replace("-", "−")
    decimals = max(digits - 1 - exponent, 0)
    return f"{x:.{decimals}f}".replace("-", "−")


def pretty(unit: str | None) -> str:
    """ "kg m^2" -> "kg m²"."""
    parts = (unit or "").split("^")
    text = parts[0]
    for part in parts[1:]:
        digits = part[: len(part) - len(part.lstrip("-0123456789"))]
        text += digits.translate(SUPERSCRIPT) + part[len(digits) :]
    return "" if text == "-" else text.replace("degC", "°C")


def noun(output_unit: str) -> str:
    """What an output of this unit is called."""
    return {"rad": "angle", "m": "position"}.get(output_unit, "output")


def shown(unit: str | None, size: float | None = None) -> Unit:
    """How values of `unit` are shown; `size` [unit] says whether lengths are small."""
    few_millimetres = 0.1  # [m]
    known = {"rad": Unit("°", DEGREES), "rad/s": Unit("°/s", DEGREES), "pct": Unit("%")}
    if unit in ("m", "m/s") and size is not None and abs(size) < few_millimetres:
        return Unit(unit.replace("m", "mm", 1), 1e3)
    return known.get(unit or "", Unit(pretty(unit)))


def spoken(value: float | None, unit: str | None, digits: int = 3) -> str:
    """One value with the unit in which it reads best."""
    return shown(unit, None if missing(value) else value)(value, digits)


def interval(ci: object, unit: Unit, digits: int = 3) -> str:
    """ "0.2 .. 0.4", a dash where there is no interval, an open end where only one is known."""
    if not isinstance(ci, list | tuple) or len(ci) != 2 or all(missing(x) for x in ci):
        return NONE
    low, high = ("" if missing(x) else unit.bare(x, digits) for x in ci)
    return f"{low or '…'} … {high}".strip()


def measured(fit: Mapping) -> tuple[str, str]:
    """How errors are measured, as a heading and as a sentence: in one free run, or in windows (`fit.measure`)."""
    if fit.get("measure") != "windows":
        return "free-run", "Each model runs free: it gets the input and the initial state, never the measurement."
    return "windowed", (
        f"Each model runs in windows of {fit.get('window_s') or 0:.3g} s, each from a state fitted to it: nothing holds"
        " this servo at its place, so that in one long run any error would add up."
    )
