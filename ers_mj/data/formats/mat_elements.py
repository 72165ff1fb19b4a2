"""The elements of a MAT file v5, looked over before scipy reads them: of a kind that there is, within what they lie in,
as many as their array needs. scipy looks kinds up in a table without asking whether they stand there, which ends the
process.

file -> elements (kind, size, content), compressed ones unpacked -> of an array: flags, dimensions, name, what it holds
After "MAT-File Format", The MathWorks.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator

from ers_mj.data.formats.base import MOST, refuse_large
from ers_mj.errors import InputError

HEADER, TAG = 128, 8  # [bytes] before the first element, and of an element's kind and size
ARRAY, COMPRESSED = 14, 15
KINDS = (*range(1, 8), 9, 12, 13, ARRAY, COMPRESSED, 16, 17, 18)
ORDERS = {b"IM": "<", b"MI": ">"}
TEXT, SPARSE, LAST = 4, 5, 15  # classes of arrays that hold no others: text, sparse ones, numbers up to the last
COMPLEX = 1 << 11  # of an array's flags


def refuse_damaged(content: bytes, name: str) -> None:
    """Raise InputError where an element is none, or is not where it can be."""
    order = ORDERS.get(content[HEADER - 2 : HEADER])
    if order is None:  # MAT v4, or no such file
        return
    for kind, inside in _elements(memoryview(content)[HEADER:], order, name):
        unpacked = memoryview(_unpacked(inside, name)) if kind == COMPRESSED else None
        arrays = [(kind, inside)] if unpacked is None else _elements(unpacked, order, name)
        for kind, inside in arrays:
            _refuse_array(kind, inside, order, name)


def _elements(content: memoryview, order: str, name: str) -> Iterator[tuple[int, memoryview]]:
    """Kind and content of the elements that follow each other here."""
    while len(content) >= TAG:
        kind, size = struct.unpack(f"{order}2I", content[:TAG])
        begin, room = TAG, len(content)
        if kind >> 16:  # so small that kind, size and content share a tag
            kind, size, begin, room = kind & 0xFFFF, kind >> 16, TAG // 2, TAG
        end = begin + size
        if kind in KINDS and end > room == len(content):
            raise InputError(f"{name}: is damaged, it seems cut off, an element goes beyond the end: copy it again")
        if kind not in KINDS or end > room:
            raise InputError(f"{name}: is damaged, an element is of kind {kind} and {size} bytes long")
        yield kind, content[begin:end]
        content = content[end + (-end % TAG if kind != COMPRESSED else 0) :]


def _refuse_array(kind: int, content: memoryview, order: str, name: str) -> None:
    """Raise InputError where an array, or one in it, has not the elements that its class needs."""
    if kind != ARRAY:
        raise InputError(f"{name}: is damaged, an element of kind {kind} stands where an array was expected")
    parts = list(_elements(content, order, name))
    if not parts:
        return
    flags = struct.unpack(f"{order}I", parts[0][1][:4].tobytes().ljust(4, b"\0"))[0]
    holds, kinds = flags & 0xFF, [kind for kind, _ in parts]
    if TEXT <= holds <= LAST:
        needed = (6 if holds == SPARSE else 4) + bool(flags & COMPLEX)  # flags, dimensions, name, numbers
        if len(parts) < needed or ARRAY in kinds or COMPRESSED in kinds:
            raise InputError(f"{name}: is damaged, an array has {len(parts)} elements, {needed} numbers were expected")
        return
    for kind, inside in parts:
        if kind == ARRAY:
            _refuse_array(kind, inside, order, name)


def _unpacked(packed: memoryview, name: str) -> bytes:
    unpacking = zlib.decompressobj()
    found = unpacking.decompress(packed, MOST.size)
    if unpacking.unconsumed_tail:
        refuse_large(name, size=MOST.size + 1)
    return found
