"""The objective of an identification: Eq. (13) as a function of the combinations that the data can tell.

    coordinates (r,) -> letters (k,) -> Model -> simulated recordings -> residuals -> integral of their squares [rad^2
    s]
 A coordinate is the logarithm of a combination over its reference; B, whose effect is a small addition to the
back-EMF's, counts in proportion, so that the valley in which it trades against the rest is straight; theta_0 counts in
half travels.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.prepared import Blocks, Trace
from ers_mj.estimation.objective import residuals
from ers_mj.identification.structure import Structure, structure_of
from ers_mj.identification.unknowns import Unknowns

STAGES = (60.0, 15.0)  # [1/s] observer rates of the objectives that are gone through before the free run
IN_PROPORTION = ("B",)
STEP = 1e-5  # of the letters' logarithms, for sensitivities


@dataclass(frozen=True)
class Near:
    """What counts as near, in an identification."""

    coarser: float = 3.0  # times STEP, a second step
    forks: float = 0.01  # share of a slope's size by which both may differ
    fewest: float = 0.5  # the samples' share that must be left
    start: float = 0.01  # half travels by which the angle at the start may be off
    home: float = 0.02  # half travels of theta_0 within which a start is at home
    shy: float = 0.02  # share of a coordinate's range, within which it rests at its end


NEAR = Near()


Simulator = Callable[[Unknowns, Sequence[np.ndarray], Sequence[Trace], float], list[np.ndarray]]


@dataclass(frozen=True)
class Search:
    """Coordinates (r,) of the combinations, and behind them, ``with_starts``, of where each recording starts (angle;
    speed where it moves).

    A recording that starts at ``home`` starts at theta_0, wherever that is: a start that may lie on either side of it
    would make a kink.
    """

    unknowns: Unknowns
    structure: Structure
    scale: float
    traces: tuple[Trace, ...]
    home: tuple[bool, ...] = ()
    with_starts: bool = False

    def at_home(self, letters: np.ndarray, surely: bool = True) -> Search:
        """The search in which those recordings start at home that must: at rest near theta_0, where the preload is
        stronger than friction.

        Where that is not known ``surely``, a preload is enough.
        """
        values = self.unknowns.values(letters)
        holds = values["c_1"] > (values["c_2"] if surely else 0.0)
        near = NEAR.home * self.scale
        return replace(
            self,
            home=tuple(
                holds and t.start[1] == 0.0 and abs(t.start[0] - values["theta_0"]) < near + 5.0 * t.sigma
                for t in self.traces
            ),
        )

    @property
    def names(self) -> list[str]:
        """The letters that are searched."""
        return [self.unknowns.names[k] for k in self.structure.kept]

    @property
    def _moved(self) -> list[tuple[int, int]]:
        """(recording, 0 for the angle or 1 for the speed) of the coordinates of the starts."""
        return (
            [
                (r, i)
                for r, t in enumerate(self.traces)
                for i in (0, 1)
                if not (self.home and self.home[r]) and (i == 0 or t.start[1] != 0.0)
            ]
            if self.with_starts
            else []
        )

    def letters(self, x: np.ndarray) -> np.ndarray:
        """The letters (k,) at coordinates x, the pivots at their reference."""
        out = self.unknowns.reference.copy()
        for k, name, z in zip(self.structure.kept, self.names, x):
            out[k] = z * self.scale if name == "theta_0" else out[k] * (z if name in IN_PROPORTION else math.exp(z))
        return out

    def coordinates(self, letters: np.ndarray) -> np.ndarray:
        """Of letters (k,): the combinations' coordinates, wherever the pivots are; the starts at 0."""
        ratio = [
            0.0 if name == "theta_0" else math.log(letters[k] / self.unknowns.reference[k])
            for k, name in enumerate(self.unknowns.names)
        ]
        out = []
        for k, name in zip(self.structure.kept, self.names):
            if name == "theta_0":
                out.append(letters[k] / self.scale)
                continue
            z = ratio[k] - sum(row[k] * ratio[p] for row, p in zip(self._powers, self.structure.pivots))
            out.append(math.exp(z) if name in IN_PROPORTION else z)
        return np.array(out + [0.0] * len(self._moved))

    @property
    def _powers(self) -> np.ndarray:
        """The null space with what is no whole exponent left out."""
        null = self.structure.null
        return np.where(np.abs(null - np.round(null)) < 0.02, np.round(null), 0.0)

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Those of the combinations (r,): the letters' own and the pivots' together."""
        u = self.unknowns
        ends = []
        for k, name in zip(self.structure.kept, self.names):
            if name == "theta_0":
                ends.append((u.lower[k] / self.scale, u.upper[k] / self.scale))
                continue
            low, high = (
                math.log(max(x[k] / u.reference[k], 1e-6))
                for x in ((u.lower, u.upper) if u.reference[k] > 0 else (u.upper, u.lower))
            )
            for row, p in zip(self._powers, self.structure.pivots):
                if u.names[p] == "theta_0":
                    continue
                reach = sorted(-row[k] * math.log(max(x[p] / u.reference[p], 1e-6)) for x in (u.lower, u.upper))
                low, high = low + reach[0], high + reach[1]
            ends.append((math.exp(low), math.exp(high)) if name in IN_PROPORTION else (low, high))
        for r, i in self._moved:
            far = max(NEAR.start, 5.0 * self.traces[r].sigma / self.scale) * (1.0 if i == 0 else 50.0)
            ends.append((-far, far))
        lower, upper = np.array(ends).T
        return lower, upper

    def at_lower_end(self, x: np.ndarray, name: str) -> bool:
        """Whether a searched letter rests at its lower bound at the coordinates x (r,)."""
        k = self.names.index(name)
        lower, upper = self.bounds
        return x[k] - lower[k] < NEAR.shy * (upper[k] - lower[k])

    def started(self, x: np.ndarray) -> tuple[Trace, ...]:
        """The traces with the starts of the coordinates x."""
        if not self.with_starts and not any(self.home):
            return self.traces
        theta_0 = self.unknowns.values(self.letters(x))["theta_0"]
        starts = [[theta_0, 0.0] if self.home and self.home[r] else list(t.start) for r, t in enumerate(self.traces)]
        for (r, i), z in zip(self._moved, x[len(self.names) :]):
            starts[r][i] += z * self.scale
        return tuple(replace(t, start=(s[0], s[1])) for t, s in zip(self.traces, starts))


@dataclass(frozen=True)
class Misfit:
    """Eq. (13) over a search's coordinates: x (M, r) -> (M,) [rad^2 s, or output unit^2 s].

    The model runs in the observer form of ``rate`` (see fit.py), free where that is 0. Further channels
    enter with the weight of their noise. ``simulate`` gives the residuals in sigmas of many candidates at once where it
    is not the reduced model that runs; the slopes are the reduced model's then. A ``robust`` one has the logarithm of
    fit.py, block by block.
    """

    search: Search
    rate: float = 0.0
    jobs: int = 1
    simulate: Simulator | None = None
    robust: bool = False

    def __call__(self, x: np.ndarray) -> np.ndarray:
        if self.simulate is not None:
            found = self.simulate(
                self.search.unknowns, [self.search.letters(row) for row in x], self.search.traces, self.rate
            )
            return np.array(
                [_squares(self.weight * (forgiving(e, self.search.traces) if self.robust else e)) for e in found]
            )
        with ThreadPoolExecutor(self.jobs) as pool:
            return np.array(list(pool.map(lambda row: _squares(self.residuals(row)), x)))

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """(N,), whose squares sum to the value."""
        traces, letters = self.search.started(x), self.search.letters(x)
        if self.simulate is not None:
            e = self.simulate(self.search.unknowns, [letters], traces, self.rate)[0]
        else:
            e = residuals(self.search.unknowns.model(letters), traces, self.rate)
        return self.weight * (forgiving(e, traces) if self.robust else e)

    @property
    def weight(self) -> np.ndarray:
        """What makes a residual in sigmas one of the square root of the integral, (N,)."""
        traces = self.search.traces
        sigma = math.sqrt(float(np.mean([t.sigma**2 for t in traces])))
        return np.concatenate([np.full(t.rows, sigma * math.sqrt(t.sample_time)) for t in traces])

    @property
    def stages(self) -> tuple[Misfit, ...]:
        """Easier objectives: the same as an observer, which forgives an early error."""
        return tuple(replace(self, rate=rate, simulate=None) for rate in STAGES)

    def draw(self, random: np.random.Generator) -> np.ndarray:
        """Coordinates of letters drawn from their own bounds: those of the combinations reach much further."""
        return self.search.coordinates(self.search.unknowns.drawn(random))

    @property
    def target(self) -> float:
        """The value that noise alone would leave, and a little more: 1.3 times a mean squared residual of one sigma."""
        seen = np.concatenate([t.seen for t in self.search.traces])
        return 1.3 * float(np.sum(self.weight[seen] ** 2))

    @property
    def slopes(self) -> Callable[[np.ndarray, np.ndarray], np.ndarray] | None:
        """(x, residuals (N,) there) -> slopes (N, r) by the reduced model, where another one is simulated."""
        if self.simulate is None:
            return None
        reduced = replace(self, simulate=None, robust=False)

        def slopes(x, e):
            found = central(reduced.residuals, x, STEP)
            return found * forgiven(e / self.weight, self.search.traces)[:, None] if self.robust else found

        return slopes


def forgiving(e: np.ndarray, traces: Sequence[Trace]) -> np.ndarray:
    """Residuals e (N,) in sigmas, scaled so that each block's squares sum to n ln(1 + m), m their mean: a few blocks
    cannot decide everything.
    """
    blocks = Blocks.of(traces)
    m = blocks.misfit(e)
    return e * np.sqrt(np.log1p(m) / np.maximum(m, 1e-300))[blocks.index]


def forgiven(e: np.ndarray, traces: Sequence[Trace]) -> np.ndarray:
    """What the slopes of plain residuals are to be multiplied by, (N,), so that with the scaled ones e (N,) they give
    the slope of the sum.
    """
    blocks = Blocks.of(traces)
    m = np.expm1(blocks.misfit(e))
    return (np.sqrt(m / np.maximum(np.log1p(m), 1e-300)) / (1.0 + m))[blocks.index]


def _squares(e: np.ndarray) -> float:
    return float(e @ e)


def central(function: Callable[[np.ndarray], np.ndarray], x: np.ndarray, step: float) -> np.ndarray:
    """Central differences (N, k) of a function of x (k,), its columns' numbers side by side."""
    out = np.empty((0, x.size), order="F")
    for k, move in enumerate(step * np.eye(x.size)):
        column = (function(x + move) - function(x - move)) / (2.0 * step)
        if not k:  # one array, filled column by column: an hour's are 30 MB each
            out = np.empty((column.size, x.size), order="F")
        out[:, k] = column
    return out


def structure_at(unknowns: Unknowns, traces: Sequence[Trace], letters: np.ndarray, scale: float) -> Structure:
    """What these recordings can tell near these letters (k,), by the reduced model in free run."""
    angle = np.array([name == "theta_0" for name in unknowns.names])

    def moved(z):
        return residuals(unknowns.model(np.where(angle, letters + scale * z, letters * np.exp(z))), traces, 0.0)

    slopes, off = (central(moved, np.zeros(len(letters)), step) for step in (STEP, NEAR.coarser * STEP))
    smooth = np.ones(len(slopes), bool)
    for column, doubt in zip(slopes.T, off.T, strict=True):
        np.nan_to_num(column, copy=False)
        np.subtract(column, np.nan_to_num(doubt, copy=False), out=doubt)
        size = np.abs(column).max() + 1e-300
        smooth &= np.abs(doubt) / size < NEAR.forks  # elsewhere stick and slip fork at a touch
    some = smooth if smooth.mean() > NEAR.fewest else None
    return structure_of(slopes, unknowns.names, off, some)
