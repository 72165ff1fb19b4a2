"""Units of a servo's output and input: what a file tells of them, and what is meant where it does not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ers_mj.errors import InputError, refuse_other

Unit = str | None  # None: as the file tells
OUTPUT_UNITS = ("rad", "m", "V")
INPUT_UNITS = ("V", "%", "pct", "N m", "A", "rad", "m")
KNOWN = {"output_unit": OUTPUT_UNITS, "input_unit": INPUT_UNITS}


def told_units(table: Mapping[str, Any], where: str) -> dict[str, str]:
    """Those units that a table has.

    Raises:
        InputError: one that there is not.
    """
    told = {key: table[key] for key in KNOWN if key in table}
    for key, unit in told.items():
        if unit not in KNOWN[key]:
            raise InputError(f"{where} has {key} = {unit!r}, one of {', '.join(KNOWN[key])} was expected")
    return told


def output_unit_of(told: str, given: Unit = None, whose: str = "") -> str:
    """The unit given, else what a file has told, else rad.

    Raises:
        InputError: there is no such unit, or the file of that name tells another one.
    """
    return _meant("output unit", told, given, whose) or "rad"


def input_unit_of(told: str, given: Unit = None, whose: str = "") -> str:
    """The unit given, else what a file has told, else V.

    Raises:
        InputError: there is no such unit, or the file of that name tells another one.
    """
    return _meant("input unit", told, given, whose) or "V"


def _meant(what: str, told: str, given: Unit, whose: str) -> str:
    if given is None:
        return told
    refuse_other(what, given, KNOWN[what.replace(" ", "_")])
    if told and told != given:
        raise InputError(f"{whose or 'the model'}: its {what} is {told}, but {given} was given")
    return given
