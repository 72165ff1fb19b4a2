"""Which effects promise to explain what a model leaves? Simulated secants, before anything is refitted."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.prepared import BLOCK, Blocks, Trace
from ers_mj.effects import BY_NAME, Effect
from ers_mj.estimation.fit import Run, central_jacobian, residuals, run_of, score
from ers_mj.selection.impulse_search import knocks
from ers_mj.servo.model import OBSERVER_RATE, Columns, Model

MOST_SENT, MOST_BENT, LATER = (
    10,
    14,
    8,
)  # candidates of the screening that are refitted at most, in the first round, there if bent, and beside an effect
PROMISING, PROMISING_DEAR = 0.25, 0.6  # share of the best one's promise from which a candidate is refitted
LESS = (
    0.1  # share of the best one's promise from which an effect is screened from further places where the first is bent
)
# share of the promise from which an effect is refitted, below which what it promises to first order is not followed up
UNLIKELY = 0.1
LEAST_PROMISE = 0.6  # of the gain that matters, that the secant of a candidate must promise where a model is quiet
LEAST_SIZE, MOST_SIZE = 0.002, 3.0  # of a start's visible size, to which the screening may scale it
HOTTEST, KNOCKS = (
    3,
    (0.08, 0.25),
)  # blocks in which a knock is looked for, and the lengths [s] from which its fit is begun
LEAST_KNOCK = (
    3.0  # of C that a recording must leave for a knock to be looked for: half of what one must buy (selection.ONCE)
)
# factor by which a block's tau + misfit must fall, more than a fork of stick and slip makes (see evaluation.NULL_PEAK)
PEAK = 30.0
USUAL = 0.95  # share of the blocks that are no worse than a bad one
HALF_NORMAL = 0.4  # mean of what a normal number is above its median, in its standard deviations
SPARSE = 2e-3  # [s] between the samples that tell a wave's share to first order
RUNAWAY = (
    1e12  # [sigma] from which a tangent has left its motion, as those of a stiff bristle may, and promises nothing
)
ANOTHER = (
    1.5  # times the size at which a secant was taken, or that part of it, from which what it asks for is another size
)


@dataclass(frozen=True)
class Begin:
    """Where a refit begins: the model, and the Jacobian's columns at the place that it extends."""

    model: Model
    known: Columns


@dataclass(frozen=True)
class Screened:
    """What the screening found: the share that each effect promises, and its models to refit, for every place those of
    its best starts.
    """

    promises: Mapping[str, float]
    begins: Mapping[str, Sequence[Sequence[Begin]]]
    floor: float
    most: int

    def promising(self, failed: Sequence[str] = ()) -> list[str]:
        """The effects that are refitted, the most promising first.

        Neither a knock's promise, what it gains as it is, is a measure for the others' secants, nor that of an effect
        whose refit ``failed``: where stick and slip fork, a secant may be all chance.
        """
        best = sorted((name for name in self.promises if name in self.begins), key=self.promises.get, reverse=True)[
            : self.most
        ]
        bar = max((self.promises[name] for name in best if not BY_NAME[name].once and name not in failed), default=0.0)
        return [
            name
            for name in best
            if self.promises[name] >= max(self.floor, (PROMISING_DEAR if BY_NAME[name].dear else PROMISING) * bar)
        ]


def screen(
    places: Sequence[Model],
    traces: Sequence[Trace],
    tau: float,
    exclude: Sequence[str],
    bent: bool,
    quiet: bool,
    tries: int = 0,
    least: float = 0.0,
) -> Screened:
    """The promises of all effects, and the models to refit.

    From each place (the refitted baseline first, and where else a fit may start from) the secant e(with effect) -
    e(without) is taken at the start's visible size, and what the place's own parameters could do as well is projected
    out. An effect's promise is the largest share of the weighted residual that a secant explains, at the weights of C
    and at those of least squares: the first see a small effect beside the noise, the second a large one that the
    baseline could not swallow. Which effects are refitted follows from the first place, or from all of them where it is
    far from the noise, ``bent`` by what is missing (from the further ones of those with LESS of the best one's promise
    so far): MOST_SENT (MOST_BENT) at most, those with PROMISING of the best one's promise, and where it is ``quiet``
    those whose share of what is left is worth LEAST_PROMISE of the ``least`` gain that matters. (How far C lies above
    zero is no such sign: it hangs on the noise, which is an estimate.) What to first order promises UNLIKELY of that,
    or of what follows from the second best promise, is not simulated; beside a bristle, where tangents may run away,
    what they tell only chooses among starts.

    A knock is looked for from the first place only, what is dear to simulate is refitted from its most promising one,
    and each effect from as many starts as it declares, or ``tries`` if more.
    """
    names, floor, most = (
        [name for name in BY_NAME if name not in exclude],
        0.0,
        LATER if places[0].names else MOST_BENT if bent else MOST_SENT,
    )
    promises, begins = {}, {}
    for place in places:
        run = run_of(place, traces, OBSERVER_RATE)
        e = run.left
        if not np.all(np.isfinite(e)):
            continue
        (known, targets), scales = _targets(place, e, traces, tau), replace(place.scales, hot=_hot(e, traces, tau))
        if quiet and not floor:
            floor = 2.0 * LEAST_PROMISE * least / float(targets[0][2] @ targets[0][2])
        whole, sparse = (run, targets, traces), _sparse(run, targets, traces)
        starts = {name: BY_NAME[name].starts(scales) for name in names if place is places[0] or not BY_NAME[name].once}
        first = {
            name: _first_order(*(sparse if BY_NAME[name].wave else whole), BY_NAME[name], some)
            for name, some in starts.items()
        }
        shares = {name: max((share for share, _ in told), default=math.inf) for name, told in first.items()}
        for name in sorted(starts, key=lambda name: -shares[name]):
            effect, most_tried = BY_NAME[name], max(BY_NAME[name].tries, tries)
            second = sorted((0.0, 0.0, *(promise for other, promise in promises.items() if not BY_NAME[other].once)))[
                -2
            ]  # the best one's may be a fork
            if shares[name] < UNLIKELY * max(floor, PROMISING * second) and not place.plant().bends:
                promises.setdefault(name, shares[name])
                continue
            if effect.once:
                found = knocks(run, effect, starts[name], targets[0][2], traces, tau)
            else:
                found = [
                    p
                    for start, size in _hopeful(effect, starts[name], first[name], most_tried)
                    if (p := _promise(place, effect, start, size, e, targets, traces))
                ]
            if found:
                found.sort(key=lambda p: -p[0])
                begun = [
                    Begin(model, known) for _, model in _of_each_form(found, lambda p: p[1].effects[-1][1])[:most_tried]
                ]
                if not effect.dear:
                    begins.setdefault(name, []).append(begun)
                elif found[0][0] > promises.get(name, 0.0):
                    begins[name] = [begun]
                if bent or place is places[0]:
                    promises[name] = max(promises.get(name, 0.0), found[0][0])
        bar = LESS * max(promises.values(), default=0.0)
        names = (
            [name for name in names if promises.get(name, 0.0) >= bar]
            if bent
            else Screened(promises, begins, floor, most).promising()
        )
    return Screened(promises, begins, floor, most)


def stands_out(misfit: np.ndarray, tau: float) -> bool:
    """Whether a block (B,) is PEAK times beyond what a model that is wrong leaves in many others."""
    scores = score(misfit, tau)
    return float(scores.max()) >= max(float(np.quantile(scores, USUAL)), 0.0) + math.log(PEAK)


def attainable(misfit: np.ndarray, counts: np.ndarray, tau: float) -> float:
    """What C would fall by, were no block (B,) worse than the noise, or than half of them where that is less; beyond
    what noise makes of ``counts`` samples.
    """
    level = min(1.0, float(np.median(misfit)))
    left = float(np.sum(np.maximum(score(misfit, tau) - score(level, tau), 0.0)))
    return left - HALF_NORMAL * level / (tau + level) * float(np.sum(np.sqrt(2.0 / counts)))


def _of_each_form(found: Sequence, start_of: Callable[..., np.ndarray]) -> list:
    """What belongs to starts, the best first, with the best of each form (which of its parameters are absent) before
    the others.
    """
    forms = [tuple(np.isfinite(start_of(item))) for item in found]
    return [p for k, p in enumerate(found) if forms[k] not in forms[:k]] + [
        p for k, p in enumerate(found) if forms[k] in forms[:k]
    ]


def _sparse(run: Run, targets, traces: Sequence[Trace]) -> tuple[Run, list, list[Trace]]:
    """The run, what is to be explained and the traces with samples SPARSE apart, where they are uniform: enough to
    choose by among many waves. (Of a friction that follows the current the first order tells nothing at such samples.)
    """
    strides = [max(1, int(SPARSE / trace.sample_time + 0.01)) if trace.is_uniform else 1 for trace in traces]
    if max(strides) == 1:
        return run, targets, traces
    begins = np.cumsum([0, *(trace.rows for trace in traces)])
    rows, shares = [], []
    for begin, stride, trace in zip(begins, strides, traces):
        some = np.arange(begin, begin + trace.rows).reshape(-1, trace.t.size)[:, ::stride].ravel()
        rows.append(some)
        shares.append(np.full(some.size, math.sqrt(stride)))
    rows, shares = np.concatenate(rows), np.concatenate(shares)
    fewer = [
        (root[rows] * shares, np.linalg.qr(basis[rows] * shares[:, None])[0], residual[rows] * shares)
        for root, basis, residual in targets
    ]
    motions = tuple(np.ascontiguousarray(motion[::stride]) for motion, stride in zip(run.motions, strides))
    return (
        Run(run.model, run.left[rows], motions),
        fewer,
        [trace.sparse(stride) for trace, stride in zip(traces, strides)],
    )


def _first_order(
    run: Run, targets, traces: Sequence[Trace], effect: Effect, starts: Sequence[np.ndarray]
) -> list[tuple[float, float]]:
    """The share that each start of an effect promises to first order along a place's own motion, and the multiple of it
    that does; nothing where that tells too little.

    The tangents of one body are near enough to choose by, whatever stops, delays, sensors and a motor that a shaft or a
    play parts from the rudder make of them; along a rudder that bends a bristle, where they may run away, only laws
    with many starts are asked, and no size told.
    """
    bends = run.model.plant().bends
    if not starts or effect.once or not effect.tangible or bends and not _is_chosen(effect, starts):
        return []
    place, motions = _of_one_body(run.model), run.motions
    if effect.at_motor and place is not run.model:
        motions = [
            np.ascontiguousarray(motion[:, [3, 1, 2, 3]]) for motion in motions
        ]  # along the motor's angle, of which its law is
    waves = 2 if effect.wave else 1
    every = [turned for start in starts for turned in ((start, _quarter(effect, start)) if effect.wave else (start,))]
    changes = -place.changes(traces, OBSERVER_RATE, [place.with_effect(effect.name, s) for s in every], 1.0, motions).T
    changes[~(np.max(np.abs(changes), axis=1) < RUNAWAY)] = 0.0
    ends = _ends(effect, traces)
    told = [_shares(changes, waves, ends, target, effect.signed) for target in targets]
    return [
        max((float(shares[k]), 1.0 if bends else _size(multiples[k])) for shares, multiples in told)
        for k in range(len(starts))
    ]


def _is_chosen(effect: Effect, starts: Sequence[np.ndarray], tries: int | None = None) -> bool:
    """Whether an effect has more starts than are tried, of which the first order tells the best: those of a law."""
    return len(starts) > (effect.tries if tries is None else tries) + 1 and bool(effect.torque or effect.friction)


def _hopeful(
    effect: Effect, starts: Sequence[np.ndarray], told: Sequence[tuple[float, float]], tries: int
) -> list[tuple[np.ndarray, float]]:
    """The starts, of many those that promise most to first order, and the multiples of them that do; 1 where the first
    order was not asked or has none.
    """
    sizes = [size if np.isfinite(size) and size else 1.0 for _, size in told] or [1.0] * len(starts)
    chosen = range(len(starts))
    if _is_chosen(effect, starts, tries) and told:
        chosen = sorted(_of_each_form(sorted(chosen, key=lambda i: -told[i][0]), lambda i: starts[i])[:tries])
    return [(starts[i], sizes[i]) for i in chosen]


def _size(multiples: np.ndarray) -> float:
    """How many times a start a mixture (G, waves) of it is: of a wave the root of its mean square over the spans, else
    signed.
    """
    return (
        float(multiples[0, 0]) if multiples.shape[1] == 1 else math.sqrt(float(np.mean(np.sum(multiples**2, axis=1))))
    )


def _tried(size: float) -> float:
    """A size as far as the screening goes."""
    return math.copysign(min(max(abs(size), LEAST_SIZE), MOST_SIZE), size)


def _of_one_body(model: Model) -> Model:
    """The model without what parts the motor from the rudder."""
    for name in model.names:
        if BY_NAME[name].subsystem == "transmission" and model.plant().has_motor_side:
            model = model.without_effect(name)
    return model


def _targets(place: Model, e: np.ndarray, traces: Sequence[Trace], tau: float):
    """The Jacobian's columns at the place, and at either weighting (weights (N,), orthonormal basis (N, k) of the
    place's own parameters, weighted residual (N,) of what it leaves, ``e``, beside it).

    A parameter that rests at its bound follows nothing: what would push it further, as an inductance does a time
    constant, is left to the effects.
    """
    blocks, layout = Blocks.of(traces), place.layout()
    m = blocks.misfit(e)
    jacobian = central_jacobian(place, layout, place.vector(layout), traces, OBSERVER_RATE)
    free, out = np.array([not place.at_bound(f) for f in layout], bool), []
    for level in (tau, max(tau, float(np.mean(m)))):
        root = np.sqrt(2.0 / ((level + m) * blocks.counts))[blocks.index]
        basis, _ = np.linalg.qr(jacobian[:, free] * root[:, None])
        out.append((root, basis, root * e - basis @ (basis.T @ (root * e))))
    return {f.key: column for f, column in zip(layout, jacobian.T)}, out


def _promise(place, effect, start, size, e, targets, traces) -> tuple[float, Model] | None:
    """Share of the residual that the start's secant explains, and the model with the start as large as the secant asks
    for.

    A secant across a large step bends, or is all stick and slip that fork; where the effect is proportional to its
    leading parameters it is taken at the ``size`` that the first order tells, again at the size that it asks for if
    that is ANOTHER, and what that one asks for is where a refit begins.
    """
    if effect.wave and np.isfinite(start[effect.wave[1]]):
        return _promise_of_wave(place, effect, start, size, e, targets, traces)
    best, ends, size = None, _ends(effect, traces), _tried(size) if effect.sized else 1.0
    for _ in range(2 if effect.sized else 1):
        secant = residuals(place.with_effect(effect.name, _scaled(effect, start, size)), traces, OBSERVER_RATE) - e
        if not np.all(np.isfinite(secant)):
            break
        share, factor = max(
            (float(part[0]), float(multiples[0, 0, 0]))
            for part, multiples in (_shares(secant[None], 1, ends, target, effect.signed) for target in targets)
        )
        size = _tried(size * factor)
        if best is None or share > best[0]:
            best = share, place.with_effect(effect.name, _scaled(effect, start, size))
        if 1.0 / ANOTHER < factor < ANOTHER:
            break
    return best


def _scaled(effect: Effect, start: np.ndarray, size: float) -> np.ndarray:
    """The start as many times as large."""
    return np.append(size * start[: effect.sized], start[effect.sized :])


def _promise_of_wave(place, effect, start, size, e, targets, traces) -> tuple[float, Model] | None:
    """As _promise, from the start and its quarter period: their best mixture tells amplitude and phase, in each
    recording its own if local.

    Of a wave that is 20 times too large, as a small cog's start may be, the rudder sticks and slips elsewhere, and its
    secants tell no more than the size to try; what a sensor adds to its reading moves nothing.
    """
    amplitudes, phase = list(effect.wave[0]), effect.wave[1]
    best, ends, begun, size = None, _ends(effect, traces), start.copy(), _tried(size)
    for _ in range(1 if effect.subsystem == "sensor" else 2):
        begun[amplitudes] = size * start[amplitudes]
        secants = [
            residuals(place.with_effect(effect.name, s), traces, OBSERVER_RATE) - e
            for s in (begun, _quarter(effect, begun))
        ]
        if not np.all(np.isfinite(secants)):
            break
        (share,), (mixture,) = max(
            (_shares(np.array(secants), 2, ends, target, True) for target in targets), key=lambda found: found[0][0]
        )
        turns, factor = np.arctan2(mixture[:, 1], mixture[:, 0]), _size(mixture)
        size = _tried(size * factor)
        if best is None or share > best[0]:
            found = begun.copy()
            found[amplitudes] = size * start[amplitudes]
            found[phase] += turns[0]
            model = place.with_effect(effect.name, found)
            if effect.local:
                model.local[effect.name][:, effect.local_columns.index(phase)] = start[phase] + turns
            best = float(share), model
        if 1.0 / ANOTHER < factor < ANOTHER:
            break
    return best


def _shares(
    changes: np.ndarray, waves: int, ends: np.ndarray, target: tuple[np.ndarray, np.ndarray, np.ndarray], signed: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Shares (S,) of a target that every ``waves`` rows of changes (S waves, N) explain together, and the multiples of
    them that do.

    The multiples (S, G, waves) are their own in each of the G spans that ``ends`` (G + 1,) bound; where the effect is
    not ``signed`` they are positive.
    """
    root, basis, residual = target
    weighted = root * changes
    spans = [slice(a, b) for a, b in itertools.pairwise(ends)]
    known = np.stack([weighted[:, s] @ basis[s] for s in spans], axis=1)
    pulls = -np.stack([weighted[:, s] @ residual[s] for s in spans], axis=1)
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
        shares[k], multiples[k] = float(pull @ found) / float(residual @ residual), found.reshape(len(spans), waves)
    return shares, multiples


def _quarter(effect: Effect, start: np.ndarray) -> np.ndarray:
    """The start of a wave a quarter period on."""
    turned = start.copy()
    turned[effect.wave[1]] += 0.5 * math.pi
    return turned


def _ends(effect: Effect, traces: Sequence[Trace]) -> np.ndarray:
    """Ends (G + 1,) of the spans of samples in which a wave may have a phase of its own: each recording, or all of them
    together.
    """
    ends = np.cumsum([0, *(t.rows for t in traces)])
    return ends if effect.local and effect.wave else ends[[0, -1]]


def _hot(e: np.ndarray, traces: Sequence[Trace], tau: float) -> tuple[tuple[int, float, float], ...]:
    """Spans (recording, begin [s], length [s]) around the blocks of largest misfit, where something may have knocked,
    in recordings that leave enough for it.
    """
    blocks = Blocks.of(traces)
    record = np.repeat(np.arange(len(traces)), [t.counts.size * (1 + len(t.channels)) for t in traces])
    within = np.concatenate([np.tile(np.arange(t.counts.size), 1 + len(t.channels)) for t in traces])
    misfit = blocks.misfit(e)
    able = [
        k
        for k in range(len(traces))
        if attainable(misfit[record == k], blocks.counts[record == k], tau) >= LEAST_KNOCK
        or score(misfit[record == k], tau).max() >= math.log(PEAK)
    ]
    worst = [b for b in np.argsort(-score(misfit, tau), kind="stable")[:HOTTEST] if record[b] in able]
    return tuple(
        (int(record[b]), float(traces[record[b]].t[0] + within[b] * BLOCK), length) for b in worst for length in KNOCKS
    )
