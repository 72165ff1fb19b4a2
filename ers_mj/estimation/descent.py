"""Levenberg-Marquardt on the block cost C of estimation/objective.py, at one tau.

Its weights are those of C's curvature, 1 / (tau + m) in each block, its slopes tangents of the event-exact motion or
finite differences (estimation/jacobian.py); Broyden's updates serve as long as they keep what they promise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.prepared import Blocks, Trace
from ers_mj.decisions import explained
from ers_mj.effects import BY_NAME
from ers_mj.estimation.jacobian import has_tangents, jacobian_of
from ers_mj.estimation.objective import Fit, Run, add_prior, prior_cost, run_of
from ers_mj.servo.model import Model
from ers_mj.solvers.levenberg_marquardt import Damping, Descent, Step


@dataclass(frozen=True)
class Effort:
    """How far a descent goes, and what it leaves where a run fails."""

    longest: float = 1.0  # step in any of the transformed numbers
    tries: int = 6  # dampings along fresh slopes,
    tries_on_updates: int = 2  # and along updated ones
    dense: float = 3e-3  # [s] between the samples that tell C's curvature: its slope is told by all of them
    most: float = 15e6  # [us] of simulation that a search may take for each minute of recordings, or one that has less
    runaway: float = 1e6  # [sigma] that a run leaves which ran away, so that one descent may find a motion


EFFORT = Effort()


@dataclass(frozen=True)
class Reached:
    """A place on the way: z (k,), the run there, the block misfits (B,), and C with its priors."""

    z: np.ndarray
    run: Run
    misfit: np.ndarray
    cost: float

    @property
    def e(self) -> np.ndarray:
        return self.run.left


class Objective:
    """C of a model's free numbers on recordings, as solvers.levenberg_marquardt has a problem."""

    def __init__(self, model: Model, traces: Sequence[Trace], rate: float, tau: float):
        self.model, self.traces, self.rate, self.tau = model, traces, rate, tau
        self.layout, self.blocks = model.layout(), Blocks.of(traces)
        self.stride = max(1, round(EFFORT.dense / max(trace.sample_time for trace in traces)))

    def looked_at(self, run: Run, z: np.ndarray) -> Reached:
        """A run as a place on the way; of infinite cost where it ran away."""
        if not np.all(np.isfinite(run.left)):
            return Reached(z, run, np.full(self.blocks.counts.size, EFFORT.runaway**2), math.inf)
        misfit = self.blocks.misfit(run.left)
        return Reached(z, run, misfit, explained.cost(misfit, self.tau) + prior_cost(self.layout, z))

    def begun(self, run: Run) -> Reached:
        """Where a descent begins, though it be from a runaway."""
        here = self.looked_at(run, self.model.vector(self.layout))
        if math.isfinite(here.cost):
            return here
        return replace(here, run=replace(run, left=np.full(self.blocks.index.size, EFFORT.runaway)))

    def reach(self, z: np.ndarray) -> Reached:
        there = self.model.at(self.layout, z)
        return self.looked_at(run_of(there, self.traces, self.rate), there.vector(self.layout))

    def normal(self, point: Reached, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        weight = (2.0 / ((self.tau + point.misfit) * self.blocks.counts))[self.blocks.index]
        some = slopes.T[:, :: self.stride] * np.sqrt(weight[:: self.stride])
        hessian, slope = self.stride * (some @ some.T), slopes.T @ (weight * point.e)
        add_prior(self.layout, point.z, hessian, slope)
        return hessian, slope

    def step(self, point: Reached, curvature: np.ndarray, slope: np.ndarray, damping: float) -> np.ndarray:
        scale = np.diag(curvature) + 1e-9 * np.trace(curvature) / slope.size + 1e-12
        return np.clip(-np.linalg.solve(curvature + damping * np.diag(scale), slope), -EFFORT.longest, EFFORT.longest)


@dataclass
class Slopes:
    """Which Jacobians a search goes along: the ``last`` one (N, k), how many it may still take (``left``), and whether
    the last was taken where one had led no further (``sure``), so that the search may end on its updates.
    """

    left: float = math.inf
    last: np.ndarray | None = None
    sure: bool = False


class _Renewal:
    """When a descent takes its slopes anew, and by what; when it ends.

    Where the number of Jacobians is unlimited a search by tangents does not end before one by finite differences leads
    no further either, if these are not dear; beside a bristle there are tangents only, and since they may lead astray
    no search ends on updates of theirs.
    """

    def __init__(self, run: Run, traces: Sequence[Trace], rate: float, slopes: Slopes, by_tangents: bool):
        self.traces, self.rate, self.slopes = traces, rate, slopes
        self.dear = any(BY_NAME[name].dear for name in run.model.names)
        lasting = math.isfinite(slopes.left) or self.dear  # tangents to the end
        self.by_tangents = by_tangents and (lasting or not slopes.sure)
        self.final = lasting or not self.by_tangents or not has_tangents(run.model, traces)
        self.resting = slopes.sure

    def renew(self, descent: Descent[Reached]) -> bool:
        """Take slopes where the descent stands; False where no more may be taken."""
        if self.slopes.left <= 0:
            return False
        descent.renew(jacobian_of(descent.point.run, self.traces, self.rate, by_tangents=self.by_tangents))
        self.slopes.left -= 1
        self.slopes.sure = self.resting and self.final and not self.dear
        return True

    def is_the_end(self, step: Step | None, descent: Descent[Reached]) -> bool:
        """Whether a step that gained little, or none at all, ends the search."""
        if step is None:
            return descent.fresh and self.final
        return (step.fresh or self.slopes.sure) and self.final or self.slopes.left <= 0

    def rest(self, step: Step | None, descent: Descent[Reached]) -> None:
        """Have the slopes taken anew where the search rests: its last word is that of finite differences."""
        if step is not None:
            self.by_tangents, self.final = self.by_tangents and self.final, True
        elif descent.fresh:
            self.by_tangents, self.final, descent.damping = False, True, descent.rule.first
        descent.slopes, self.resting = None, True


def descended(
    run: Run,
    traces: Sequence[Trace],
    rate: float,
    tau: float,
    steps: int,
    tolerance: float,
    slopes: Slopes,
    by_tangents: bool = True,
) -> tuple[Fit, Run]:
    """The fit where a step along fresh slopes gains less than the ``tolerance``, or after so many ``steps``, and its
    run; ``slopes`` are left as they are there. It ends at what a search may simulate as well, which is said there.
    """
    above = run.model.effort
    run = replace(run, model=in_a_search(run.model, traces))
    objective = Objective(run.model, traces, rate, tau)
    descent = Descent(objective, objective.begun(run), Damping(), slopes.last)
    renewal = _Renewal(run, traces, rate, slopes, by_tangents)
    for _ in range(steps):
        if descent.slopes is None and not renewal.renew(descent):
            break
        if is_spent(run.model):
            break
        step = descent.advance(EFFORT.tries if descent.fresh else EFFORT.tries_on_updates)
        if step is not None and step.gain >= tolerance:
            continue
        if renewal.is_the_end(step, descent):
            break
        renewal.rest(step, descent)
    slopes.last, end = descent.slopes, descent.point
    there = replace(end.run, model=replace(end.run.model, effort=above))
    return Fit(there.model, end.cost, end.misfit, descent.curvature), there


def in_a_search(model: Model, traces: Sequence[Trace]) -> Model:
    """The model with what one search on these recordings may simulate of it."""
    minutes = sum(float(trace.t[-1] - trace.t[0]) for trace in traces) / 60.0
    return model.with_effort(EFFORT.most * max(1.0, minutes))


def is_spent(model: Model) -> bool:
    """Whether a search with this model has simulated what it may, which is said where it is told."""
    if model.effort is None or not model.effort.is_spent:
        return False
    model.effort.cut()
    return True
