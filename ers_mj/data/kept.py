"""What was computed along a recording and may be asked for again, as much as fits into a little memory."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Hashable

import numpy as np


class Kept:
    """Arrays by what they were computed from; those not asked for longest go first. A copy in another process
    begins empty.
    """

    def __init__(self, most_bytes: int = 16_000_000):
        self._lock, self._most, self._bytes = threading.Lock(), most_bytes, 0
        self._found: OrderedDict[Hashable, tuple[np.ndarray, ...]] = OrderedDict()

    def __reduce__(self):
        return Kept, (self._most,)

    def get(self, key: Hashable) -> tuple[np.ndarray, ...] | None:
        """What was kept under a key."""
        with self._lock:
            if key not in self._found:
                return None
            self._found.move_to_end(key)
            return self._found[key]

    def keep(self, key: Hashable, arrays: tuple[np.ndarray, ...]) -> None:
        """Keep arrays under a key, in the place of those that it holds, as long as there is room."""
        size = sum(a.nbytes for a in arrays)
        with self._lock:
            if size > self._most:
                return
            self._bytes += size - sum(a.nbytes for a in self._found.pop(key, ()))
            self._found[key] = arrays
            while self._bytes > self._most:
                self._bytes -= sum(a.nbytes for a in self._found.popitem(last=False)[1])
