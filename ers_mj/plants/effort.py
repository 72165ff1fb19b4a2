"""What simulations take, counted alike on every machine."""

from __future__ import annotations

import threading

import numpy as np

OVERHEAD = 20  # samples whose handling takes another microsecond


class Effort:
    """What has been simulated with the models that it was handed to, in the microseconds that it takes a slow core,
    about. A copy in another process begins at nought.
    """

    def __init__(self):
        self._lock, self._spent = threading.Lock(), 0

    def __reduce__(self):
        return Effort, ()

    @property
    def spent(self) -> int:
        """[us]"""
        return self._spent

    def add(self, t: np.ndarray, per_second: int) -> None:
        """Count a simulation of the samples at t (N,) [s] that takes so many microseconds a second."""
        with self._lock:
            self._spent += int((t[-1] - t[0]) * per_second) + t.size // OVERHEAD
