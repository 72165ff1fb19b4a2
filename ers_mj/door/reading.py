"""Recordings in: from files, from arrays, from data frames."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any

from ers_mj.data.recording import Recording, from_columns, read_recording
from ers_mj.errors import InputError

Path = str | os.PathLike[str]
Given = Path | Recording  # what a job takes for one recording
ALIASES = {"t": "t_s"}  # short names that from_arrays takes as well


def read(
    path: Path,
    map: Mapping[str, str] | None = None,
    *,
    input: str | None = None,
    second: str | None = None,
    episode: str | int | None = None,
    dbc: Path | None = None,
) -> Recording:
    """Read one recording.

    Args:
        path: a file of any format that is read (text, Parquet, MATLAB, HDF5, MF4, MCAP, ...), or "FILE#run=17" for one
            run of a file that holds several.
        map: contract name -> column of the file, where it uses names of its own; with a unit, a factor or arithmetic
            where wanted, as in "Time [ms]", "enc:counts/4096", "pwm*24/255", "state[3]".
        input: the column that the servo is told, where several could be.
        second: a column to explain beside the output, such as the duty beside a position command.
        episode: one run of a file that holds several, where the path names none.
        dbc: what the messages of a CAN log mean.

    Returns:
        The recording: arrays (N,), time in s, input and output in its `input_unit` and `output_unit`.

    Raises:
        InputError: the file cannot be read or used, in one sentence.
        MissingPackage: what reads such files is not installed.

    Examples:
        >>> import tempfile, pathlib
        >>> import ers_mj as ers
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "run.csv"
        >>> _ = ers.simulate(input="steps", duration=2.0, rate_hz=200.0).save(file)
        >>> ers.read(file)
        <Recording run.csv: 400 samples over 1.995 s, input in V, output in rad>

    Source: the columns are those of `ers diagnose`, with their units as suffixes.
    """
    return read_recording(path, map, input_column=input, second=second, episode=episode, dbc=dbc)


def from_arrays(
    table: Any = None,
    /,
    *,
    map: Mapping[str, str] | None = None,
    input: str | None = None,
    second: str | None = None,
    name: str = "array",
    **columns: Any,
) -> Recording:
    """A recording from arrays, or from a data frame.

    Args:
        table: a data frame (pandas, polars) or a mapping of columns, if there is one.
        map: contract name -> column, where the table uses names of its own.
        input: as `read` takes it.
        second: as `read` takes it.
        name: what the recording is called in results.
        columns: arrays (N,) under the names that a file's columns have, unit and all: `t` or `t_s` [s], `u_V`,
            `u_duty_pct`, `tau_cmd_Nm`, `i_cmd_A` or a reference, `theta_rad`, `theta_deg`, `x_m` or `y_sensor_V`, and
            what else was recorded (`i_A`, `vin_V`, `omega_rad_s`, ...). NaN where a sample is missing. They are copied.

    Returns:
        The recording, under the same checks that a file gets.

    Raises:
        InputError: the columns cannot be used, in one sentence.

    Examples:
        >>> import numpy as np
        >>> import ers_mj as ers
        >>> t = np.arange(500) / 100.0
        >>> ers.from_arrays(t=t, theta_deg=10 * np.sin(t), u_V=4 * np.cos(t), name="bench")
        <Recording bench: 500 samples over 4.99 s, input in V, output in rad>
    """
    given = {} if table is None else {str(label): table[label] for label in _labels(table)}
    for label, column in columns.items():
        known = ALIASES.get(label, label)
        if known in given:
            raise InputError(f"{name}: the column {known} is given twice, once was expected")
        given[known] = column
    return from_columns(given, map, name, input_column=input, second=second)


def _labels(table: Any) -> Iterable[Any]:
    """The columns of a table.

    Raises:
        InputError: it is no table.
    """
    labels = getattr(table, "columns", None)
    if labels is None and isinstance(table, Mapping):
        labels = table.keys()
    if labels is None:
        raise InputError(
            f"{type(table).__name__} was given, a data frame or a mapping was expected (arrays by name, as in"
            " t=t, theta_rad=theta, u_V=u)"
        )
    return list(labels)


def recordings_of(given: Given | Iterable[Given]) -> list[Recording]:
    """Recordings, or paths of some, one or many, as a list.

    Raises:
        InputError: there are none, or one is neither.
    """
    if isinstance(given, str | os.PathLike | Recording):
        return [_recording(given)]
    return [_recording(item) for item in given]


def _recording(given: Given) -> Recording:
    if isinstance(given, Recording):
        return given
    if isinstance(given, str | os.PathLike):
        return read_recording(given)
    raise InputError(f"{type(given).__name__} was given, a path or a recording was expected (see read, from_arrays)")
