"""Which effects does the data ask for? Screen all by simulated secants, refit the promising, add greedily, test removals.

A candidate's worth is the decrease of the block cost C (identification.py) after every baseline parameter has been refitted with it.
Two models are compared block by block on the same noise (a paired test in the manner of Vuong 1989), so that the verdict
does not rest on a model of the noise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.effects import BY_NAME, EFFECTS
from ers_mj.identification import OBSERVER_RATE, STATES, Fit, converged, fit, jacobian_of, residuals, score, tau_of
from ers_mj.traces import Blocks, Trace

LEAST_GAIN = 0.02  # decrease of C per block that an effect must buy: an error of about 0.2 sigma RMS
LEAST_SHARE = 0.1  # and the share of what is left to explain
LEAST_Z = 2.0  # and the paired z-score of that decrease over the blocks
PARAMETER_PRICE = 0.25  # of C for each further parameter, when candidates are compared
REFITTED = 7  # candidates of the screening that are refitted
FINISHED = 3  # of those, how many at most are fitted to the end: those with half the best one's gain
AGAIN = 0.1  # share of the best first refit's gain from which an effect is refitted from its other starts as well
NEAR_TIE = 0.02  # share of the best one's gain within which candidates are rivals, which only converged fits can tell apart
MOST_ROUNDS = 2


@dataclass(frozen=True)
class Candidate:
    """A model that adds one effect to another: the fit, its gain in C over the reference, the paired z of that gain."""

    name: str
    fit: Fit
    gain: float
    z: float

    @property
    def worth(self) -> float:
        """Gain less the price of the parameters."""
        return self.gain - PARAMETER_PRICE * self.fit.size


def paired_z(better: np.ndarray, worse: np.ndarray, tau: float) -> float:
    """z-score over blocks of the mean decrease in score from ``worse`` to ``better`` (misfits (B,) on the same data)."""
    d = score(worse, tau) - score(better, tau)
    spread = float(np.std(d, ddof=1)) if d.size > 1 else math.inf
    return float(np.mean(d)) * math.sqrt(d.size) / spread if spread > 0 else 0.0


def tie(best: Candidate, other: Candidate) -> float:
    """How probable the other is against the best (1 = equal): the chance that its score over the blocks is no worse."""
    d = score(other.fit.misfit, 1.0) - score(best.fit.misfit, 1.0)
    spread = float(np.std(d, ddof=1)) * math.sqrt(d.size)
    if spread == 0.0:
        return 1.0
    return math.erfc(max(float(np.sum(d)), 0.0) / spread / math.sqrt(2.0))


def screen(base: Fit, traces: Sequence[Trace], tau: float, exclude: Sequence[str]) -> list[tuple[str, list[np.ndarray]]]:
    """Effects with their most promising starts, by the share of the weighted residual that the start's secant explains.

    The secant e(with effect) - e(without) is taken at the start's visible size, and what the baseline's own parameters
    could do as well is projected out.
    """
    model, blocks = base.model, Blocks.of(traces)
    layout = model.layout()
    z = model.vector(layout)
    e = residuals(model, traces, OBSERVER_RATE)
    m = blocks.misfit(e)
    root = np.sqrt(2.0 / ((tau + m) * blocks.counts))[blocks.index]
    basis, _ = np.linalg.qr(jacobian_of(model, layout, z, e, traces, OBSERVER_RATE) * root[:, None])
    target = root * e
    target = target - basis @ (basis.T @ target)
    found = []
    for effect in EFFECTS:
        if effect.name in exclude:
            continue
        tried = []
        for start in effect.starts(model.scales):
            secant = residuals(model.with_effect(effect.name, start), traces, OBSERVER_RATE) - e
            if not np.all(np.isfinite(secant)):
                continue
            secant = root * secant
            secant = secant - basis @ (basis.T @ secant)
            size, pull = float(secant @ secant), -float(secant @ target)
            tried.append((math.copysign(pull**2 / size, pull) if size > 1e-12 else 0.0, start))
        if tried:
            tried.sort(key=lambda item: -item[0])
            found.append((effect.name, tried))
    found.sort(key=lambda item: -item[1][0][0])
    return [(name, [start for _, start in tried[:BY_NAME[name].tries]]) for name, tried in found]


def candidates(base: Fit, traces: Sequence[Trace], tau: float, jobs: int, exclude: Sequence[str],
               anchors: Sequence[Mapping[str, float]] = ()) -> list[Candidate]:
    """The promising effects, and what may differ between recordings, each refitted with the whole baseline, best first."""
    reference = float(score(base.misfit, tau).sum())

    def total(found):
        return float(score(found.misfit, tau).sum())

    def quick(models):
        return min((fit(model, traces, tau=tau, steps=6, ceiling=base.misfit) for model in models), key=total)

    def first(item):
        name, starts = item
        if name in STATES:
            return name, quick([base.model.with_state(name, len(traces))])
        model = base.model.with_effect(name, starts[0])
        return name, quick([model, *(replace(model, values={**model.values, **values}) for values in anchors)])

    def further(item):
        (name, starts), (_, found) = item
        others = [base.model.with_effect(name, start) for start in starts[1:]]
        return name, min(found, quick(others), key=total) if others and reference - total(found) >= AGAIN * most else found

    def finish(item):
        return item[0], fit(item[1].model, traces, tau=tau, steps=20, ceiling=base.misfit)

    def judged(item):
        name, found = item
        return Candidate(name, found, reference - total(found), paired_z(found.misfit, base.misfit, tau))

    states = [(s, []) for s in STATES if len(traces) > 1 and s not in (base.model.states or {})]
    with ThreadPoolExecutor(jobs) as pool:
        screened = screen(base, traces, tau, exclude)[:REFITTED] + states
        once = list(pool.map(first, screened))
        most = max((reference - total(f) for _, f in once), default=0.0)
        rough = sorted(pool.map(further, zip(screened, once)), key=lambda item: total(item[1]))
        gains = [reference - total(f) for _, f in rough]
        close = sum(g >= 0.5 * gains[0] for g in gains[:FINISHED])
        ranked = sorted(map(judged, list(pool.map(finish, rough[:close])) + rough[close:]), key=lambda c: -c.worth)
        least = ranked[0].worth - max(1.0, NEAR_TIE * ranked[0].gain) if ranked else 0.0
        rivals = sum(c.worth > max(least, 0.0) for c in ranked)
        if rivals > 1:
            close = [c.fit for c in ranked[:rivals]]
            ranked[:rivals] = pool.map(lambda c: judged((c.name, converged(c.fit, [f for f in close if f is not c.fit], traces, tau))), ranked[:rivals])
    return sorted(ranked, key=lambda c: -c.worth)


@dataclass(frozen=True)
class Selection:
    """The chosen model, the baseline it grew from, each round's candidates, and the tau at which the last was judged."""

    base: Fit
    chosen: Fit
    rounds: tuple[tuple[Candidate, ...], ...]
    tau: float


def select(base: Fit, traces: Sequence[Trace], *, anchors: Sequence[Mapping[str, float]] = (), exclude: Sequence[str] = (),
           jobs: int = 1, progress: Callable[[str, float], None] = lambda text, share: None) -> Selection:
    """Grow the model while the data asks for it, dropping what later additions make needless."""
    current, rounds, blocks = base, [], base.misfit.size
    tau = tau_of(base.misfit)
    while len(rounds) < MOST_ROUNDS and float(score(current.misfit, tau).sum()) > LEAST_GAIN * blocks:
        progress(f"round {len(rounds) + 1}: comparing effects", 0.15 + 0.12 * len(rounds))
        ranked = candidates(current, traces, tau, jobs, (*exclude, *current.model.names), anchors if not rounds else ())
        rounds.append(tuple(ranked))
        least = max(LEAST_GAIN * blocks, LEAST_SHARE * float(score(current.misfit, tau).sum()))
        if not ranked or ranked[0].gain < least or ranked[0].z < LEAST_Z:
            break
        current = _pruned(ranked[0].fit, ranked[0].name, traces, tau)
        tau = tau_of(current.misfit)
        current = fit(current.model, traces, tau=tau, steps=20)
    return Selection(base, current, tuple(rounds), tau)


def _pruned(current: Fit, newest: str, traces: Sequence[Trace], tau: float) -> Fit:
    """Without the earlier effects that no longer pay."""
    for name in (n for n in current.model.names if n != newest):
        without = fit(current.model.without_effect(name), traces, tau=tau, steps=12)
        if without.cost - current.cost < LEAST_GAIN * current.misfit.size:
            current = without
    return current
