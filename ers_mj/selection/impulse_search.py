"""What happens once: a knock on a rudder, found where it acts. Tried as it is and brought nearer, since no secant of it
may be scaled.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize

from ers_mj.data.prepared import BLOCK, Blocks, Trace
from ers_mj.effects import Effect
from ers_mj.estimation.fit import Run, residuals_in, score
from ers_mj.servo.model import OBSERVER_RATE, Model

NEARER, NEAR = (
    60,
    0.05,
    # simulations in which a knock is brought nearer at most, and of C, within which all that were tried last are near
    # enough
)
# how far the mean misfit of blocks may lie above their geometric mean before one of them hides what a knock does to the
# others
OUTWEIGHED = 5.0
LEAD, TAIL = 0.1, 2.0  # [s] before a knock begins and after, in which it is tried
IDLE, HALVINGS = (
    0.1,
    6,
)  # of C that a push which moves little changes; of the way from it to the next that throws the rudder


def knocks(
    run: Run, effect: Effect, starts: Sequence[np.ndarray], target: np.ndarray, traces: Sequence[Trace], tau: float
) -> list[tuple[float, Model]]:
    """What happens once, tried as it is in its own recording: a rudder at rest moves for a large push and not at all
    for a small one, so that no secant may be scaled. The best starts of different side, length or recording, brought
    nearer, with what they gain in C as a share of the residual. They are compared and brought nearer at a tau that the
    recording's part around them gives (see fit): at the last one C has a dent wherever one block is met. Where one
    block is so bad that it outweighs all others they are brought nearer at that one's own level first: any push that
    throws the rudder about as far as it was thrown leaves much in the next blocks until it is met. What a coarse
    converter's thresholds tell counts as rounding here: a knock bends to when one of them was passed.
    """
    place = run.model
    column = [p.name for p in effect.parameters].index("record")
    near = Surroundings(run, traces, tau)

    def gains(start):
        """What a start gains at tau, at the level of its surroundings, and at that of the worst of them."""
        k = int(start[column])
        trace, *levels = near.of(k, start[1])
        misfit = near.misfit(trace, residuals_in(place.with_effect(effect.name, start), trace, k, OBSERVER_RATE))
        won = [without - float(np.sum(score(misfit, level))) for level, without in levels]
        return won if np.all(np.isfinite(won)) else [-math.inf] * len(won)

    tried: dict[tuple, list[tuple[list[float], np.ndarray]]] = {}
    for start in starts:
        tried.setdefault((start[0] > 0, *start[1:]), []).append((gains(start), start))
    nearer = []
    for levels, most in (((1,), effect.tries), ((2, 1), 1)):

        def gain(start):
            return gains(start)[levels[0]]  # noqa: B023

        best: dict[tuple, tuple[float, np.ndarray]] = {}
        for pushes in tried.values():
            if levels[0] == 2 and not near.is_outweighed(pushes[0][1][column], pushes[0][1][1]):
                continue
            pushes = [(won[levels[0]], start) for won, start in pushes]
            for won, start in (*pushes, *between(gain, pushes)):
                kind = int(start[column]), start[0] > 0, start[2]
                best[kind] = max(best.get(kind, (0.0, start)), (won, start), key=lambda found: found[0])
        likely = [start for won, start in sorted(best.values(), key=lambda found: -found[0])[:most] if won > 0]
        for start in (form for push in likely for form in (push, *effect.grown(effect.name, push, place.scales))):
            for level in levels:
                start = _nearer(lambda p: gains(p)[level], effect, start)  # noqa: B023
            nearer.append(start)
    return [
        (2.0 * won / float(target @ target), place.with_effect(effect.name, start))
        for start in nearer
        if (won := gains(start)[0]) > 0
    ]


class Surroundings:
    """The part of a recording around a moment, from LEAD before it to TAIL after, begun in the state that a run had
    there: what a knock changes is in it, and simulated in a fraction of the time. All of the recording where that state
    is more than position, speed and current.
    """

    def __init__(self, run: Run, traces: Sequence[Trace], tau: float):
        self.run, self.traces, self.tau, self.known = run, traces, tau, {}
        place = run.model
        self.whole = not place.plant().is_told_by_motion

    def misfit(self, trace: Trace, e: np.ndarray) -> np.ndarray:
        """Misfits (B,) of the residuals (rows,) of a trace, its converter's thresholds aside."""
        return Blocks.of([trace]).misfit(trace.plain(e))

    def of(
        self, record: int, moment: float
    ) -> tuple[Trace, tuple[float, float], tuple[float, float], tuple[float, float]]:
        """The part around a moment [s], and (level, C of the run there at it) for tau, for the geometric mean of its
        misfits and for their plain mean.
        """
        trace = self.traces[record]
        begin, end = 0, trace.t.size
        if not self.whole and trace.converter is None:
            blocks = math.floor((moment - LEAD - trace.t[0]) / BLOCK), math.ceil((moment + TAIL - trace.t[0]) / BLOCK)
            begin, end = (
                int(np.searchsorted(trace.block, min(block, trace.block[-1] + after)))
                for after, block in enumerate(blocks)
            )
        if (record, begin, end) not in self.known:
            theta, omega = self.run.motions[record][begin, :2]
            start = (theta + self.run.model.offset(record), omega) if begin else trace.start
            part = trace if (begin, end) == (0, trace.t.size) else replace(trace.part(begin, end), start=start)
            misfit = self.misfit(part, residuals_in(self.run.model, part, record, OBSERVER_RATE))
            levels = self.tau, float(np.exp(np.mean(np.log(misfit + self.tau)))), float(np.mean(misfit)) + self.tau
            self.known[record, begin, end] = part, *((level, float(np.sum(score(misfit, level)))) for level in levels)
        return self.known[record, begin, end]

    def is_outweighed(self, record: int, moment: float) -> bool:
        """Whether the worst blocks around a moment are OUTWEIGHED times as bad as most."""
        _, _, (usual, _), (worst, _) = self.of(int(record), moment)
        return worst > OUTWEIGHED * usual


def between(
    gain: Callable[[np.ndarray], float], pushes: Sequence[tuple[float, np.ndarray]]
) -> list[tuple[float, np.ndarray]]:
    """Pushes alike but for their size, between the largest that moves little (a shaft twists under it) and the next,
    which throws the rudder too far: what a rudder at rest was moved by is often within a few per cent of what moves it
    at all.
    """
    ordered = sorted(pushes, key=lambda push: abs(push[1][0]))
    k = next((k for k, (won, _) in enumerate(ordered) if abs(won) > IDLE), 0)
    if k == 0 or ordered[k][0] > 0.0:
        return []
    idle, thrown, found = ordered[k - 1][1], ordered[k][1], []
    for _ in range(HALVINGS):
        middle = np.append(np.sign(idle[0]) * math.sqrt(idle[0] * thrown[0]), idle[1:])
        won = gain(middle)
        found.append((won, middle))
        idle, thrown = (middle, thrown) if won > -IDLE else (idle, middle)
    return found


def _nearer(gain: Callable[[np.ndarray], float], effect: Effect, start: np.ndarray) -> np.ndarray:
    """A knock's size, beginning and length, or how it fades, brought nearer: a time has no slope before the knock
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
    found = minimize(
        lambda p: -gain(whole(p)),
        first[0],
        method="Nelder-Mead",
        bounds=bounds,
        options={"initial_simplex": first, "maxfev": NEARER, "xatol": np.inf, "fatol": NEAR},
    )
    return whole(found.x)
