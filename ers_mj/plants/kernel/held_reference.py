"""A reference that is held between its samples, as a step of the position loop meets it."""

from __future__ import annotations

from ers_mj.plants.compiling.compiled import inline

SHORTEST = 1e-9  # [s] of a part of a step


@inline
def mean_reference(t, r, before, k, a, b):
    """(mean of the held reference over a..b, the sample that holds at b), the search begun at sample k."""
    n = r.size
    while k + 1 < n and t[k + 1] <= a:
        k += 1
    total, at = 0.0, a
    while True:
        end = b if k + 1 >= n or t[k + 1] >= b else t[k + 1]
        if a < t[0] and at < t[0]:
            end = min(b, t[0])
            total += before * (end - at)
        else:
            total += r[k] * (end - at)
            if k + 1 < n and end >= t[k + 1]:
                k += 1
        at = end
        if at >= b:
            return total / (b - a), k


@inline
def switched(t, r, before, k, tau, at, end, least):
    """The first instant well within at..end at which a reference that is tau late switches by more than ``least``, or
    the end; the search begun at the sample k that holds at ``at``.
    """
    if at + SHORTEST < t[0] + tau < end - SHORTEST and abs(r[0] - before) > least:
        return t[0] + tau
    while k + 1 < t.size and t[k + 1] + tau < end - SHORTEST:
        if t[k + 1] + tau > at + SHORTEST and abs(r[k + 1] - r[k]) > least:
            return t[k + 1] + tau
        k += 1
    return end
