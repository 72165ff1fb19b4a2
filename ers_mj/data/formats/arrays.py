"""Named arrays of one file as columns: those that are as long as the time, constants beside them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ers_mj.data.formats.base import Loaded, table_of
from ers_mj.data.tables import listed
from ers_mj.errors import InputError


def flattened(tree: Any, path: str = "", sign: str = ".") -> Iterator[tuple[str, np.ndarray]]:
    """Names with their arrays, of dictionaries within dictionaries; fields of records become columns of their own."""
    if isinstance(tree, Mapping):
        for key, value in tree.items():
            yield from flattened(value, f"{path}{sign}{key}" if path else str(key), sign)
        return
    array = np.asarray(tree)
    if array.dtype.names:
        for field in array.dtype.names:
            yield from flattened(array[field], f"{path}{sign}{field}" if path else field, sign)
        return
    yield path, array


def loaded(
    arrays: Mapping[str, np.ndarray], name: str, notes: Sequence[str] = (), units: Mapping[str, str] | None = None
) -> Loaded:
    """A table of the arrays that hold numbers; of several lengths, the one that most have counts.

    Raises:
        InputError: none holds more than one number.
    """
    numeric = _numeric(arrays)
    long = {k: x for k, x in numeric.items() if x.ndim in (1, 2)}
    if not long:
        raise InputError(f"{name}: holds no arrays of numbers{', only ' if arrays else ''}{listed(arrays)}")
    count = Counter(len(x) for x in long.values()).most_common(1)[0][0]
    upright = {k: _upright(x, count) for k, x in long.items()}
    columns = {k: x for k, x in upright.items() if len(x) == count}
    constants = {k: np.full(count, float(x)) for k, x in numeric.items() if x.ndim == 0}
    other = [k for k in long if k not in columns]
    told = [*notes, *_left_out(arrays, numeric, other, count)]
    why = _why_left_out(arrays, numeric, other, count)
    return Loaded(table_of(columns | constants, name), tuple(told), units or {}, why)


def _why_left_out(
    arrays: Mapping[str, np.ndarray], numeric: Mapping[str, np.ndarray], other: Sequence[str], count: int
) -> dict[str, str]:
    """What is no column, and why."""
    lengths = {k: f"has {len(numeric[k])} values and others {count}" for k in other}
    return lengths | {k: "holds no numbers" for k in arrays if k not in numeric}


def _numeric(arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {k: np.squeeze(x) for k, x in arrays.items() if x.dtype.kind in "biuf" and x.size}


def _upright(x: np.ndarray, count: int) -> np.ndarray:
    """A matrix with its rows along the time."""
    return x.T if x.ndim == 2 and x.shape[1] == count != x.shape[0] else x


def _left_out(
    arrays: Mapping[str, np.ndarray], numeric: Mapping[str, np.ndarray], other: Sequence[str], count: int
) -> list[str]:
    """What is no column, in words."""
    told = []
    if other:
        lengths = listed(f"{k} ({len(numeric[k])})" for k in other)
        told.append(f"arrays of another length than {count} are left out: {lengths}")
    if skipped := [k for k in arrays if k not in numeric]:
        told.append(f"what holds no numbers is left out: {listed(skipped)}")
    return told
