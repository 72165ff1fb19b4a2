"""Which column of a file is which quantity: names, units, and what a person's own names stand for."""

import re
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ers_mj.data.tables import listed
from ers_mj.errors import InputError


class Role(NamedTuple):
    """What a column of a file means: the field it fills, that field's unit, and the factor to it."""

    field: str
    unit: str
    factor: float = 1.0


COLUMNS: Mapping[str, Role] = {
    "t_s": Role("t", "s"),
    "u_V": Role("u", "V"),
    "u_duty_pct": Role("u", "pct"),
    "theta_rad": Role("y", "rad"),
    "theta_deg": Role("y", "rad", np.pi / 180),
    "x_m": Role("y", "m"),
    "y_sensor_V": Role("y", "V"),
    "omega_rad_s": Role("omega", "rad/s"),
    "i_A": Role("current", "A"),
    "theta_m_rad": Role("theta_m", "rad"),
    "vin_V": Role("vin", "V"),
    "T_L_Nm": Role("load", "N m"),
    "theta_ref_rad": Role("reference", "rad"),
    "theta_ref_deg": Role("reference", "rad", np.pi / 180),
    "x_ref_m": Role("reference", "m"),
    "temp_C": Role("temperature", "degC"),
    "torque_enable": Role("enable", "-"),
}
REQUIRED = {"t": "time", "u": "input", "y": "output"}
LOOKS_LIKE = {"t": r"(t|time)(_|$)", "u": r"u(_|$)", "y": r"(theta|x|y)(?!_ref|_m_)(_|$)"}
MEASURED = ("y", "omega", "current", "theta_m")  # missing stays NaN; every other column holds its last value
OPTIONAL = tuple(dict.fromkeys(role.field for role in COLUMNS.values() if role.field not in REQUIRED))


def choose_columns(columns: list[str], mapping: dict[str, str], name: str) -> dict[str, str]:
    """Contract name -> column of the file: what the mapping says, then what is called by its name."""
    _refuse_mistyped(columns, mapping, name)
    settled = {COLUMNS[contract].field for contract in mapping}
    free = [c for c in columns if c in COLUMNS and COLUMNS[c].field not in settled and c not in mapping.values()]
    chosen = mapping | {column: column for column in free}
    by_field = {field: [c for c in chosen if COLUMNS[c].field == field] for field in (*REQUIRED, *OPTIONAL)}
    for field, found in by_field.items():
        _refuse_several_or_none(field, found, columns, name)
    unit = COLUMNS[by_field["y"][0]].unit
    return {c: column for c, column in chosen.items() if COLUMNS[c].field != "reference" or COLUMNS[c].unit == unit}


def _refuse_several_or_none(field: str, found: list[str], columns: list[str], name: str) -> None:
    if len(found) > 1:
        raise InputError(f"{name}: {listed(found)} are all columns of one quantity, drop one or choose with --map")
    if not found and field in REQUIRED:
        raise InputError(f"{name}: {_told_missing(field, columns)}")


def _refuse_mistyped(columns: list[str], mapping: dict[str, str], name: str) -> None:
    for contract, column in mapping.items():
        if contract not in COLUMNS:
            raise InputError(f"{name}: --map gives {contract!r}, the names it knows are {listed(COLUMNS)}")
        if column not in columns:
            raise InputError(f"{name}: --map asks for the column {column!r}, the columns are {listed(columns)}")


def _told_missing(field: str, columns: list[str]) -> str:
    noun, known = REQUIRED[field], [contract for contract, role in COLUMNS.items() if role.field == field]
    if alike := [c for c in columns if c not in COLUMNS and re.match(LOOKS_LIKE[field], c)]:
        return f"the {noun} {listed(alike)} has an unknown unit, known are {listed(known)} (or choose with --map)"
    return f"there is no {noun}, {listed(known)} was expected and the columns are {listed(columns)}"


def refuse_unknown_unit(noun: str, unit: str, field: str, name: str) -> None:
    """Raise InputError where no column of this field has such a unit."""
    known = dict.fromkeys(role.unit for role in COLUMNS.values() if role.field == field)
    if unit not in known:
        raise InputError(f"{name}: the {noun} has the unknown unit {unit!r}; known are {listed(known)}")
