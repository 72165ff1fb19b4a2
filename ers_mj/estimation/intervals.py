"""Intervals that survive model error: a jackknife over recordings and a sandwich over blocks.

What is too small to be found moves the parameters as well, further than the noise does, and so does what is missing:
``unseen_shifts`` tells how far.

(J^T J)^-1 takes neighbouring residuals for independent; a model error is anything but that. The jackknife sees what
differs between recordings, but a refit may rest in the local minimum of the cost where it begins, and then says
nothing; the sandwich only sees the scatter within them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from ers_mj.data.prepared import Blocks, Trace
from ers_mj.decisions.explained import attainable
from ers_mj.effects import BY_NAME, Effect
from ers_mj.estimation.jacobian import central_jacobian
from ers_mj.estimation.objective import residuals
from ers_mj.servo.model import OBSERVER_RATE, STATES, Free, Model


@dataclass(frozen=True)
class Doubt:
    """What widens an interval beyond the noise, and of what it is told."""

    # of C that an effect would gain which is not found (decisions.policy.least_gain is what it must)
    unseen_gain: float = 2.0
    unseen: float = 1.0  # effects of that size that act, on average
    fewest_records: int = 3  # left out in turn, from which a jackknife counts
    lost: float = 1e6  # [sigma] that a run leaves where it ran away
    same: float = 0.5  # share of an unseen effect that an effect of the model leaves, below which it is that one
    run: int = 4  # neighbouring blocks that are resampled together


DOUBT = Doubt()


def slopes_of(model: Model, traces: Sequence[Trace]) -> np.ndarray:
    """The Jacobian (N, k) from which intervals follow."""
    layout = model.layout()
    return central_jacobian(model, layout, model.vector(layout), traces, OBSERVER_RATE)


def told_spreads(
    model: Model, traces: Sequence[Trace], left_out: Sequence[Model], tau: float
) -> tuple[np.ndarray, np.ndarray]:
    """Covariance (k, k) of the model's transformed numbers times the square of its 95 % quantile: that of
    ``half_spread`` and that of effects which act unseen, and the same as it is told, where these may be as large as
    what the model leaves. The roots of its diagonal are the half-widths.
    """
    jacobian, blocks = slopes_of(model, traces), Blocks.of(traces)
    half, shifts = half_spread(model, traces, left_out, tau, jacobian), unseen_shifts(model, traces, tau, jacobian)
    left = attainable(blocks.misfit(_left(model, traces)), blocks.counts, tau)
    return half + spread_by(shifts, DOUBT.unseen_gain), half + spread_by(shifts, max(DOUBT.unseen_gain, left))


def half_widths(model: Model, traces: Sequence[Trace], left_out: Sequence[Model], tau: float) -> np.ndarray:
    """95 % half-widths (k,) by ``half_spread``."""
    return widths_of(half_spread(model, traces, left_out, tau))


def widths_of(spread: np.ndarray) -> np.ndarray:
    """95 % half-widths (k,) of a spread (k, k)."""
    return np.sqrt(np.maximum(np.diag(spread), 0.0))


def at_given(spread: np.ndarray, asked: Sequence[int], given: Sequence[int]) -> np.ndarray:
    """Spread (n, n) of the n ``asked`` numbers while the ``given`` ones stay where they are."""
    own, held, between = (spread[np.ix_(*ends)] for ends in ((asked, asked), (given, given), (asked, given)))
    return own - between @ np.linalg.pinv(held, rcond=1e-9, hermitian=True) @ between.T


def half_spread(
    model: Model, traces: Sequence[Trace], left_out: Sequence[Model], tau: float, jacobian: np.ndarray | None = None
) -> np.ndarray:
    """Spread (k, k) of the model's transformed numbers: that of the jackknife and that of the sandwich.

    ``left_out`` holds the model refitted without each recording in turn; with fewer than three, or where some numbers
    belong to one recording only, the sandwich serves alone. The ``jacobian`` is ``slopes_of`` the model, where it is
    known.
    """
    layout = model.layout()
    spread = _sandwich(model, traces, tau, slopes_of(model, traces) if jacobian is None else jacobian)
    if len(left_out) >= DOUBT.fewest_records and not any(f.local or f.owner in STATES for f in layout):
        z = np.array([m.vector(layout) for m in left_out])
        off, n = z - z.mean(axis=0), len(left_out)
        spread = spread + stdtrit(n - 1, 0.975) ** 2 * (n - 1) / n * (off.T @ off)
    return spread


def _sandwich(model: Model, traces: Sequence[Trace], tau: float, jacobian: np.ndarray) -> np.ndarray:
    """Spread (k, k) by H^-1 (sum of outer products of the slopes of runs of blocks) H^-1."""
    layout, blocks, e = model.layout(), Blocks.of(traces), _left(model, traces)
    weight = (2.0 / ((tau + blocks.misfit(e)) * blocks.counts))[blocks.index]
    weighted = jacobian * weight[:, None]
    hessian = weighted.T @ jacobian
    run = blocks.index // DOUBT.run
    slopes = np.array([np.bincount(run, weighted[:, k] * e, run.max() + 1) for k in range(len(layout))]).T
    inverse = _inverse(hessian)
    n = slopes.shape[0]
    covariance = inverse @ (slopes.T @ slopes) @ inverse * n / max(n - len(layout), 1)
    return stdtrit(max(n - len(layout), 1), 0.975) ** 2 * covariance


def _left(model: Model, traces: Sequence[Trace]) -> np.ndarray:
    """What the run leaves (N,); where it ran away so much that the blocks weigh nothing."""
    return np.nan_to_num(residuals(model, traces, OBSERVER_RATE), nan=DOUBT.lost)


def _is_in(effect: Effect, model: Model) -> bool:
    """Whether a model's baseline has a number of its own for an effect."""
    return any(model.values[name] > 0 for name in effect.absorbs)


@dataclass(frozen=True)
class Shifts:
    """How far effects (n,) that are not in a model move its numbers (n, k) at the size of one of their starts, what a
    fit would gain by each of them there (n,), and how likely each start is beside others (n,).
    """

    moved: np.ndarray
    gain: np.ndarray
    share: np.ndarray


def spread_by(shifts: Shifts, gain: float) -> np.ndarray:
    """Spread (k, k) by effects at a size that would gain so much of C, and never larger than their starts; any is as
    likely as the next, DOUBT.unseen of them act.
    """
    size = np.minimum(1.0, np.sqrt(gain / np.maximum(shifts.gain, 1e-12)))
    moved = shifts.moved * (size * np.sqrt(shifts.share))[:, None]
    return 1.96**2 * DOUBT.unseen * moved.T @ moved


def unseen_shifts(model: Model, traces: Sequence[Trace], tau: float, jacobian: np.ndarray) -> Shifts:
    """How far the numbers move to make up for effects that act unseen: what a fit makes of each effect's secant. The
    ``jacobian`` is ``slopes_of`` the model. One most of which an effect of the model explains is the same by another
    name: a rival, to which that one may have to give way, but nothing that moves its numbers from beside.
    """
    layout, blocks, e = model.layout(), Blocks.of(traces), _left(model, traces)
    weight = (2.0 / ((tau + blocks.misfit(e)) * blocks.counts))[blocks.index]
    hessian = jacobian.T @ (weight[:, None] * jacobian)
    inverse, beside = _inverse(hessian), _without_each(model, layout, hessian)
    found: list[list[tuple[np.ndarray, float]]] = []
    for effect in (e for e in BY_NAME.values() if not (e.name in model.names or e.once or _is_in(e, model))):
        own = []
        for start in (starts := effect.starts(model.scales))[:1] + starts[1:][-1:]:
            secant = residuals(model.with_effect(effect.name, start), traces, OBSERVER_RATE) - e
            if np.all(np.isfinite(secant)):
                pull, whole = jacobian.T @ (weight * secant), float(secant @ (weight * secant))
                shift, apart = inverse @ pull, whole - float(pull @ inverse @ pull)
                for mine, others in beside:
                    if apart < DOUBT.same * (whole - float(pull @ others @ pull)):
                        shift = np.where(mine, 0.0, shift)
                own.append((shift, 0.5 * apart))
        found += [own] if own else []
    every = [(shift, gain, 1.0 / (len(own) * len(found))) for own in found for shift, gain in own]
    moved, gains, shares = zip(*every) if every else ((), (), ())
    return Shifts(np.array(moved).reshape(-1, len(layout)), np.array(gains), np.array(shares))


def _without_each(model: Model, layout: Sequence[Free], hessian: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Of each effect of a model: which numbers (k,) are its own, and the inverse (k, k) among the others."""
    found = []
    for name in model.names:
        mine = np.array([f.owner == name for f in layout])
        others, inverse = np.flatnonzero(~mine), np.zeros_like(hessian)
        inverse[np.ix_(others, others)] = _inverse(hessian[np.ix_(others, others)])
        found += [(mine, inverse)] if mine.any() else []
    return found


def _inverse(hessian: np.ndarray) -> np.ndarray:
    return np.linalg.pinv(hessian + 1e-12 * np.trace(hessian) * np.eye(len(hessian)), rcond=1e-12)
