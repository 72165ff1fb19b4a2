"""A recursion that numpy has not."""

from __future__ import annotations

from numba import types

from ers_mj.plants.compiled import kernel

WAVE = types.Array(types.complex128, 1, "C")


@kernel(types.void(WAVE, types.float64, types.float64, WAVE))
def two_poles(driven, slow, fast, out):
    """Fill out (N,) with what two first-order lags in a row make of ``driven`` (N,): ``slow`` and ``fast`` are what is
    left of each after a sample.
    """
    first = second = 0.0j
    for k in range(driven.size):
        first = slow * first + driven[k]
        second = fast * second + first
        out[k] = second
