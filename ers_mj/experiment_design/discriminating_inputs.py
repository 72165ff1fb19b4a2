"""T-optimal design: how much of the difference between two explanations would another recording show, after a refit?
 Everything is told in the currency of the diagnosis, the block cost C (Atkinson and Fedorov 1975 asked it of squares).
Of each pair the richer model plays the rig and the other one answers, in the observer form that a diagnosis would judge
it in. Its parameters may move to swallow the difference, as far as the recordings at hand let them: the curvature of
their C is the price.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.excitation import GENTLE, SHARES, Limits, excitations, signal
from ers_mj.data.prepared import Blocks, Signals, Trace, make_trace
from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import Fit, step_of
from ers_mj.servo.model import OBSERVER_RATE, STATES, Free, Model

DESIGN, DESIGN_SAMPLES = (
    3.0,
    3000,
)  # [s] and samples, whichever is longer, of the short recording that inputs are ranked on
DESIGN_RATE, CHECK_RATE = (
    1000.0,
    2000.0,
)  # [Hz] up to which inputs are ranked and checked: the events between samples are exact
REFITTED = 8  # inputs at most for which the linear refit is taken
CHECKED = 2  # of these, how many at most are simulated at full length
SETTLED = math.log(19.0)  # of C: odds at which the wrong one has a probability of 5 %
STEPS, JACOBIANS = 8, 2  # of a true refit, at most
DRAWS, FAR = 32, 0.3  # of the rig's numbers, and how far a draw may take one of them (its slopes bend)
VAGUE = 3.0  # standard deviation (of a logarithm, or over the value) of a number of which nothing is known
UNSEEN = 1e-12  # curvature of a number that no recording shows
LEAST_STEP = 0.05  # of C, at which it ends
CHANNELS: Mapping[str, float | None] = {
    "i_A": 0.01,
    "theta_m_rad": None,
    "vin_V": 0.005,
}  # noise over the peak (None: the output's own)


@dataclass(frozen=True)
class Explanation:
    """A fitted model made ready for a recording that does not exist yet.

    That recording is number 1 of two: what differs from one to the next is free in it. ``known`` (k, k) is the
    curvature of C over the recordings at hand, in the numbers z (k,) of ``layout``.
    """

    name: str
    model: Model
    layout: Sequence[Free]
    z: np.ndarray
    known: np.ndarray

    @staticmethod
    def of(name: str, found: Fit) -> Explanation:
        model = found.model.of_records([0, 0])
        for state in found.model.states or {}:
            model = model.with_state(state, 2)
        layout = model.layout()
        return Explanation(name, model, layout, model.vector(layout), _known(found, layout))

    def at(self, z: np.ndarray) -> Model:
        """The model with other numbers."""
        return self.model.at(self.layout, z)


def _known(found: Fit, layout: Sequence[Free]) -> np.ndarray:
    """The curvature of the fit in the numbers of another layout; what belongs to one recording only is refitted beside
    them.
    """
    old = found.model.layout()
    if len(old) != found.size:
        raise ValueError(f"the fit's curvature is of {found.size} numbers, its model has {len(old)}")
    shared = [i for i, f in enumerate(old) if not f.local and f.owner not in STATES]
    single = [i for i in range(len(old)) if i not in shared]
    curvature = found.hessian[np.ix_(shared, shared)]
    if single:
        cross = found.hessian[np.ix_(shared, single)]
        curvature = curvature - cross @ np.linalg.pinv(found.hessian[np.ix_(single, single)], rcond=1e-12) @ cross.T
    place = {old[i].key: k for k, i in enumerate(shared)}
    out = np.zeros((len(layout), len(layout)))
    both = [(i, place[f.key]) for i, f in enumerate(layout) if not f.local and f.owner not in STATES and f.key in place]
    new, known = ([pair[k] for pair in both] for k in (0, 1))
    out[np.ix_(new, new)] = curvature[np.ix_(known, known)]
    for i, f in enumerate(layout):
        if f.prior and (f.local or f.owner in STATES):
            out[i, i] += 1.0 / f.prior[1] ** 2
    return out


@dataclass
class Bench:
    """Where explanations are tried out: the limits, the noise [output unit], and the ``level`` of misfit that the
    leader leaves (1: noise).
    """

    limits: Limits
    sigma: float
    level: float
    tau: float
    simulations: int = 0

    @property
    def floor(self) -> float:
        """What a block of misfit stands above in C."""
        return self.tau + self.level

    def trace(self, excitation: Mapping, duration: float, rate: float) -> Trace:
        """An empty recording of an excitation."""
        t, u = signal({**excitation, "duration_s": duration, "rate_hz": min(rate, excitation["rate_hz"])})
        return make_trace("next", Signals.empty(t, u), self.sigma, start=(excitation["start"], 0.0))

    def filled(self, model: Model, trace: Trace) -> Trace | None:
        """The recording as the model would make it, without noise; None where the motion leaves the limits."""
        self.simulations += 1
        y = model.predict(trace, 1)
        return replace(trace, y=y) if self.limits.holds(y) else None

    def misses(self, model: Model, trace: Trace) -> np.ndarray:
        """What the model misses of a filled recording (N,) [sigma], in observer form."""
        self.simulations += 1
        return (trace.y - model.predict(trace, 1, OBSERVER_RATE)) / trace.sigma

    def noise(self, trace: Trace) -> np.ndarray:
        """What the rig's sensor and its unexplained rest add to a recording (N,) [sigma], the same every time."""
        return math.sqrt(self.level) * np.random.default_rng(1).standard_normal(trace.t.size)

    def forked(self, model: Model, clean: Trace) -> float:
        """C that a model leaves of its own recording beyond the noise, which reaches it by way of the observer and of
        the initial state.

        Under some inputs stick and slip fork on so little; what looks like a difference between explanations there is
        chance.
        """
        noise, blocks, (theta, omega) = self.noise(clean), Blocks.of([clean]), clean.start
        e = self.misses(model, replace(clean, y=clean.y + clean.sigma * noise, start=(theta + clean.sigma, omega)))
        more = np.sum(np.log((self.tau + blocks.misfit(e)) / (self.tau + blocks.misfit(noise))))
        return max(float(more), 0.0) if np.isfinite(more) else math.inf

    def slopes(
        self, one: Explanation, z: np.ndarray, e: np.ndarray, trace: Trace, by: np.ndarray | None = None
    ) -> np.ndarray:
        """Finite differences (N, k) of ``misses``, over steps ``by`` (k,)."""
        by = np.full(z.size, step_of(one.model)) if by is None else by
        columns = [(self.misses(one.at(z + row), trace) - e) / step for row, step in zip(np.diag(by), by)]
        return np.nan_to_num(np.column_stack(columns), nan=0.0, posinf=0.0, neginf=0.0)

    def further(self, model: Model, trace: Trace) -> dict[str, np.ndarray]:
        """What CHANNELS would read (N,): the motor's torque for the current, the motor's side, and the share of the
        supply that is left.
        """
        self.simulations += 1
        plant, run = model.staged(trace, 1, OBSERVER_RATE, None)
        motion = plant.outputs(trace.t, trace.u, **run)[1]
        theta, drive, theta_m, supply = motion[:, 0], motion[:, 2], motion[:, 3], np.ones(trace.t.size)
        for name, values in plant.effects:
            supply = supply * BY_NAME[name].supply_left(values, plant.coefficients, trace.t, motion, drive)
        return {
            "i_A": plant.current(trace.t, motion),
            "theta_m_rad": theta_m if plant.coupled else theta,
            "vin_V": supply,
        }

    def cost(self, misfit: np.ndarray) -> float:
        """C beyond the leader's of blocks that miss this much (B,) more than it does."""
        return float(np.sum(np.log1p(misfit / self.floor)))


# -- two explanations --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Pair:
    """Two explanations: the one that plays the rig, which is the richer, and the one that answers."""

    rig: Explanation
    answer: Explanation

    @staticmethod
    def of(one: Explanation, other: Explanation) -> Pair:
        return Pair(other, one) if other.z.size > one.z.size else Pair(one, other)


@dataclass(frozen=True)
class Check:
    """What remains between two explanations after a true refit.

    ``cost`` is the C expected, net of what the rig's own model may leave (``forked``), ``rms`` the difference [sigma],
    ``noisy`` the C on the noisy recording that was simulated, ``z`` the answer's numbers, ``clean`` the recording
    without noise and ``e`` what the refitted answer misses of it (N,) [sigma].
    """

    cost: float
    forked: float
    rms: float
    noisy: float
    z: np.ndarray
    clean: Trace
    e: np.ndarray

    @property
    def sigmas(self) -> float:
        """The z-score of a normal law that weighs as much as the cost."""
        return math.sqrt(2 * max(self.cost, 0.0))


@dataclass(frozen=True)
class Design:
    """The best input that was found, what the pairs' checks say of it, and how many inputs were tried."""

    excitation: dict
    checks: Sequence[Check]
    tried: int

    @property
    def cost(self) -> float:
        """C that remains between the pair that differs least."""
        return min(c.cost for c in self.checks)


def designed(pairs: Sequence[Pair], bench: Bench) -> Design | None:
    """The input that leaves most between the least different pair, checked at full length; None where no motion stays
    in the travel.
    """
    order, tried = ranked(pairs, bench)
    found: list[Design] = []
    for _, excitation in order:
        checks = [checked(pair, excitation, bench) for pair in pairs]
        found += [Design(excitation, checks, tried)] if None not in checks else []
        if len(found) == CHECKED:
            break
    return max(found, key=lambda d: d.cost, default=None)


def ranked(pairs: Sequence[Pair], bench: Bench) -> tuple[list[tuple[float, dict]], int]:
    """Inputs by what remains of the least different pair after its linear refit, the best first, and how many were
    tried.

    What remains without a refit is an upper bound, by which the search goes, from the best of every shape to the second
    of any. The short recording of the ranking may stay within a travel that the whole one leaves, so this is looked at
    first.
    """
    length = min(bench.limits.duration, max(DESIGN, DESIGN_SAMPLES / min(bench.limits.rate_hz, DESIGN_RATE)))
    rigs = list({id(p.rig): p.rig for p in pairs}.values())
    bounds, tried = [], 0
    for shares in (SHARES, GENTLE):
        for shape in excitations(bench.limits, shares):
            for excitation in shape:
                tried += 1
                trace = bench.trace(excitation, length, DESIGN_RATE)
                filled = {id(rig): bench.filled(rig.model, trace) for rig in rigs}
                if None in filled.values():
                    continue
                e = [bench.misses(p.answer.model, filled[id(p.rig)]) for p in pairs]
                if np.all(np.isfinite(np.concatenate(e))):
                    blocks = Blocks.of([trace])
                    bounds.append(
                        (
                            min(bench.cost(blocks.misfit(x)) for x in e),
                            excitation,
                            [filled[id(p.rig)] for p in pairs],
                            e,
                        )
                    )
        if bounds:
            break
    found: list[tuple[float, dict]] = []
    for bound, excitation, filled, e in _mixed(bounds):
        if len(found) == REFITTED or (len(found) >= CHECKED and bound <= sorted(left for left, _ in found)[-CHECKED]):
            continue
        long = bench.trace(excitation, excitation["duration_s"], DESIGN_RATE)
        if any(bench.filled(x.model, long) is None for pair in pairs for x in (pair.rig, pair.answer)):
            continue
        left = math.inf
        for pair, trace, miss in zip(pairs, filled, e):
            slopes = bench.slopes(pair.answer, pair.answer.z, miss, trace)
            left = min(
                left,
                remains(miss, slopes, pair.answer.known, Blocks.of([trace]), bench)
                - bench.forked(pair.rig.model, trace),
            )
        found.append((left, excitation))
    return sorted(found, key=lambda r: -r[0]), tried


def _mixed(bounds: list) -> list:
    """By their bound, the best of every shape before the second of any."""
    bounds, turn, out = sorted(bounds, key=lambda b: -b[0]), {}, []
    for b in bounds:
        shape = tuple(v for k, v in b[1].items() if k not in ("amplitude", "peak_u"))
        turn[shape] = turn.get(shape, 0) + 1
        out.append((turn[shape], b))
    return [b for _, b in sorted(out, key=lambda item: item[0])]


def remains(
    e: np.ndarray, slopes: np.ndarray, known: np.ndarray, blocks: Blocks, bench: Bench, gone: np.ndarray | float = 0.0
) -> float:
    """C that is left of e (N,) once the numbers have moved along their slopes (N, k), the price of that move included.

    ``gone`` (k,) is how far they are already from where the recordings at hand have them.
    """
    move, best = np.zeros(known.shape[0]), math.inf
    for _ in range(4):
        m = blocks.misfit(e + slopes @ move)
        best = min(best, bench.cost(m) + 0.5 * float((gone + move) @ known @ (gone + move)))
        weight = (2.0 / ((bench.floor + m) * blocks.counts))[blocks.index]
        weighted = slopes * weight[:, None]
        move = -solved(weighted.T @ slopes + known, weighted.T @ e + known @ (gone + np.zeros_like(move)))
    return best


def solved(curvature: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """curvature^-1 slope, scaled, with what nothing determines left where it is."""
    scaled, scale = _scaled(curvature)
    return scale * np.linalg.solve(scaled, scale * slope)


def drawn(curvature: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Numbers (D, k) of covariance curvature^-1 from ``normal`` ones (D, k): some are known a hundred million times
    better than others.
    """
    scaled, scale = _scaled(curvature)
    return scale * np.linalg.solve(np.linalg.cholesky(scaled).T, normal.T).T


def _scaled(curvature: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The curvature with a diagonal of ones, and hardly more, and the scale (k,) that makes it so: 0 for what nothing
    determines.
    """
    diagonal = np.diag(curvature)
    scale = np.where(diagonal > UNSEEN, 1.0 / np.sqrt(np.maximum(diagonal, UNSEEN)), 0.0)
    return curvature * np.outer(scale, scale) + 1e-10 * np.eye(scale.size), scale


def checked(pair: Pair, excitation: dict, bench: Bench) -> Check | None:
    """The pair at full length; None where one of the two leaves the travel."""
    trace = bench.trace(excitation, excitation["duration_s"], CHECK_RATE)
    rig, answer = (bench.filled(x.model, trace) for x in (pair.rig, pair.answer))
    return None if rig is None or answer is None else _check(pair, rig, bench)


def _check(pair: Pair, clean: Trace, bench: Bench) -> Check:
    """True refit of the answer to what the rig would show, on its noise; the price of leaving what is known counts."""
    answer, forked = pair.answer, bench.forked(pair.rig.model, clean)
    noise = bench.noise(clean)
    noisy = replace(clean, y=clean.y + clean.sigma * noise)
    z, cost = _refitted(answer, noisy, bench)
    blocks = Blocks.of([clean])
    e = bench.misses(answer.at(z), clean)
    price = 0.5 * float((z - answer.z) @ answer.known @ (z - answer.z))
    true = float(np.sum(np.log((bench.tau + blocks.misfit(noise)) / bench.floor)))
    return Check(
        bench.cost(blocks.misfit(e)) + price - forked, forked, float(np.sqrt(np.mean(e**2))), cost - true, z, clean, e
    )


def chances(pair: Pair, check: Check, slopes: np.ndarray, bench: Bench) -> np.ndarray:
    """C (DRAWS,) that remains were the rig's numbers others, as far as the recordings at hand leave them open; the
    answer refits each time.

    To first order, as everything here: what the rig's own model would miss of itself with other numbers, the answer
    misses as well. ``slopes`` are the answer's at its refitted numbers.
    """
    rig, blocks = pair.rig, Blocks.of([check.clean])
    own = bench.slopes(rig, rig.z, bench.misses(rig.model, check.clean), check.clean)
    draws = drawn(
        rig.known + np.eye(rig.z.size) / VAGUE**2, np.random.default_rng(2).standard_normal((DRAWS, rig.z.size))
    )
    gone = check.z - pair.answer.z
    return (
        np.array(
            [
                remains(check.e - own @ np.clip(d, -FAR, FAR), slopes, pair.answer.known, blocks, bench, gone)
                for d in draws
            ]
        )
        - check.forked
    )


def _refitted(answer: Explanation, trace: Trace, bench: Bench) -> tuple[np.ndarray, float]:
    """The numbers z that minimise C over the new recording plus the curvature of the old ones, and that sum."""
    blocks, z, damping = Blocks.of([trace]), answer.z, 1e-3

    def evaluate(z):
        e = bench.misses(answer.at(z), trace)
        if not np.all(np.isfinite(e)):
            return e, None, math.inf
        m = blocks.misfit(e)
        return (
            e,
            m,
            float(np.sum(np.log((bench.tau + m) / bench.floor)))
            + 0.5 * float((z - answer.z) @ answer.known @ (z - answer.z)),
        )

    e, m, cost = evaluate(z)
    slopes, fresh = None, 0
    for _ in range(STEPS if m is not None else 0):
        if slopes is None:
            slopes, fresh, new = bench.slopes(answer, z, e, trace), fresh + 1, True
        weighted = slopes * (2.0 / ((bench.tau + m) * blocks.counts))[blocks.index][:, None]
        curvature, slope = weighted.T @ slopes + answer.known, weighted.T @ e + answer.known @ (z - answer.z)
        gain = 0.0
        for _ in range(4 if new else 2):
            step = np.clip(-solved(curvature + damping * np.diag(np.diag(curvature)), slope), -1.0, 1.0)
            goal = answer.at(z + step).vector(answer.layout)
            trial = evaluate(goal)
            if trial[2] < cost:
                moved, gain, damping = goal - z, cost - trial[2], damping / 8
                slopes = slopes + np.outer(trial[0] - e - slopes @ moved, moved / (moved @ moved))
                z, (e, m, cost) = goal, trial
                break
            damping = max(damping * 10, 1e-6)
        if gain < LEAST_STEP:
            if new or fresh == JACOBIANS:
                break
            slopes = None
        new = False
    return z, cost


# -- further channels --------------------------------------------------------------------------------------------------


def channels(pair: Pair, check: Check, slopes: np.ndarray, bench: Bench) -> dict[str, float]:
    """Sigmas that each further channel beside the angle would leave between the two, after one more linear refit of the
    answer.

    Current and supply are taken as known up to a scale and an offset, the motor's angle up to an offset.
    """
    one, clean, e, blocks = pair.answer, check.clean, check.e, Blocks.of([check.clean])
    seen, read = bench.further(pair.rig.model, clean), bench.further(one.at(check.z), clean)
    step = step_of(one.model)
    moved = [bench.further(one.at(check.z + step * row), clean) for row in np.eye(check.z.size)]
    both = Blocks(np.concatenate([blocks.index, blocks.index + blocks.counts.size]), np.tile(blocks.counts, 2))
    out = {}
    for name, noise in CHANNELS.items():
        sigma = noise * float(np.max(np.abs(seen[name]))) if noise else clean.sigma
        free = np.column_stack([read[name], np.ones(clean.t.size)] if noise else [np.ones(clean.t.size)])
        columns = np.column_stack([(read[name] - x[name]) / step for x in moved])
        wide = np.block([[slopes, np.zeros(free.shape)], [columns / sigma, free / sigma]])
        known, gone = np.zeros((wide.shape[1],) * 2), np.zeros(wide.shape[1])
        known[: check.z.size, : check.z.size], gone[: check.z.size] = one.known, check.z - one.z
        stacked = np.concatenate([e, (seen[name] - read[name]) / sigma])
        out[name] = math.sqrt(
            2 * max(remains(np.nan_to_num(stacked), np.nan_to_num(wide), known, both, bench, gone), 0.0)
        )
    return out
