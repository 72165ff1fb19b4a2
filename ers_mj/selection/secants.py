"""What an effect promises to explain of what a model leaves: to first order along the model's own motion, and by
simulated secants.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from ers_mj.data.prepared import Blocks, Trace
from ers_mj.effects import BY_NAME, Effect
from ers_mj.estimation.jacobian import central_jacobian
from ers_mj.estimation.objective import Run, residuals
from ers_mj.estimation.sparse import strides
from ers_mj.selection.budget import SEARCH, Search
from ers_mj.servo.model import OBSERVER_RATE, Columns, Model

MOST = 0.5  # of what is left, in the recordings by which starts are chosen
# [sigma] from which a tangent has left its motion, as those of a stiff bristle may, and promises nothing
RUNAWAY = 1e12


@dataclass(frozen=True)
class Target:
    """What is to be explained at one weighting: the square roots of the weights (N,), an orthonormal basis (N, k) of
    what the model's own parameters can do, the weighted residual (N,) that they leave, and how the basis makes up their
    slopes, (k, k).
    """

    root: np.ndarray
    basis: np.ndarray
    residual: np.ndarray
    slopes: np.ndarray

    @cached_property
    def power(self) -> float:
        """The squared size of the residual."""
        return float(self.residual @ self.residual)


@dataclass(frozen=True)
class View:
    """What a place shows: its run along the traces, and the targets there, at the weights of C and at those of least
    squares: the first see a small effect beside the noise, the second a large one that the baseline could not swallow.
    """

    run: Run
    targets: Sequence[Target]
    traces: Sequence[Trace]
    search: Search = SEARCH

    @property
    def place(self) -> Model:
        return self.run.model

    def beside(self, change: np.ndarray, target: Target) -> Model:
        """The place with its own numbers where they make the best of a ``change`` (N,) of what it leaves, to first
        order; those that rest at a bound stay.
        """
        layout = [f for f in self.place.layout() if not self.place.at_bound(f)]
        pull = target.basis.T @ (target.root * (self.run.left + change))
        size = np.maximum(np.linalg.norm(target.slopes, axis=0), 1e-300)
        way = -np.linalg.lstsq(target.slopes / size, pull, rcond=self.search.telling)[0] / size
        way *= min(1.0, self.search.aside / max(float(np.max(np.abs(way), initial=0.0)), 1e-300))
        return self.place.at(layout, self.place.vector(layout) + way)

    def secant(self, effect: Effect, start: np.ndarray) -> np.ndarray:
        """What the effect at a start changes of what the run leaves (N,)."""
        return residuals(self.place.with_effect(effect.name, start), self.traces, OBSERVER_RATE) - self.run.left

    def ends(self, effect: Effect) -> np.ndarray:
        """Ends (G + 1,) of the spans of samples in which a wave may have a phase of its own: each recording, or all of
        them together.
        """
        ends = np.cumsum([0, *(t.rows for t in self.traces)])
        return ends if effect.local and effect.wave else ends[[0, -1]]

    def tried(self, size: float) -> float:
        """A size as far as the screening goes."""
        return math.copysign(min(max(abs(size), self.search.least_size), self.search.most_size), size)

    def is_another(self, factor: float) -> bool:
        """Whether what a secant asks for is another size than that at which it was taken."""
        return not 1.0 / self.search.another < factor < self.search.another

    @cached_property
    def foremost(self) -> View:
        """The view of the recordings that leave most, as few as hold MOST of it together: enough to choose by. All of
        them where the model tells them apart.
        """
        target, ends = self.targets[0], np.cumsum([0, *(trace.rows for trace in self.traces)])
        powers = np.add.reduceat(target.residual**2, ends[:-1])
        order = np.argsort(-powers, kind="stable")
        enough = int(np.searchsorted(np.cumsum(powers[order]), MOST * target.power)) + 1
        if self.place.states or self.place.local or enough >= len(self.traces):
            return self
        records = sorted(order[:enough].tolist())
        rows = np.concatenate([np.arange(ends[k], ends[k + 1]) for k in records])
        fewer = [_target(t.root[rows], t.basis[rows] @ t.slopes, t.residual[rows]) for t in self.targets]
        place, motions = self.place.of_records(records), tuple(self.run.motions[k] for k in records)
        return View(Run(place, self.run.left[rows], motions), fewer, [self.traces[k] for k in records], self.search)

    def sparse(self) -> View:
        """The view with few samples (see estimation.sparse): enough to choose by among many waves. (Of a friction that
        follows the current the first order tells nothing at such samples.)
        """
        apart = strides(self.traces)
        if max(apart) == 1:
            return self
        begins = np.cumsum([0, *(trace.rows for trace in self.traces)])
        rows, shares = [], []
        for begin, stride, trace in zip(begins, apart, self.traces):
            some = np.arange(begin, begin + trace.rows).reshape(-1, trace.t.size)[:, ::stride].ravel()
            rows.append(some)
            shares.append(np.full(some.size, math.sqrt(stride)))
        kept, weight = np.concatenate(rows), np.concatenate(shares)
        fewer = [
            _target(t.root[kept] * weight, t.basis[kept] @ t.slopes * weight[:, None], t.residual[kept] * weight)
            for t in self.targets
        ]
        motions = tuple(np.ascontiguousarray(motion[::stride]) for motion, stride in zip(self.run.motions, apart))
        run = Run(self.place, self.run.left[kept], motions)
        return View(run, fewer, [t.sparse(stride) for t, stride in zip(self.traces, apart)], self.search)


def _target(root: np.ndarray, slopes: np.ndarray, residual: np.ndarray) -> Target:
    """The target of weighted slopes (N, k) and residual (N,)."""
    basis, made_up = np.linalg.qr(slopes)
    return Target(root, basis, residual, made_up)


def view_of(run: Run, traces: Sequence[Trace], tau: float, search: Search = SEARCH) -> tuple[View, Columns]:
    """What a run shows, and the Jacobian's columns at its place.

    A parameter that rests at its bound follows nothing: what would push it further, as an inductance does a time
    constant, is left to the effects.
    """
    place, e = run.model, run.left
    blocks, layout = Blocks.of(traces), place.layout()
    m = blocks.misfit(e)
    jacobian = central_jacobian(place, layout, place.vector(layout), traces, OBSERVER_RATE)  # refits borrow it
    free, targets = np.array([not place.at_bound(f) for f in layout], bool), []
    for level in dict.fromkeys((tau, max(tau, float(np.mean(m))))):
        root = np.sqrt(2.0 / ((level + m) * blocks.counts))[blocks.index]
        basis, slopes = np.linalg.qr(jacobian[:, free] * root[:, None])
        targets.append(Target(root, basis, root * e - basis @ (basis.T @ (root * e)), slopes))
    return View(run, targets, traces, search), {f.key: column for f, column in zip(layout, jacobian.T)}


# -- to first order ----------------------------------------------------------------------------------------------------


def first_order(view: View, effect: Effect, starts: Sequence[np.ndarray]) -> list[tuple[float, float]]:
    """The share that each start of an effect promises to first order along a place's own motion, and the multiple of it
    that does; nothing where that tells too little.

    The tangents of one body are near enough to choose by, whatever stops, delays, sensors and a motor that a shaft or a
    play parts from the rudder make of them; along a rudder that bends a bristle, where they may run away, only laws
    with many starts are asked, and no size told.
    """
    bends = view.place.plant().bends
    is_law = bool(effect.torque or effect.friction)
    if not starts or effect.once or not effect.tangible or bends and not (is_law and is_chosen(effect, starts)):
        return []
    waves, ends, changes = 2 if effect.wave else 1, view.ends(effect), _tangents(view, effect, starts)
    told = [_shares(changes, waves, ends, target, effect.signed) for target in view.targets]
    return [
        max((float(shares[k]), 1.0 if bends else _size(multiples[k])) for shares, multiples in told)
        for k in range(len(starts))
    ]


def _tangents(view: View, effect: Effect, starts: Sequence[np.ndarray]) -> np.ndarray:
    """What each start changes to first order of what the run leaves (starts, N), a wave a quarter period on as well; 0
    where the tangent has run away.
    """
    place, motions = _of_one_body(view.place), view.run.motions
    if effect.at_motor and place is not view.place:  # along the motor's angle, of which its law is
        motions = tuple(np.ascontiguousarray(motion[:, [3, 1, 2, 3]]) for motion in motions)
    every = [turned for start in starts for turned in ((start, _quarter(effect, start)) if effect.wave else (start,))]
    others = [place.with_effect(effect.name, s) for s in every]
    changes = -place.changes(view.traces, OBSERVER_RATE, others, 1.0, motions).T
    changes[~(np.max(np.abs(changes), axis=1) < RUNAWAY)] = 0.0
    return changes


def is_chosen(effect: Effect, starts: Sequence[np.ndarray], tries: int | None = None) -> bool:
    """Whether an effect has more starts than are tried, of which the first order tells the best."""
    return len(starts) > (effect.tries if tries is None else tries) + 1


def by_recordings(view: View, effect: Effect, starts: Sequence[np.ndarray], most: int) -> Sequence[np.ndarray]:
    """The starts of an effect that no first order tells, of many as many as promise ``most`` in the recordings that
    leave most.
    """
    fewer = view.foremost
    if fewer is view or len(starts) <= most:
        return starts
    shares = {k: found[0] for k, start in enumerate(starts) if (found := promise(fewer, effect, start, 1.0))}
    return [starts[k] for k in sorted(sorted(shares, key=lambda k: -shares[k])[:most])]


def hopeful(
    effect: Effect, starts: Sequence[np.ndarray], told: Sequence[tuple[float, float]], tries: int
) -> list[tuple[np.ndarray, float]]:
    """The starts, of many those that promise most to first order, and the multiples of them that do; 1 where the first
    order was not asked or has none.
    """
    sizes = [size if np.isfinite(size) and size else 1.0 for _, size in told] or [1.0] * len(starts)
    chosen = list(range(len(starts)))
    if is_chosen(effect, starts, tries) and told:
        by_promise = sorted(chosen, key=lambda i: -told[i][0])
        chosen = sorted(of_each_form(by_promise, lambda i: starts[i])[:tries])
    return [(starts[i], sizes[i]) for i in chosen]


def of_each_form(found: Sequence, start_of: Callable[..., np.ndarray]) -> list:
    """What belongs to starts, the best first, with the best of each form (which of its parameters are absent) before
    the others.
    """
    forms = [tuple(np.isfinite(start_of(item))) for item in found]
    first = [forms[k] not in forms[:k] for k in range(len(forms))]
    return [p for p, is_first in zip(found, first) if is_first] + [
        p for p, is_first in zip(found, first) if not is_first
    ]


def _of_one_body(model: Model) -> Model:
    """The model without what parts the motor from the rudder."""
    for name in model.names:
        if BY_NAME[name].subsystem == "transmission" and model.plant().has_motor_side:
            model = model.without_effect(name)
    return model


def _size(multiples: np.ndarray) -> float:
    """How many times a start a mixture (G, waves) of it is: of a wave the root of its mean square over the spans, else
    signed.
    """
    if multiples.shape[1] == 1:
        return float(multiples[0, 0])
    return math.sqrt(float(np.mean(np.sum(multiples**2, axis=1))))


# -- by simulated secants ----------------------------------------------------------------------------------------------


def promise(view: View, effect: Effect, start: np.ndarray, size: float) -> tuple[float, Model] | None:
    """Share of the residual that the start's secant explains, and the model with the start as large as the secant asks
    for.

    A secant across a large step bends, or is all stick and slip that fork; where the effect is proportional to its
    leading parameters it is taken at the ``size`` that the first order tells, again at the size that it asks for if
    that is another, and what that one asks for is where a refit begins.
    """
    if effect.wave and np.isfinite(start[effect.wave[1]]):
        return _promise_of_wave(view, effect, start, size)
    best, ends, size = None, view.ends(effect), view.tried(size) if effect.sized else 1.0
    for _ in range(2 if effect.sized else 1):
        secant = view.secant(effect, _scaled(effect, start, size))
        if not np.all(np.isfinite(secant)):
            break
        told = [_shares(secant[None], 1, ends, target, effect.signed) for target in view.targets]
        share, factor, n = max(
            (float(part[0]), float(multiples[0, 0, 0]), n) for n, (part, multiples) in enumerate(told)
        )
        asked = view.tried(size * factor)
        if best is None or share > best[0]:
            place = view.beside(asked / size * secant, view.targets[n]) if share > 0.0 else view.place
            best = share, place.with_effect(effect.name, _scaled(effect, start, asked))
        size = asked
        if not view.is_another(factor):
            break
    return best


def _scaled(effect: Effect, start: np.ndarray, size: float) -> np.ndarray:
    """The start as many times as large."""
    return np.append(size * start[: effect.sized], start[effect.sized :])


def _promise_of_wave(view: View, effect: Effect, start: np.ndarray, size: float) -> tuple[float, Model] | None:
    """As promise, from the start and its quarter period: their best mixture tells amplitude and phase, in each
    recording its own if local.

    Of a wave that is 20 times too large, as a small cog's start may be, the rudder sticks and slips elsewhere, and its
    secants tell no more than the size to try; what a sensor adds to its reading moves nothing.
    """
    amplitudes, phase = list(effect.wave[0]), effect.wave[1]
    best, ends, begun, size = None, view.ends(effect), start.copy(), view.tried(size)
    for _ in range(1 if effect.subsystem == "sensor" else 2):
        begun[amplitudes] = size * start[amplitudes]
        secants = [view.secant(effect, s) for s in (begun, _quarter(effect, begun))]
        if not np.all(np.isfinite(secants)):
            break
        (share,), (mixture,) = max(
            (_shares(np.array(secants), 2, ends, target, True) for target in view.targets),
            key=lambda found: found[0][0],
        )
        turns, factor = np.arctan2(mixture[:, 1], mixture[:, 0]), _size(mixture)
        size = view.tried(size * factor)
        if best is None or share > best[0]:
            found = begun.copy()
            found[amplitudes] = size * start[amplitudes]
            found[phase] += turns[0]
            model = view.place.with_effect(effect.name, found)
            if effect.local:
                model.local[effect.name][:, effect.local_columns.index(phase)] = start[phase] + turns
            best = float(share), model
        if not view.is_another(factor):
            break
    return best


def _quarter(effect: Effect, start: np.ndarray) -> np.ndarray:
    """The start of a wave a quarter period on."""
    turned = start.copy()
    turned[effect.wave[1]] += 0.5 * math.pi
    return turned


def _shares(
    changes: np.ndarray, waves: int, ends: np.ndarray, target: Target, signed: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Shares (S,) of a target that every ``waves`` rows of changes (S waves, N) explain together, and the multiples of
    them that do.

    The multiples (S, G, waves) are their own in each of the G spans that ``ends`` (G + 1,) bound; where the effect is
    not ``signed`` they are positive.
    """
    weighted = target.root * changes
    spans = [slice(a, b) for a, b in pairwise(ends)]
    known = np.stack([weighted[:, s] @ target.basis[s] for s in spans], axis=1)
    pulls = -np.stack([weighted[:, s] @ target.residual[s] for s in spans], axis=1)
    shares, multiples = np.zeros(len(changes) // waves), np.zeros((len(changes) // waves, len(spans), waves))
    for k in range(shares.size):
        rows = slice(k * waves, (k + 1) * waves)
        columns = known[rows].transpose(1, 0, 2).reshape(len(spans) * waves, -1)
        gram, pull = -columns @ columns.T, pulls[rows].T.ravel()
        for g, s in enumerate(spans):
            own = weighted[rows, s]
            gram[g * waves : (g + 1) * waves, g * waves : (g + 1) * waves] += own @ own.T
        if np.trace(gram) <= 1e-12 or (pull[0] <= 0 and not signed):
            continue
        found = np.linalg.lstsq(gram, pull, rcond=1e-12)[0]
        shares[k], multiples[k] = float(pull @ found) / target.power, found.reshape(len(spans), waves)
    return shares, multiples
