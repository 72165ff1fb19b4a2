"""Refits of one round: what is fitted beside the same base, and what it has won there."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from ers_mj.decisions import explained
from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import Along
from ers_mj.estimation.objective import Fit
from ers_mj.selection.bench import Bench
from ers_mj.selection.comparison import Candidate
from ers_mj.selection.screening import Begin

Label = tuple[str, int]  # of a refit: the effect (or what differs between recordings), and which place it began from
Named = tuple[str, Fit]


class Refits:
    """The base of a round, and fits beside it; each is given up that stands above the base after a stage."""

    def __init__(self, bench: Bench, base: Fit):
        self.bench, self.base, self.reference = bench, base, bench.cost(base)

    def total(self, found: Fit) -> float:
        """C at the round's tau."""
        return self.bench.cost(found)

    def won(self, found: Fit) -> float:
        """The gain over the base."""
        return self.reference - self.total(found)

    def priced(self, found: Fit) -> float:
        """C and the price of the parameters."""
        return self.total(found) + self.bench.policy.parameter_price * found.size

    def most_won(self, ends: Mapping[Any, Fit]) -> float:
        return max(map(self.won, ends.values()), default=0.0)

    def explains_all(self, total: float) -> bool:
        """Whether so much of C is next to nothing."""
        return total <= self.bench.policy.quiet * self.base.misfit.size

    def fitted(self, items: Iterable[tuple], steps: int, along: Along = Along()) -> list[tuple]:
        """The pairs (label, what has a model) fitted on."""
        return self.mapped(items, lambda found: self.on(found, steps, along))

    def on(self, found: Fit | Begin, steps: int, along: Along = Along(), **settings) -> Fit:
        """A fit of so many steps from where something stands."""
        return self.bench.fit(found.model, steps, ceiling=self.base.misfit, along=along, **settings)

    def mapped(self, items: Iterable[tuple], function: Callable[..., Fit]) -> list[tuple]:
        """The pairs (label, function of what has a model), side by side."""
        return self.bench.each(lambda item: (item[0], function(item[1])), items)

    def finished(self, items: Iterable[tuple]) -> list[tuple]:
        """The pairs fitted to the end."""
        return self.fitted(items, 20)

    def lap(self, items: Iterable[tuple]) -> list[tuple]:
        """The pairs fitted a few steps on, on Jacobians of their own: one where these are finite differences beside an
        effect.
        """
        many = self.bench.search.renewals

        def on(found):
            has_many = found.model.has_tangents or not self.base.model.names
            return self.on(found, 6, Along(renewals=many if has_many else 1))

        return self.mapped(items, on)

    def quick(self, starts: Sequence[tuple[Label, Begin]]) -> dict[Label, Fit]:
        """The best of quick fits on a borrowed Jacobian, by label; those with the most parameters are begun first since
        they take longest.
        """
        order = sorted(starts, key=lambda start: -len(start[1].model.layout()))
        steps = self.bench.search.quick
        ends = self.mapped(order, lambda begin: self.on(begin, steps, Along(known=begin.known, renewals=0)))
        return {label: min((found for other, found in ends if other == label), key=self.total) for label, _ in starts}

    def contending(self, labels: Iterable, ends: Mapping[Any, Fit]) -> list:
        """Those labels that may still be the explanation: all while none explains everything, then the best one's
        rivals.
        """
        most = self.reference - min(map(self.total, ends.values()), default=self.reference)
        is_open = not self.explains_all(self.reference - most)
        return [n for n in labels if is_open or self.won(ends[n]) >= self.bench.policy.rival * most]

    def judged(self, ends: Iterable[Named]) -> list[Candidate]:
        return [self.bench.judged(name, found, self.base) for name, found in ends]


def leaders(ends: Mapping[Label, Fit], total: Callable[[Fit], float]) -> dict[str, Fit]:
    """The best fit by name of those by (name, place)."""
    return {name: min((found for (other, _), found in ends.items() if other == name), key=total) for name, _ in ends}


def cheapest(found: Sequence[Named], most: int) -> list[Named]:
    """Those that cost least, so many at most."""
    return sorted(found, key=lambda item: item[1].cost)[:most]


def is_out_of_reach(bench: Bench, base: Fit, least: float) -> bool:
    """Whether no explanation of what a base leaves could buy so much, nor an impulse be there."""
    policy = bench.policy
    most = explained.attainable(base.misfit, bench.counts, bench.tau)
    is_flat = explained.score(base.misfit, bench.tau).max() < math.log(policy.peak)
    return most < min(policy.least_gain, least) and bool(is_flat)


def is_law_of_dear(name: str) -> bool:
    """Whether an effect takes many times as long to simulate as others."""
    return name in BY_NAME and BY_NAME[name].dear
