"""Intervals of a loop's numbers and of what only a sum or a ratio of them can tell: a sandwich over blocks, how far
effects move the numbers that act unseen, as large as what is left supports, and the likeliest that was not taken.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit

from ers_mj.decisions.thresholds import Policy
from ers_mj.position_loop import beside
from ers_mj.position_loop.compared import Selection
from ers_mj.position_loop.fit import Data, Fit, best, fitted, gain, jacobian
from ers_mj.position_loop.model import LETTERS, Free, LoopModel
from ers_mj.position_loop.terms import lagging, parts, terms
from ers_mj.position_loop.two_bodies import other_sides


@dataclass(frozen=True)
class Doubt:
    """What widens an interval, and how wide a number that is told may have one."""

    run: int = 5  # neighbouring blocks that are taken as one
    fewest: int = 3  # left-out refits from which they count
    told: float = 0.7  # half width of a logarithm up to which a number is told
    inexact: float = 0.0025  # standard deviation of what firmware and simulation do in steps: relative,
    clock: float = 0.00075  # [s] and in time
    unseen: float = 2.0  # gain of an effect that is not found
    noise: float = 1.1  # noise variances that noise alone may leave
    lagged: int = 12  # steps of a refit with a late speed,
    turned: int = 25  # and of one with the sensors elsewhere


DOUBT = Doubt()

RATES = ("K", "I", "a_2", "c_2")
COMBINED = ("a_2+D", "c_2/K", "(a_2+D)/K", "L/K", "I/K")


@dataclass(frozen=True)
class Told:
    """A number with its 95 % interval, and whether the recordings tell it."""

    value: float
    ci95: tuple[float, float]
    identifiable: bool


@dataclass(frozen=True)
class Intervals:
    """The model whose numbers are told, ``chosen``, and the one around which their intervals lie, with terms that were
    left out; the covariance of its transformed numbers with the factor that makes 95 % of a standard deviation.
    """

    chosen: LoopModel
    model: LoopModel
    layout: tuple[Free, ...]
    covariance: np.ndarray
    factor: float

    @staticmethod
    def of(
        fit: Fit, data: Data, left_out: Sequence[LoopModel] = (), rivals: Sequence[tuple[float, LoopModel]] = ()
    ) -> Intervals:
        """``left_out`` are refits without each recording in turn; three or more widen what scatters between them.
        ``rivals`` are refits with something that was not taken, each with how likely it acts nevertheless.
        """
        model = fit.model
        if "L" in model.free and "D" not in model.free:  # a term that was left out leaves doubt in what it moves
            model = fitted(model.having(D=0.0), data, 8).model
        layout, rate = model.layout(), max(model["a_2"] + model["D"], 0.0)
        j = jacobian(model, data)
        e = data.residuals(model)
        groups = data.block // DOUBT.run
        slopes = np.array([np.bincount(groups, j[:, k] * e) for k in range(len(layout))]).T
        hessian = j.T @ j + np.diag([12.0 / f.span**2 for f in layout])  # within its bounds any number is as likely
        size = np.sqrt(np.maximum(np.diag(hessian), 1e-12))
        inverse = np.linalg.pinv(hessian / np.outer(size, size), rcond=1e-10) / np.outer(size, size)
        n = slopes.shape[0]
        spread = inverse @ (slopes.T @ slopes) @ inverse * n / max(n - len(layout), 1)
        spread += inverse * float(np.mean(e * e))
        if len(left_out) >= DOUBT.fewest and set(left_out[0].free) == set(fit.model.free):
            spread += _jackknife(fit.model, layout, left_out)
        spread += _beside_rivals(fit.model, layout, [*rivals, *_with_lag(fit.model, data)])
        spread += _unseen(model, data, e, j, inverse)
        alike = np.array([0.5 * rate * DOUBT.clock if f.name in RATES else 0.0 for f in layout])
        own = [_inexact(f, q, model) for f, q in zip(layout, model.vector(layout), strict=True)]
        spread += np.outer(alike, alike) + np.diag(np.square(own))
        return Intervals(fit.model, model, tuple(layout), spread, float(stdtrit(max(n - len(layout), 1), 0.975)))

    def told(self, owner: str, name: str) -> Told | None:
        """A fitted number."""
        z = self.model.vector(self.layout)
        for k, f in enumerate(self.layout):
            if (f.owner, f.name) == (owner, name):
                half = self.factor * math.sqrt(max(self.covariance[k, k], 0.0))
                low, high = f.ends(z[k], half)
                known = half < DOUBT.told if f.positive else True
                value = self._chosen(f)
                return Told(value, (min(low, value), max(high, value)), known)
        return None

    def _chosen(self, f: Free) -> float:
        """A number of the chosen model."""
        q = _at(self.chosen).get(_key(f))
        return self.chosen[f.name] if q is None else f.inside(q)

    def combined(self, name: str) -> Told | None:
        """One of COMBINED; None where a part of it is not in the model."""
        rule = {
            "a_2+D": lambda m: m["a_2"] + m["D"],
            "c_2/K": lambda m: m["c_2"] / m["K"],
            "(a_2+D)/K": lambda m: (m["a_2"] + m["D"]) / m["K"],
            "L/K": lambda m: m["L"] / m["K"],
            "I/K": lambda m: m["I"] / m["K"],
        }[name]
        return self._of(rule)

    def input_gain(self, data: Data) -> Told | None:
        """b [output unit/s^2 of the drive per unit of the signal recorded beside]; None where there is none."""
        runs = [run for run in data.runs if run.beside is not None and not run.beside.is_current]
        if not runs:
            return None

        def factor(model: LoopModel) -> float:
            return float(beside.factors(model, runs, [model.motion(run) for run in runs])[0])

        found = self._of(lambda model: abs(1.0 / factor(model)))
        if found is None or factor(self.model) > 0.0:
            return found
        return replace(found, value=-found.value, ci95=(-found.ci95[1], -found.ci95[0]))

    def _of(self, rule: Callable[[LoopModel], float]) -> Told | None:
        """A positive number that follows from the model."""
        value, z = rule(self.model), self.model.vector(self.layout)
        if not math.isfinite(value) or value <= 0.0:
            return None
        slope = np.zeros(z.size)
        for k in range(z.size):
            ends = []
            for way in (1e-4, -1e-4):
                moved = z.copy()
                moved[k] += way
                ends.append(math.log(max(rule(self.model.at(self.layout, moved)), 1e-300)))
            slope[k] = (ends[0] - ends[1]) / 2e-4
        half = self.factor * math.sqrt(max(float(slope @ self.covariance @ slope), 0.0))
        half = min(half, 50.0)
        told = rule(self.chosen)
        around = min(told, value * math.exp(-half)), max(told, value * math.exp(half))
        return Told(told, around, half < DOUBT.told)


def _inexact(f: Free, z: float, model: LoopModel) -> float:
    """Standard deviation of a transformed number by what steps leave untold: a drive that is late by a step h acts as
    the damping -K h, the firmware's or, where that is not parted from it, the plant's. (A motion that is damped at a
    rate and goes on in steps has all its rates wrong alike, by half the rate times h.)
    """
    late = model["K"] * DOUBT.clock
    if f.name == "D":
        return late / f.size
    if f.name in ("tau_s", "dead_time_s"):
        return DOUBT.clock / f.size
    if f.name == "a_2" and "D" not in model.free:
        return math.hypot(DOUBT.inexact, late / model["a_2"])
    return DOUBT.inexact * (1.0 if f.positive else abs(z))


def passed_over(selection: Selection, policy: Policy) -> list[tuple[float, LoopModel]]:
    """The answer with the likeliest candidate that was not taken in the end, and how likely that acts: its share of the
    gain that is asked for. What lacks a term of the answer is no doubt of it.
    """
    last = selection.rounds[-1] if selection.rounds else ()
    answer = set(parts(selection.chosen.model))
    asked = [c for c in last if c.gain > 0.0 and c.name not in answer and answer <= set(parts(c.fit.model))]
    return [(min(1.0, c.gain / policy.loop_gain), c.fit.model) for c in sorted(asked, key=lambda c: -c.gain)[:1]]


def turned_over(fit: Fit, data: Data, policy: Policy) -> list[tuple[float, LoopModel]]:
    """Two bodies with their sensors on other sides, and how likely they sit there: what is worse by all the gain that
    is asked for is out of the question.
    """
    found = [best(starts, data, DOUBT.turned) for starts in other_sides(fit.model)]
    chances = [1.0 + min(gain(fit, other), 0.0) / policy.loop_gain for other in found]
    return [(chance, other.model) for chance, other in zip(chances, found, strict=True) if chance > 0.0]


def _with_lag(model: LoopModel, data: Data) -> list[tuple[float, LoopModel]]:
    """A loop whose damping has the speed late, which its firmware is sure to do by a little."""
    if "lag_s" in model.free:
        return []
    if "D" in model.free:
        return [(1.0, best(lagging(model), data, DOUBT.lagged).model)]
    half = 0.5 * model["a_2"]
    return [(1.0, best(lagging(model.having(D=half, a_2=half)), data, DOUBT.lagged).model)]


def _beside_rivals(model: LoopModel, layout: Sequence[Free], rivals: Sequence[tuple[float, LoopModel]]) -> np.ndarray:
    """Covariance by how far rivals move the numbers; the plant's damping holds the firmware's where nothing parts the
    two.
    """
    own, spread = _at(model), np.zeros((len(layout), len(layout)))
    for likely, rival in rivals:
        whole = {**rival.values, "a_2": max(rival["a_2"] + rival["D"], LETTERS["a_2"].lower)}
        its = _at(rival if "D" in model.free else replace(rival, values=whole))
        moved = np.array([its[key] - own[key] if key in its and key in own else 0.0 for key in map(_key, layout)])
        spread += likely * np.outer(moved, moved)
    return spread


def _key(free: Free) -> tuple[str, str]:
    return free.owner, free.name


def _at(model: LoopModel) -> dict[tuple[str, str], float]:
    """The transformed numbers of a model."""
    layout = model.layout()
    return dict(zip(map(_key, layout), model.vector(layout).tolist(), strict=True))


def _unseen(model: LoopModel, data: Data, e: np.ndarray, j: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    """Covariance (k, k) by effects that the model lacks: what a fit of its numbers makes of the errors that each adds
    from its first and last start, scaled to where it would take away what an effect may that is not found, or all that
    is left beyond the noise, or what it takes of what is left, if that is more; never beyond the start. Any is as
    likely as the next.
    """
    cost = 0.5 * float(e @ e)
    hidden = max(cost * -math.expm1(-2.0 * DOUBT.unseen / data.blocks), cost - 0.5 * DOUBT.noise * e.size)
    error = math.sqrt(2.0 * cost / e.size) * max(run.sigma for run in data.runs)
    found: list[list[np.ndarray]] = []
    for term in terms(model, data.runs, error):
        own = []
        for start in term.starts[:1] + term.starts[1:][-1:]:
            secant = data.residuals(start) - e
            if np.all(np.isfinite(secant)):
                shift = inverse @ (j.T @ secant)
                apart = secant - j @ shift
                most = max(0.5 * float(apart @ apart), 1e-12)
                own.append(shift * min(1.0, math.sqrt(max(hidden, 0.25 * float(e @ apart) ** 2 / most) / most)))
        found += [own] if own else []
    moved = [shift / math.sqrt(len(own) * len(found)) for own in found for shift in own]
    return np.array(moved).reshape(-1, j.shape[1]).T @ np.array(moved).reshape(-1, j.shape[1])


def _jackknife(model: LoopModel, layout: Sequence[Free], left_out: Sequence[LoopModel]) -> np.ndarray:
    """Covariance by the refits without each recording in turn; nothing of what they do not have free."""
    own = model.layout()
    z = np.array([m.vector(own) for m in left_out])
    n = len(left_out)
    spread = (n - 1) / n * (z - z.mean(axis=0)).T @ (z - z.mean(axis=0))
    place = [next((i for i, f in enumerate(own) if (f.owner, f.name) == (g.owner, g.name)), -1) for g in layout]
    out = np.zeros((len(layout), len(layout)))
    for a, i in enumerate(place):
        for b, k in enumerate(place):
            out[a, b] = spread[i, k] if i >= 0 and k >= 0 else 0.0
    return out
