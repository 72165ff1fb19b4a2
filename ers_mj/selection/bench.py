"""What a selection works on and by: the recordings, the tau at which C is judged, the policy, the budget."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from ers_mj.data.prepared import Blocks, Trace
from ers_mj.decisions import explained
from ers_mj.decisions.thresholds import POLICY, Policy
from ers_mj.estimation.fit import Along, fit
from ers_mj.estimation.objective import Fit
from ers_mj.estimation.sparse import few_of
from ers_mj.selection.budget import SEARCH, Budget, Search
from ers_mj.selection.comparison import Candidate, judged, priced
from ers_mj.servo.model import Model
from ers_mj.solvers.successive_halving import carried_on

A = TypeVar("A")
B = TypeVar("B")


@dataclass(frozen=True)
class Bench:
    """The traces, the tau at which C is judged, how many threads help (the result does not depend on it), the effects
    that are not looked for, the policy, the sizes of the search, and the budget of simulation.
    """

    traces: Sequence[Trace]
    tau: float
    jobs: int = 1
    exclude: Sequence[str] = ()
    policy: Policy = POLICY
    search: Search = SEARCH
    budget: Budget = field(default_factory=lambda: Budget(()), repr=False)

    def without(self, names: Iterable[str]) -> Bench:
        """The bench on which these effects are not looked for either."""
        return replace(self, exclude=(*self.exclude, *names))

    def few(self, base: Fit) -> Bench:
        """The bench for first steps beside a base: few samples, where that is as far from those as from all."""
        return replace(self, traces=few_of(base.model, self.traces, self.tau))

    @property
    def counts(self) -> np.ndarray:
        """Samples in each block (B,)."""
        return Blocks.of(self.traces).counts

    def fit(self, model: Model, steps: int, **settings) -> Fit:
        """A fit of at most so many steps at this tau (see estimation.fit)."""
        return fit(model, self.traces, tau=self.tau, steps=steps, **settings)

    def cost(self, found: Fit) -> float:
        """C of a fit without its priors, at this tau."""
        return explained.cost(found.misfit, self.tau)

    def judged(self, name: str, found: Fit, base: Fit) -> Candidate:
        """What a fit has won over the model that it extends."""
        return judged(name, found, base, self.tau, self.policy)

    def priced(self, found: Fit) -> float:
        """A fit's cost and the price of its parameters."""
        return priced(found, self.policy)

    def each(self, function: Callable[[A], B], items: Iterable[A]) -> list[B]:
        """The function of each item, side by side."""
        if self.jobs == 1:
            return list(map(function, items))
        with ThreadPoolExecutor(self.jobs) as pool:
            return list(pool.map(function, items))

    def carried_on(
        self,
        begun: Iterable[Model],
        is_near: Callable[[Fit], bool],
        *,
        first: int,
        then: int,
        along: Along,
        ceiling: np.ndarray | None = None,
    ) -> list[Fit]:
        """The models fitted for ``first`` steps along these slopes, and for ``then`` more, under a ``ceiling``, where
        that ``is_near``.
        """
        return carried_on(
            begun,
            lambda model: self.fit(model, first, along=along),
            is_near,
            lambda found: self.fit(found.model, then, ceiling=ceiling),
            self.each,
        )

    def leaves_more_than_forks(self, current: Fit) -> bool:
        """Whether effects leave more than forks of stick and slip in two blocks do."""
        return bool(current.model.names) and explained.is_more_than_forks(current.misfit, self.tau, self.policy)

    def is_doubtful(self, current: Fit) -> bool:
        """Whether a model of one body does, beside which a sweep takes little time."""
        return not current.model.plant().coupled and self.leaves_more_than_forks(current)
