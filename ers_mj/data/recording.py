"""A recording: time, input and output of a servo, checked, in SI, and locked.

    file -> table -> columns by role -> numbers -> checks -> Recording

What cannot be used is refused with one sentence (`InputError`); what can be worked around is, and is
told in `Recording.problems`. Time is axis 0, every array is (N,).
"""

import hashlib
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ers_mj.data.sensor_faults import at_extreme, converter_step, decimal_grain, frozen_spans, held_spans, varied
from ers_mj.data.tables import cell_of, listed, numbers, parse_table, read_content, select_run, split_spec, write_whole
from ers_mj.errors import InputError

FEWEST_SAMPLES = 100
MOST_MISSING = 0.20  # share of a required column
GAP = 3.0  # a step of time longer than this many median steps is a gap
LEAST_JITTER = 0.01  # rms share of the step from which jitter is worth a sentence


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

    def __setstate__(self, state: dict) -> None:
        """Lock the arrays again: a copy that has been to another process comes back writeable."""
        self.__dict__.update({key: _locked(x) if isinstance(x, np.ndarray) else x for key, x in state.items()})

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


def read_recording(path_or_spec: str | os.PathLike, mapping: Mapping[str, str] | None = None) -> Recording:
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
    chosen = choose_columns(table.column_names, dict(mapping or {}), name)
    raw = {contract: numbers(table[column], column, name) for contract, column in chosen.items()}
    roles = {COLUMNS[contract].field: COLUMNS[contract] for contract in chosen}
    labels = {COLUMNS[contract].field: column for contract, column in chosen.items()}
    printed = {COLUMNS[contract].field: x for contract, x in raw.items()}
    fields = _checked({field: x * roles[field].factor for field, x in printed.items()}, labels, name)
    units = {"input_unit": roles["u"].unit, "output_unit": roles["y"].unit}
    step = converter_step(printed["y"])
    problems = _problems(fields, printed, labels, step) + _ignored(table.column_names, labels)
    origin = {"name": name, "path": str(path), "sha256": hashlib.sha256(content).hexdigest()}
    return Recording(**fields, **units, **origin, quantum=step * roles["y"].factor, problems=tuple(problems))


def write_recording(path: str | os.PathLike, columns: Mapping[str, Sequence[float]]) -> None:
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
    _refuse_unknown_unit("input", input_unit, "u", name)
    _refuse_unknown_unit("output", output_unit, "y", name)
    given = {"t": t, "u": u, "y": y, **{field: x for field, x in optional.items() if x is not None}}
    values = {field: _array(x, field, name) for field, x in given.items()}
    labels = {field: field for field in values}
    fields = _checked(values, labels, name)
    units = {"input_unit": input_unit, "output_unit": output_unit}
    step = converter_step(values["y"])
    problems = _problems(fields, values, labels, step)
    origin = {"name": name, "sha256": hashlib.sha256(b"".join(x.tobytes() for x in values.values())).hexdigest()}
    return Recording(**fields, **units, **origin, quantum=step, problems=tuple(problems))


def _refuse_unknown_unit(noun: str, unit: str, field: str, name: str) -> None:
    known = dict.fromkeys(role.unit for role in COLUMNS.values() if role.field == field)
    if unit not in known:
        raise InputError(f"{name}: the {noun} has the unknown unit {unit!r}; known are {listed(known)}")


def _array(x: Sequence[float], field: str, name: str) -> np.ndarray:
    """A copy of x as floats (N,)."""
    try:
        array = np.array(x, float)
    except (TypeError, ValueError):
        raise InputError(f"{name}: {field} is not an array of numbers") from None
    if array.ndim != 1:
        raise InputError(f"{name}: {field} has shape {array.shape}, (N,) was expected")
    return array


def read_input(path: str | os.PathLike) -> tuple[np.ndarray, np.ndarray]:
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
    _refuse_time(columns[0], "t_s", file.name)
    return columns[0], columns[1]


# -- from a table's columns to roles -------------------------------------------------------------------------


def choose_columns(columns: list[str], mapping: dict[str, str], name: str) -> dict[str, str]:
    """Contract name -> column of the file: what the mapping says, then what is called by its name."""
    _refuse_mistyped(columns, mapping, name)
    settled = {COLUMNS[contract].field for contract in mapping}
    free = [c for c in columns if c in COLUMNS and COLUMNS[c].field not in settled and c not in mapping.values()]
    chosen = mapping | {column: column for column in free}
    by_field = {field: [c for c in chosen if COLUMNS[c].field == field] for field in (*REQUIRED, *OPTIONAL)}
    for field, found in by_field.items():
        if len(found) > 1:
            raise InputError(f"{name}: {listed(found)} are all columns of one quantity, drop one or choose with --map")
        if not found and field in REQUIRED:
            raise InputError(f"{name}: {_told_missing(field, columns)}")
    unit = COLUMNS[by_field["y"][0]].unit
    return {c: column for c, column in chosen.items() if COLUMNS[c].field != "reference" or COLUMNS[c].unit == unit}


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


# -- what is refused ----------------------------------------------------------------------------------------


def _checked(values: dict[str, np.ndarray], labels: dict[str, str], name: str) -> dict[str, np.ndarray]:
    """The fields of a recording, locked, or the first reason to refuse them."""
    for field, x in values.items():
        _refuse_length(x, labels[field], len(values["t"]), name)
        _refuse_infinite(x, labels[field], name)
    _refuse_time(values["t"], labels["t"], name)
    for field in ("u", "y"):
        _refuse_missing(values[field], labels[field], name)
    if np.nanmin(values["y"]) == np.nanmax(values["y"]):
        raise InputError(f"{name}: the output {labels['y']} is constant at {np.nanmax(values['y']):.6g}")
    fields = {field: x if field in MEASURED else _held(x) for field, x in values.items() if not _sparse(x)}
    if "enable" in fields:
        fields["enable"] = fields["enable"] > 0.5
    return {field: _locked(x) for field, x in (fields | {"valid": np.isfinite(values["y"])}).items()}


def _refuse_length(x: np.ndarray, label: str, count: int, name: str) -> None:
    if len(x) != count:
        raise InputError(f"{name}: {label} has {len(x)} samples, the time has {count}")
    if count < FEWEST_SAMPLES:
        raise InputError(f"{name}: has {count} samples, at least {FEWEST_SAMPLES} are needed")


def _refuse_infinite(x: np.ndarray, label: str, name: str) -> None:
    if np.isinf(x).any():
        raise InputError(f"{name}: {label} is infinite in data row {1 + int(np.argmax(np.isinf(x)))}")


def _refuse_time(t: np.ndarray, label: str, name: str) -> None:
    if np.isnan(t).any():
        raise InputError(f"{name}: the time {label} is missing in data row {1 + int(np.argmax(np.isnan(t)))}")
    if (late := np.flatnonzero(np.diff(t) <= 0)).size:
        k = int(late[0]) + 1
        what = "repeats" if t[k] == t[k - 1] else "runs backwards"
        raise InputError(f"{name}: the time {label} {what} in data row {k + 1} ({t[k - 1]:.9g} s, then {t[k]:.9g} s)")


def _refuse_missing(x: np.ndarray, label: str, name: str) -> None:
    if _sparse(x):
        raise InputError(
            f"{name}: {label} lacks {np.mean(np.isnan(x)):.0%} of its values, at most {MOST_MISSING:.0%} may be missing"
        )


def _sparse(x: np.ndarray) -> bool:
    return bool(np.mean(np.isnan(x)) > MOST_MISSING)


def _held(x: np.ndarray) -> np.ndarray:
    """x with each gap filled by the value before it (the first value, where it begins with one)."""
    known = np.flatnonzero(np.isfinite(x))
    last = np.maximum(np.searchsorted(known, np.arange(len(x)), side="right") - 1, 0)
    return x[known[last]]


def _locked(x: np.ndarray) -> np.ndarray:
    x = np.ascontiguousarray(x)
    x.setflags(write=False)
    return x


# -- what is worked around and told -----------------------------------------------------------------------


def _problems(
    fields: dict[str, np.ndarray], printed: dict[str, np.ndarray], labels: dict[str, str], step: float
) -> list[str]:
    """A sentence for each; `printed` are the columns as they stand in the file, `step` the converter's there."""
    t, u, y = fields["t"], fields["u"], printed["y"]
    frozen = frozen_spans(y, step or decimal_grain(y[np.isfinite(y)]))
    return [
        *(_told_blanks(x, labels[field], field) for field, x in printed.items() if np.isnan(x).any()),
        *_told_gaps(t),
        *_told_jitter(t),
        *_told_clipped(u, labels["u"], [s for s in held_spans(u) if at_extreme(u, s) and varied(u, s)]),
        *_told_clipped(y, labels["y"], [s for s in frozen if at_extreme(y, s)]),
        *_told_stuck(t, labels["y"], [s for s in frozen if not at_extreme(y, s) and np.ptp(u[s]) > 0]),
        *([f"the input {labels['u']} is constant at {u[0]:.6g}"] if np.ptp(u) == 0 else []),
        *([f"the output {labels['y']} moves in steps of {step:.4g}, those of its converter"] if step else []),
    ]


def _told_blanks(x: np.ndarray, label: str, field: str) -> str:
    count, share = int(np.isnan(x).sum()), np.mean(np.isnan(x))
    if _sparse(x):
        return f"{label} lacks {share:.0%} of its values and is not used"
    remedy = "left out" if field in MEASURED else "taken as the last value before"
    return f"{label} is missing in {count} samples ({share:.2%}), which are {remedy}"


def _told_gaps(t: np.ndarray) -> list[str]:
    dt = np.diff(t)
    gaps = np.flatnonzero(dt > GAP * np.median(dt))
    if not gaps.size:
        return []
    k = gaps[np.argmax(dt[gaps])]
    return [f"time has {gaps.size} gap{'s'[: gaps.size > 1]}, the largest of {dt[k]:.4g} s after {t[k]:.4g} s"]


def _told_jitter(t: np.ndarray) -> list[str]:
    dt = np.diff(t) / np.median(np.diff(t))
    jitter = np.sqrt(np.mean((dt[dt <= GAP] - 1) ** 2))
    return [f"the steps of time jitter by {jitter:.1%} rms"] if jitter > LEAST_JITTER else []


def _told_clipped(x: np.ndarray, label: str, spans: list[slice]) -> list[str]:
    if not spans:
        return []
    limits = listed(f"{limit:.6g}" for limit in sorted({float(x[span.start]) for span in spans}))
    return [f"{label} looks clipped at {limits}: {_told_spans(spans, len(x))}"]


def _told_stuck(t: np.ndarray, label: str, spans: list[slice]) -> list[str]:
    if not spans:
        return []
    longest = max(spans, key=lambda s: s.stop - s.start)
    lasts, start = t[longest.stop - 1] - t[longest.start], t[longest.start]
    return [f"{label} looks stuck: {_told_spans(spans, len(t))}, the longest for {lasts:.4g} s from {start:.4g} s on"]


def _told_spans(spans: list[slice], total: int) -> str:
    count = sum(span.stop - span.start for span in spans)
    return f"{count} samples ({count / total:.2%}) in {len(spans)} span{'s'[: len(spans) > 1]}"


def _ignored(columns: list[str], labels: dict[str, str]) -> list[str]:
    """Tell the columns that were not taken in; `run` chose the rows."""
    ignored = [column for column in columns if column not in labels.values() and column != "run"]
    return [f"columns that mean nothing here are ignored: {listed(ignored)}"] if ignored else []
