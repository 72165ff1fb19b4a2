"""What happens once: an impulse on a rudder, found where it acts. Tried as it is and brought nearer, since no secant of
it may be scaled.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ers_mj.data.prepared import BLOCK, Trace
from ers_mj.decisions.explained import cost
from ers_mj.effects import Effect
from ers_mj.estimation.objective import Run, residuals_in
from ers_mj.servo.model import OBSERVER_RATE, Model


@dataclass(frozen=True)
class Nearing:
    """How an impulse is looked for and brought nearer.

    It is tried from ``lead`` [s] before it begins until ``tail`` after; in ``simulations`` at most it is brought
    nearer, until all that were tried last are ``within`` so much of C. A block hides what it does to the others where
    the mean misfit is ``outweighing`` times the geometric mean. A push is ``idle`` that changes so much of C, and so
    often the way from it to the next, that throws the rudder, is halved (``halvings``). Brought nearer it gains
    ``further`` times as much at most, about.
    """

    lead: float = 0.1
    tail: float = 1.25
    simulations: int = 40
    within: float = 0.05
    outweighing: float = 5.0
    idle: float = 0.1
    halvings: int = 6
    further: float = 3.0


NEARING = Nearing()
Gain = Callable[[np.ndarray], float]


def impulses(
    run: Run,
    effect: Effect,
    starts: Sequence[np.ndarray],
    power: float,
    traces: Sequence[Trace],
    tau: float,
    least: float = 0.0,
) -> list[tuple[float, Model]]:
    """What happens once, tried as it is in its own recording: a rudder at rest moves for a large push and not at all
    for a small one, so that no secant may be scaled. The best starts of different side, length or recording, brought
    nearer where they may gain the ``least`` share that matters, with what they gain in C as a share of the residual's
    ``power``; first that which brings its surroundings nearest.

    They are compared and brought nearer at a tau that the recording's part around them gives (see fit): at the last one
    C has a local minimum wherever one block is met. Where one block is so bad that it outweighs all others they are
    brought nearer at that one's own level first: any push that throws the rudder about as far as it was thrown leaves
    much in the next blocks until it is met. What a coarse converter's thresholds tell counts as rounding here: an
    impulse bends to when one of them was passed.
    """
    place, near = run.model, Surroundings(run, traces, tau)
    search = _Pushes(effect, near, 0.5 * least * power)
    tried: dict[tuple, list[tuple[list[float], np.ndarray]]] = {}
    for start in starts:
        tried.setdefault((start[0] > 0, *start[1:]), []).append((search.gains(start), start))
    nearer = search.nearer(tried.values(), (1,), effect.tries)
    outweighed = [pushes for pushes in tried.values() if search.is_outweighed(pushes[0][1])]
    nearer += search.nearer(outweighed, (2, 1), 1)
    gained = sorted(((search.gains(start), start) for start in nearer), key=lambda found: -found[0][1])
    return [(2.0 * won[0] / power, place.with_effect(effect.name, start)) for won, start in gained if won[0] > 0]


class _Pushes:
    """The pushes of an effect that acts once, and what they gain; ``least`` is the gain that matters."""

    def __init__(self, effect: Effect, near: Surroundings, least: float = 0.0):
        self.effect, self.near, self.place, self.least = effect, near, near.run.model, least
        self.column = [p.name for p in effect.parameters].index("record")

    def gains(self, start: np.ndarray) -> list[float]:
        """What a start gains at tau, at the level of its surroundings, and at that of the worst of them."""
        k = int(start[self.column])
        trace, *levels = self.near.of(k, start[1])
        model = self.place.with_effect(self.effect.name, start)
        misfit = self.near.misfit(trace, residuals_in(model, trace, k, OBSERVER_RATE))
        won = [without - cost(misfit, level) for level, without in levels]
        return won if np.all(np.isfinite(won)) else [-math.inf] * len(won)

    def may_matter(self, start: np.ndarray) -> bool:
        """Whether a push may gain what matters when it is brought nearer."""
        return NEARING.further * max(self.gains(start)[0], 0.0) >= self.least

    def is_outweighed(self, start: np.ndarray) -> bool:
        return self.near.is_outweighed(start[self.column], start[1])

    def nearer(self, tried, levels: Sequence[int], most: int) -> list[np.ndarray]:
        """The ``most`` best of the pushes of different side, length or recording, in each of their forms, brought
        nearer at each of the ``levels`` in turn.
        """
        best: dict[tuple, tuple[float, np.ndarray]] = {}
        for alike in tried:
            pushes = [(won[levels[0]], start) for won, start in alike]
            for won, start in (*pushes, *between(lambda p: self.gains(p)[levels[0]], pushes)):
                kind = int(start[self.column]), start[0] > 0, start[2]
                best[kind] = max(best.get(kind, (0.0, start)), (won, start), key=lambda found: found[0])
        likely = [start for won, start in sorted(best.values(), key=lambda found: -found[0])[:most] if won > 0]
        out, scales = [], self.place.scales
        for start in likely:
            if not self.may_matter(start):
                out.append(start)
                continue
            for form in (start, *self.effect.grown(self.effect.name, start, scales)):
                for level in levels:
                    form = brought_nearer(lambda p, level=level: self.gains(p)[level], self.effect, form)
                out.append(form)
        return out


class Surroundings:
    """The part of a recording around a moment, begun in the state that a run had there: what an impulse changes is in
    it, and simulated in a fraction of the time. All of the recording where that state is more than position, speed and
    current.
    """

    def __init__(self, run: Run, traces: Sequence[Trace], tau: float, nearing: Nearing = NEARING):
        self.run, self.traces, self.tau, self.nearing = run, traces, tau, nearing
        self.known: dict[tuple[int, int, int], tuple] = {}
        self.whole = not run.model.plant().is_told_by_motion

    def misfit(self, trace: Trace, e: np.ndarray) -> np.ndarray:
        """Misfits (B,) of the residuals (rows,) of a trace, its converter's thresholds aside."""
        return trace.blocks.misfit(trace.plain(e))

    def of(
        self, record: int, moment: float
    ) -> tuple[Trace, tuple[float, float], tuple[float, float], tuple[float, float]]:
        """The part around a moment [s], and (level, C of the run there at it) for tau, for the geometric mean of its
        misfits and for their plain mean.
        """
        trace = self.traces[record]
        begin, end = self._bounds(trace, moment)
        if (record, begin, end) not in self.known:
            theta, omega = self.run.motions[record][begin, :2]
            start = (theta + self.run.model.offset(record), omega) if begin else trace.start
            is_all = (begin, end) == (0, trace.t.size)
            part = trace if is_all else trace.part(begin, end, start)
            misfit = self.misfit(part, residuals_in(self.run.model, part, record, OBSERVER_RATE))
            geometric = float(np.exp(np.mean(np.log(misfit + self.tau))))
            levels = self.tau, geometric, float(np.mean(misfit)) + self.tau
            self.known[record, begin, end] = part, *((level, cost(misfit, level)) for level in levels)
        return self.known[record, begin, end]

    def _bounds(self, trace: Trace, moment: float) -> tuple[int, int]:
        """The samples of a trace from which and to which the part around a moment goes, whole blocks."""
        if self.whole or trace.converter is not None:
            return 0, trace.t.size
        first = math.floor((moment - self.nearing.lead - trace.t[0]) / BLOCK)
        last = math.ceil((moment + self.nearing.tail - trace.t[0]) / BLOCK)
        ends = (min(first, trace.block[-1]), min(last, trace.block[-1] + 1))
        begin, end = (int(np.searchsorted(trace.block, block)) for block in ends)
        return begin, end

    def is_outweighed(self, record: float, moment: float) -> bool:
        """Whether the worst blocks around a moment outweigh the others."""
        _, _, (usual, _), (worst, _) = self.of(int(record), moment)
        return worst > self.nearing.outweighing * usual


def between(gain: Gain, pushes: Sequence[tuple[float, np.ndarray]]) -> list[tuple[float, np.ndarray]]:
    """Pushes alike but for their size, between the largest that moves little (a shaft twists under it) and the next,
    which throws the rudder too far: what a rudder at rest was moved by is often within a few per cent of what moves it
    at all.
    """
    ordered = sorted(pushes, key=lambda push: abs(push[1][0]))
    k = next((k for k, (won, _) in enumerate(ordered) if abs(won) > NEARING.idle), 0)
    if k == 0 or ordered[k][0] > 0.0:
        return []
    idle, thrown, found = ordered[k - 1][1], ordered[k][1], []
    for _ in range(NEARING.halvings):
        middle = np.append(np.sign(idle[0]) * math.sqrt(idle[0] * thrown[0]), idle[1:])
        won = gain(middle)
        found.append((won, middle))
        idle, thrown = (middle, thrown) if won > -NEARING.idle else (idle, middle)
    return found


def brought_nearer(gain: Gain, effect: Effect, start: np.ndarray) -> np.ndarray:
    """An impulse's size, beginning and length, or how it fades, brought nearer: a time has no slope before it
    overlaps the mismatch.
    """
    free = [k for k, parameter in enumerate(effect.parameters) if parameter.fitted and np.isfinite(start[k])]

    def whole(p):
        out = start.copy()
        out[free] = p
        return out

    step = [0.03 if effect.parameters[k].name == "t_0" else 0.3 * start[k] for k in free]
    bounds = [(effect.parameters[k].lower, effect.parameters[k].upper) for k in free]
    first = np.clip(start[free] + np.vstack([np.zeros(len(free)), np.diag(step)]), *np.transpose(bounds))
    from scipy.optimize import minimize  # takes as long to import as a search

    found = minimize(
        lambda p: -gain(whole(p)),
        first[0],
        method="Nelder-Mead",
        bounds=bounds,
        options={"initial_simplex": first, "maxfev": NEARING.simulations, "xatol": np.inf, "fatol": NEARING.within},
    )
    return whole(found.x)
