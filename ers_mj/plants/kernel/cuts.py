"""How a sample is cut into segments: at the end of a delay, and as short as the forces within it ask for."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ers_mj.plants.compiling.compiled import compiled, inline
from ers_mj.plants.kernel.state import MODES, VECTOR, F, has_bristle, types

# where the inductance falls with the current: length of a segment over the electrical time constant, and how many there
# are in a sample at most, since what a far shorter one changes by falling is little
FALL_STEP = 0.3, 12
LAW_STEP = 0.12  # mechanical rate [1/s] times segment length under a law
SLOWEST = 1e-6  # [1/s] rate at least, of a plant without spring and damping
CREEP_STEP = 0.7  # rate [1/s] of friction that creeps times segment length
CONTACT_STEP = 0.8  # contact frequency [rad/s] times segment length with a second body or at a stop
CORNER = 1e-4  # a crossing of theta_0 slower than this share of (c_1 + c_2) h ends in the corner
BRISTLE_CORNER = 0.1  # the same for a rudder that no friction slows: share of c_1 h below which it bounces out of sight


class Cuts(NamedTuple):
    """Ends (k,) of a sample's segments [s], whether the input of this sample (1) or the one before (0) acts in each,
    the length of a sample, of its last segment and of its longest one: a delay may end just before a sample does.
    """

    ends: np.ndarray
    fresh: np.ndarray
    h0: float
    last: float
    longest: float


CUTS = types.NamedTuple([VECTOR, MODES, F, F, F], Cuts)


@inline
def law_step(c, a_emf):
    """Length of a segment [s] at most under a law."""
    rate = max(abs(c.a_mech_plus), abs(c.a_mech_minus)) + math.sqrt(abs(c.a_1)) + a_emf
    return LAW_STEP / max(rate, SLOWEST)


@inline
def _longest(c, h0):
    """Length of a segment [s] at most."""
    step = h0
    if c.lawful > 0:
        step = min(step, law_step(c, c.a_emf))
    if c.creep > 0:
        step = min(step, CREEP_STEP / c.creep)
    if c.fall > 0 and c.tau_e > 0:
        step = min(step, max(FALL_STEP[0] * c.tau_e, h0 / FALL_STEP[1]))
    if c.two_body > 0:
        stiffness = c.k_twist / (c.rho * (1.0 - c.rho)) if c.rho > 0 else c.k_bristle
        step = min(step, CONTACT_STEP / math.sqrt(stiffness))
    return step


@inline
def split_delay(c, h0):
    """(whole samples, rest [s]) of the delay."""
    skip = int(c.delay / h0 + 1e-9)
    late = c.delay - skip * h0
    return skip, 0.0 if late < 1e-9 * h0 else late


@compiled
def cut(c, h0, refine):
    """A uniform sample's cuts, ``refine`` times as many."""
    step = _longest(c, h0) / refine
    _, late = split_delay(c, h0)
    before, after = int(math.ceil(late / step - 1e-9)), max(int(math.ceil((h0 - late) / step - 1e-9)), 1)
    ends, fresh = np.empty(before + after), np.zeros(before + after, np.int64)
    for k in range(before):
        ends[k] = late * (k + 1) / before
    for k in range(after):
        ends[before + k] = late + (h0 - late) * (k + 1) / after
        fresh[before + k] = 1
    last = (h0 - late) / after
    return Cuts(ends, fresh, h0, last, max(late / max(before, 1), last))


@inline
def longest_step(c, cuts, refine):
    """Length of a step [s] at most that looks for events."""
    h_max = np.inf
    if c.upper < np.inf or c.lower > -np.inf:
        h_max = CONTACT_STEP / (math.sqrt(c.k_stop) + c.d_stop)
    if c.two_body > 0 or c.lawful > 0:
        h_max = min(h_max, cuts.longest / refine)
    return h_max


@inline
def corner_speed(c, cuts, refine):
    """Speed below which a rudder that crosses theta_0 may end there."""
    corner = CORNER * (c.c_1 + c.c_2_plus) * cuts.h0
    if has_bristle(c):
        corner = max(corner, BRISTLE_CORNER * c.c_1 * cuts.longest * refine)
    return corner
