"""Files to tables, one file a format family; what reads it is imported when such a file comes.

Each member has `load(file: File) -> Loaded` and says in FORMAT what it reads. A format whose reader is an optional
extra names it where it is missing.
"""

from __future__ import annotations

import contextlib
import gc
import gzip
import hashlib
import importlib
import io
import os
import re
import sys
import traceback
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from ers_mj.data.formats.base import MOST, File, Loaded, refuse_large
from ers_mj.data.tables import listed, read_content, reason
from ers_mj.errors import ErsError, InputError

READERS = {
    **dict.fromkeys((".csv", ".tsv", ".txt", ".dat"), "csv_text"),
    **dict.fromkeys((".parquet", ".feather", ".arrow"), "arrow"),
    **dict.fromkeys((".npz", ".npy"), "npz"),
    ".mat": "mat",
    **dict.fromkeys((".h5", ".hdf5", ".hdf"), "hdf5"),
    **dict.fromkeys((".json", ".jsonl", ".ndjson"), "json_records"),
    **dict.fromkeys((".mf4", ".mdf"), "mf4"),
    **dict.fromkeys((".mcap", ".bag"), "ros"),
    ".ulg": "ulog",
    ".tdms": "tdms",
    **dict.fromkeys((".asc", ".blf", ".trc", ".log"), "can_log"),
    ".bin": "ardupilot",
}

CUT_OFF = re.compile(
    "truncated|could not read bytes|unpack requires|not a zip file|Unterminated|end magic|reach(ed)? EOF"
)
ON_DISK = ("ros", "can_log", "ardupilot")  # formats whose libraries take paths


def load(
    path: Path, name: str, wanted: Mapping[str, str] | None = None, beside: Sequence[Path] = ()
) -> tuple[Loaded, str]:
    """The table of a file, and the hash of its bytes; ``wanted`` is a mapping, ``beside`` what a format needs further.

    Raises:
        InputError: the file cannot be read, in one sentence.
    """
    if os.path.isfile(path / "metadata.yaml"):  # a bag of ROS 2
        whole = b"".join(p.read_bytes() for p in sorted(path.iterdir()) if p.is_file())
        return _read("ros", File(path, b"", name, wanted or {}, beside)), hashlib.sha256(whole).hexdigest()
    packed = read_content(path)
    content, inner = (_unpacked(packed, name), path.with_suffix("")) if path.suffix.lower() == ".gz" else (packed, path)
    suffix = inner.suffix.lower()
    if suffix not in READERS:
        raise InputError(f"{name}: the file name ends in {suffix!r}, recordings end in {listed(READERS)}")
    if packed is not content and READERS[suffix] in ON_DISK:
        raise InputError(f"{name}: is packed, unpack it first")
    loaded = _read(READERS[suffix], File(inner, content, name, wanted or {}, beside))
    return loaded, hashlib.sha256(packed).hexdigest()


def _read(module: str, file: File) -> Loaded:
    """The file by this reader; what its library raises, it raises at whatever its parser met."""
    reader = importlib.import_module(f"ers_mj.data.formats.{module}")
    with _quiet():
        try:
            return reader.load(file)
        except ErsError:
            raise
        except MemoryError:
            raise InputError(f"{file.name}: takes more memory than there is, cut it") from None
        except Exception as error:
            traceback.clear_frames(error.__traceback__)  # and with them what the library has left half read
            told = re.sub(r"'?<_io\.\w+ object at 0x[0-9a-f]+>'?", "it", reason(error))
        gc.collect(1)  # it may hold itself
    hint = ": it seems cut off, copy it again" if CUT_OFF.search(told) else ""
    raise InputError(f"{file.name}: is not a readable {reader.FORMAT} ({told}){hint}")


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """What a library prints, and what its destructors raise over a damaged file, is not for our output."""
    hook, sys.unraisablehook = sys.unraisablehook, lambda unraisable: None
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            yield
    finally:
        sys.unraisablehook = hook


def _unpacked(content: bytes, name: str) -> bytes:
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(content)) as file:
            found = file.read(MOST.size + 1)
        refuse_large(name, size=len(found))
        return found
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(f"{name}: is no whole gzip file ({error})") from None
