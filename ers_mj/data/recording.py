"""A recording: time, input and output of a servo, checked, in SI, and locked.

    file -> table (tables.py) -> columns by role (columns.py) -> numbers -> checks (checks.py) -> Recording

What cannot be used is refused with one sentence (`InputError`); what can be worked around is, and is
told in `Recording.problems`. Time is axis 0, every array is (N,).
"""

import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from ers_mj.data.checks import FEWEST_SAMPLES as FEWEST_SAMPLES
from ers_mj.data.checks import GAP as GAP
from ers_mj.data.checks import checked, ignored, locked, problems_of, refuse_time
from ers_mj.data.columns import COLUMNS, OPTIONAL, choose_columns, refuse_unknown_unit
from ers_mj.data.sensor_faults import converter_step
from ers_mj.data.tables import (
    cell_of,
    listed,
    numbers,
    parse_table,
    read_content,
    reason,
    select_run,
    split_spec,
    write_whole,
)
from ers_mj.errors import InputError


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
        input_unit: "V" or "pct".
        output_unit: "rad", "m" or "V".
        quantum: the converter's step [`output_unit`] as `converter_step` finds it in the file's own unit.
        name, path, sha256: file name with its run, path, and hash of the bytes that were read.
        problems: what was worked around or ignored, a sentence each.
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
    input_unit: str = "V"
    output_unit: str = "rad"
    quantum: float = 0.0
    name: str = "array"
    path: str = ""
    sha256: str = ""
    problems: tuple[str, ...] = ()

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
        units = {"u": self.input_unit, "y": self.output_unit, "reference": self.output_unit}
        names = {
            role.field: name
            for name, role in COLUMNS.items()
            if role.factor == 1.0 and role.unit == units.get(role.field, role.unit)
        }
        return {name: getattr(self, field) for field, name in names.items() if getattr(self, field) is not None}


# -- the three ways in and out --------------------------------------------------------------------------


def read_recording(path_or_spec: str | os.PathLike[str], mapping: Mapping[str, str] | None = None) -> Recording:
    """Read one recording from CSV or Parquet.

    Args:
        path_or_spec: a path, or "FILE#run=17" for one run of a file that holds several.
        mapping: contract name -> column of the file, for files that use other names.

    Raises:
        InputError: whatever makes the file unusable, in one sentence that names it.
    """
    path, run = split_spec(os.fspath(path_or_spec))
    name = path.name if run is None else f"{path.name}#run={run}"
    content = read_content(path)
    table = select_run(parse_table(content, path.suffix.lower(), name), run, name)
    return _of_table(table, mapping, name, str(path), hashlib.sha256(content).hexdigest())


def from_columns(
    columns: Mapping[str, Any], mapping: Mapping[str, str] | None = None, name: str = "array"
) -> Recording:
    """A recording from columns (N,) under the names and units that a file's columns have; they are copied.

    Args:
        columns: name -> what makes an array (N,); those that mean nothing here are ignored and told.
        mapping: as `read_recording` takes it.
        name: what the recording is called.

    Raises:
        InputError: as `read_recording` does.
    """
    arrays = {str(label): np.asarray(column) for label, column in columns.items()}
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
    return _of_table(table, mapping, name, "", hashlib.sha256(content).hexdigest())


def _of_table(table: pa.Table, mapping: Mapping[str, str] | None, name: str, path: str, sha256: str) -> Recording:
    """The recording in a table of named columns."""
    chosen = choose_columns(table.column_names, dict(mapping or {}), name)
    raw = {contract: numbers(table[column], column, name) for contract, column in chosen.items()}
    roles = {COLUMNS[contract].field: COLUMNS[contract] for contract in chosen}
    labels = {COLUMNS[contract].field: column for contract, column in chosen.items()}
    printed = {COLUMNS[contract].field: x for contract, x in raw.items()}
    fields: dict[str, Any] = checked({field: x * roles[field].factor for field, x in printed.items()}, labels, name)
    units: dict[str, Any] = {"input_unit": roles["u"].unit, "output_unit": roles["y"].unit}
    step = converter_step(printed["y"])
    problems = problems_of(fields, printed, labels, step) + ignored(table.column_names, labels)
    origin: dict[str, Any] = {"name": name, "path": path, "sha256": sha256}
    return Recording(**fields, **units, **origin, quantum=step * roles["y"].factor, problems=tuple(problems))


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
    **optional: Sequence[float] | None,
) -> Recording:
    """A recording from arrays (N,) in SI, under the checks that a file gets; the arrays are copied.

    Args:
        t, u, y: time [s], input [`input_unit`], output [`output_unit`], NaN where missing.
        optional: further fields of `Recording` by name: omega, current, theta_m, vin, load, ...

    Raises:
        InputError: as `read_recording` does.
    """
    if unknown := set(optional) - set(OPTIONAL):
        raise InputError(f"{name}: there is no field {listed(unknown)}; there are {listed(OPTIONAL)}")
    refuse_unknown_unit("input", input_unit, "u", name)
    refuse_unknown_unit("output", output_unit, "y", name)
    given = {"t": t, "u": u, "y": y, **{field: x for field, x in optional.items() if x is not None}}
    values = {field: _array(x, field, name) for field, x in given.items()}
    labels = {field: field for field in values}
    fields: dict[str, Any] = checked(values, labels, name)
    units: dict[str, Any] = {"input_unit": input_unit, "output_unit": output_unit}
    step = converter_step(values["y"])
    problems = problems_of(fields, values, labels, step)
    origin: dict[str, Any] = {
        "name": name,
        "sha256": hashlib.sha256(b"".join(x.tobytes() for x in values.values())).hexdigest(),
    }
    return Recording(**fields, **units, **origin, quantum=step, problems=tuple(problems))


def _array(x: Sequence[float], field: str, name: str) -> np.ndarray:
    """A copy of x as floats (N,)."""
    try:
        array = np.array(x, float)
    except (TypeError, ValueError):
        raise InputError(f"{name}: {field} is not an array of numbers") from None
    if array.ndim != 1:
        raise InputError(f"{name}: {field} has shape {array.shape}, (N,) was expected")
    return array


def read_input(path: str | os.PathLike[str]) -> tuple[np.ndarray, np.ndarray]:
    """Time [s] and voltage [V], each (N,), of a CSV or Parquet file with the columns t_s and u_V.

    Raises:
        InputError: the file is no such thing, or has holes, in one sentence.
    """
    file = Path(path)
    table = parse_table(read_content(file), file.suffix.lower(), file.name)
    columns = []
    for label in ("t_s", "u_V"):
        if label not in table.column_names:
            raise InputError(f"{file.name}: there is no column {label}, the columns are {listed(table.column_names)}")
        x = numbers(table[label], label, file.name)
        if not np.isfinite(x).all():
            row = 1 + int(np.argmax(~np.isfinite(x)))
            raise InputError(f"{file.name}: {label} is missing or infinite in data row {row}, an input has no holes")
        columns.append(x)
    if columns[0].size < 2:
        raise InputError(f"{file.name}: has {columns[0].size} samples, at least 2 are needed")
    refuse_time(columns[0], "t_s", file.name)
    return columns[0], columns[1]
