"""Which column of a file is which quantity: names, units, the kind of input, and what a person's own names stand for.

A servo is told a voltage, a duty, a torque or a current; where none of these is recorded, a position: it closes a loop
of its own.
"""

import math
import re
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ers_mj.data.mapping import Source, source_of
from ers_mj.data.tables import listed
from ers_mj.data.units import Unit, conversion, split_header
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
HEADERS = {  # what a header's name without its unit stands for, whatever its case
    "t": r"t|time|timestamp|zeit",
    "u": r"u|voltage|command|duty|pwm|tau|torque command|current command",
    "y": r"theta|angle|position|pos|x|y",
    "omega": r"omega|speed|velocity",
    "current": r"i|current",
    "vin": r"vin|supply|supply voltage|battery",
    "reference": r"theta_ref|reference|setpoint|goal|target",
    "temperature": r"temp|temperature",
}
MEASURED = ("y", "omega", "current", "theta_m", "second")  # missing stays NaN; others hold their last value
CONSTANT = ("kp", "load_kg", "arm_m")  # one value a recording
OPTIONAL = tuple(dict.fromkeys(role.field for role in COLUMNS.values() if role.field not in REQUIRED))


class Choice(NamedTuple):
    """The columns of a file that mean something.

    Attributes:
        sources: contract name -> where it comes from.
        input: contract name of what the servo is told.
        second: contract name of a further signal to explain, or None.
    """

    sources: dict[str, Source]
    input: str
    second: str | None = None

    @property
    def kind(self) -> str:
        """Of the input: voltage, duty, torque, current or position."""
        return INPUTS[self.input]

    def roles(self) -> dict[str, str]:
        """Field -> contract name."""
        fields = {COLUMNS[contract].field: contract for contract in self.sources if contract not in INPUTS}
        beside = {COLUMNS[c].field: c for c in self.sources if COLUMNS[c].field == "reference" and c != self.input}
        return fields | beside | {"u": self.input} | ({"second": self.second} if self.second else {})


class Asking(NamedTuple):
    """What a person says of the columns: contract name -> column, unit or arithmetic (see mapping); which column is the
    input where several could be; and which is to be explained as well.
    """

    mapping: Mapping[str, str]
    input: str | None = None
    second: str | None = None


def choose_columns(columns: list[str], asked: Asking, name: str, units: Mapping[str, str] | None = None) -> Choice:
    """What the mapping says, then what is called by its name, then what a header such as "theta [deg]" says; ``units``
    are those that the file gives its columns.
    """
    _refuse_mistyped(asked.mapping, name)
    sources = _sources(columns, asked.mapping, units or {}, name)
    told_input, second = (_asked(o, getattr(asked, o), sources, name) for o in ("input", "second"))
    by_field = {field: [c for c in sources if COLUMNS[c].field == field] for field in (*REQUIRED, *OPTIONAL)}
    inputs = by_field.pop("u")
    _refuse_several_or_none("t", by_field["t"], columns, name)
    told = _input(inputs, by_field["reference"], (told_input, second), columns, name)
    for field, found in by_field.items():
        _refuse_several_or_none(field, found, columns, name)
    output = by_field["y"][0]
    _refuse_other_unit(told, output, sources, name)
    strange = {c for c in by_field["reference"] if COLUMNS[c].unit != COLUMNS[output].unit}
    return Choice({c: source for c, source in sources.items() if c not in strange}, told, second)


def _sources(columns: list[str], mapping: Mapping[str, str], units: Mapping[str, str], name: str) -> dict[str, Source]:
    """Contract name -> where it comes from, of all that a file holds."""
    targets = {contract: (COLUMNS[contract].unit, COLUMNS[contract].factor) for contract in mapping}
    mapped = {c: source_of(c, text, targets[c], columns, units, name) for c, text in mapping.items()}
    settled = {COLUMNS[contract].field for contract in mapped}
    used = {column for source in mapped.values() for column in source.columns}
    free = [c for c in columns if c in COLUMNS and COLUMNS[c].field not in settled and c not in used]
    sources = mapped | {c: _named(c, units, name) for c in free}
    return sources | _by_header(columns, units, {COLUMNS[c].field for c in sources}, used)


def _named(contract: str, units: Mapping[str, str], name: str) -> Source:
    """A column under the contract's own name, in the unit of that name; the file's must not deny it."""
    role = COLUMNS[contract]
    turned = conversion(units[contract], role.unit) if contract in units and role.unit != "-" else None
    if turned is not None and not math.isclose(turned.factor, role.factor):
        raise InputError(
            f"{name}: {contract} is in {units[contract]} by its file and not by its name, choose with --map"
            f' "{contract}={contract} [{units[contract]}]"'
        )
    return Source(contract, ((contract, None),), Unit("", role.factor))


def _by_header(columns: list[str], units: Mapping[str, str], there: set[str], used: set[str]) -> dict[str, Source]:
    """Columns such as "theta [deg]" and "Time (ms)", for fields that nothing else gives."""
    found: dict[str, Source] = {}
    for column in columns:
        base, unit = split_header(column)
        unit = unit or units.get(column)
        if unit is None or column in used or column in COLUMNS:
            continue
        for contract, role in COLUMNS.items():
            turned = conversion(unit, role.unit) if role.factor == 1.0 else None
            fits = re.fullmatch(HEADERS.get(role.field, "(?!)"), base.strip().lower())
            if turned is not None and fits and role.field not in there:
                told = f"{contract} is {column}, in {unit} as its header says"
                found[contract] = Source(column, ((column, None),), turned, True, told)
                there = there | {role.field} if role.field != "u" else there
                break
    return found


def _refuse_other_unit(told: str, output: str, sources: Mapping[str, Source], name: str) -> None:
    """Raise InputError where a position command is no output to be reached."""
    units = COLUMNS[told].unit, COLUMNS[output].unit
    if INPUTS[told] == "position" and units[0] != units[1]:
        raise InputError(
            f"{name}: the position command {sources[told].columns[0]} is in {units[0]} and the output"
            f" {sources[output].columns[0]} in {units[1]}, one unit was expected (choose with --map)"
        )


def _asked(option: str, column: str | None, sources: Mapping[str, Source], name: str) -> str | None:
    """The contract name of a column that is asked for by either name."""
    if column is None:
        return None
    taken = {**{s.text: contract for contract, s in sources.items()}, **{contract: contract for contract in sources}}
    known = [c for c in sources if (c in INPUTS if option == "input" else COLUMNS[c].field != "t")]
    if (contract := taken.get(column)) in known:
        return contract
    there = f"there are {listed(known)}" if known else "there is none"
    raise InputError(f"{name}: --{option} asks for {column!r}, {there} (other names come in with --map)")


def _input(
    inputs: list[str], references: list[str], asked: tuple[str | None, str | None], columns: list[str], name: str
) -> str:
    """The input's contract name: what is asked for, the only one, or where there is none, the position command."""
    first, second = asked
    if first is not None and first == second:
        raise InputError(f"{name}: {first} is the input, --second takes another signal")
    found = [first] if first else [c for c in inputs if c != second] or references
    if len(found) > 1:
        raise InputError(f"{name}: {listed(found)} are all inputs, choose one with --input")
    if not found:
        raise InputError(f"{name}: {_told_missing('u', columns)}")
    return found[0]


def input_name(unit: str) -> str:
    """The contract name of an input in this unit."""
    contract = "u_duty_pct" if unit == "%" else next((c for c in INPUTS if COLUMNS[c].unit == unit), None)
    return contract or f"u_{unit}"


def output_name(unit: str) -> str:
    """The contract name of an output in this unit."""
    return next(name for name, role in COLUMNS.items() if (role.field, role.unit, role.factor) == ("y", unit, 1.0))


def per(unit: str) -> str:
    """A unit as it stands below a stroke: in brackets where it is a product."""
    return f"({unit})" if " " in unit else unit


def kind_of(unit: str) -> str:
    """The kind of an input in this unit: a torque's is N m, a position's rad or m."""
    return INPUTS[input_name(unit)]


def _refuse_several_or_none(field: str, found: list[str], columns: list[str], name: str) -> None:
    if len(found) > 1:
        raise InputError(f"{name}: {listed(found)} are all columns of one quantity, drop one or choose with --map")
    if not found and field in REQUIRED:
        raise InputError(f"{name}: {_told_missing(field, columns)}")


def _refuse_mistyped(mapping: Mapping[str, str], name: str) -> None:
    for contract in mapping:
        if contract not in COLUMNS:
            raise InputError(f"{name}: --map gives {contract!r}, the names it knows are {listed(COLUMNS)}")


def refuse_left_out(left_out: Mapping[str, str], asked: Asking, name: str) -> None:
    """Raise InputError where what is mapped, or bears a required name, is no column of the file."""
    required = [c for c, role in COLUMNS.items() if role.field in REQUIRED and c not in asked.mapping]
    for column in (*asked.mapping.values(), *required):
        if column in left_out:
            raise InputError(f"{name}: {column} cannot be used, it {left_out[column]}")


def _told_missing(field: str, columns: list[str]) -> str:
    noun, known = REQUIRED[field], [contract for contract, role in COLUMNS.items() if role.field == field]
    known += [c for c, kind in INPUTS.items() if kind == "position"] if field == "u" else []
    if alike := [c for c in columns if c not in COLUMNS and re.match(LOOKS_LIKE[field], c)]:
        return f"the {noun} {listed(alike)} has an unknown unit, known are {listed(known)} (or choose with --map)"
    expected = f"{listed(known)} was expected or --map {known[0]}=COLUMN"
    return f"there is no {noun}, {expected}, and the columns are {listed(columns)}"


def refuse_unknown_unit(noun: str, unit: str, field: str, name: str) -> None:
    """Raise InputError where no column of this field has such a unit."""
    known = dict.fromkeys(
        role.unit for c, role in COLUMNS.items() if role.field == field or field == "u" and c in INPUTS
    )
    if unit not in known:
        raise InputError(f"{name}: the {noun} has the unknown unit {unit!r}; known are {listed(known)}")
