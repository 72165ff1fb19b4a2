"""How a motion of one body changes with anything that its model is made of, to first order, without simulating it
again.

Along a motion (theta, w, j) that the kernel of event_integrator.py has made, the change (a, b, d) of the three obeys
the same equations within each mode, driven by what the changed model adds to the forces there. The instants at which
the mode changes are taken from the states at the ends of the sample, so a column is good to a few per cent: enough for
the steps of a search, which weighs every step by a simulation. One costs about as much as a simulation of the bare
plant, half of one under a law.
"""

from __future__ import annotations

from ers_mj.plants.compiling.compiled import inline, kernel
from ers_mj.plants.kernel.forces import extra
from ers_mj.plants.kernel.laws import remember
from ers_mj.plants.kernel.maps import MAPS, fill_map
from ers_mj.plants.kernel.state import (
    READ,
    READ_BOOL,
    TABLE,
    VECTOR,
    F,
    L,
    Mode,
    N,
    State,
    has_bristle,
    plant_in,
    types,
)
from ers_mj.plants.kernel.tangents_bristle import along_bristle
from ers_mj.plants.kernel.tangents_slip import along

NUDGE = 1e-6  # of the motion's largest angle, speed and drive: step of a law's slopes


@inline
def _fill_maps(c, h, maps):
    """Fill maps (6, 5, 17) for a closed and an open circuit, by slip (see maps.fill_map)."""
    for i in range(5):
        for k in range(17):
            maps[1, i, k] = maps[4, i, k] = 0.0
    for s in (-1, 1):
        fill_map(maps, s + 1, c, Mode(s, 0, 0, 0, 0), c.tau_e, c.a_emf, h, False)
        fill_map(maps, 3 + s + 1, c, Mode(s, 0, 0, 0, 0), 0.0, 0.0, h, False)


@kernel(types.void(READ, READ, TABLE, VECTOR, MAPS, TABLE))
def prepare(t, load, path, plant, maps, slopes):
    """Fill maps (6, 5, 17) over a sample, and slopes (N, 3) of the laws' force by theta, w and j along the motion."""
    c, h = plant_in(plant), t[1] - t[0]
    if not has_bristle(c):
        _fill_maps(c, h, maps)
    if c.torques + c.frictions == 0:
        return
    size_theta = size_w = size_j = 0.0
    for k in range(t.size):
        size_theta = max(size_theta, abs(path[k, 0]))
        size_w, size_j = max(size_w, abs(path[k, 1])), max(size_j, abs(path[k, 2]))
    for k in range(t.size):
        theta, w, j = path[k, 0], path[k, 1], path[k, 2]
        remember(c, theta, w, j, theta, w, h)
        if w == 0.0:
            slopes[k, 0] = slopes[k, 1] = slopes[k, 2] = 0.0
            continue
        s = 1 if w > 0 else -1
        here = extra(c, load[k], t[k], State(theta, w, j, theta, 0.0), s)
        step = NUDGE * size_theta
        slopes[k, 0] = (extra(c, load[k], t[k], State(theta + step, w, j, theta, 0.0), s) - here) / step
        step = NUDGE * size_w
        slopes[k, 1] = (extra(c, load[k], t[k], State(theta, w + s * step, j, theta, 0.0), s) - here) / (s * step)
        step = NUDGE * max(size_j, 1e-9)
        slopes[k, 2] = (extra(c, load[k], t[k], State(theta, w, j + step, theta, 0.0), s) - here) / step


@kernel(
    types.void(
        READ, READ, READ, READ_BOOL, READ, READ, READ, TABLE, MAPS, TABLE, F, N, VECTOR, VECTOR, VECTOR, L, F, TABLE
    )
)
def tangent(t, u, du, enable, load, y, dy, path, maps, slopes, gain, every, plant, plant_2, change, differ, scale, out):
    """Fill out (N, >= 3) with the change of (theta, w, j) per unit of the change that made plant_2 of plant (see
    laws.laid_out), times ``scale``.

    ``change`` is that of the coefficients times scale, laid out alike, ``differ`` whether the laws do; ``du`` (N,) and
    ``dy`` (N,) are the changes per unit of the input and of what an observer follows. The rest as in
    event_integrator.simulate, which has made ``path`` (N, >= 3) of it.
    """
    c, c_2, dc = plant_in(plant), plant_in(plant_2), plant_in(change)
    if has_bristle(c):
        along_bristle(t, u, du, enable, load, y, dy, path, slopes, gain, every, c, c_2, dc, scale, out)
    else:
        along(t, u, du, enable, load, y, dy, path, maps, slopes, gain, every, c, c_2, dc, differ, scale, out)
