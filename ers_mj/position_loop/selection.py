"""Which effects does a position loop's recording ask for? The bare loop first, then one effect at a time.

closed form -> base (gain, limit, latency, load) -> compare all candidates -> add the best -> ... -> leave out
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ers_mj.decisions.thresholds import POLICY, Policy
from ers_mj.effects.gravity_imbalance import GravityImbalance
from ers_mj.effects.input_delay import InputDelay
from ers_mj.effects.rate_limit import RateLimit
from ers_mj.effects.voltage_saturation import VoltageSaturation
from ers_mj.position_loop.closed_form import ClosedForms
from ers_mj.position_loop.compared import Compared, Left, Selection, in_order
from ers_mj.position_loop.fit import Data, Fit, Halving, best, fitted, gain, jacobian
from ers_mj.position_loop.model import LoopModel, only_letters
from ers_mj.position_loop.runs import Run, spread_out
from ers_mj.position_loop.terms import (
    CONSTANT,
    DERIVATIVE,
    INTEGRAL,
    SPRING,
    Term,
    delayed_within,
    form_of,
    is_there,
    lagging,
    lesser,
    other_forms,
    parts,
    sized,
    terms,
    ways_round,
)
from ers_mj.position_loop.two_bodies import other_sides, parted, refitted
from ers_mj.position_loop.weak_form import SCAN, Rough

Progress = Callable[[str, float], None]
GRAVITY = GravityImbalance.name
FIRST = (RateLimit.name, INTEGRAL)
BARE = (InputDelay.name, VoltageSaturation.name, RateLimit.name)  # what the loop of any servo may have


@dataclass(frozen=True)
class Effort:
    """How far a search goes."""

    rounds: int = 6
    alignments: int = 3  # of logs of different offsets
    screened: float = 50.0  # [s] of recordings on which starts are compared
    several: Halving = Halving(looked=9, first=10, kept=3)  # starts of the bare loop
    far: int = 25  # steps of the best ones of a bent model
    tried: int = 10  # steps of a candidate's best starts
    promise: float = 0.3  # of what is asked for, from which a law is refitted,
    begun: int = 3  # from so many of its starts
    finalists: int = 3  # candidates that are refitted to the end,
    near: float = 0.3  # those that gain this share of what the best one gains at first,
    nearer: float = 0.6  # or this one, where a refit to the end takes in more recordings than are screened
    enough: float = 1.15  # noise levels of error that a model may leave before what is far from it is tried
    full: int = 40  # steps of a fit to the end


EFFORT = Effort()


class Selector:
    """A selection under way on some runs."""

    def __init__(self, runs: Sequence[Run], is_angle: bool, jobs: int = 1, policy: Policy = POLICY):
        self.is_angle, self.jobs, self.policy = is_angle, jobs, policy
        self.logged = tuple(runs)
        self._take(runs)

    def _take(self, runs: Sequence[Run]) -> None:
        self.data = Data.of(runs)
        self.closed = ClosedForms(runs, self.is_angle)
        some = spread_out(runs, EFFORT.screened)
        self.screen = self.data if len(some) == len(runs) else Data.of(some)

    @property
    def runs(self) -> tuple[Run, ...]:
        return self.data.runs

    def run(self, progress: Progress = lambda text, share: None) -> Selection:
        """Base, rounds, and what can be left out again."""
        progress("fitting the loop", 0.05)
        base = self.base()
        current, rounds = self._levelled(base)
        while len(rounds) < EFFORT.rounds and self._may_gain(current := self.aligned(self.begun_again(current))):
            progress(f"round {len(rounds) + 1}: comparing effects", 0.1 + 0.1 * len(rounds))
            ranked = self.compared(current)
            rounds.append(tuple(ranked))
            if not ranked or not self._is_worth(current, ranked[0]):
                break
            current = self._formed(ranked[0])
        current = self._realigned(current)
        progress("leaving out what is not needed", 0.65)
        found = self.pruned(Selection(base, current, tuple(rounds)))
        chosen = found.chosen
        for name in chosen.model.names:  # beside all that was found
            chosen = self._formed(Compared(name, chosen, 0.0))
        return found if chosen is found.chosen else self.pruned(replace(found, chosen=chosen, left=()))

    def another(self, selection: Selection, refused: Collection[frozenset[str]]) -> Selection | None:
        """The selection with the best term that it lacks; None where that is not worth it, or where what stays is a set
        of terms that was refused.
        """
        current = selection.chosen
        ranked = self.compared(current, refused) if self._may_gain(current) else []
        if not ranked or not self._is_worth(current, ranked[0]):
            return None
        more = self.pruned(replace(selection, chosen=self._formed(ranked[0]), left=()))
        terms_of = [frozenset(parts(fit.model)) for fit in (current, more.chosen)]
        return None if terms_of[1] in {*refused, terms_of[0]} else more

    def _formed(self, taken: Compared) -> Fit:
        """The fit of a candidate, or the better one with that effect in another form, before others stand for that."""
        if not self._may_gain(taken.fit):
            return taken.fit
        starts = [[form] for form in other_forms(taken.fit.model, taken.name)]
        starts += other_sides(taken.fit.model) if taken.is_transmission else []
        others = [best(one, self.data, EFFORT.full) for one in starts]
        found = max(others, key=lambda fit: gain(taken.fit, fit), default=taken.fit)
        return found if gain(taken.fit, found) > self.policy.loop_place else taken.fit

    def _is_worth(self, current: Fit, candidate: Compared) -> bool:
        """Whether a candidate buys more than chance offers, and its share of what is left."""
        return candidate.gain >= self.policy.loop_gain and self._pays(current, candidate.fit)

    def _pays(self, without: Fit, after: Fit) -> bool:
        """Whether an effect takes its share of the squared error above the noise: of a model that stays wrong blocks
        hang together, and nearly anything gains.
        """
        above = max(without.misfit - 1.0, 0.0)
        return without.misfit - after.misfit >= self.policy.least_share * above

    def _takes_most(self, current: Fit, candidate: Compared) -> bool:
        """Whether a candidate may be taken before others are looked at."""
        return candidate.gain >= self.policy.loop_gain and candidate.fit.misfit < 0.5 * current.misfit

    # -- the bare loop -------------------------------------------------------------------------------------------------

    def base(self) -> Fit:
        """The loop with a limit and without, under gravity (or a spring where the output is no angle)."""
        roughs = [rough for width in SCAN.widths for rough in self.closed.rough(self.closed.loads, width)]
        starts = [self.closed.begun(rough) for rough in roughs]
        first = min(roughs, key=lambda rough: rough.left)
        if "L" in first.values:
            values = {**first.values, "K": 1.5 * first.values["K"], "L": 1.3 * first.values["L"]}
            starts.append(self.closed.begun(Rough(values, first.left)))
        bare = self._whole(best(starts, self.screen, EFFORT.full, EFFORT.several))
        found = self._firmware(bare)
        within = self._firmware(self._whole(best(delayed_within(bare.model), self.screen, EFFORT.full)))
        return self.unburdened(within if gain(found, within) > self.policy.loop_place else found)

    def _firmware(self, fit: Fit) -> Fit:
        """The fit, or a better one of the same loop in another firmware: the damped speed lags behind; the integral is
        empty at the beginning; the gain register multiplies all of the loop, which only several gains tell.
        """
        if "D" in fit.model.free and "lag_s" not in fit.model.free:
            late = self._whole(best(lagging(fit.model), self.screen, EFFORT.full))
            damps = late.model["D"] > self.policy.loop_damping * late.model["a_2"]
            fit = late if gain(fit, late) > 0.0 or (damps and late.cost < fit.cost) else fit
        for turned in ways_round(fit.model, self.runs):
            fit = min(fit, fitted(turned(fit.model), self.data, EFFORT.full), key=lambda one: one.cost)
        return fit

    def aligned(self, base: Fit) -> Fit:
        """The bare loop once the logs' offsets against the first one are taken off, where they leave half of what it
        leaves: what differs between recordings comes before structure.
        """
        for _ in range(EFFORT.alignments if len(self.runs) > 1 else 0):
            each = self._offsets(base)
            if sum(fit.cost for fit in each) > 0.5 * base.cost or not self._may_gain(base):
                break
            base = self._shifted(base, each)
        return base

    def _offsets(self, base: Fit) -> list[Fit]:
        """Each run's own offset, all else as it is."""
        alone = only_letters(base.model, ("offset",))
        return [fitted(alone, self.data.alone(run), EFFORT.tried) for run in self.runs]

    def _shifted(self, base: Fit, each: Sequence[Fit]) -> Fit:
        """The loop on runs that are taken to the first one's offset."""
        first = each[0].model["offset"]
        self._take([run.shifted(fit.model["offset"] - first) for run, fit in zip(self.runs, each, strict=True)])
        return fitted(base.model, self.data, EFFORT.full)

    def _realigned(self, found: Fit) -> Fit:
        """The loop once logs that were aligned are aligned anew: what it lacked then bent their offsets."""
        for _ in range(EFFORT.alignments):
            before = self.runs
            if all(run is log for run, log in zip(before, self.logged, strict=True)):
                break
            again = self._shifted(found, self._offsets(found))
            if gain(found, again) < self.policy.loop_place:
                self._take(before)
                break
            found = again
        return found

    def _levelled(self, base: Fit) -> tuple[Fit, list[tuple[Compared, ...]]]:
        """The loop with what bends all the rest, its logs aligned before that is looked for or after, whichever leaves
        less: what bends a loop may look like offsets, and they like that.
        """
        logs = self.runs
        aligned = self.aligned(base)
        bent, rounds = self._bent(aligned)
        if aligned is base:
            return self.aligned(bent), rounds
        shifted = self.runs
        self._take(logs)
        other, other_rounds = self._bent(base)
        other = self.aligned(other)
        if other.cost < bent.cost:
            return other, other_rounds
        self._take(shifted)
        return bent, rounds

    def _bent(self, current: Fit) -> tuple[Fit, list[tuple[Compared, ...]]]:
        """The fit with what bends all the rest, before anything that could stand for it, and those rounds."""
        rounds: list[tuple[Compared, ...]] = []
        for name in FIRST:
            if self._may_gain(current):
                for c in self._ranked(current, self._terms(current, (name,))):
                    if self._takes_most(current, c):
                        rounds.append((c,))
                        current = self._firmware(c.fit)
        return current, rounds

    def _whole(self, fit: Fit) -> Fit:
        """A fit to some of the runs refitted to all."""
        return fit if self.screen is self.data else fitted(fit.model, self.data, EFFORT.full)

    def unburdened(self, fit: Fit) -> Fit:
        """The fit without those loads that do not pay."""
        for name in (SPRING, GRAVITY, CONSTANT):
            if is_there(fit.model, name):
                bare = best(lesser(fit.model, name), self.data, EFFORT.full)
                fit = bare if gain(bare, fit) < self.policy.loop_gain else fit
        return fit

    def begun_again(self, fit: Fit) -> Fit:
        """The fit, or a better one of the same terms from their closed form, in this firmware or another: what was not
        yet there bent what was told first.
        """
        starts = self.closed.again(fit.model) if self._may_gain(fit) else []
        if not starts:
            return fit
        starts += [turned(start) for turned in ways_round(fit.model, self.runs) for start in starts]
        found = self._whole(best(starts, self.screen, EFFORT.full, EFFORT.several))
        return found if gain(fit, found) > self.policy.loop_place else fit

    # -- comparing -----------------------------------------------------------------------------------------------------

    def _may_gain(self, fit: Fit) -> bool:
        """Whether noise alone leaves so much less that an effect could be asked for."""
        return 0.5 * fit.blocks * math.log(max(fit.misfit, 1e-9)) > self.policy.loop_gain

    @staticmethod
    def _explains(fit: Fit) -> bool:
        """Whether a fit leaves little beside the noise."""
        return fit.misfit < EFFORT.enough**2

    def _error(self, fit: Fit) -> float:
        """What a fit leaves [output unit]."""
        return math.sqrt(fit.misfit) * float(np.sqrt(np.mean([run.sigma**2 for run in self.runs])))

    def compared(self, current: Fit, refused: Collection[frozenset[str]] = ()) -> list[Compared]:
        """The candidates beside a model, the one that buys most first: two bodies only where one leaves too much; none
        that makes a set of terms that was refused.
        """
        there = parts(current.model)
        every = [term for term in self._terms(current) if frozenset((*there, term.name)) not in refused]
        ranked = self._ranked(current, self._promising(current, [t for t in every if not t.is_far]))
        if ranked and self._explains(ranked[0].fit):
            return self._weighed(ranked)
        return self._weighed(in_order([*self._ranked(current, [t for t in every if t.is_far]), *ranked]))

    def _weighed(self, ranked: list[Compared]) -> list[Compared]:
        """The candidates, a weight before a spring that does no better: along a small travel they are alike."""
        least = ranked[0].gain - self.policy.loop_place if ranked and ranked[0].name == SPRING else math.inf
        return sorted(ranked, key=lambda c: not (c.name == GRAVITY and c.is_final and c.gain > least))

    def _terms(self, current: Fit, names: Sequence[str] = ()) -> list[Term]:
        """The candidates beside a model, or those of these names."""
        found = terms(current.model, self.runs, self._error(current))
        return [self.closed.beside(term, current.model) for term in found if not names or term.name in names]

    def _ranked(self, current: Fit, candidates: Sequence[Term]) -> list[Compared]:
        """The candidates, the one that buys most first, those that promise most refitted to the end. What acts in few
        runs is tried on all of them.
        """
        whole = self.screen is self.data
        seen = current if whole else fitted(current.model, self.screen, EFFORT.tried)
        often = [term for term in candidates if whole or not term.is_rare]
        quick = sorted(self._map(partial(self._tried, seen, self.screen), often), key=lambda c: -c.gain)
        least = (EFFORT.near if whole else EFFORT.nearer) * max((c.gain for c in quick), default=0.0)
        ready = [c for c in quick[: EFFORT.finalists] if c.gain > max(least, 0.0)]
        rest = quick[len(ready) :]
        seldom = self._map(
            partial(self._tried, current, self.data), [term for term in candidates if not (whole or not term.is_rare)]
        )
        for c in seldom:
            (ready if c.gain > self.policy.loop_gain else rest).append(c)
        full = list(self._map(partial(self._finished, current), ready))
        return in_order([*full, *rest])

    def _promising(self, current: Fit, candidates: Sequence[Term]) -> list[Term]:
        """The candidates without those laws of which no start, in any size and beside any other numbers of the model,
        takes away what could be asked for; the others' starts that promise most, in the size that does.
        """
        slopes = jacobian(current.model, self.data)
        basis = np.linalg.qr(slopes)[0] if slopes.size else np.zeros((current.errors.size, 0))
        e = current.errors - basis @ (basis.T @ current.errors)

        def promise(model: LoopModel) -> tuple[float, float]:
            d = self.data.residuals(model) - current.errors
            d = d - basis @ (basis.T @ d)
            if not np.isfinite(d).all():
                return 0.0, 1.0
            size = -float(e @ d) / max(float(d @ d), 1e-300)
            return -0.5 * current.blocks * math.log(max(1.0 + size * float(e @ d) / float(e @ e), 1e-9)), size

        least, found = EFFORT.promise * self.policy.loop_gain, []
        for term in candidates:
            if not term.is_law:
                found.append(term)
                continue
            ranked = sorted(((*promise(start), k) for k, start in enumerate(term.starts)), reverse=True)
            if ranked[0][0] > least:
                forms = [form_of(term.starts[k], term.name) for *_, k in ranked]
                order = sorted(range(len(ranked)), key=lambda n: forms.index(forms[n]) != n)  # each form's best first
                first = [ranked[n] for n in order[: EFFORT.begun]]
                found.append(replace(term, starts=tuple(sized(term.starts[k], term.name, x) for _, x, k in first)))
        return found

    @staticmethod
    def _tried(current: Fit, data: Data, term: Term) -> Compared:
        if term.is_bent:
            fit = best(term.starts, data, EFFORT.far, EFFORT.several)
        elif term.is_far:
            fit = parted(term.starts, data)
        else:
            fit = best(term.starts, data, EFFORT.tried)
        return Compared(term.name, fit, gain(current, fit))

    def _finished(self, current: Fit, candidate: Compared) -> Compared:
        fit = refitted([candidate.fit.model], self.data, EFFORT.full, EFFORT.enough)
        return replace(candidate, fit=fit, gain=gain(current, fit), is_final=True)

    def _map(self, call: Callable, items: Sequence):
        if self.jobs == 1:
            return map(call, items)
        with ThreadPoolExecutor(self.jobs) as pool:
            return list(pool.map(call, items))

    # -- leaving out ---------------------------------------------------------------------------------------------------

    def pruned(self, selection: Selection) -> Selection:
        """The selection with what buys too little taken out again, and with what the rest buys."""
        current = selection.chosen
        while True:
            left = [self._left_out(current, name) for name in parts(current.model)]
            weakest = min(left, key=lambda x: x.gain - self._least(x, current), default=None)
            if weakest is None or weakest.gain >= self._least(weakest, current):
                return replace(selection, chosen=current, left=tuple(left))
            current = weakest.fit

    def _least(self, left: Left, current: Fit) -> float:
        """What a term must buy; one that takes no share (a part of the bare loop's need not), everything, and so one
        whose size says that it is not there, unless too much is left without it.
        """
        model, policy = current.model, self.policy
        small = {
            INTEGRAL: model["I"] < policy.loop_integral * model["K"],
            DERIVATIVE: abs(model["D"]) < policy.loop_damping * model["a_2"],
        }
        absent = small.get(left.name, False) and self._explains(left.fit)
        shares = left.name in BARE or self._pays(left.fit, current)
        return policy.loop_gain if shares and not absent else math.inf

    def _left_out(self, current: Fit, name: str) -> Left:
        """The best refit without a term, from where the answer stands and from its own closed form."""
        enough = math.inf if self._explains(current) else EFFORT.enough
        fit = refitted(lesser(current.model, name), self.data, EFFORT.full, enough)
        return Left(name, gain(fit, current), fit)
