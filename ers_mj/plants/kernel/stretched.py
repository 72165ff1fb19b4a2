"""Maps over samples that are a little shorter or longer than the usual one, as a clock that jitters makes them: a
parabola in the length of the sample through maps over a shorter, a usual and a longer one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ers_mj.plants.compiling.compiled import compiled, inline, unit
from ers_mj.plants.kernel.maps import COLUMNS, MAPS, MODES_APART, made, no_maps, number
from ers_mj.plants.kernel.state import C, F, L, M, types

JITTER = 0.08  # how much longer and shorter than the usual sample those are between which maps are taken


class Maps(NamedTuple):
    """Maps over a sample's last segments, its first one, and the whole of it (see maps.no_maps); the first two over
    those of a shorter and of a longer sample; and of the sample that is gone through, where it is not the usual one.
    """

    late: np.ndarray
    early: np.ndarray
    whole: np.ndarray
    late_shorter: np.ndarray
    early_shorter: np.ndarray
    late_longer: np.ndarray
    early_longer: np.ndarray
    late_now: np.ndarray
    early_now: np.ndarray


OF_A_SAMPLE = types.NamedUniTuple(MAPS, 9, Maps)


@compiled
def room(is_cut, leaps, jitters):
    """Room for the maps: of a first segment of its own where a sample ``is_cut`` by a delay, of the whole where it is
    leapt over, of other samples where the clock ``jitters``.
    """
    late = no_maps()
    early = no_maps() if is_cut else late
    whole = no_maps() if leaps else late
    if not jitters:
        return Maps(late, early, whole, late, late, late, late, late, late)
    if not is_cut:
        shorter, longer, now = no_maps(), no_maps(), no_maps()
        return Maps(late, early, whole, shorter, shorter, longer, longer, now, now)
    return Maps(late, early, whole, no_maps(), no_maps(), no_maps(), no_maps(), no_maps(), no_maps())


@unit(L(F[::1], F))
def jitters(t, h0):
    """Whether samples at t (N,) are a little shorter or longer than h0."""
    for k in range(t.size - 1):
        off = abs(t[k + 1] - t[k] - h0)
        if 1e-6 * h0 < off <= 1.5 * JITTER * h0:
            return True
    return False


@inline
def is_near(c, stretch):
    """Whether there are maps over a sample of one body so much longer than the usual one."""
    return c.two_body <= 0 and abs(stretch - 1.0) <= 1.5 * JITTER


@inline
def forgotten(maps):
    """Make room for another sample."""
    for n in range(2 * MODES_APART):
        maps.late_now[n, 0, 0] = maps.early_now[n, 0, 0] = np.nan


@unit(types.void(MAPS, MAPS, MAPS, MAPS, C, M, F, F))
def between(now, shorter, usual, longer, c, m, step, stretch):
    """Fill in the maps over a step of one body in the mode m, and over half of it under laws, in a sample ``stretch``
    times as long as the usual one.
    """
    d = (stretch - 1.0) / JITTER
    a, b, e = 0.5 * d * (d - 1.0), 1.0 - d * d, 0.5 * d * (d + 1.0)
    for k in range(2 if c.lawful > 0 else 1):
        n, h = number(m) + k * MODES_APART, step / (1 + k)
        if now[n, 0, 0] == now[n, 0, 0]:
            continue
        made(shorter, n, c, m, c.tau_e, c.a_emf, h * (1.0 - JITTER), False)
        made(usual, n, c, m, c.tau_e, c.a_emf, h, False)
        made(longer, n, c, m, c.tau_e, c.a_emf, h * (1.0 + JITTER), False)
        for i in range(3):
            for column in range(COLUMNS):
                now[n, i, column] = a * shorter[n, i, column] + b * usual[n, i, column] + e * longer[n, i, column]


@inline
def over_segment(maps, c, m, cuts, is_late, is_usual, stretch):
    """The maps over a segment of a sample, and the length of it in the usual one."""
    step = cuts.last if is_late else cuts.ends[0]
    if is_usual or m.s == 0 or c.two_body > 0:
        return maps.late if is_late else maps.early, step
    if is_late:
        between(maps.late_now, maps.late_shorter, maps.late, maps.late_longer, c, m, step, stretch)
        return maps.late_now, step
    between(maps.early_now, maps.early_shorter, maps.early, maps.early_longer, c, m, step, stretch)
    return maps.early_now, step
