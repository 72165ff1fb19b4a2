"""Least squares of the free runs: every number of a model at once, by Levenberg and Marquardt."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ers_mj.position_loop import beside
from ers_mj.position_loop.model import Free, LoopModel
from ers_mj.position_loop.runs import Run
from ers_mj.solvers.levenberg_marquardt import Damping, Descent

RULE = Damping(first=1e-2, raised=6.0, lowered=6.0)


@dataclass(frozen=True)
class Search:
    """How far a descent goes, and over what its slopes are taken."""

    tries: int = 5
    longest: float = 1.5  # of a step, in transformed numbers
    step: float = 1e-2  # in transformed numbers, to take a slope: wider than what sticking and switching leave uneven,
    place: float = 1e-3  # and of an effect's number that is no logarithm: a place on the travel
    enough: float = 1e-4  # share of the cost that a step must win,
    last: float = 1e-7  # and where a fit is brought to its minimum
    untold: float = 1.0  # noise variances that a step of one must change, else no data tell where to go
    soft: float = 0.03  # of the travel: errors beyond grow the cost by their size, not its square


SEARCH = Search()


@dataclass(frozen=True)
class Fit:
    """A model and what it leaves: ``misfit`` the mean squared error in noise variances (of runs: the soft one that was
    minimised), ``rmse`` [output unit], and ``blocks`` of how much data it rests on.
    """

    model: LoopModel
    cost: float
    misfit: float
    blocks: int
    errors: np.ndarray = field(repr=False)

    @property
    def size(self) -> int:
        """Fitted numbers."""
        return len(self.model.layout())


@dataclass(frozen=True)
class _Point:
    z: np.ndarray
    e: np.ndarray
    cost: float


@dataclass(frozen=True)
class Data:
    """Runs, how their errors count, and the blocks (N,) of all scored samples; simulations take ``refine`` times finer
    steps, and follow what was seen at a rate of ``following`` [1/s] where that is not 0.
    """

    runs: tuple[Run, ...]
    soft: float
    block: np.ndarray
    refine: int = 1
    following: float = 0.0
    simulated: list[int] = field(default_factory=lambda: [0], repr=False)  # how often these runs were

    @staticmethod
    def of(runs: Sequence[Run]) -> Data:
        travel = max(float(np.nanmax(run.y) - np.nanmin(run.y)) for run in runs)
        blocks, second, base = [], [], 0
        for run in runs:
            block = run.block - run.block[run.scored][0] + base
            blocks.append(block[run.scored])
            second += [block[run.beside.scored]] if run.beside is not None else []
            base = int(blocks[-1][-1]) + 1
        return Data(
            tuple(runs), SEARCH.soft * travel, np.unique(np.concatenate(blocks + second), return_inverse=True)[1]
        )

    def alone(self, run: Run) -> Data:
        """One run, its errors counted as here."""
        return replace(Data.of([run]), soft=self.soft)

    @property
    def blocks(self) -> int:
        return int(self.block.max()) + 1

    @cached_property
    def _simulated(self) -> tuple[Run, ...]:
        return tuple(run.as_far_as_scored() for run in self.runs)

    def residuals(self, model: LoopModel) -> np.ndarray:
        """Errors (N,) of the scored samples in noise sigmas, large ones softened; those of a second signal last."""
        self.simulated[0] += 1
        runs = self._simulated
        motions = [model.motion(run, self.refine, self.following) for run in runs]
        errors = [
            _softened((run.y - model.logged(m))[run.scored], self.soft, run.sigma)
            for run, m in zip(runs, motions, strict=True)
        ]
        for signal, e in beside.errors(model, runs, motions):
            errors.append(_softened(e, SEARCH.soft * float(np.ptp(signal.values[signal.scored])), signal.sigma))
        return np.concatenate(errors)


def _softened(e: np.ndarray, scale: float, sigma: float) -> np.ndarray:
    """Errors over sigma; beyond ``scale`` their squares grow as their size does."""
    x = e / scale
    with np.errstate(invalid="ignore", over="ignore"):
        small = np.sqrt(2.0 * (np.sqrt(1.0 + x * x) - 1.0))
    soft = np.where(np.abs(x) < 1e-4, np.abs(x), small)
    return np.copysign(soft, e) * (scale / sigma)


class _Problem:
    """The fit of one structure as solvers/levenberg_marquardt.py sees it."""

    def __init__(self, model: LoopModel, layout: Sequence[Free], data: Data):
        self.model, self.layout, self.data = model, layout, data

    def reach(self, z: np.ndarray) -> _Point:
        model = self.model.at(self.layout, z)
        e = self.data.residuals(model)
        cost = 0.5 * float(e @ e)
        return _Point(model.vector(self.layout), e, cost if math.isfinite(cost) else math.inf)

    def normal(self, point: _Point, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return slopes.T @ slopes, slopes.T @ point.e

    def step(self, point: _Point, curvature: np.ndarray, slope: np.ndarray, damping: float) -> np.ndarray | None:
        raised = curvature + damping * np.diag(np.diag(curvature)) + SEARCH.untold * np.eye(slope.size)
        way = np.linalg.lstsq(raised, -slope, rcond=None)[0]
        way *= min(1.0, SEARCH.longest / max(float(np.max(np.abs(way))), 1e-12))
        promised = -(slope @ way + 0.5 * way @ curvature @ way)
        return way if promised > SEARCH.last * point.cost else None

    def slopes(self, point: _Point, both: bool = False) -> np.ndarray:
        """Of the errors by the transformed numbers (N, k), from one side or from ``both``."""
        out = np.zeros((point.e.size, point.z.size), order="F")
        for k, f in enumerate(self.layout):
            step = SEARCH.place if f.owner and not f.positive else SEARCH.step
            ends = [self._beside(point, k, way * step) for way in (1.0, -1.0)[: 1 + both]]
            ends = [end for end in ends if end[0] != point.z[k] and np.isfinite(end[1]).all()]
            if not ends and not both:
                ends = [self._beside(point, k, -step)]
            if len(ends) < 2:
                ends.append((point.z[k], point.e))
            (z_1, e_1), (z_2, e_2) = ends
            if z_1 != z_2 and np.isfinite(e_1).all():
                out[:, k] = (e_1 - e_2) / (z_1 - z_2)
        return out

    def _beside(self, point: _Point, k: int, way: float) -> tuple[float, np.ndarray]:
        """(number, errors) at a point whose k-th number is moved."""
        z = point.z.copy()
        z[k] += way
        model = self.model.at(self.layout, z)
        return float(model.vector(self.layout)[k]), self.data.residuals(model)


def polished(fit: Fit, data: Data, steps: int = 12) -> Fit:
    """A fit brought to its minimum along slopes from both sides, anew at every step."""
    layout = fit.model.layout()
    problem = _Problem(fit.model, layout, data)
    descent = Descent(problem, problem.reach(fit.model.vector(layout)), RULE)
    for _ in range(steps):
        descent.renew(problem.slopes(descent.point, both=True))
        step = descent.advance(SEARCH.tries)
        if step is None or step.gain < SEARCH.last * descent.point.cost:
            break
    return _told(problem, descent.point)


def fitted(model: LoopModel, data: Data, steps: int = 30) -> Fit:
    """The model refitted from where it stands, in at most so many steps."""
    layout = model.layout()
    problem = _Problem(model, layout, data)
    descent = Descent(problem, problem.reach(model.vector(layout)), RULE)
    if not math.isfinite(descent.point.cost):
        return _told(problem, descent.point)
    for _ in range(steps):
        if descent.slopes is None:
            descent.renew(problem.slopes(descent.point))
        step = descent.advance(SEARCH.tries)
        if step is None:
            if descent.fresh:
                break
            descent.slopes = None
        elif step.gain < SEARCH.enough * descent.point.cost:
            if step.fresh:
                break
            descent.slopes = None
    return _told(problem, descent.point)


def _told(problem: _Problem, point: _Point) -> Fit:
    model = problem.model.at(problem.layout, point.z)
    return Fit(model, point.cost, 2.0 * point.cost / point.e.size, problem.data.blocks, point.e)


def jacobian(model: LoopModel, data: Data) -> np.ndarray:
    """Slopes (N, k) of the errors by the transformed numbers."""
    layout = model.layout()
    problem = _Problem(model, layout, data)
    return problem.slopes(problem.reach(model.vector(layout)), both=True)


def gain(before: Fit, after: Fit) -> float:
    """What a refit with more numbers buys: half the blocks times the logarithm of the squared errors' ratio, less half
    the logarithm of the blocks for every number (Schwarz), blocks being what is independent.
    """
    if not math.isfinite(after.cost):
        return -math.inf
    if not math.isfinite(before.cost):
        return math.inf
    n = after.blocks
    return 0.5 * n * math.log(before.cost / after.cost) - 0.5 * (after.size - before.size) * math.log(n)


@dataclass(frozen=True)
class Halving:
    """Of several starts how many go on after being looked at, and after ``first`` steps."""

    looked: int = 4
    first: int = 5
    kept: int = 2


HALVING = Halving()


def best(starts: Sequence[LoopModel], data: Data, steps: int = 30, halving: Halving = HALVING) -> Fit:
    """The best fit of several starts: all of them looked at, fewer some steps, the best few to the end."""
    if len(starts) > halving.looked:
        starts = sorted(starts, key=lambda model: _cost(model, data))[: halving.looked]
    tried = sorted((fitted(model, data, halving.first) for model in starts), key=lambda fit: fit.cost)
    return min((fitted(fit.model, data, steps) for fit in tried[: halving.kept]), key=lambda fit: fit.cost)


def _cost(model: LoopModel, data: Data) -> float:
    e = data.residuals(model)
    cost = float(e @ e)
    return cost if math.isfinite(cost) else math.inf
