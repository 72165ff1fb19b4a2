"""Which effects does the data ask for? A round at a time (candidates.py), as long as the winner buys more than chance
offers; what is named is looked at again.

    compare -> sweep what was missed -> decide (decisions/acceptance.py) -> add -> drop, swap, widen -> compare ...
    nothing asked for -> review, pair, part -> end
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from ers_mj.data.prepared import Trace
from ers_mj.decisions import acceptance, explained
from ers_mj.decisions.thresholds import POLICY, Policy
from ers_mj.decisions.verdict import is_more_than_noise
from ers_mj.effects import BY_NAME
from ers_mj.estimation.baseline import Held, Start
from ers_mj.estimation.fit import hopped
from ers_mj.estimation.initial_state import begun_again
from ers_mj.estimation.objective import Fit, tau_of
from ers_mj.selection.bench import Bench
from ers_mj.selection.budget import Budget
from ers_mj.selection.candidates import candidates
from ers_mj.selection.comparison import Candidate, bends_and_twists, is_dear, stands_alone
from ers_mj.selection.drop import pruned, reconsidered
from ers_mj.selection.foundation import held_beside, held_instead, hung
from ers_mj.selection.loads import still_loaded, under_loads
from ers_mj.selection.moves import Grown, Move, less, rounds_that_count
from ers_mj.selection.pair import bending_and_twisting, beside_a_rival, paired
from ers_mj.selection.swap import as_what_it_is, exchanged, in_its_place, narrowed, other_way_round, reviewed, widened
from ers_mj.selection.sweep import SIZED, any_body, joined, of_one_body, of_two_bodies, swept
from ers_mj.selection.whiteness import is_beyond_rounding, left_by_sensor

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Selection:
    """The chosen model, the baseline it grew from, each round's candidates, the tau at which the last was judged, the
    traces with the starts that the chosen model gives them, what was done, and if a budget ended it.
    """

    base: Fit
    chosen: Fit
    rounds: tuple[tuple[Candidate, ...], ...]
    tau: float
    traces: Sequence[Trace]
    trail: tuple[Move, ...] = ()
    cut_short: bool = False


def select(
    base: Fit,
    traces: Sequence[Trace],
    *,
    start: Start | None = None,
    exclude: Sequence[str] = (),
    jobs: int = 1,
    progress: Progress = lambda text, share: None,
    policy: Policy = POLICY,
    budget: Budget | None = None,
) -> Selection:
    """Grow the model while the data asks for it, dropping what later additions make needless.

    Of the ``start`` the anchors are tried as well; a baseline in which an effect is held for a spring is what it grows
    from where that explains far more, and a candidate of the first round where not.

    What takes longest, the sweeps, what is begun once more the other way round, and a shaft or a play beside a bristle,
    is left out as the ``budget`` of simulation is spent, the selection's own unless one is handed in; its sizes are
    those of the search.
    """
    budget = Budget(traces) if budget is None else budget
    base = replace(base, model=replace(base.model, effort=budget.effort))
    bench = Bench(traces, tau_of(base.misfit), jobs, exclude, policy, budget.search, budget)
    growing = _Stepwise(bench, base, start.anchors if start is not None else (), progress)
    growing.may_hang = start is not None and start.held is None and not start.is_spring_known
    if start is not None and start.held is not None:
        growing.begin_with(start.held)
    growing.tell_loads()
    return growing.run()


class _Stepwise:
    """A selection under way: the model so far, the rounds that led to it, and what has been tried once."""

    def __init__(self, bench: Bench, base: Fit, anchors: Sequence[Mapping[str, float]], progress: Progress):
        self.bench, self.base, self.current, self.anchors, self.progress = bench, base, base, anchors, progress
        self.rounds: list[tuple[Candidate, ...]] = []
        self.trail: list[Move] = []
        self.tried: set[str] = set()  # of what is tried once a case
        self.mended, self.took = 0, 0.0
        self.held: Fit | None = None  # a baseline that holds the output otherwise, as a candidate
        self.may_hang = False  # whether one is to be made where a load is named
        self.given: tuple[str, ...] = ()  # effects of the baseline

    def run(self) -> Selection:
        while not (cut_short := not self._may_go_on()):
            if self._taken() >= self.bench.policy.most_effects:
                if not self._look_again(("pair", self._pair)):
                    break
                continue
            comparison = self._compare()
            if comparison is None:  # the model itself has been mended
                continue
            ranked, bar = comparison
            asked, because = self._asked(ranked, bar)
            self.rounds.append(tuple(sorted(ranked, key=lambda c: c is not asked)))
            if asked is None:
                self._note("add", self.current, 0.0, False, because)
                if not self._look_again(("swap", self._review), ("pair", self._pair), ("pair", self._part)):
                    break
                self.tried.add("review")
            else:
                self._add(because)
        self._look_again(("swap", lambda: as_what_it_is(self.bench, self.current, self.rounds)))
        if not is_dear(self.current):
            self._go_on("narrow", narrowed(self.bench, self.current), self.current, "a narrower form does as well")
        bench, rounds, trail = self.bench, tuple(self.rounds), tuple(self.trail)
        return Selection(self.base, self.current, rounds, bench.tau, bench.traces, trail, cut_short)

    # -- how far it goes -----------------------------------------------------------------------------------------------

    def _may_go_on(self) -> bool:
        """Whether another round may begin."""
        budget, current = self.bench.budget, self.current
        longer = not is_dear(current) and self.bench.leaves_more_than_forks(current)
        return budget.spent < (budget.longest if longer else budget.last)

    def _may_sweep(self) -> bool:
        return self.bench.budget.spent < self.bench.budget.sweeps

    def _taken(self) -> int:
        return rounds_that_count(len(self.rounds), self.current.model) - self._given()

    def _given(self) -> int:
        """How many of the effects are the baseline's own."""
        return sum(name in self.given for name in self.current.model.names)

    def _is_in_order(self) -> bool:
        """Whether a further effect may be told that takes a small part only: of few, or near the noise, or after one
        that took a good part.
        """
        policy, few = self.bench.policy, self._taken() < self.bench.policy.fewer_effects
        near = explained.is_near_noise(self.current.misfit, policy)
        return self.bench.budget.spent < self.bench.budget.last and (few or near or self.took >= policy.good_part)

    # -- what it stands on --------------------------------------------------------------------------------------------

    def begin_with(self, held: Held) -> None:
        """Grow from a baseline that holds the output otherwise, where it is the better one; else keep it as a
        candidate.
        """
        bench, base, one = held_instead(self.bench, self.base, held)
        if one is None:
            self.held = replace(held.fit, model=replace(held.fit.model, effort=self.bench.budget.effort))
            return
        self._note("add", one.fit, one.gain, True, "it holds the output in the place of a spring")
        self.bench, self.base, self.current, self.given = bench, base, one.fit, one.fit.model.names
        self.rounds.append((one,))

    def tell_loads(self) -> None:
        """Give each recording a load of its own, where that is what they differ by, before anything is missed."""
        if (found := under_loads(self.bench, self.current)) is None:
            return
        one, is_bare = self.bench.judged("load", found, self.current), not self.current.model.names
        self._note("add", found, one.gain, True, "recordings fitted one by one are of different loads")
        states = found.model.states
        self.base = found if is_bare else self.bench.fit(replace(self.base.model, states=states), 20)
        self.current = found
        self.rounds.append((one,))

    def _hold_otherwise(self) -> None:
        """Stand on what holds the output otherwise, where what was found since shows it."""
        if self.may_hang and any(BY_NAME[name].subsystem == "load" for name in self.current.model.names):
            self.may_hang, self.held = False, hung(self.bench, self.base)
        if self.held is None or any(name in self.current.model.names for name in self.held.model.names):
            return
        if (found := held_beside(self.bench, self.current, self.held)) is None:
            return
        self._go_on("swap", found, self.current, "what was found since shows what holds the output")
        self.given, self.held = self.held.model.names, None
        self.rounds.insert(0, (self.bench.judged(self.given[-1], found, self.base),))

    # -- comparing -----------------------------------------------------------------------------------------------------

    def _compare(self) -> tuple[list[Candidate], acceptance.Bar] | None:
        """A round's candidates, the likeliest first, and what must be bought; None where the model itself was mended on
        the way.
        """
        bench = self.bench
        self.progress(f"round {len(self.rounds) + 1}: comparing effects", 0.15 + 0.12 * len(self.rounds))
        bar = self._bar()
        ranked = self._ranked(bar)
        leader, may_mend = ranked[0] if ranked else None, self.mended < self._most_mended()
        if may_mend and (again := self._way_back(ranked, bar)) is not None:
            won = self._mend(again)
            if leader.gain - won < bar.faint or any(c.worth >= leader.worth - won for c in ranked[1:]):
                return None
            ranked, may_mend = [bench.judged(c.name, c.fit, self.current) for c in ranked], False
            leader = ranked[0]
        bar = replace(bar, outstanding=explained.stands_out(self.current.misfit, bench.tau, bench.policy))
        ranked = self._with_what_was_missed(ranked, bar)
        if may_mend and ranked and ranked[0] is not leader and (again := self._way_back(ranked, bar)) is not None:
            self._mend(again)
            return None
        return self._other_way_round(ranked, bar), bar

    def _ranked(self, bar: acceptance.Bar) -> list[Candidate]:
        """The promising candidates; in the first round a baseline that holds the output otherwise among them."""
        bench, current, is_first = self.bench, self.current, not self.rounds
        slow = () if self._may_sweep() else bending_and_twisting(current.model)
        last = bench.budget.raced if is_dear(current) else bench.budget.longest
        anchors = self.anchors if is_first else ()
        ranked = candidates(bench.without((*current.model.names, *slow)), current, anchors, bar.faint, last)
        if self.held is None or not is_first:
            return ranked
        return joined(ranked, [bench.judged(self.held.model.names[-1], self.held, current)])

    def _bar(self) -> acceptance.Bar:
        """What must be bought beside the model as it stands."""
        current, bench = self.current, self.bench
        named, left = len(current.model.names) - self._given(), bench.cost(current)
        return acceptance.bar(left, named, is_dear(current), self._is_in_order(), False, bench.policy)

    def _most_mended(self) -> int:
        """How often the model itself may win on its way back from a candidate."""
        if bends_and_twists(self.current):
            return 0
        return 1 if is_dear(self.current) else self.bench.search.most_mended

    def _way_back(self, ranked: Sequence[Candidate], bar: acceptance.Bar) -> Fit | None:
        """The model itself, refitted from where a leader of modest gain stands, if that wins something: the way out of
        a local minimum is no gain of an effect's.
        """
        policy = self.bench.policy
        if not ranked or not bar.faint <= ranked[0].gain <= policy.modest:
            return None
        again = self.bench.fit(less(ranked[0].fit.model, ranked[0].name), 12)
        return again if self.bench.cost(self.current) - self.bench.cost(again) > policy.local_minimum else None

    def _mend(self, again: Fit) -> float:
        """Go on from the model refitted; what it won."""
        won = self.bench.cost(self.current) - self.bench.cost(again)
        self._note("restart", again, won, True, "the model itself wins on its way back from a candidate")
        self.base = self.base if self.current.model.names else again
        self.current, self.mended = again, self.mended + 1
        return won

    def _with_what_was_missed(self, ranked: list[Candidate], bar: acceptance.Bar) -> list[Candidate]:
        """The candidates with what a sweep finds, where the screening may have missed what acts: the second body, which
        takes most of the time, once a case.
        """
        current, bench = self.current, self.bench
        nothing = not (ranked and acceptance.is_asked_for(ranked[0].offer, bar, bench.policy))
        beside, end, rough = bench.without(current.model.names), bench.budget.sweeps, self._is_rough_and_unswept(ranked)
        if rough or nothing and self._may_sweep() and self._is_cheap_and_wrong():
            kinds = of_one_body if "sweep" in self.tried else any_body
            self.tried.add("sweep")
            return joined(ranked, swept(beside, current, ranked, end, kinds, rough))
        if self._may_sweep() and self._may_twist(ranked):
            return joined(ranked, swept(beside, current, ranked, end, of_two_bodies))
        if nothing and bench.is_doubtful(current) or self._is_an_impulse_beside(ranked):
            end = bench.budget.longest  # what has a threshold no secant shows
            return joined(ranked, swept(beside.without(SIZED), current, ranked, end, of_one_body))
        return ranked

    def _is_rough_and_unswept(self, ranked: Sequence[Candidate]) -> bool:
        """Whether a model is wrong behind a coarse converter, of which nothing was swept yet and nothing explains
        all.
        """
        bench, model = self.bench, self.current.model
        if "sweep" in self.tried or not self._may_sweep() or not is_beyond_rounding(model, bench.traces, bench.policy):
            return False
        return not (ranked and explained.is_quiet(ranked[0].fit.misfit, bench.tau, bench.policy))

    def _is_cheap_and_wrong(self) -> bool:
        """Whether a model of one body, which is simulated fast, leaves more than noise (see whiteness.py)."""
        model, traces = self.current.model, self.bench.traces
        without = left_by_sensor(self.base.model, traces) if model.names else None
        left = None if model.plant().coupled else left_by_sensor(model, traces)
        return left is not None and is_more_than_noise(left, without, self.bench.policy)

    def _may_twist(self, ranked: Sequence[Candidate]) -> bool:
        """Whether a rudder whose friction bends a bristle is explained so badly that a play or a shaft may be there,
        which beside it no secant shows.
        """
        current = self.current
        near = explained.is_near_noise(current.misfit, self.bench.policy)
        bends = current.model.plant().bends and not bends_and_twists(current) and not near
        return bool(ranked) and bends and not ranked[0].fit.model.plant().has_motor_side

    def _is_an_impulse_beside(self, ranked: Sequence[Candidate]) -> bool:
        """Whether an impulse leads beside effects of one body: in the blocks where a law is missed most it may do what
        that would do in all.
        """
        leads = bool(ranked and self.current.model.names and ranked[0].offer.once)
        return leads and not self.current.model.plant().coupled

    def _other_way_round(self, ranked: list[Candidate], bar: acceptance.Bar) -> list[Candidate]:
        """The candidates with those that come of the last round's rivals, while something may still be bought."""
        bench, current = self.bench, self.current
        if not (self.rounds and ranked and self._may_sweep()):
            return ranked
        if explained.attainable(current.misfit, bench.counts, bench.tau) >= bar.usual:
            return other_way_round(bench, current, self.rounds[-1], ranked)
        return ranked

    def _asked(self, ranked: Sequence[Candidate], bar: acceptance.Bar) -> tuple[Candidate | None, str]:
        """What is named in this round, and why."""
        if not ranked:
            return None, "no effect promises anything"
        policy = self.bench.policy
        alone = [c.gain < bar.usual and stands_alone(c, ranked, policy) for c in ranked]
        offer, because = acceptance.asked([c.offer for c in ranked], alone, bar, policy)
        return next((c for c in ranked if c.offer is offer), None), because

    # -- growing -------------------------------------------------------------------------------------------------------

    def _add(self, because: str) -> None:
        """Put the leader of the last round in, and look at what was named before it."""
        leader, before, bench = self.rounds[-1][0], self.current, self.bench
        self._note("add", leader.fit, leader.gain, True, because)
        self.took = leader.gain / max(leader.gain, bench.cost(before))
        self._go_on("drop", pruned(bench, leader.fit, leader.name), leader.fit, "no longer pays beside the newest")
        current, self.rounds = reconsidered(bench, self.current, self.rounds)
        self._go_on("drop", current, self.current, "it was found in a model that the newest had bent")
        tau, least = tau_of(self.current.misfit), bench.policy.local_minimum
        self.bench = replace(bench, tau=tau, traces=begun_again(self.current.model, bench.traces, tau, least))
        self.current = self.bench.fit(self.current.model, 20)
        if (other := in_its_place(bench, self.current, before, self.rounds[-1])) is not None:
            self.rounds[-1] = other
            found = self.bench.fit(other[0].fit.model, 20)
            self._go_on("swap", found, self.current, "the refit made of it a form of another effect")
        self._refine(leader.name)
        self._hold_otherwise()
        found = still_loaded(self.bench, self.current)
        self._go_on("drop", found, self.current, "beside what was named the recordings are of one load")

    def _refine(self, newest: str) -> None:
        """Out of local minima, into wider forms, into the place of earlier rivals."""
        bench, policy = self.bench, self.bench.policy
        if not is_dear(self.current):
            self.current, _ = hopped(self.current, bench.traces, bench.tau, bench.jobs)
        if bench.cost(self.current) > policy.later_gain:
            self._go_on(
                "widen", widened(bench, self.current, newest), self.current, "a wider form pays beside the newest"
            )
        if explained.is_near_noise(self.current.misfit, policy):
            found = exchanged(bench, self.current, self.rounds)
            self._go_on("swap", found, self.current, "a rival is likelier beside what came later")

    def _go_on(self, kind: str, found: Fit, before: Fit, because: str) -> None:
        """Go on with what a move has found; noted where it is another model than ``before``."""
        if found is not before:
            self.current = before
            self._note(kind, found, before.cost - found.cost, True, because)
        self.current = found

    def _note(self, kind: str, found: Fit, gain: float, accepted: bool, because: str) -> None:
        before, after = ((*(fit.model.states or {}), *fit.model.names) for fit in (self.current, found))
        self.trail.append(Move(kind, before, after, gain, accepted, because))

    # -- looking again -------------------------------------------------------------------------------------------------

    def _look_again(self, *ways: tuple[str, Callable[[], Grown | None]]) -> bool:
        """Try these ways to a better model in turn, each with its kind of move; whether one has found it."""
        for kind, way in ways:
            if (other := way()) is not None:
                found, self.rounds = other
                self._go_on(kind, found, self.current, "better than what was named")
                return True
        return False

    def _review(self) -> Grown | None:
        """Something else in the place of the effect found last, once."""
        if "review" in self.tried or not self._may_sweep() or not self.bench.is_doubtful(self.current):
            return None
        return reviewed(self.bench, self.current, self.rounds, self.bench.budget.sweeps)

    def _pair(self) -> Grown | None:
        """Two effects in the place of the first leader, once."""
        if "pair" in self.tried:
            return None
        self.tried.add("pair")
        return paired(self.bench, self.current, self.rounds)

    def _part(self) -> Grown | None:
        """A rival of one body in the place of a lone second body, once."""
        bench = self.bench
        if "part" in self.tried or bench.budget.spent >= bench.budget.last:
            return None
        if not bench.leaves_more_than_forks(self.current):
            return None
        self.tried.add("part")
        return beside_a_rival(bench, self.current, self.rounds)
