"""What simulations take, counted alike on every machine."""

from __future__ import annotations

import math
import threading

import numpy as np

OVERHEAD = 20  # samples whose handling takes another microsecond


class Effort:
    """What has been simulated with the models that it was handed to, in the microseconds that it takes a slow core,
    about. A copy in another process begins at nought.

    One within another is a part of it, which may take ``most``; who stops at that says so (``cut``).
    """

    def __init__(self, within: Effort | None = None, most: float = math.inf):
        self._lock, self._spent, self._is_cut = threading.Lock(), 0, False
        self.within, self.most = within, most

    def __reduce__(self):
        return Effort, ()

    @property
    def spent(self) -> int:
        """[us]"""
        return self._spent

    def add(self, t: np.ndarray, per_second: int, beyond: int = 0) -> None:
        """Count a simulation of the samples at t (N,) [s] that takes so many microseconds a second; what its events
        take ``beyond`` that counts where there is a most that may be taken.
        """
        with self._lock:
            more = beyond if self.most < math.inf else 0
            self._spent += int((t[-1] - t[0]) * per_second) + t.size // OVERHEAD + more
        if self.within is not None:
            self.within.add(t, per_second, beyond)

    @property
    def is_spent(self) -> bool:
        """Whether this part, or one that it is in, has taken what it may."""
        return self._spent >= self.most or self.within is not None and self.within.is_spent

    @property
    def is_cut(self) -> bool:
        """Whether something was stopped at what it may take, here or in a part."""
        return self._is_cut

    def cut(self) -> None:
        """Say that something is stopped here."""
        self._is_cut = True
        if self.within is not None:
            self.within.cut()
