"""How sure fitted numbers are: Fisher's information, resampled blocks, and the profile of what is weak.

sensitivities J (N, r), residuals e (N,), both in sigmas -> covariance (r, r) -> 95 % half-width of anything that
follows from the numbers
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.stats import t as student

from ers_mj.data.prepared import Trace
from ers_mj.identification.minimisers import LS


@dataclass(frozen=True)
class Resampling:
    """How pieces of the recordings are drawn anew."""

    blocks: int = 60  # pieces of all recordings together
    shortest: int = 5  # samples of a piece
    recordings: int = 8  # from which whole recordings are drawn
    draws: int = 400


RESAMPLING = Resampling()


@dataclass(frozen=True)
class Profiling:
    """How the profile of a weak coordinate is followed."""

    places: tuple[float, ...] = (0.35, 0.7, 1.0, 1.4, 2.0)  # half-widths either way at which it is minimised
    budget: int = 30  # simulations for each
    gain: float = 1e-6  # share of chi^2 below which a step ends one


PROFILING = Profiling()

WEAK = 0.05  # half-width from which a coordinate's profile is taken


@dataclass(frozen=True)
class Precision:
    """Covariances (r, r) of the coordinates: ``fisher`` by the residuals' size, ``resampled`` by blocks; ``freedom`` of
    the latter.
    """

    fisher: np.ndarray
    resampled: np.ndarray
    freedom: int

    def half_width(self, gradient: np.ndarray) -> float:
        """95 % half-width of what has this gradient (r,): the wider of both."""
        return max(
            1.96 * float(np.sqrt(gradient @ self.fisher @ gradient)),
            float(student.ppf(0.975, self.freedom) * np.sqrt(gradient @ self.resampled @ gradient)),
        )


def precision_of(slopes: np.ndarray, e: np.ndarray, traces: Sequence[Trace], seed: int) -> Precision:
    """From sensitivities (N, r) and residuals (N,) in sigmas at the optimum.

    Each draw weighs the pieces by how often chance picks them and takes the one Gauss-Newton step that the weights ask
    for.
    """
    pieces = _pieces(traces)
    seen = np.concatenate([t.seen for t in traces])
    count, r = int(pieces.max()) + 1, slopes.shape[1]
    outer = np.array([slopes[pieces == b].T @ slopes[pieces == b] for b in range(count)])
    pull = np.array([slopes[pieces == b].T @ e[pieces == b] for b in range(count)])
    information = outer.sum(axis=0)
    fisher = max(float(e @ e) / max(int(seen.sum()) - r, 1), 1e-300) * np.linalg.pinv(
        information, rcond=1e-14, hermitian=True
    )
    random, steps = np.random.default_rng(seed), []
    for _ in range(RESAMPLING.draws):
        weight = np.bincount(random.integers(0, count, count), minlength=count)
        steps.append(np.linalg.lstsq(np.tensordot(weight, outer, 1), weight @ pull, rcond=1e-14)[0])
    spread = np.array(steps)
    low, high = np.quantile(spread, (0.16, 0.84), axis=0)
    sigma = 0.5 * (high - low)  # a draw that leaves out what tells a coordinate is no measure of its spread
    ranks = np.clip(spread - np.median(spread, axis=0), -4.0 * sigma, 4.0 * sigma)
    resampled = ranks.T @ ranks / RESAMPLING.draws * count / max(count - r, 1)
    for matrix in (fisher, resampled):
        matrix.setflags(write=False)
    return Precision(fisher, resampled, max(count - r, 1))


def _pieces(traces: Sequence[Trace]) -> np.ndarray:
    """(N,) which piece each row belongs to: pieces of time, all channels together, or whole recordings where there are
    enough.
    """
    if len(traces) >= RESAMPLING.recordings:
        return np.concatenate([np.full(t.rows, k) for k, t in enumerate(traces)])
    length = max(RESAMPLING.shortest, sum(t.t.size for t in traces) // RESAMPLING.blocks)
    out, base = [], 0
    for trace in traces:
        own = np.minimum(np.arange(trace.t.size) // length, max(trace.t.size // length - 1, 0)) + base
        out.append(np.tile(own, 1 + len(trace.channels)))
        base = int(own[-1]) + 1
    return np.concatenate(out)


@dataclass(frozen=True)
class Profile:
    """What the misfit rises to where one coordinate is held at x (P,): ``rise`` (P,) over that of 1 sigma^2, and where
    it passes the 95 % level.
    """

    name: str
    x: np.ndarray
    rise: np.ndarray
    level: float
    ends: tuple[float | None, float | None]


class Pinned:
    """An objective (see minimisers/base.py) over all coordinates but one, which is held; its slopes (N, r) are those of
    the optimum throughout.
    """

    def __init__(self, objective, slopes: np.ndarray, k: int, value: float):
        self._objective, self._slopes, self._k, self._value = objective, np.delete(slopes, k, axis=1), k, value

    def slopes(self, x: np.ndarray, e: np.ndarray) -> np.ndarray:
        """Slopes (N, r - 1), wherever x is: Broyden's updates see to the rest."""
        return self._slopes

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """Residuals (N,) at the other coordinates (r - 1,)."""
        return self._objective.residuals(np.insert(x, self._k, self._value))

    def __call__(self, x: np.ndarray) -> np.ndarray:
        return np.array([float(e @ e) for e in map(self.residuals, x)])


def profile(
    objective,
    slopes: np.ndarray,
    x: np.ndarray,
    k: int,
    name: str,
    half: float,
    inflation: float,
    bounds: tuple[np.ndarray, np.ndarray],
) -> Profile:
    """The profile likelihood of coordinate k about the optimum x (r,).

    Args:
        objective: with residuals (N,) whose squares sum to chi^2.
        slopes: (N, r) of the residuals at the optimum.
        half: 95 % half-width by Fisher, which sets the places.
        inflation: of the level, where blocks scatter more than single residuals (a ratio of half-widths).
        bounds: lower and upper ends of the coordinates (r,).
    """
    lower, upper = bounds
    least, level = float(np.sum(objective.residuals(x) ** 2)), 3.84 * inflation**2
    places, rises, keep = [float(x[k])], [0.0], np.arange(x.size) != k
    for way in (-1.0, 1.0):
        rest = x[keep]
        for share in PROFILING.places:
            at = float(np.clip(x[k] + way * share * half * inflation, lower[k], upper[k]))
            if at in places:
                break
            held = Pinned(objective, slopes, k, at)
            found = LS(attempts=1, staged=False, gain=PROFILING.gain).minimise(
                held, lower[keep], upper[keep], budget=PROFILING.budget, start=rest
            )
            places.append(at)
            rises.append(max(found.value - least, 0.0))
            rest = found.x
            if rises[-1] > level:
                break
    order = np.argsort(places)
    along, rise = np.array(places)[order], np.array(rises)[order]
    low, high = (_crossing(along, rise, level, float(x[k]), way) for way in (-1, 1))
    return Profile(name, along, rise, level, (low, high))


def _crossing(at: np.ndarray, rise: np.ndarray, level: float, best: float, way: int) -> float | None:
    """Where the square root of a profile passes that of the level on one side; None where it does not as far as it was
    followed.
    """
    side = way * (at - best) >= 0
    distance, height = way * (at[side] - best), np.sqrt(np.maximum.accumulate(rise[side][::way])[::way])
    order = np.argsort(distance)
    distance, height = distance[order], height[order]
    above = np.flatnonzero(height >= np.sqrt(level))
    if not above.size:
        return None
    fine = np.linspace(0.0, distance[above[0]], 400)
    curve = PchipInterpolator(distance[: above[0] + 1], height[: above[0] + 1])(fine) if above[0] else height[:1]
    return best + way * float(np.interp(np.sqrt(level), curve, fine))
