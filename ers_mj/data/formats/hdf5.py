"""HDF5: every dataset a column under its path, fields of compound ones as path.field; units from their attributes."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from ers_mj.data.formats import arrays
from ers_mj.data.formats.base import File, Loaded, library, refuse_large
from ers_mj.errors import InputError

FORMAT = "HDF5 file"
MARK, PLACES = b"\x89HDF\r\n\x1a\n", (0, 512, 1024, 2048)  # with which it begins, behind what a user may keep there
UNIT_KEYS = ("units", "unit", "Units", "Unit")


def load(file: File) -> Loaded:
    """The datasets of a file."""
    h5py = library("h5py", "h5py", "hdf5", file.name)
    if not any(file.content.startswith(MARK, place) for place in PLACES):
        raise InputError(f"{file.name}: is no HDF5 file (it does not begin as one)")
    found: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}

    def visit(path: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or item.shape is None:
            return
        refuse_large(file.name, len(found), size=int(item.size) * item.dtype.itemsize)
        found.update(arrays.flattened(item[()], path))
        said = next((item.attrs[key] for key in UNIT_KEYS if key in item.attrs), None)
        if said is not None:
            units[path] = said.decode() if isinstance(said, bytes) else str(said)

    with h5py.File(io.BytesIO(file.content), "r") as root:
        root.visititems(visit)
    return arrays.loaded(found, file.name, units=units)
