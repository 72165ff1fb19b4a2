"""The compiled, event-exact integrator of Eq. (1)/(5): through a recording sample by sample, smooth flow between
events, every switch of a Sgn located exactly.

Where nothing happens, a precomputed map takes a whole segment of a sample (see maps); where its end says that something
may have, the segment is gone through by events (see ``advance``).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ers_mj.plants.compiling.compiled import inline, kernel, unit
from ers_mj.plants.kernel.calm import is_plain, rests_on, slips_on, written
from ers_mj.plants.kernel.checks import is_calm, is_clean, is_free, is_steady, is_still, linear_part, may_turn, turns
from ers_mj.plants.kernel.cuts import CUTS, corner_speed, cut, law_step, longest_step
from ers_mj.plants.kernel.events import (
    BREAKAWAY,
    CONTACT,
    CROSSING,
    ORDER,
    REVERSAL,
    STOP,
    Along,
    breakaway,
    locate,
    state_after,
    switch,
    violation,
)
from ers_mj.plants.kernel.falling import charged, fallen
from ers_mj.plants.kernel.flow import is_linear
from ers_mj.plants.kernel.laws import remember
from ers_mj.plants.kernel.maps import one_body_segment, two_body_segment
from ers_mj.plants.kernel.modes import corrected, start_mode, start_state
from ers_mj.plants.kernel.series import expand
from ers_mj.plants.kernel.state import (
    READ,
    READ_BOOL,
    TABLE,
    VECTOR,
    C,
    F,
    L,
    M,
    Mode,
    N,
    State,
    X,
    bends,
    has_bristle,
    is_bounded,
    never_sticks,
    plant_in,
    types,
    with_drive,
)
from ers_mj.plants.kernel.stretched import OF_A_SAMPLE, forgotten, is_near, jitters, over_segment, room

RELEASE_LIMIT = 60  # events in one segment after which a body is left stuck
ROUNDING = 1e-14  # [output unit] by which a position may lie beyond its boundary without an event
# events a sample, on average, beyond which a simulation is given up (NaN): a chatter no servo shows; a segment on a
# bristle, which bounces in the corner
EVENT_BUDGET = 4


class Sample(NamedTuple):
    """What acts from one sample to the next: time [s] of its beginning, length over the usual one, whether it has the
    usual length or one near it, and the circuit is closed, known acceleration of the rudder, the same of the next
    sample, drive of the sample before and of this one as they arrive.
    """

    k: int
    t: float
    stretch: float
    is_usual: bool
    is_near: bool
    closed: bool
    load: float
    next_load: float
    before: float
    now: float


@inline
def _step_along(c, t, x, m, drive, tau, a_emf, along, left, h_max):
    """(length of the next step, the expansion along which it goes): the one at hand as far as that goes; else over all
    that is left of the segment where no law acts, or over the step.
    """
    h = left if m.s == 0 and c.two_body <= 0 else min(left, h_max)
    if along.begun + h <= along.span * (1.0 + 1e-12):
        return h, along
    if h < left and is_linear(c, m) and expand(c, t, x, m, drive, tau, a_emf, left):
        return h, Along(left, 0.0)
    return h, Along(h if expand(c, t, x, m, drive, tau, a_emf, h) else 0.0, 0.0)


@inline
def _smooth_step(c, t, x, m, drive, tau, a_emf, along, h, dt):
    """(length, state after it) of a step of at most h within the mode, shortened where the speed turns twice within
    it.
    """
    z = state_after(c, t, x, m, drive, tau, a_emf, along, h)
    while h > dt / 40 and turns(c, t, x, z, m, drive, tau, a_emf, h):
        h *= 0.25
        z = state_after(c, t, x, m, drive, tau, a_emf, along, h)
    return h, z


@inline
def _first_event(c, t, x, z, m, drive, tau, a_emf, along, h):
    """(event, time after t, state then) of what happens first within h, which ends in z: -1 where nothing does."""
    first, event = h, -1
    for e in ORDER:
        g = violation(e, c, t + first, z, m)
        if g > (ROUNDING if e == CROSSING or e == STOP or e == CONTACT else 0.0):
            first, z = locate(e, c, t, x, m, drive, tau, a_emf, along, first, g)
            event = e
    return event, first, z


@inline
def _charged(j, drive, tau, h):
    """The drive acceleration of a body at rest h later."""
    return drive + (j - drive) * math.exp(-h / tau) if tau > 0 else j


@unit(types.Tuple((X, M, N))(C, F, X, M, F, F, F, F, F, F))
def advance(c, t, x, m, drive, tau, a_emf, dt, h_max, corner):
    """Integrate over dt under a constant drive, through every event on the way. Returns (x, m, number of events)."""
    if tau <= 0:
        x = with_drive(c, x, drive, tau, a_emf)
        if m.s == 0 and breakaway(c, t, x, m) > 0:
            x, m = switch(BREAKAWAY, c, t, x, m, corner)
    left, events, along = dt, 0, Along(0.0, 0.0)
    while left > 1e-13 * dt:
        h, along = _step_along(c, t, x, m, drive, tau, a_emf, along, left, h_max)
        h, z = _smooth_step(c, t, x, m, drive, tau, a_emf, along, h, dt)
        event, first, z = _first_event(c, t, x, z, m, drive, tau, a_emf, along, h)
        if event < 0:
            x, along = z, Along(along.span, along.begun + h)
        else:
            events, along = events + 1, Along(0.0, 0.0)
            x, new = switch(event, c, t + first, z, m, corner)
            tires = events > RELEASE_LIMIT and (event == REVERSAL or event == BREAKAWAY)
            if tires or (first <= 0.0 and event == REVERSAL):
                m = Mode(0, new.side, new.stop, new.s_m, new.twist)
                if c.two_body <= 0:
                    x, first = State(x.theta, 0.0, _charged(x.j, drive, tau, h), x.theta_m, x.w_m), h
            else:
                m = new
            if events > 4 * RELEASE_LIMIT:
                z = State(x.theta, 0.0, _charged(x.j, drive, tau, left), x.theta_m, 0.0)
                return z, Mode(0, m.side, m.stop, 0, m.twist), events
        if not is_bounded(x):
            return x, m, events
        t += first
        left -= first
    return x, m, events


@inline
def _at_rest(c, t, x, m, drive, tau, load, h, is_checked):
    """(whether one body stays at rest over h, the state then; as it begins where it does not). The beginning was
    looked at where ``is_checked``.
    """
    x = State(x.theta, 0.0, x.j if tau > 0 else drive, x.theta_m, x.w_m)
    z = State(x.theta, 0.0, drive + (x.j - drive) * math.exp(-h / tau) if tau > 0 else drive, x.theta_m, x.w_m)
    bias = c.bias
    c.bias = bias + load
    held = breakaway(c, t + h, z, m) <= 0 and (is_checked or breakaway(c, t, x, m) <= 0)
    c.bias = bias
    return held, z if held else x


@inline
def _acceleration(c, x, m, push):
    """Of a slipping body under the acceleration ``push`` of laws and of a known load."""
    constant, stiffness, damping = linear_part(c, m)
    return x.j + push + constant - stiffness * x.theta - damping * x.w


@inline
def _slipping(e, step, c, t, x, m, drive, tau, a_emf, load, h, extra, slips):
    """(whether one body goes on slipping over h, the state then or as it begins, what laws add then)."""
    x, before = with_drive(c, x, drive, tau, a_emf), extra if c.lawful > 0 else 0.0
    z, extra = one_body_segment(e, step, c, t, x, m, drive, tau, a_emf, load, h, extra if tau > 0 else np.nan)
    z = with_drive(c, z, drive, tau, a_emf)
    within = (slips or z.w * m.s > 0) and (z.theta - c.theta_0) * m.side >= 0
    within = within and z.theta <= c.upper and z.theta >= c.lower
    if within and (before != before or may_turn(x, z, m.s, _acceleration(c, x, m, load + before), h)):
        within = not turns(c, t, x, z, m, drive, tau, a_emf, h)
    return within, z if within else x, extra


@unit(types.Tuple((L, X))(C, F, X, M, F, F, F, F, F))
def _resting_on_bristle(c, t, x, m, drive, tau, a_emf, load, h):
    """(whether a rudder rests on its bristle over h, the state then)."""
    z = State(x.theta, x.w, _charged(x.j, drive, tau, h), x.theta_m, x.w_m)
    bias = c.bias
    c.bias = bias + load
    still = is_still(c, t, x, m, drive, tau, a_emf) and is_still(c, t + h, z, m, drive, tau, a_emf)
    c.bias = bias
    return still, z


@inline
def _of_two_bodies(e, step, c, t, x, m, drive, tau, a_emf, load, h):
    """(whether two bodies, or one on a bristle, go on in their mode over h, the state then or as it begins)."""
    x = with_drive(c, x, drive, tau, a_emf)
    if bends(c, m):
        still, z = _resting_on_bristle(c, t, x, m, drive, tau, a_emf, load, h)
        if still:
            return True, z
    z = two_body_segment(e, step, c, t, x, m, drive, tau, a_emf, load, h)
    z = with_drive(c, z, drive, tau, a_emf)
    clean = is_clean(c, t, x, z, m, tau, load, h)
    return clean, z if clean else x


@inline
def _leap(maps, c, now, h, x, m):
    """(whether two bodies go on in their mode over a whole sample of length h, the state then or as it begins)."""
    if not (now.is_usual and now.closed and m.stop == 0 and is_calm(c, x, h)):
        return False, x
    tau, a_emf, drive = c.tau_e, c.a_emf, now.now
    x = with_drive(c, x, drive, tau, a_emf)
    z = two_body_segment(maps.whole, h, c, now.t, x, m, drive, tau, a_emf, now.load, h)
    z = with_drive(c, z, drive, tau, a_emf)
    clean = is_calm(c, z, h) and is_steady(x, z) and is_clean(c, now.t, x, z, m, tau, now.load, h)
    return clean, z if clean else x


@inline
def _rest(c, now, cuts, x, m, resting):
    """(whether one body at rest stays there over a whole sample that is cut into segments, the state then or as it
    begins, the sample that begins in a rest which was checked).
    """
    tau, changes = c.tau_e, cuts.fresh[0] != 1 and now.before != now.now
    moves = tau > 0 and (changes or c.fall > 0 or c.lawful > 0)  # what pulls need not be the most at an end then
    if m.s != 0 or c.two_body > 0 or moves or not (now.closed and is_free(c, now.t, x, m)):
        return False, x, resting
    h = cuts.h0 * now.stretch
    if changes and not _at_rest(c, now.t, x, m, now.before, tau, now.load, h, False)[0]:
        return False, x, resting
    done, x = _at_rest(c, now.t, x, m, now.now, tau, now.load, h, tau > 0 and resting == now.k)
    return done, x, now.k + 1 if done and now.next_load == now.load else resting


@inline
def _segment(e, step, c, now, is_last, t, x, m, drive, h, extra, resting, slips):
    """Over a segment of length h from t, as if nothing happened: (whether that is so, the state then or as it begins,
    what laws add then, the sample that begins in a rest which was checked).
    """
    tau, a_emf, load = c.tau_e, c.a_emf, now.load
    if c.two_body > 0:
        done, x = _of_two_bodies(e, step, c, t, x, m, drive, tau, a_emf, load, h)
    elif m.s == 0:
        done, x = _at_rest(c, t, x, m, drive, tau, load, h, tau > 0 and c.fall <= 0 and resting == now.k)
        if done:
            resting = now.k + 1 if is_last and now.next_load == load else now.k
    else:
        done, x, extra = _slipping(e, step, c, t, x, m, drive, tau, a_emf, load, h, extra, slips)
    return done, x, extra, resting


@inline
def _through_events(c, now, t, x, m, drive, h, h_max, corner):
    """(x, m, number of events) after a segment of length h from t, the circuit open where it is."""
    bias, tau, a_emf = c.bias, c.tau_e, c.a_emf
    if not now.closed:
        x = State(x.theta, x.w, 0.0, x.theta_m, x.w_m)
        drive = tau = a_emf = 0.0
    c.bias = bias + now.load
    x, m, events = advance(c, t, x, m, drive, tau, a_emf, h, h_max, corner)
    c.bias = bias
    return x, m, events


@inline
def _through_segments(maps, c, now, cuts, x, m, h_max, corner, extra, resting, slips):
    """(x, m, extra, resting, number of events) after the segments of a sample, see ``_segment``."""
    start, events = 0.0, 0
    if now.is_near:
        forgotten(maps)
    for i in range(cuts.ends.size):
        h, t = (cuts.ends[i] - start) * now.stretch, now.t + start * now.stretch
        start = cuts.ends[i]
        drive, further = now.now if cuts.fresh[i] == 1 else now.before, 0.0
        if c.fall > 0 and c.tau_e > 0 and now.closed:
            drive, further = fallen(c, t, x, m, drive, h)
        if (now.is_usual or now.is_near) and now.closed and is_free(c, t, x, m):
            e, step = over_segment(maps, c, m, cuts, cuts.fresh[i] == 1, now.is_usual, now.stretch)
            is_last = i == cuts.ends.size - 1
            done, x, extra, resting = _segment(e, step, c, now, is_last, t, x, m, drive, h, extra, resting, slips)
            if done:
                x = charged(x, further)
                continue
        extra = np.nan
        x, m, more = _through_events(c, now, t, x, m, drive, h, h_max, corner)
        x = charged(x, further)
        events += more
    return x, m, extra, resting, events


@inline
def _sample(t, u, enable, load, c, cuts, k):
    """Sample k, which is not the last."""
    is_usual = abs(t[k + 1] - t[k] - cuts.h0) < 1e-6 * cuts.h0
    stretch = 1.0 if is_usual else (t[k + 1] - t[k]) / cuts.h0
    near = not is_usual and is_near(c, stretch)
    return Sample(k, t[k], stretch, is_usual, near, enable[k], load[k], load[k + 1], c.b * u[k], c.b * u[k + 1])


@inline
def _event_budget(c, n, cuts):
    """Events that n samples may have."""
    return EVENT_BUDGET * n * (cuts.ends.size if has_bristle(c) else 1) + 1000


@inline
def _calm(t, u, enable, load, c, cuts, e, k, last, x, m, slips, out):
    """(sample, state) up to which nothing happens from sample k on."""
    if m.s == 0:
        return rests_on(t, u, enable, load, c, cuts, k, last, x, m, out)
    return slips_on(t, u, enable, load, c, cuts, e, k, last, x, m, slips, out)


@unit(N(READ, READ, READ_BOOL, READ, READ, F, N, C, N, VECTOR, CUTS, OF_A_SAMPLE, L, TABLE))
def _march(t, u, enable, load, y, gain, every, c, refine, x0, cuts, maps, leaps, out):
    """See ``simulate``: through the samples, by maps over segments or, if it ``leaps``, over a whole sample; how many
    events there were.
    """
    n, plain, slips = t.size, is_plain(c, cuts), never_sticks(c)
    h_max, corner = longest_step(c, cuts, refine), corner_speed(c, cuts, refine)
    most = budget = _event_budget(c, n, cuts)
    resting = -1  # the sample that begins in a rest which was checked already
    extra = np.nan  # what the laws add where a segment ended that holds no event
    x = start_state(c, x0[0], x0[1], x0[2], x0[3], x0[4], 0.5 * (c.c_2_plus + c.c_2_minus))
    m, k = start_mode(c, x), 0
    due = 0 if gain > 0.0 else n  # the sample at which the observer looks next
    written(out, 0, c, x)
    while k < n - 1:
        remember(c, x.theta, x.w, x.j, x.theta_m, x.w_m, t[k + 1] - t[k])
        if k == due:
            due += every
            if y[k] == y[k]:
                resting, extra = -1, np.nan
                x, m = corrected(c, t[k], x, m, gain * (y[k] - x.theta))
        if plain and is_free(c, t[k], x, m):
            calm, x = _calm(t, u, enable, load, c, cuts, maps.late, k, min(n - 1, due), x, m, slips, out)
            if calm > k:
                resting, extra, k = -1, np.nan, calm
                continue
        now = _sample(t, u, enable, load, c, cuts, k)
        done, x = _leap(maps, c, now, cuts.h0, x, m) if leaps else (False, x)
        if not done and cuts.ends.size > 1:
            done, x, resting = _rest(c, now, cuts, x, m, resting)
        if not done:
            x, m, extra, resting, events = _through_segments(
                maps, c, now, cuts, x, m, h_max, corner, extra, resting, slips
            )
            budget -= events
            if not is_bounded(x) or budget < 0:
                out[k + 1 :, :] = np.nan
                return most - budget
        k += 1
        written(out, k, c, x)
    return most - budget


@kernel(N(READ, READ, READ_BOOL, READ, READ, F, N, VECTOR, N, VECTOR, TABLE))
def simulate(t, u, enable, load, y, gain, every, plant, refine, x0, out):
    """Fill out (N, 4) with (theta, w, j, theta_m) at the sample times, taken just before u[k] acts; how many events
    there were.

    ``gain`` in [0, 1] is the observer's: at one sample in ``every`` theta is moved by gain * (y - theta); 0 is a free
    run. ``u`` (N + 1,) is what arrives, from the sample before the first on; ``y`` may hold NaN (no correction there).
    ``load`` is a known acceleration of the rudder, ``enable`` false an open circuit. ``plant`` is what laws.laid_out
    gives, of which memories change; ``refine`` divides the segments. A motion that runs away, or chatters beyond
    EVENT_BUDGET, is NaN from there on.
    """
    c, h0 = plant_in(plant), t[1] - t[0]
    cuts = cut(c, h0, refine)
    leaps = c.two_body > 0 and not has_bristle(c) and c.harden <= 0 and c.fall <= 0
    leaps = leaps and cuts.ends.size > 1 and cuts.fresh[0] == 1
    leaps = leaps and (c.lawful == 0 or refine * h0 <= law_step(c, c.a_emf))
    maps = room(cuts.fresh[0] != 1, leaps, jitters(t, h0))
    return _march(t, u, enable, load, y, gain, every, c, refine, x0, cuts, maps, leaps, out)
