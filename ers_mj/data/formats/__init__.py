"""Files to tables, one file a format family; what reads it is imported when such a file comes.

Each member has `load(file: File) -> Loaded`. A format whose reader is an optional extra names it where it is missing.
"""

from __future__ import annotations

import gzip
import hashlib
import importlib
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path

from ers_mj.data.formats.base import File, Loaded
from ers_mj.data.tables import listed, read_content
from ers_mj.errors import InputError

READERS = {
    **dict.fromkeys((".csv", ".tsv", ".txt", ".dat"), "csv_text"),
    **dict.fromkeys((".parquet", ".feather", ".arrow"), "arrow"),
}


def load(
    path: Path, name: str, wanted: Mapping[str, str] | None = None, beside: Sequence[Path] = ()
) -> tuple[Loaded, str]:
    """The table of a file, and the hash of its bytes; ``wanted`` is a mapping, ``beside`` what a format needs further.

    Raises:
        InputError: the file cannot be read, in one sentence.
    """
    packed = read_content(path)
    content, inner = (_unpacked(packed, name), path.with_suffix("")) if path.suffix.lower() == ".gz" else (packed, path)
    suffix = inner.suffix.lower()
    if suffix not in READERS:
        raise InputError(f"{name}: the file name ends in {suffix!r}, recordings end in {listed(READERS)}")
    reader = importlib.import_module(f"ers_mj.data.formats.{READERS[suffix]}")
    return reader.load(File(inner, content, name, wanted or {}, beside)), hashlib.sha256(packed).hexdigest()


def _unpacked(content: bytes, name: str) -> bytes:
    try:
        return gzip.decompress(content)
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(f"{name}: is no whole gzip file ({error})") from None
