"""A recording: time, input and output of a servo, checked, in SI, and locked.

    file -> table (formats/) -> columns by role (mapping.py, columns.py) -> numbers -> checks (checks.py)
         -> data before physics (consistency/) -> Recording

What cannot be used is refused with one sentence (`InputError`); what can be worked around is, and is
told in `Recording.problems`. Time is axis 0, every array is (N,).
"""

import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from ers_mj.data.checks import FEWEST_SAMPLES as FEWEST_SAMPLES
from ers_mj.data.checks import GAP as GAP
from ers_mj.data.checks import checked, constants, ignored, locked, problems_of, refuse_still
from ers_mj.data.columns import (
    COLUMNS,
    CONSTANT,
    OPTIONAL,
    Asking,
    choose_columns,
    input_name,
    kind_of,
    refuse_left_out,
    refuse_unknown_unit,
)
from ers_mj.data.consistency import consistent
from ers_mj.data.consistency.sheet import Fault, Sheet
from ers_mj.data.expressions import Column
from ers_mj.data.formats import load
from ers_mj.data.formats.base import Loaded
from ers_mj.data.inspection import Inspection, inspected
from ers_mj.data.mapping import Source
from ers_mj.data.rails import off_rails, rail_spans
from ers_mj.data.sensor_faults import converter_step
from ers_mj.data.tables import cell_of, chosen_run, element, listed, numbers, reason, seconds, select_run, split_spec
from ers_mj.data.whole import write_whole
from ers_mj.errors import InputError, brief


@dataclass(frozen=True, eq=False)
class Recording:
    """One run of a servo. Arrays are (N,) and locked; `u[k]` is held from `t[k]` to `t[k + 1]`.

    Attributes:
        t: time [s], strictly increasing, from anywhere.
        u: commanded input [`input_unit`].
        y: measured output [`output_unit`], taken just before `u` changes; NaN where missing.
        valid: False where `y` is missing.
        omega, current, theta_m, vin, load, reference, temperature: speed [rad/s], current [A], motor
            angle [rad], supply [V], known load [N m], reference [`output_unit`], temperature [degC]; or None.
        enable: whether the drive was on, or None.
        direction: the sign of a duty that has none, or None.
        second: a further signal to explain (`--second`) [`second_unit`], NaN where missing, or None.
        kp, load_kg, arm_m: the firmware's gain register, load [kg] and its arm [m] of the whole recording; or None.
        input_kind: "voltage", "duty", "torque", "current", or "position": `u` is then what the servo's own loop is
            told [`output_unit`]. Torque and current commands know of no back-EMF.
        input_unit: "V", "pct", "N m", "A", "rad" or "m".
        output_unit: "rad", "m" or "V".
        second_name, second_unit: the contract's name of `second` and its unit, or "".
        quantum: the converter's step [`output_unit`] as `converter_step` finds it in the file's own unit.
        name, path, sha256: file name with its run, path, and hash of the bytes that were read.
        problems: what was worked around or ignored, a sentence each.
        faults: of these what is wrong with the data, and where: masked, mended, or to be known.
    """

    t: np.ndarray
    u: np.ndarray
    y: np.ndarray
    valid: np.ndarray
    omega: np.ndarray | None = None
    current: np.ndarray | None = None
    theta_m: np.ndarray | None = None
    vin: np.ndarray | None = None
    load: np.ndarray | None = None
    reference: np.ndarray | None = None
    temperature: np.ndarray | None = None
    enable: np.ndarray | None = None
    direction: np.ndarray | None = None
    second: np.ndarray | None = None
    kp: float | None = None
    load_kg: float | None = None
    arm_m: float | None = None
    input_kind: str = "voltage"
    input_unit: str = "V"
    output_unit: str = "rad"
    second_name: str = ""
    second_unit: str = ""
    quantum: float = 0.0
    name: str = "array"
    path: str = ""
    sha256: str = ""
    problems: tuple[str, ...] = ()
    faults: tuple[Fault, ...] = ()

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Lock the arrays again: a copy that has been to another process comes back writeable."""
        self.__dict__.update({key: locked(x) if isinstance(x, np.ndarray) else x for key, x in state.items()})

    def __repr__(self) -> str:
        return (
            f"<Recording {self.name}: {self.t.size} samples over {self.duration:.4g} s, input in {self.input_unit},"
            f" output in {self.output_unit}>"
        )

    @property
    def duration(self) -> float:
        """Time from the first sample to the last [s]."""
        return float(self.t[-1] - self.t[0])

    @property
    def sample_time(self) -> float:
        """Median step of time [s]."""
        return float(np.median(np.diff(self.t)))

    @property
    def rate_hz(self) -> float:
        """Sample rate [Hz], from the median step."""
        return 1.0 / self.sample_time

    def columns(self) -> dict[str, np.ndarray]:
        """The arrays under the names that a file gives them, ready for `write_recording`."""
        units = {"y": self.output_unit, "reference": self.output_unit}
        names = {"t": "t_s", "u": input_name(self.input_unit)} | {
            role.field: name
            for name, role in COLUMNS.items()
            if role.field != "u" and role.factor == 1.0 and role.unit == units.get(role.field, role.unit)
        }
        names |= {"second": self.second_name} if self.second_name else {}
        there = {name: getattr(self, field) for field, name in names.items() if getattr(self, field) is not None}
        return {name: np.full(self.t.size, x) if isinstance(x, float) else x for name, x in there.items()}

    def inspect(self) -> Inspection:
        """What it holds and could tell, before anything is fitted."""
        return inspected(self)


# -- the three ways in and out --------------------------------------------------------------------------


@brief
def read_recording(
    path_or_spec: str | os.PathLike[str],
    mapping: Mapping[str, str] | None = None,
    *,
    input_column: str | None = None,
    second: str | None = None,
    episode: str | int | None = None,
    dbc: str | os.PathLike[str] | None = None,
) -> Recording:
    """Read one recording from a file of any format that `formats` knows.

    Args:
        path_or_spec: a path, or "FILE#run=17" for one run of a file that holds several.
        mapping: contract name -> column of the file, with a unit or arithmetic where wanted (see mapping.py).
        input_column: the column that the servo is told, where several could be.
        second: a column to explain beside the output, such as the duty beside a position command.
        episode: one run of a file that holds several, where the path names none.
        dbc: what the messages of a CAN log mean.

    Raises:
        InputError: whatever makes the file unusable, in one sentence that names it.
    """
    path, run = split_spec(os.fspath(path_or_spec))
    run = chosen_run(run, episode, path.name)
    name = path.name if run is None else f"{path.name}#run={run}"
    loaded, digest = load(path, name, dict(mapping or {}), [Path(dbc)] if dbc is not None else [])
    table = select_run(loaded.table, run, name)
    asked = Asking(dict(mapping or {}), input_column, second)
    return _of_table(replace(loaded, table=table), asked, name, path=str(path), sha256=digest)


@brief
def from_columns(
    columns: Mapping[str, Any],
    mapping: Mapping[str, str] | None = None,
    name: str = "array",
    *,
    input_column: str | None = None,
    second: str | None = None,
) -> Recording:
    """A recording from columns (N,) under the names and units that a file's columns have; they are copied.

    Args:
        columns: name -> what makes an array (N,), or one number of the whole recording; those that mean nothing here
            are ignored and told.
        mapping, input_column, second: as `read_recording` takes them.
        name: what the recording is called.

    Raises:
        InputError: as `read_recording` does.
    """
    arrays = {str(label): np.asarray(column) for label, column in columns.items()}
    longest = max((x.size for x in arrays.values()), default=0)
    arrays = {label: np.full(longest, x) if x.ndim == 0 else x for label, x in arrays.items()}
    for label, x in arrays.items():
        if x.ndim != 1:
            raise InputError(f"{name}: {label} has shape {x.shape}, (N,) was expected")
    count = {label: x.size for label, x in arrays.items()}
    if len(set(count.values())) > 1:
        raise InputError(f"{name}: columns of one length are expected, these have {count}")
    try:
        table = pa.table(arrays)
    except pa.ArrowException as error:
        raise InputError(f"{name}: holds what is no column of numbers ({reason(error)})") from None
    content = b"".join(label.encode() + arrays[label].tobytes() for label in sorted(arrays))
    asked = Asking(dict(mapping or {}), input_column, second)
    return _of_table(Loaded(table), asked, name, path="", sha256=hashlib.sha256(content).hexdigest())


def _of_table(loaded: Loaded, asked: Asking, name: str, **origin: Any) -> Recording:
    """The recording in a table of named columns, as it was asked for."""
    table = loaded.table
    refuse_left_out(loaded.left_out, asked, name)
    choice = choose_columns(table.column_names, asked, name, loaded.units)
    sources = {field: choice.sources[contract] for field, contract in choice.roles().items()}
    printed, factors = _printed(table, sources, name)
    units = {field: COLUMNS[contract].unit for field, contract in choice.roles().items()}
    labels = {field: source.columns[0] for field, source in sources.items()}
    read = Read(name, choice.kind, labels, units, frozenset(f for f, source in sources.items() if source.sure))
    found = read.fields(printed, factors, _notes(loaded.notes, sources, table.column_names))
    if choice.second:
        found |= {"second_name": choice.second, "second_unit": units["second"]}
    return Recording(**found, **origin)


def _notes(told: Sequence[str], sources: Mapping[str, Source], columns: list[str]) -> list[Fault]:
    """What the file's reader tells, what was assumed of its columns, and which are ignored."""
    assumed = [source.told for source in sources.values() if source.told]
    taken = {column for source in sources.values() for column in source.columns}
    return [Fault("read", "", sentence) for sentence in (*told, *assumed)] + ignored(columns, taken)


def _printed(
    table: pa.Table, sources: Mapping[str, Source], name: str
) -> tuple[dict[str, np.ndarray], dict[str, float]]:
    """By field: values (N,) as the file prints them, and the factor from there."""

    def column(part: Column) -> np.ndarray:
        cells = element(table[part[0]], part[1], part[0], name)
        stamps = seconds(cells) if part[0] in sources["t"].columns else None
        return numbers(cells, part[0], name) if stamps is None else stamps

    found = {field: source.values(column, name) for field, source in sources.items()}
    return {field: x for field, (x, _) in found.items()}, {field: factor for field, (_, factor) in found.items()}


def write_recording(path: str | os.PathLike[str], columns: Mapping[str, Sequence[float] | np.ndarray]) -> None:
    """Write columns as CSV: the header first, shortest exact decimals, missing values blank.

    The file appears whole or not at all.

    Raises:
        InputError: the columns differ in length, or there are none.
    """
    lengths = {name: len(column) for name, column in columns.items()}
    if len(set(lengths.values())) != 1:
        raise InputError(f"{path}: columns of one length are expected, these have {lengths}")
    cells = [[cell_of(x) for x in np.asarray(column, float).tolist()] for column in columns.values()]
    lines = [",".join(columns), *map(",".join, zip(*cells, strict=True))]
    write_whole(Path(path), "\n".join(lines) + "\n")


def from_arrays(
    t: Sequence[float],
    u: Sequence[float],
    y: Sequence[float],
    *,
    name: str = "array",
    input_unit: str = "V",
    output_unit: str = "rad",
    **optional: Sequence[float] | float | None,
) -> Recording:
    """A recording from arrays (N,) in SI, under the checks that a file gets; the arrays are copied.

    Args:
        t, u, y: time [s], input [`input_unit`], output [`output_unit`], NaN where missing. The unit tells the kind of
            input: V a voltage, pct a duty, N m a torque, A a current, rad or m a position command.
        optional: further fields of `Recording` by name: omega, current, theta_m, vin, load, ...

    Raises:
        InputError: as `read_recording` does.
    """
    if unknown := set(optional) - set(OPTIONAL):
        raise InputError(f"{name}: there is no field {listed(unknown)}; there are {listed(OPTIONAL)}")
    refuse_unknown_unit("input", input_unit, "u", name)
    refuse_unknown_unit("output", output_unit, "y", name)
    kind = kind_of(input_unit)
    if kind == "position" and input_unit != output_unit:
        raise InputError(
            f"{name}: the position command is in {input_unit} and the output in {output_unit}, one unit was expected"
        )
    given = {"t": t, "u": u, "y": y, **{field: x for field, x in optional.items() if x is not None}}
    count = len(np.atleast_1d(t))
    values = {
        f: _array(np.full(count, x) if f in CONSTANT and np.isscalar(x) else x, f, name) for f, x in given.items()
    }
    labels = {field: field for field in values}
    units = {field: next(r.unit for r in COLUMNS.values() if r.field == field) for field in values}
    units |= {"u": input_unit, "y": output_unit} | ({"reference": output_unit} if "reference" in units else {})
    read = Read(name, kind, labels, units, frozenset(values))
    digest = hashlib.sha256(b"".join(x.tobytes() for x in values.values())).hexdigest()
    return Recording(**read.fields(values, dict.fromkeys(values, 1.0), []), sha256=digest)


@dataclass(frozen=True)
class Read:
    """What is known of columns before they become a recording: names, the input's kind, and each field's column and
    unit; ``sure`` are fields whose unit a person has given.
    """

    name: str
    kind: str
    labels: Mapping[str, str]
    units: Mapping[str, str]
    sure: frozenset[str] = frozenset()

    def fields(
        self, printed: Mapping[str, np.ndarray], factors: Mapping[str, float], notes: Sequence[Fault]
    ) -> dict[str, Any]:
        """The fields of `Recording`: checked, looked over, locked.

        Args:
            printed: field -> values (N,) in the file's unit, in which the converter's step is sought.
            factors: field -> factor from that unit to the field's.
            notes: what is already to be told.
        """
        name, labels = self.name, dict(self.labels)
        with np.errstate(all="ignore"):  # a NaN that signals, an infinity: told below, with its row
            values = {field: x * factors[field] for field, x in printed.items()}
        fields, step = checked(values, labels, name), converter_step(printed["y"])
        quantum, rows = step * factors["y"], np.arange(fields["t"].size)
        first = Sheet(name, self.kind, fields, labels, self.units, rows, quantum, self.sure)
        sheet, faults = consistent(first)
        if faults:
            refuse_still(sheet.y, labels["y"], name)
        seen = {f: _seen(x[sheet.rows], f, first, sheet, factors[f]) for f, x in printed.items()}
        told = [*problems_of(sheet.fields, seen, sheet.rows, labels, step), *faults, *notes]
        return {
            **{field: locked(x) for field, x in off_rails(sheet.fields, rail_spans(seen["y"], step)).items()},
            **constants(values, labels, name),
            "input_kind": self.kind,
            "input_unit": self.units["u"],
            "output_unit": self.units["y"],
            "quantum": quantum,
            "name": name,
            "problems": tuple(fault.sentence for fault in told),
            "faults": tuple(fault for fault in told if not fault.is_note),
        }


def _seen(x: np.ndarray, field: str, first: Sheet, last: Sheet, factor: float) -> np.ndarray:
    """A column in the file's unit as it is after all was mended; the file's own values where nothing was."""
    if field not in last.fields or field not in ("y", "u", "theta_m", "omega"):
        return x
    same = np.array_equal(last.fields[field], first.fields[field][last.rows], equal_nan=True)
    return x if same else np.where(np.isfinite(last.fields[field]), last.fields[field] / factor, x)


def _array(x: Any, field: str, name: str) -> np.ndarray:
    """A copy of x as floats (N,)."""
    try:
        array = np.array(x, float)
    except (TypeError, ValueError):
        raise InputError(f"{name}: {field} is not an array of numbers") from None
    if array.ndim != 1:
        raise InputError(f"{name}: {field} has shape {array.shape}, (N,) was expected")
    return array
