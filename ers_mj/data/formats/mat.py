"""MATLAB's files: up to v7 by scipy, v7.3 (which is HDF5) by h5py."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any

import numpy as np

from ers_mj.data.formats import arrays
from ers_mj.data.formats.base import File, Loaded, library
from ers_mj.data.formats.mat_elements import refuse_damaged
from ers_mj.errors import InputError

FORMAT = "MAT file"
HOW = "save its numbers instead, as in t_s = ts.Time; theta_rad = ts.Data; save('rec.mat', 't_s', 'theta_rad')"


def load(file: File) -> Loaded:
    """Each variable, and each field of a struct as struct.field, a column."""
    newer = file.content[:128].startswith(b"MATLAB 7.3") or file.content[:8] == b"\x89HDF\r\n\x1a\n"
    found = _of_v73(file) if newer else _of_v5(file)
    return arrays.loaded(found, file.name)


def _of_v5(file: File) -> dict[str, np.ndarray]:
    from scipy.io import loadmat, matlab  # here alone: it takes long to import

    refuse_damaged(file.content, file.name)
    found = loadmat(io.BytesIO(file.content), simplify_cells=True)
    for name, value in found.items():
        if isinstance(value, matlab.MatlabOpaque) or name == "__function_workspace__":
            raise InputError(f"{file.name}: holds an object of MATLAB (a timeseries?), {HOW}")
    return dict(arrays.flattened({k: v for k, v in found.items() if not k.startswith("__")}))


def _of_v73(file: File) -> dict[str, np.ndarray]:
    h5py = library("h5py", "h5py", "hdf5", file.name)
    with h5py.File(io.BytesIO(file.content), "r") as root:
        return dict(_variables(root, "", h5py, file.name))


def _variables(group: Any, path: str, h5py: Any, name: str) -> Iterator[tuple[str, np.ndarray]]:
    """Variables with their arrays as MATLAB has them: h5py gives their axes turned, and empties as their shape."""
    for key, item in group.items():
        if key.startswith("#"):
            continue
        kind = item.attrs.get("MATLAB_class", b"")
        kind = kind.decode() if isinstance(kind, bytes) else str(kind)
        if "MATLAB_object_decode" in item.attrs or kind == "timeseries":
            raise InputError(f"{name}: {path}{key} is an object of MATLAB (a timeseries?), {HOW}")
        if isinstance(item, h5py.Group):
            yield from _variables(item, f"{path}{key}.", h5py, name)
        elif not item.attrs.get("MATLAB_empty", 0):
            yield f"{path}{key}", np.array(kind) if kind in ("char", "cell") else np.asarray(item).T
