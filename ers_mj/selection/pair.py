"""Do two effects together explain what one of them stands for?"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import Along
from ers_mj.estimation.objective import Fit
from ers_mj.plants.reduced import ReducedModel
from ers_mj.selection.bench import Bench
from ers_mj.selection.candidates import candidates
from ers_mj.selection.comparison import Candidate, is_clocked, is_dear, kin_of
from ers_mj.selection.moves import Grown
from ers_mj.servo.model import Model


def paired(bench: Bench, current: Fit, rounds: Sequence[tuple[Candidate, ...]]) -> Grown | None:
    """The model with two rivals of the first leader without a clock of its own in the place of it and all that came
    later, and their rounds, if that is better: what leads may do much of what two others do together, neither of which
    does as much alone.
    """
    k = _first_lawful(current, rounds)
    if k is None or is_dear(current) or not (_named_since(current, rounds[k:]) > 1 or bench.is_doubtful(current)):
        return None
    leader, *others = rounds[k]
    won = leader.gain + bench.cost(leader.fit) - current.cost
    pairs = _pairs(bench, leader, others, won)
    begun = [a.fit.model.with_effect(b.name, dict(b.fit.model.effects)[b.name]) for a, b in pairs]
    ends = bench.carried_on(
        begun,
        lambda found: found.cost - current.cost < bench.search.far * won,
        first=20,
        then=20,
        along=Along(renewals=4),
    )
    if not ends:
        return None
    found, (a, b) = min(zip(ends, pairs, strict=True), key=lambda end: bench.priced(end[0]))
    if bench.priced(found) >= bench.priced(current) - bench.policy.tie:
        return None
    first = (a, *(c for c in rounds[k] if c is not a))
    return found, [*rounds[:k], first, (bench.judged(b.name, found, a.fit),)]


def _first_lawful(current: Fit, rounds: Sequence[tuple[Candidate, ...]]) -> int | None:
    """The first round whose leader is still named and has no clock of its own."""
    named = current.model.names
    return next(
        (k for k, ranked in enumerate(rounds) if ranked and ranked[0].name in named and not is_clocked(ranked[0].name)),
        None,
    )


def _named_since(current: Fit, rounds: Sequence[tuple[Candidate, ...]]) -> int:
    """How many leaders of these rounds are still named."""
    return len({ranked[0].name for ranked in rounds if ranked} & {*current.model.names})


def _pairs(
    bench: Bench, leader: Candidate, others: Sequence[Candidate], won: float
) -> list[tuple[Candidate, Candidate]]:
    """The pairs of rivals, of one body and without a clock, that buy enough of what was ``won`` one by one."""
    least = bench.policy.rival * leader.gain
    rivals = [c for c in others if c.name in BY_NAME and c.gain >= least and _is_quick_law(c)]
    enough = bench.search.paired * won
    pairs = [(a, b) for a, b in combinations(rivals, 2) if a.gain + b.gain >= enough and b.name not in kin_of(a.name)]
    return pairs[: bench.search.most_pairs]


def _is_quick_law(candidate: Candidate) -> bool:
    """Whether a candidate is a law without a clock of its own that is simulated fast."""
    return not (is_clocked(candidate.name) or BY_NAME[candidate.name].dear or candidate.fit.model.plant().coupled)


def beside_a_rival(bench: Bench, current: Fit, rounds: Sequence[tuple[Candidate, ...]]) -> Grown | None:
    """A rival of one body in the place of a lone play, shaft or bristle beside which nothing is found, with what a
    round finds beside it, and their rounds, if that is better: a second body does a part of much, and what acts with
    the rival need not show alone.
    """
    names = current.model.names
    if not current.model.plant().coupled or len(names) != 1 or rounds[0][0].name not in names:
        return None
    ends = _rounds_beside_rivals(bench, rounds[0])
    if not ends:
        return None
    rival, ranked = min(ends, key=lambda end: bench.priced(end[1][0].fit))
    if bench.priced(ranked[0].fit) >= bench.priced(current) - bench.policy.tie:
        return None
    return ranked[0].fit, [(rival, *(c for c in rounds[0] if c is not rival)), tuple(ranked)]


def _rounds_beside_rivals(bench: Bench, first: Sequence[Candidate]) -> list[tuple[Candidate, list[Candidate]]]:
    """The best rivals of one body of a round's leader, and what a round finds beside each, if anything."""
    leader, *others = first
    least = bench.policy.rival * leader.gain
    rivals = [c for c in others if c.name in BY_NAME and c.gain >= least and _is_quick(c)]
    ends = []
    for rival in rivals[: bench.search.most_parted]:
        coupling = (name for name, plant in plants_beside(rival.fit.model) if plant.coupled)
        ranked = candidates(bench.without((rival.name, *coupling)), rival.fit)
        if ranked:
            ends.append((rival, ranked))
    return ends


def _is_quick(candidate: Candidate) -> bool:
    """Whether a candidate lasts and is simulated fast."""
    return not (is_dear(candidate.fit) or BY_NAME[candidate.name].once or candidate.fit.model.plant().coupled)


def plants_beside(model: Model) -> list[tuple[str, ReducedModel]]:
    """The plants that a model's becomes with what may give it more than one body."""
    starts = (
        (name, effect.starts(model.scales)[:1])
        for name, effect in BY_NAME.items()
        if effect.subsystem == "transmission" or effect.dear
    )
    return [
        (name, model.with_effect(name, start).plant())
        for name, some in starts
        if name not in model.names
        for start in some
    ]


def bending_and_twisting(model: Model) -> list[str]:
    """The effects that make a plant whose friction bends a bristle and whose shaft twists, which the model's has only
    one of.
    """
    return [name for name, plant in plants_beside(model) if plant.bends and plant.has_motor_side]
