"""Which column of a file is which quantity: names, units, the kind of input, and what a person's own names stand for.

A servo is told a voltage, a duty, a torque or a current; where none of these is recorded, a position: it closes a loop
of its own.
"""

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
    "tau_cmd_Nm": Role("u", "N m"),
    "i_cmd_A": Role("u", "A"),
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
    "direction": Role("direction", "-"),
    "kp": Role("kp", "-"),
    "load_kg": Role("load_kg", "kg"),
    "arm_m": Role("arm_m", "m"),
}
INPUTS: Mapping[str, str] = {  # the kind that each makes a recording; taken in this order of the fields u, reference
    "u_V": "voltage",
    "u_duty_pct": "duty",
    "tau_cmd_Nm": "torque",
    "i_cmd_A": "current",
    "theta_ref_rad": "position",
    "theta_ref_deg": "position",
    "x_ref_m": "position",
}
REQUIRED = {"t": "time", "u": "input", "y": "output"}
LOOKS_LIKE = {"t": r"(t|time)(_|$)", "u": r"u(_|$)", "y": r"(theta|x|y)(?!_ref|_m_)(_|$)"}
MEASURED = ("y", "omega", "current", "theta_m", "second")  # missing stays NaN; others hold their last value
CONSTANT = ("kp", "load_kg", "arm_m")  # one value a recording
OPTIONAL = tuple(dict.fromkeys(role.field for role in COLUMNS.values() if role.field not in REQUIRED))


class Choice(NamedTuple):
    """The columns of a file that mean something.

    Attributes:
        columns: contract name -> column of the file.
        input: contract name of what the servo is told.
        second: contract name of a further signal to explain, or None.
    """

    columns: dict[str, str]
    input: str
    second: str | None = None

    @property
    def kind(self) -> str:
        """Of the input: voltage, duty, torque, current or position."""
        return INPUTS[self.input]

    def roles(self) -> dict[str, str]:
        """Field -> contract name."""
        fields = {COLUMNS[contract].field: contract for contract in self.columns if contract not in INPUTS}
        beside = {COLUMNS[c].field: c for c in self.columns if COLUMNS[c].field == "reference" and c != self.input}
        return fields | beside | {"u": self.input} | ({"second": self.second} if self.second else {})


def choose_columns(
    columns: list[str],
    mapping: dict[str, str],
    name: str,
    input_column: str | None = None,
    second: str | None = None,
) -> Choice:
    """What the mapping says, then what is called by its name; ``input_column`` is the input where several stand, and
    ``second`` a further signal to explain, both by either name.
    """
    _refuse_mistyped(columns, mapping, name)
    settled = {COLUMNS[contract].field for contract in mapping}
    free = [c for c in columns if c in COLUMNS and COLUMNS[c].field not in settled and c not in mapping.values()]
    chosen = mapping | {column: column for column in free}
    asked = {"input": _asked("input", input_column, chosen, name), "second": _asked("second", second, chosen, name)}
    by_field = {field: [c for c in chosen if COLUMNS[c].field == field] for field in (*REQUIRED, *OPTIONAL)}
    inputs = by_field.pop("u")
    _refuse_several_or_none("t", by_field["t"], columns, name)
    told = _input(inputs, by_field["reference"], asked, columns, name)
    for field, found in by_field.items():
        _refuse_several_or_none(field, found, columns, name)
    output = by_field["y"][0]
    _refuse_other_unit(told, output, chosen, name)
    strange = {c for c in by_field["reference"] if COLUMNS[c].unit != COLUMNS[output].unit}
    return Choice({c: column for c, column in chosen.items() if c not in strange}, told, asked["second"])


def _refuse_other_unit(told: str, output: str, chosen: dict[str, str], name: str) -> None:
    """Raise InputError where a position command is no output to be reached."""
    units = COLUMNS[told].unit, COLUMNS[output].unit
    if INPUTS[told] == "position" and units[0] != units[1]:
        raise InputError(
            f"{name}: the position command {chosen[told]} is in {units[0]} and the output {chosen[output]} in"
            f" {units[1]}, one unit was expected (choose with --map)"
        )


def _asked(option: str, column: str | None, chosen: dict[str, str], name: str) -> str | None:
    """The contract name of a column that is asked for by either name."""
    if column is None:
        return None
    taken = {**{c: contract for contract, c in chosen.items()}, **{contract: contract for contract in chosen}}
    known = [c for c in chosen if c in INPUTS] if option == "input" else [c for c in chosen if COLUMNS[c].field != "t"]
    if (contract := taken.get(column)) in known:
        return contract
    there = f"there are {listed(known)}" if known else "there is none"
    raise InputError(f"{name}: --{option} asks for {column!r}, {there} (other names come in with --map)")


def _input(
    inputs: list[str], references: list[str], asked: dict[str, str | None], columns: list[str], name: str
) -> str:
    """The input's contract name: what is asked for, the only one, or where there is none, the position command."""
    if asked["input"] is not None and asked["input"] == asked["second"]:
        raise InputError(f"{name}: {asked['input']} is the input, --second takes another signal")
    found = [asked["input"]] if asked["input"] else [c for c in inputs if c != asked["second"]] or references
    if len(found) > 1:
        raise InputError(f"{name}: {listed(found)} are all inputs, choose one with --input")
    if not found:
        raise InputError(f"{name}: {_told_missing('u', columns)}")
    return found[0]


def input_name(unit: str) -> str:
    """The contract name of an input in this unit."""
    contract = "u_duty_pct" if unit == "%" else next((c for c in INPUTS if COLUMNS[c].unit == unit), None)
    return contract or f"u_{unit}"


def kind_of(unit: str) -> str:
    """The kind of an input in this unit: a torque's is N m, a position's rad or m."""
    return INPUTS[input_name(unit)]


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
    known += [c for c, kind in INPUTS.items() if kind == "position"] if field == "u" else []
    if alike := [c for c in columns if c not in COLUMNS and re.match(LOOKS_LIKE[field], c)]:
        return f"the {noun} {listed(alike)} has an unknown unit, known are {listed(known)} (or choose with --map)"
    return f"there is no {noun}, {listed(known)} was expected and the columns are {listed(columns)}"


def refuse_unknown_unit(noun: str, unit: str, field: str, name: str) -> None:
    """Raise InputError where no column of this field has such a unit."""
    known = dict.fromkeys(
        role.unit for c, role in COLUMNS.items() if role.field == field or field == "u" and c in INPUTS
    )
    if unit not in known:
        raise InputError(f"{name}: the {noun} has the unknown unit {unit!r}; known are {listed(known)}")
