"""Which effects does the data ask for? Screen all by simulated secants, refit the promising, add greedily, test removals.

A candidate's worth is the decrease of the block cost C (identification.py) after every baseline parameter has been refitted with it.
Two models are compared block by block on the same noise (a paired test in the manner of Vuong 1989), so that the verdict
does not rest on a model of the noise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ers_mj.effects import BY_NAME, EFFECTS
from ers_mj.identification import OBSERVER_RATE, Fit, Model, _jacobian, fit, residuals, score
from ers_mj.traces import Blocks, Trace

LEAST_GAIN = 0.02  # decrease of C per block that an effect must buy: an error of about 0.2 sigma RMS
LEAST_Z = 2.0  # and the paired z-score of that decrease over the blocks
PARAMETER_PRICE = 0.25  # of C for each further parameter, when candidates are compared
REFITTED = 7  # candidates of the screening that are refitted
FINISHED = 3  # of those, how many are fitted to the end
MOST_EFFECTS = 4


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
    basis, _ = np.linalg.qr(_jacobian(model, layout, z, e, traces, OBSERVER_RATE) * root[:, None])
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


def candidates(base: Fit, traces: Sequence[Trace], tau: float, jobs: int, exclude: Sequence[str]) -> list[Candidate]:
    """The promising effects, each refitted with the whole baseline, best first."""
    ranked = screen(base, traces, tau, exclude)[:REFITTED]

    def quick(item):
        name, starts = item
        fits = [fit(base.model.with_effect(name, start), traces, tau=tau, steps=6) for start in starts]
        return name, min(fits, key=lambda f: f.cost)

    def finish(item):
        return item[0], fit(item[1].model, traces, tau=tau, steps=20)

    with ThreadPoolExecutor(jobs) as pool:
        rough = sorted(pool.map(quick, ranked), key=lambda item: item[1].cost)
        done = list(pool.map(finish, rough[:FINISHED])) + rough[FINISHED:]
    out = [Candidate(name, f, base.cost - f.cost, paired_z(f.misfit, base.misfit, tau)) for name, f in done]
    return sorted(out, key=lambda c: -c.worth)


@dataclass(frozen=True)
class Selection:
    """The chosen model, the baseline it grew from, and each round's candidates."""

    base: Fit
    chosen: Fit
    rounds: tuple[tuple[Candidate, ...], ...]


def select(base: Fit, traces: Sequence[Trace], *, tau: float = 1.0, jobs: int = 1,
           progress: Callable[[str, float], None] = lambda text, share: None) -> Selection:
    """Grow the model effect by effect while the data asks for it, dropping what later effects make needless."""
    current, rounds = base, []
    blocks = base.misfit.size
    while len(current.model.effects) < MOST_EFFECTS and current.cost > LEAST_GAIN * blocks:
        progress(f"round {len(rounds) + 1}: comparing effects", 0.2 + 0.15 * len(rounds))
        ranked = candidates(current, traces, tau, jobs, current.model.names)
        rounds.append(tuple(ranked))
        if not ranked or ranked[0].gain < LEAST_GAIN * blocks or ranked[0].z < LEAST_Z:
            break
        current = _pruned(ranked[0].fit, traces, tau, blocks)
    return Selection(base, current, tuple(rounds))


def _pruned(current: Fit, traces: Sequence[Trace], tau: float, blocks: int) -> Fit:
    """Without the earlier effects that no longer pay."""
    for name in current.model.names[:-1]:
        without = fit(current.model.without_effect(name), traces, tau=tau, steps=12)
        if without.cost - current.cost < LEAST_GAIN * blocks:
            current = without
    return current
