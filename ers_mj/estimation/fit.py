"""Fit a model's parameters to recordings by simulating them.
 The model runs as an observer of low gain, theta_hat' = w_hat + rate (y - theta_hat), so that one late stick event does
not become a lasting offset, while forces stay in open loop. Time is cut into blocks; each block's misfit m_b = SSE_b /
(n_b sigma^2) enters as C = sum_b ln(1 + m_b / tau): a few blocks where stick and slip fork cannot decide everything. C
is minimised by Levenberg-Marquardt with weights 1 / (tau + m_b) over finite differences of the event-exact simulation,
which is smooth.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg.blas import dger

from ers_mj.data.prepared import Blocks, Trace
from ers_mj.effects import BY_NAME, Effect
from ers_mj.estimation.initial_state import with_starts
from ers_mj.servo.model import OBSERVER_RATE, Columns, Model

POLISHED = 100.0  # median misfit (ten sigma) from which parameters are polished by free-run least squares
SQUARES = 1e4  # tau over the mean misfit at which C is a sum of squares
LEAST_STEP = 0.01  # gain in C of one step below which a fit ends
FLOOR = 1e-4  # gain in C of one step below which a fit stands on its valley's floor
HOP = 30.0  # C by which a hop would raise the cost, were its curvature the same all the way
MOST_HOPS = 3
FAR_HOP = 0.3  # length of the longest hop, in the transformed parameters
SOFT = 3  # directions along which a fit hops, of least curvature
HOP_GAIN = 0.3  # of C that a hop must win to be followed by further ones
ROUGH, QUIET = 3.0, 0.02  # median misfit up to which, and C per block from which, a fit hops
DENSE = 3e-3  # [s] between the samples that tell a fit's curvature: its slope is told by all of them
HOPELESS = 0.02  # excess of C per block over a nested model at which a search is given up


@dataclass(frozen=True)
class Fit:
    """A fitted model: its cost C, block misfits m (B,), and the curvature in transformed parameters (k, k)."""

    model: Model
    cost: float
    misfit: np.ndarray
    hessian: np.ndarray

    @property
    def size(self) -> int:
        """Number of fitted numbers."""
        return self.hessian.shape[0]


@dataclass(frozen=True)
class Run:
    """A model run along recordings: y - y_hat in sigmas over all traces and their channels (N,), 0 where a sample is
    missing, NaN where the simulation ran away; and the motion (n, 4) in each trace."""

    model: Model
    left: np.ndarray
    motions: tuple[np.ndarray, ...]


def run_of(model: Model, traces: Sequence[Trace], rate: float) -> Run:
    """The model's run along the traces, in observer form where ``rate`` [1/s] > 0."""
    parts, motions = zip(*(_run_in(model, trace, k, rate) for k, trace in enumerate(traces)))
    return Run(model, np.concatenate(parts), motions)


def residuals(model: Model, traces: Sequence[Trace], rate: float) -> np.ndarray:
    """What the run leaves (N,) (see Run)."""
    return run_of(model, traces, rate).left


def residuals_in(model: Model, trace: Trace, record: int, rate: float) -> np.ndarray:
    """The same (rows,) in one recording."""
    return _run_in(model, trace, record, rate)[0]


def _run_in(model, trace, record, rate):
    (theta, *others), motion = model.observed(trace, record, rate)
    left = np.empty((1 + len(others), trace.t.size))
    left[0] = trace.weighed(theta)
    for channel, seen, row in zip(trace.channels, others, left[1:]):
        np.divide(channel.values - seen, channel.sigma, out=row)
        if (
            channel.kind == "current" and model.dead_time > 0
        ):  # before it is over it follows a command that was not recorded
            row[trace.t < trace.t[0] + model.dead_time] = 0.0
    left = left.ravel()
    left[trace.unseen] = 0.0
    return left, motion


def score(misfit: np.ndarray, tau: float) -> np.ndarray:
    """Each block's share of the cost C."""
    return np.log((tau + misfit) / (1.0 + tau))


def cost_of(model: Model, traces: Sequence[Trace], rate: float, tau: float) -> float:
    """C of a model as it stands, without its priors; infinite where the simulation ran away."""
    cost = float(score(Blocks.of(traces).misfit(residuals(model, traces, rate)), tau).sum())
    return cost if math.isfinite(cost) else math.inf


def tau_of(misfit: np.ndarray) -> float:
    """The misfit at which C turns from squares to logarithms: a tenth of the median, never below the noise."""
    return max(1.0, 0.1 * float(np.median(misfit)))


def fit(
    model: Model,
    traces: Sequence[Trace],
    *,
    rate: float = OBSERVER_RATE,
    tau: float = 1.0,
    steps: int = 25,
    ceiling: np.ndarray | None = None,
    known: Columns | None = None,
    renewals: float = math.inf,
    by_tangents: bool = True,
    tolerance: float = LEAST_STEP,
) -> Fit:
    """Minimise C over the model's free numbers, from the model's own values, until a step gains less than the
    ``tolerance``.

    ``ceiling`` holds the misfits (B,) of a model that is nested in this one: a search that stands above it after a
    stage is given up, since its start was a bad one. ``known`` are columns of a Jacobian taken near by, with which the
    search begins; after ``renewals`` Jacobians of its own it ends where the last one, updated, leads no further. Where
    their number is unlimited it does not end before one that was taken where an earlier one led no further leads no
    further either, by finite differences if these are not dear (see jacobian_of).

    Far from the data the logarithm of C has a local minimum in every block, so the search starts at a ``tau`` near the
    geometric mean of the misfits, where C is nearly a sum of squares, and lowers it to the one that was asked for.
    (Their plain mean asks more of a search that begins near the data: one bad block would send it back to the sum of
    squares.) The cost is that at ``tau``, wherever the search ends.
    """
    run = _begun(model, traces, rate)
    now, jacobian, sure, blocks = (
        math.inf,
        jacobian_of(run, traces, rate, known) if known is not None else None,
        False,
        Blocks.of(traces),
    )
    while True:
        misfit = blocks.misfit(run.left)
        sound = np.all(np.isfinite(misfit))  # a runaway has one descent to find a motion
        level = float(np.exp(np.mean(np.log(misfit + tau)))) if sound else 0.0
        now = max(tau, min(level, 0.1 * now))
        last = now <= 1.5 * tau
        found, run, jacobian, renewals, sure = _descend(
            run,
            traces,
            rate,
            tau if last else now,
            steps,
            tolerance if last else 0.3,
            jacobian,
            renewals,
            by_tangents,
            sure,
        )
        if last:
            return found
        if ceiling is not None and score(found.misfit, now).sum() > score(ceiling, now).sum() + HOPELESS * ceiling.size:
            return replace(found, cost=float(score(found.misfit, tau).sum()))


def _begun(model: Model, traces: Sequence[Trace], rate: float) -> Run:
    """The run of a model whose numbers lie within their bounds."""
    layout = model.layout()
    return run_of(model.at(layout, model.vector(layout)), traces, rate)


def converged(found: Fit, rival: Fit, traces: Sequence[Trace], tau: float) -> Fit:
    """The fit carried on to its valley's floor, from its own values and from the baseline values of a rival.

    Where stick and slip fork, the cost has dents of about one block's cost, in which a single descent may rest.
    """
    starts = found.model, replace(found.model, values=rival.model.values)
    ends = [descend(model, traces, OBSERVER_RATE, tau, 40, FLOOR) for model in starts]
    return min(ends, key=lambda f: f.cost)


def hopped(
    found: Fit, traces: Sequence[Trace], tau: float, jobs: int, *, restart: bool = False, quiet: float = QUIET
) -> tuple[Fit, Sequence[Trace]]:
    """The fit after hops along its softest directions, as long as they pay, and the traces it belongs to.

    One start leads into one dent of many (see ``converged``). A hop goes as far as the fit's own curvature prices at
    HOP, and descends from there; ``restart`` fits the initial states again, which a wrong model has bent. Only near the
    noise are dents what keeps a fit from its floor: beyond ROUGH the model itself is wrong, below ``quiet`` nothing is
    left to win.
    """

    def land(start):
        begun = with_starts(start, traces) if restart else traces
        return descend(start, begun, OBSERVER_RATE, tau, 12, 0.03), begun

    for _ in range(MOST_HOPS):
        if not near_noise(found) or float(np.mean(score(found.misfit, tau))) < quiet:
            break
        layout = found.model.layout()
        z, (curvature, directions) = found.model.vector(layout), np.linalg.eigh(found.hessian)
        hops = [min(math.sqrt(2 * HOP / max(c, 1e-9)), FAR_HOP) * d for c, d in zip(curvature[:SOFT], directions.T)]
        with ThreadPoolExecutor(jobs) as pool:
            ends = list(pool.map(land, [found.model.at(layout, z + way * hop) for hop in hops for way in (-1, 1)]))
        best, begun = min(ends, key=lambda end: end[0].cost)
        if not best.cost < found.cost - HOP_GAIN:
            break
        found, traces = best, begun
    return found, traces


def is_rough(traces: Sequence[Trace]) -> bool:
    """Whether a converter is so coarse that C has dents wherever a threshold is passed a sample sooner or later."""
    return any(trace.converter is not None for trace in traces)


def near_noise(found: Fit) -> bool:
    """Whether half the blocks are explained to about their noise (ROUGH), so that details may be told."""
    return float(np.median(found.misfit)) <= ROUGH


def is_at_observer(found: Fit) -> bool:
    """Whether a fit stays one of the observer form, near enough to the noise, when it is ``polished``."""
    return float(np.median(found.misfit)) < POLISHED


def polished(found: Fit, traces: Sequence[Trace]) -> Fit:
    """The fit carried on in free run by plain least squares, where model error and not noise decides (see POLISHED).

    The free run has more than one valley, so it is reached directly and by way of slower observers; the lower one
    counts.
    """
    if is_at_observer(found):
        return found
    ends = []
    for rates in ((0.0,), (1.0, 0.0), (2.0, 0.5, 0.0)):
        model = found.model
        for rate in rates:
            level = float(np.mean(Blocks.of(traces).misfit(residuals(model, traces, rate))))
            if np.isfinite(level):
                best = descend(model, traces, rate, SQUARES * level, 40, 1e-7 * found.misfit.size / SQUARES)
                model = best.model
        ends.append((float(np.sum(residuals(model, traces, 0.0) ** 2)), model))
    ends = [e for e in ends if np.isfinite(e[0])]
    return replace(found, model=min(ends, key=lambda e: e[0])[1]) if ends else found


def descend(model: Model, traces: Sequence[Trace], rate: float, tau: float, steps: int, tolerance: float) -> Fit:
    """Levenberg-Marquardt on C at one ``tau``, until a step gains less than ``tolerance`` along a fresh Jacobian, or
    one taken where such a step was.
    """
    return _descend(_begun(model, traces, rate), traces, rate, tau, steps, tolerance, None, math.inf)[0]


def _descend(
    run: Run,
    traces: Sequence[Trace],
    rate: float,
    tau: float,
    steps: int,
    tolerance: float,
    jacobian: np.ndarray | None,
    renewals: float,
    by_tangents: bool = True,
    sure: bool = False,
) -> tuple[Fit, Run, np.ndarray | None, float, bool]:
    """See ``descend``: the fit, its run, the Jacobian that it ended with, how many it may still take, and whether that
    one is ``sure``: taken where one had led no further, so that the search may end on its updates (beside a bristle,
    where there are tangents only and they may lead astray, on none).

    Between fresh Jacobians Broyden's update serves as long as the decrease keeps a third of what it promised;
    ``jacobian`` is changed by it.
    """
    layout, blocks = run.model.layout(), Blocks.of(traces)
    stride = max(1, round(DENSE / max(trace.sample_time for trace in traces)))
    z, damping, fresh, resting = run.model.vector(layout), 1e-3, False, sure
    dear = any(BY_NAME[name].dear for name in run.model.names)
    lasting = math.isfinite(renewals) or dear  # tangents to the end
    by_tangents = by_tangents and (lasting or not sure)
    final = lasting or not by_tangents or not _has_tangents(run.model, traces)

    def judged(run, z):
        """(run, misfits (B,), cost), the last two None and infinite of a runaway."""
        if not np.all(np.isfinite(run.left)):
            return run, None, np.inf
        m = blocks.misfit(run.left)
        return run, m, float(score(m, tau).sum()) + _prior_cost(layout, z)

    run, m, cost = judged(run, z)
    if m is None:
        run, m = replace(run, left=np.full(blocks.index.size, 1e6)), np.full(blocks.counts.size, 1e12)
    hessian = np.eye(z.size)
    for _ in range(steps):
        if jacobian is None:
            if renewals <= 0:
                break
            jacobian, fresh, sure = (
                jacobian_of(run, traces, rate, by_tangents=by_tangents),
                True,
                resting and final and not dear,
            )
            renewals -= 1
        weight = (2.0 / ((tau + m) * blocks.counts))[blocks.index]
        some = jacobian.T[:, ::stride] * np.sqrt(weight[::stride])
        hessian, slope = stride * (some @ some.T), jacobian.T @ (weight * run.left)
        _add_prior(layout, z, hessian, slope)
        step = None
        for _ in range(6 if fresh else 2):
            scale = np.diag(hessian) + 1e-9 * np.trace(hessian) / z.size + 1e-12
            step = np.clip(-np.linalg.solve(hessian + damping * np.diag(scale), slope), -1.0, 1.0)
            there = run.model.at(layout, z + step)
            goal = there.vector(layout)
            trial = judged(run_of(there, traces, rate), goal)
            if trial[2] < cost:
                break
            damping = max(damping * 8, 1e-6)
            step = None
        if step is None:
            if fresh and final:
                break
            if fresh:
                by_tangents, final, damping = False, True, 1e-3
            jacobian, resting = None, True
            continue
        moved, gain, was_fresh = goal - z, cost - trial[2], fresh
        promised = -(slope @ moved + 0.5 * moved @ hessian @ moved)
        if gain > 0.3 * promised and moved @ moved > 0:
            dger(
                1.0 / float(moved @ moved),
                trial[0].left - run.left - jacobian @ moved,
                moved,
                a=jacobian,
                overwrite_a=1,
            )  # in place
            fresh = False
        else:
            jacobian = None
        z, (run, m, cost) = goal, trial
        damping = max(damping / 8, 1e-9)
        if gain < tolerance:
            if ((was_fresh or sure) and final) or renewals <= 0:
                break
            by_tangents, final = by_tangents and final, True
            jacobian, resting = None, True
    return Fit(run.model, cost, m, hessian), run, jacobian, renewals, sure


def _has_tangents(model: Model, traces: Sequence[Trace]) -> bool:
    return model.has_tangents and all(t.is_uniform for t in traces)


def step_of(model: Model) -> float:
    """Step of finite differences in the transformed numbers."""
    return max((BY_NAME[name].step for name in model.names), default=Effect.step)


def jacobian_of(
    run: Run, traces: Sequence[Trace], rate: float, known: Columns | None = None, by_tangents: bool = True
) -> np.ndarray:
    """Slopes (N, k) of what a run leaves by the numbers fitted of its model, but for the ``known`` ones.

    By tangents of the motion where the model has them, else by finite differences of simulations. Where stick and slip
    fork the two lead elsewhere, and either may be the better. Numbers whose effect on a motion hangs on what is finer
    than its samples go by differences.
    """
    model, layout = run.model, run.model.layout()
    z = model.vector(layout)
    jacobian = np.empty((z.size, run.left.size)).T  # a column's numbers side by side
    wanted = [k for k in range(z.size) if not (known and layout[k].key in known)]
    for k in set(range(z.size)) - set(wanted):
        jacobian[:, k] = known[layout[k].key]
    step = step_of(model)
    others = {k: model.at(layout, z + step * (np.arange(z.size) == k)) for k in wanted}
    tangible = by_tangents and _has_tangents(model, traces)
    along = [k for k in wanted if tangible and (layout[k].owner not in BY_NAME or BY_NAME[layout[k].owner].tangible)]
    if along:
        for k, column in zip(along, model.changes(traces, rate, [others[k] for k in along], 1.0 / step, run.motions).T):
            np.negative(column, out=jacobian[:, k])
    for k in (k for k in wanted if k not in along):
        jacobian[:, k] = (residuals(others[k], traces, rate) - run.left) / step
    jacobian[~np.isfinite(jacobian)] = 0.0
    return jacobian


def columns_of(model: Model, traces: Sequence[Trace], rate: float, by_tangents: bool = True) -> Columns:
    """The columns of a model's Jacobian, with which fits that begin near by may begin."""
    run = _begun(model, traces, rate)
    return {
        f.key: column
        for f, column in zip(run.model.layout(), jacobian_of(run, traces, rate, by_tangents=by_tangents).T)
    }


def central_jacobian(model: Model, layout, z: np.ndarray, traces: Sequence[Trace], rate: float) -> np.ndarray:
    """Central differences (N, k) of the residuals: tangents, good to a few per cent each, blur the directions in which
    their columns cancel.
    """
    step = step_of(model)
    ends = [
        [residuals(model.at(layout, z + way * row), traces, rate) for way in (1, -1)] for row in step * np.eye(z.size)
    ]
    return np.nan_to_num(
        np.column_stack([(ahead - behind) / (2.0 * step) for ahead, behind in ends]), nan=0.0, posinf=0.0, neginf=0.0
    )


def _prior_cost(layout, z):
    return sum(0.5 * ((q - f.prior[0]) / f.prior[1]) ** 2 for f, q in zip(layout, z) if f.prior)


def _add_prior(layout, z, hessian, slope):
    for k, f in enumerate(layout):
        if f.prior:
            hessian[k, k] += 1.0 / f.prior[1] ** 2
            slope[k] += (z[k] - f.prior[0]) / f.prior[1] ** 2
