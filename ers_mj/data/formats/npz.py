"""numpy's archives (.npz) and single arrays with fields (.npy)."""

from __future__ import annotations

import io
import zipfile

import numpy as np

from ers_mj.data.formats import arrays
from ers_mj.data.formats.base import File, Loaded, refuse_large
from ers_mj.errors import InputError

FORMAT = "numpy file"


def load(file: File) -> Loaded:
    """Each array a column; arrays (N, k) become lists."""
    if not file.content.startswith((b"PK", b"\x93NUMPY")):
        raise InputError(f"{file.name}: is no numpy file (it does not begin as one)")
    try:
        if zipfile.is_zipfile(io.BytesIO(file.content)):
            parts = zipfile.ZipFile(io.BytesIO(file.content)).infolist()
            refuse_large(file.name, len(parts), size=sum(part.file_size for part in parts))
        found = np.load(io.BytesIO(file.content), allow_pickle=False)
        tree = dict(found) if hasattr(found, "files") else found
    except ValueError as error:
        if "allow_pickle" not in str(error):
            raise
        raise InputError(
            f"{file.name}: holds Python objects, which are not read; save each column as an array of numbers"
        ) from None
    if not isinstance(tree, dict) and not tree.dtype.names:
        raise InputError(f"{file.name}: is one array without names, save columns by name with numpy.savez")
    return arrays.loaded(dict(arrays.flattened(tree)), file.name)
