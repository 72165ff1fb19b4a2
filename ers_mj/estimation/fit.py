"""Fit a model's parameters to recordings by simulating them: objective -> jacobian -> descent -> fit.

Far from the data the logarithm of C has a local minimum in every block, so a fit begins where C is nearly a sum of
squares; near the data it may rest in a local minimum of about one block's cost, out of which it hops.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.prepared import Blocks, Trace
from ers_mj.decisions import explained
from ers_mj.estimation.descent import Slopes, descended, in_a_search, is_spent
from ers_mj.estimation.initial_state import with_starts
from ers_mj.estimation.jacobian import jacobian_of
from ers_mj.estimation.objective import Fit, begun, residuals
from ers_mj.servo.model import OBSERVER_RATE, Columns, Model
from ers_mj.solvers.successive_halving import Stage, halved

SQUARES = 1e4  # tau over the mean misfit at which C is a sum of squares
LEAST_STEP = 0.01  # gain in C of one step below which a fit ends
HOPELESS = 0.02  # excess of C per block over a nested model at which a search is given up


@dataclass(frozen=True)
class Along:
    """Along which slopes a fit goes: ``known`` are columns of a Jacobian taken near by, with which it begins; after
    ``renewals`` Jacobians of its own it ends where the last one, updated, leads no further. By tangents of the motion
    where there are any, if ``by_tangents`` (see jacobian_of).
    """

    known: Columns | None = None
    renewals: float = math.inf
    by_tangents: bool = True


def fit(
    model: Model,
    traces: Sequence[Trace],
    *,
    rate: float = OBSERVER_RATE,
    tau: float = 1.0,
    steps: int = 25,
    ceiling: np.ndarray | None = None,
    along: Along = Along(),
    tolerance: float = LEAST_STEP,
) -> Fit:
    """Minimise C over the model's free numbers, from the model's own values, until a step gains less than the
    ``tolerance``.

    ``ceiling`` holds the misfits (B,) of a model that is nested in this one: a search that stands above it after a
    stage is given up, since its start was a bad one.

    The search starts at a ``tau`` near the geometric mean of the misfits, where C is nearly a sum of squares, and
    lowers it to the one that was asked for. (Their plain mean asks more of a search that begins near the data: one bad
    block would send it back to the sum of squares.) The cost is that at ``tau``, wherever the search ends.
    """
    run = begun(in_a_search(model, traces), traces, rate)
    slopes = Slopes(along.renewals, jacobian_of(run, traces, rate, along.known) if along.known is not None else None)
    now, blocks = math.inf, Blocks.of(traces)
    while True:
        misfit = blocks.misfit(run.left)
        sound = np.all(np.isfinite(misfit))  # a runaway has one descent to find a motion
        level = float(np.exp(np.mean(np.log(misfit + tau)))) if sound else 0.0
        now = max(tau, min(level, 0.1 * now))
        last = now <= 1.5 * tau
        at, least = (tau, tolerance) if last else (now, 0.3)
        found, run = descended(run, traces, rate, at, steps, least, slopes, along.by_tangents)
        is_hopeless = ceiling is not None and explained.cost(found.misfit, now) > _hopeless(ceiling, now)
        if last or is_hopeless or is_spent(found.model):
            there = replace(found.model, effort=model.effort)
            return replace(found, model=there, cost=found.cost if last else explained.cost(found.misfit, tau))


def _hopeless(ceiling: np.ndarray, tau: float) -> float:
    return explained.cost(ceiling, tau) + HOPELESS * ceiling.size


def descend(model: Model, traces: Sequence[Trace], rate: float, tau: float, steps: int, tolerance: float) -> Fit:
    """Levenberg-Marquardt on C at one ``tau``, until a step gains less than ``tolerance`` along a fresh Jacobian, or
    one taken where such a step was.
    """
    return descended(begun(model, traces, rate), traces, rate, tau, steps, tolerance, Slopes())[0]


def converged(found: Fit, rival: Fit, traces: Sequence[Trace], tau: float) -> Fit:
    """The fit carried on to its valley's floor, from its own values and from the baseline values of a rival.

    Where stick and slip fork, the cost has local minima of about one block's cost, in which a single descent may rest.
    """
    floor = 1e-4  # gain in C of one step
    starts = found.model, replace(found.model, values=rival.model.values)
    ends = [descend(model, traces, OBSERVER_RATE, tau, 40, floor) for model in starts]
    return min(ends, key=lambda f: f.cost)


@dataclass(frozen=True)
class Hops:
    """How a fit hops: ``most`` times, along its ``soft`` directions of least curvature, as far as its own curvature
    prices at ``price`` of C, and no further than ``far`` in the transformed parameters; after ``glance`` steps along
    ``renewals`` Jacobians the best ``kept`` go on; again where one has won ``gain`` of C; not where it leaves less than
    ``quiet`` of C per block.
    """

    most: int = 3
    soft: int = 3
    price: float = 30.0
    far: float = 0.3
    glance: int = 5
    renewals: int = 2
    kept: int = 2
    gain: float = 0.3
    quiet: float = 0.02


def hopped(
    found: Fit, traces: Sequence[Trace], tau: float, jobs: int, *, restart: bool = False, hops: Hops = Hops()
) -> tuple[Fit, Sequence[Trace]]:
    """The fit after hops along its softest directions, as long as they pay, and the traces it belongs to.

    One start leads into one local minimum of many (see ``converged``). A hop descends from where it lands; ``restart``
    fits the initial states again, which a wrong model has bent. Only near the noise are local minima what keeps a fit
    from its floor: beyond it the model itself is wrong, and where it is quiet nothing is left to win.
    """

    def land(start: Model) -> tuple[Fit, Sequence[Trace]]:
        there, slopes = with_starts(start, traces) if restart else traces, Slopes(hops.renewals)
        run = begun(start, there, OBSERVER_RATE)
        return descended(run, there, OBSERVER_RATE, tau, hops.glance, 0.03, slopes)[0], there

    def go_on(landed: tuple[Fit, Sequence[Trace]]) -> tuple[Fit, Sequence[Trace]]:
        found, there = landed
        return descend(found.model, there, OBSERVER_RATE, tau, 12, 0.03), there

    stages = [Stage(land, lambda ends: sorted(ends, key=lambda end: end[0].cost)[: hops.kept]), Stage(go_on)]
    for _ in range(hops.most):
        if not explained.is_near_noise(found.misfit) or _per_block(found, tau) < hops.quiet:
            break
        with ThreadPoolExecutor(jobs) as pool:
            ends = halved(_landings(found, hops), stages, lambda *work: list(pool.map(*work)))
        best, there = min(ends, key=lambda end: end[0].cost)
        if not best.cost < found.cost - hops.gain:
            break
        found, traces = best, there
    return found, traces


def _per_block(found: Fit, tau: float) -> float:
    return float(np.mean(explained.score(found.misfit, tau)))


def _landings(found: Fit, hops: Hops) -> list[Model]:
    """Where the hops land, either way along each soft direction."""
    layout = found.model.layout()
    z, (curvature, directions) = found.model.vector(layout), np.linalg.eigh(found.hessian)
    ways = [
        min(math.sqrt(2 * hops.price / max(c, 1e-9)), hops.far) * d
        for c, d in zip(curvature[: hops.soft], directions.T)
    ]
    return [found.model.at(layout, z + sign * way) for way in ways for sign in (-1, 1)]


def polished(found: Fit, traces: Sequence[Trace]) -> Fit:
    """The fit carried on in free run by plain least squares, where model error and not noise decides.

    The free run has more than one valley, so it is reached directly and by way of slower observers; the lower one
    counts. All of it together may simulate as much as one search.
    """
    if not explained.is_model_error(found.misfit):
        return found
    ends: list[tuple[float, Model]] = []
    begun = in_a_search(found.model, traces)
    for rates in ((0.0,), (1.0, 0.0), (2.0, 0.5, 0.0)):
        model = begun
        if ends and is_spent(model):
            break
        for rate in rates:
            level = float(np.mean(Blocks.of(traces).misfit(residuals(model, traces, rate))))
            if np.isfinite(level):
                best = descend(model, traces, rate, SQUARES * level, 40, 1e-7 * found.misfit.size / SQUARES)
                model = best.model
        ends.append((float(np.sum(residuals(model, traces, 0.0) ** 2)), model))
    ends = [e for e in ends if np.isfinite(e[0])]
    lowest = min(ends, key=lambda e: e[0], default=None)
    return replace(found, model=replace(lowest[1], effort=found.model.effort)) if lowest else found
