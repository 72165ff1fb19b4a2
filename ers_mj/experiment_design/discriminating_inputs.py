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

from ers_mj.data.excitation import GENTLE, SHARES, excitations
from ers_mj.data.prepared import Blocks, Trace
from ers_mj.estimation.jacobian import step_of
from ers_mj.experiment_design.bench import VAGUE, Bench, Explanation
from ers_mj.experiment_design.refits import drawn, refitted, remains

SETTLED = math.log(19.0)  # of C: odds at which the wrong one has a probability of 5 %


@dataclass(frozen=True)
class Search:
    """How inputs are ranked and the best of them checked."""

    seconds: float = 3.0  # of the short recording that inputs are ranked on, or samples where these are longer
    samples: int = 3000
    rank_hz: float = 1000.0  # up to which inputs are ranked: the events between samples are exact
    check_hz: float = 2000.0  # and checked
    refitted: int = 8  # inputs at most for which the linear refit is taken
    checked: int = 2  # of these, how many at most are simulated at full length
    draws: int = 32  # of the rig's numbers
    far: float = 0.3  # how far a draw may take one of them (its slopes bend)


SEARCH = Search()
CHANNELS: Mapping[str, float | None] = {
    "i_A": 0.01,
    "theta_m_rad": None,
    "vin_V": 0.005,
}  # noise over the peak (None: the output's own)


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
        checks = [check for pair in pairs if (check := checked(pair, excitation, bench)) is not None]
        found += [Design(excitation, checks, tried)] if len(checks) == len(pairs) else []
        if len(found) == SEARCH.checked:
            break
    return max(found, key=lambda d: d.cost, default=None)


@dataclass(frozen=True, eq=False)
class Tried:
    """An input on a short recording: C between the least different pair without a refit, which bounds what one leaves,
    the recordings that the rigs would make (a pair), and what the answers miss of them.
    """

    bound: float
    excitation: dict
    filled: Sequence[Trace]
    misses: Sequence[np.ndarray]

    def left(self, pairs: Sequence[Pair], bench: Bench) -> float:
        """C that is left of the least different pair after a linear refit, net of what its rig forks."""
        left = math.inf
        for pair, trace, miss in zip(pairs, self.filled, self.misses):
            slopes = bench.slopes(pair.answer, pair.answer.z, miss, trace)
            known, blocks = pair.answer.known, Blocks.of([trace])
            left = min(left, remains(miss, slopes, known, blocks, bench) - bench.forked(pair.rig.model, trace))
        return left


def ranked(pairs: Sequence[Pair], bench: Bench) -> tuple[list[tuple[float, dict]], int]:
    """Inputs by what remains of the least different pair after its linear refit, the best first, and how many were
    tried.

    What remains without a refit is an upper bound, by which the search goes, from the best of every shape to the second
    of any. The short recording of the ranking may stay within a travel that the whole one leaves, so this is looked at
    first.
    """
    bounds, tried = [], 0
    for shares in (SHARES, GENTLE):
        wave = [excitation for shape in excitations(bench.limits, shares) for excitation in shape]
        tried += len(wave)
        bounds += [one for excitation in wave if (one := _tried(pairs, excitation, bench)) is not None]
        if bounds:
            break
    found: list[tuple[float, dict]] = []
    for one in _mixed(bounds):
        enough = len(found) >= SEARCH.checked and one.bound <= sorted(left for left, _ in found)[-SEARCH.checked]
        if len(found) == SEARCH.refitted or enough or not _stays(pairs, one.excitation, bench):
            continue
        found.append((one.left(pairs, bench), one.excitation))
    return sorted(found, key=lambda r: -r[0]), tried


def _tried(pairs: Sequence[Pair], excitation: dict, bench: Bench) -> Tried | None:
    """The input on a short recording; None where a rig leaves the travel or an answer runs away."""
    length = min(bench.limits.duration, max(SEARCH.seconds, SEARCH.samples / min(bench.limits.rate_hz, SEARCH.rank_hz)))
    trace = bench.trace(excitation, length, SEARCH.rank_hz)
    rigs = {id(p.rig): p.rig for p in pairs}
    filled = {key: made for key, rig in rigs.items() if (made := bench.filled(rig.model, trace)) is not None}
    if len(filled) < len(rigs):
        return None
    e = [bench.misses(p.answer.model, filled[id(p.rig)]) for p in pairs]
    if not np.all(np.isfinite(np.concatenate(e))):
        return None
    blocks = Blocks.of([trace])
    bound = min(bench.cost(blocks.misfit(x)) for x in e)
    return Tried(bound, excitation, [filled[id(p.rig)] for p in pairs], e)


def _stays(pairs: Sequence[Pair], excitation: dict, bench: Bench) -> bool:
    """Whether everybody stays within the travel over the whole recording."""
    long = bench.trace(excitation, excitation["duration_s"], SEARCH.rank_hz)
    return not any(bench.filled(x.model, long) is None for pair in pairs for x in (pair.rig, pair.answer))


def _mixed(bounds: Sequence[Tried]) -> list[Tried]:
    """By their bound, the best of every shape before the second of any."""
    turn: dict[tuple, int] = {}
    out = []
    for b in sorted(bounds, key=lambda b: -b.bound):
        shape = tuple(v for k, v in b.excitation.items() if k not in ("amplitude", "peak_u"))
        turn[shape] = turn.get(shape, 0) + 1
        out.append((turn[shape], b))
    return [b for _, b in sorted(out, key=lambda item: item[0])]


def checked(pair: Pair, excitation: dict, bench: Bench) -> Check | None:
    """The pair at full length; None where one of the two leaves the travel."""
    trace = bench.trace(excitation, excitation["duration_s"], SEARCH.check_hz)
    rig, answer = (bench.filled(x.model, trace) for x in (pair.rig, pair.answer))
    return None if rig is None or answer is None else _check(pair, rig, bench)


def _check(pair: Pair, clean: Trace, bench: Bench) -> Check:
    """True refit of the answer to what the rig would show, on its noise; the price of leaving what is known counts."""
    answer, forked = pair.answer, bench.forked(pair.rig.model, clean)
    noise = bench.noise(clean)
    noisy = replace(clean, y=clean.y + clean.sigma * noise)
    z, cost = refitted(answer, noisy, bench)
    blocks = Blocks.of([clean])
    e = bench.misses(answer.at(z), clean)
    price = 0.5 * float((z - answer.z) @ answer.known @ (z - answer.z))
    true = float(np.sum(np.log((bench.tau + blocks.misfit(noise)) / bench.floor)))
    return Check(
        bench.cost(blocks.misfit(e)) + price - forked, forked, float(np.sqrt(np.mean(e**2))), cost - true, z, clean, e
    )


def chances(pair: Pair, check: Check, slopes: np.ndarray, bench: Bench) -> np.ndarray:
    """C (draws,) that remains were the rig's numbers others, as far as the recordings at hand leave them open; the
    answer refits each time.

    To first order, as everything here: what the rig's own model would miss of itself with other numbers, the answer
    misses as well. ``slopes`` are the answer's at its refitted numbers.
    """
    rig, blocks = pair.rig, Blocks.of([check.clean])
    own = bench.slopes(rig, rig.z, bench.misses(rig.model, check.clean), check.clean)
    draws = drawn(
        rig.known + np.eye(rig.z.size) / VAGUE**2, np.random.default_rng(2).standard_normal((SEARCH.draws, rig.z.size))
    )
    gone = check.z - pair.answer.z
    return (
        np.array(
            [
                remains(
                    check.e - own @ np.clip(d, -SEARCH.far, SEARCH.far), slopes, pair.answer.known, blocks, bench, gone
                )
                for d in draws
            ]
        )
        - check.forked
    )


# -- further channels ------------------------------------------------------------------------------------------------


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
