"""Eq. (6)'s coefficients from a recording alone: where a fit starts when there is no datasheet.

Weak form: Eq. (6) is multiplied by a bump that vanishes with its slope at both ends of a window, and integrated by
parts, so that the output is never differentiated twice. What is left is linear in a_1, a_2, b, c_1, c_2 once theta_0 is
given, and theta_0 is scanned over the travel; and in the numbers of an effect that stands in a spring's place.

It is solved for the acceleration, and once more for the input: where friction and damping take nearly all that a drive
gives, the acceleration is a small difference of which the first makes all numbers small alike (of a throttle's by 50).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls
from scipy.signal import savgol_filter

from ers_mj.data.prepared import Trace
from ers_mj.effects.base import Effect

WINDOWS = (0.1, 0.3, 1.0)  # [s], never shorter than SHORTEST samples
SHORTEST = 16
EDGE = 0.02  # share of the travel next to its ends that is left out: a stop may act there
PLACES = np.linspace(0.05, 0.95, 13)  # quantiles of the output at which theta_0 is tried
VISCOUS, GAIN, DRY, CONSTANT, SPRING = range(5)  # columns of the regression
LEAST = 0.05  # of an effect's largest number, that its others begin with: one that begins at zero has no scale
# [1/s] acceleration by the largest input over the speeds that are met: what makes more was guessed from no input at all
FASTEST = 1e4


class Guess(NamedTuple):
    """Eq. (6)'s letters, and the effects beside them, with which a fit may begin; the ``misfit`` of the regression, and
    whether it was solved for the input (``of_input``).
    """

    misfit: float
    values: Mapping[str, float]
    effects: tuple[tuple[str, np.ndarray], ...] = ()
    of_input: bool = False

    @property
    def held_by(self) -> str:
        """What holds the output at its place: an effect, "preload" or, maybe, a spring."""
        return self.effects[0][0] if self.effects else "preload" if self.values["c_1"] > 0 else "spring"


class Rows(NamedTuple):
    """Weak-form rows of a trace: right side (W,), columns (W, 5) of -y', u, -sgn(w), 1, -y, and what makes one of any
    further torque (N,) along the output, given as a function of that.
    """

    right: np.ndarray
    columns: np.ndarray
    of: Callable[[Callable[[np.ndarray], np.ndarray]], np.ndarray]


def _rows(trace: Trace, window: float, still: float) -> Rows | None:
    """The rows of one trace; None where it is too short for a window [s] or moves, faster than ``still``, too little.

    The bump's slopes are differences of the sampled bump, which sum to zero exactly: else a constant output would make
    a torque.
    """
    h = trace.sample_time
    n = max(SHORTEST, int(window / h))
    if trace.t.size < 2 * n:
        return None
    s = (np.arange(n + 1)) / n
    bump = (s * (1 - s)) ** 3 * 64
    slope = np.gradient(bump, n * h / n)
    bend = np.gradient(slope, h)
    y = np.interp(trace.t, trace.t[trace.valid], trace.y[trace.valid])
    w = savgol_filter(y, max(5, min(n // 2 * 2 + 1, 2 * int(0.02 / h) + 5)), 2, deriv=1, delta=h)
    sign = np.clip(w / still, -1.0, 1.0)
    starts = np.arange(0, y.size - n - 1, max(n // 4, 1))
    index = starts[:, None] + np.arange(n + 1)
    margin = EDGE * (y.max() - y.min())
    inside = np.all((y[index] > y.min() + margin) & (y[index] < y.max() - margin), axis=1)
    moving = np.mean(np.abs(sign[index]), axis=1) > 0.6
    index = index[moving & inside]
    if index.shape[0] < 8:
        return None
    take = lambda f, v: (v[index] * f).sum(axis=1) * h
    columns = [take(slope, y), take(bump, trace.u), -take(bump, sign)]
    columns += [np.full(index.shape[0], bump.sum() * h), -take(bump, y)]
    return Rows(take(bend, y), np.column_stack(columns), lambda torque: take(bump, torque(y)))


def guesses(traces: Sequence[Trace], holding: Sequence[Effect] = ()) -> list[Guess]:
    """Starting values of Eq. (6), best regression first, those for the acceleration before those for the input: without
    a spring and with one, with preload, and with each of the effects ``holding`` the output in their place; none of an
    absurd gain.
    """
    y = np.concatenate([t.y[t.valid] for t in traces])
    speed = np.concatenate([np.abs(np.diff(savgol_filter(t.y[t.valid], 9, 2))) / t.sample_time for t in traces])
    still = max(0.02 * float(np.quantile(speed, 0.98)), 1e-12)
    most, peak = FASTEST * float(np.quantile(speed, 0.98)), max(float(np.max(np.abs(t.u))) for t in traces)
    largest = most / max(peak, 1e-300)
    found = [one for window in WINDOWS for one in _by_window(traces, window, still, y, holding, largest)]
    found.sort(key=lambda guess: (guess.of_input, guess.misfit))
    return [guess for guess in found if abs(guess.values["b"]) * peak <= most * (1.0 + 1e-9)]


def _by_window(
    traces: Sequence[Trace], window: float, still: float, y: np.ndarray, holding: Sequence[Effect], largest: float
) -> list[Guess]:
    """The regressions over windows of one length [s], of a gain b that is no ``largest`` one."""
    rows = [r for r in (_rows(t, window, still) for t in traces) if r is not None]
    if not rows:
        return []
    middle = float(np.median(y))
    right, columns = np.concatenate([r.right for r in rows]), np.vstack([r.columns for r in rows])
    found = []
    with np.errstate(all="ignore"):  # of a constant input next to nothing follows
        for of_input in (False, True):
            joint = Joint(right, columns, rows, largest if of_input else 0.0)
            found += [joint.sprung(at, spring, middle) for at, spring in ((None, False), (None, True))]
            found += [joint.sprung(theta_0, True, middle) for theta_0 in np.quantile(y, PLACES)]
            found += [joint.held(effect, middle) for effect in holding]
    return found


class Joint(NamedTuple):
    """The rows of all traces: one regression over every law that is linear in its numbers, for the input where a
    ``largest`` gain b is given.
    """

    right: np.ndarray
    columns: np.ndarray
    rows: Sequence[Rows]
    largest: float = 0.0

    def sprung(self, theta_0: float | None, spring: bool, middle: float) -> Guess:
        """With a preload about ``theta_0`` or without one, with a spring or without."""
        design = self.columns[:, : SPRING + spring]
        if theta_0 is not None:
            design = np.column_stack([design, self._torque(lambda y: -np.sign(y - theta_0))])
        misfit, x = self._solved(design, [GAIN, CONSTANT])
        a_1 = x[SPRING] if spring else 0.0
        rest = x[CONSTANT] / a_1 if a_1 > 0 else middle
        held = {"a_1": a_1, "c_1": x[-1] if theta_0 is not None else 0.0}
        values = {**_moving(x), **held, "theta_0": theta_0 if theta_0 is not None else rest}
        return Guess(misfit, values, (), self.largest > 0)

    def held(self, effect: Effect, middle: float) -> Guess:
        """With an effect in the spring's place."""
        count = len(effect.parameters)
        torques = [self._torque(lambda y, k=k: effect.columns(y)[:, k]) for k in range(count)]
        misfit, x = self._solved(
            np.column_stack([self.columns[:, :CONSTANT], *torques]), [GAIN, *range(CONSTANT, CONSTANT + count)]
        )
        p = x[CONSTANT:]
        least = LEAST * max(float(np.max(np.abs(p))), 1e-12)
        p = np.where(np.abs(p) < least, np.copysign(least, p), p)
        values = {**_moving(x), "a_1": 0.0, "c_1": 0.0, "theta_0": middle}
        return Guess(misfit, values, ((effect.name, p),), self.largest > 0)

    def _torque(self, torque: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        return np.concatenate([r.of(torque) for r in self.rows])

    def _solved(self, design: np.ndarray, signed: list[int]) -> tuple[float, np.ndarray]:
        """(relative residual, coefficients) of one regression; all but the ``signed`` coefficients are positive."""
        if not self.largest:
            return _reweighted(self.right, design, signed)
        others = [k for k in range(design.shape[1]) if k != GAIN]
        turned = np.column_stack([self.right, -design[:, others]])
        free = [1 + others.index(k) for k in signed if k != GAIN]
        tries = [(way, *_reweighted(way * design[:, GAIN], turned, free)) for way in (1.0, -1.0)]
        way, misfit, found = min(tries, key=lambda one: one[1])
        b, x = min(1.0 / max(found[0], 1e-300), self.largest), np.empty(design.shape[1])
        x[GAIN], x[others] = way * b, b * found[1:]
        return misfit, x


def _reweighted(right: np.ndarray, design: np.ndarray, signed: list[int]) -> tuple[float, np.ndarray]:
    """(relative residual, coefficients) of a regression, reweighted towards its smaller residuals; all but the
    ``signed`` coefficients are positive.
    """
    size = np.maximum(np.abs(design).max(axis=0), 1e-300)
    both = np.column_stack([design / size, -design[:, signed] / size[signed]])
    weight = np.ones(right.size)
    for _ in range(4):
        x = nnls(both * weight[:, None], right * weight)[0]
        x[signed] -= x[design.shape[1] :]
        x = x[: design.shape[1]] / size
        e = right - design @ x
        weight = 1.0 / np.sqrt(1.0 + (e / (2 * np.median(np.abs(e)) + 1e-300)) ** 2)
    return float(np.median(np.abs(e)) / np.median(np.abs(right))), x


def _moving(x: np.ndarray) -> dict[str, float]:
    """What a regression says of an output that moves."""
    return {"a_2": max(x[VISCOUS], 1e-3), "b": x[GAIN], "c_2": max(x[DRY], 1e-3 * abs(x[GAIN]))}
