"""Is what was named earlier still needed?"""

from __future__ import annotations

from collections.abc import Sequence

from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import Along
from ers_mj.estimation.objective import Fit
from ers_mj.selection.bench import Bench
from ers_mj.selection.comparison import Candidate, is_clocked
from ers_mj.selection.moves import Grown


def pruned(bench: Bench, current: Fit, newest: str) -> Fit:
    """Without the earlier effects that no longer pay; what a few steps along one Jacobian show to be sorely missed is
    not tried to the end.
    """
    for name in (n for n in current.model.names if n != newest):
        (without,) = bench.carried_on(
            [current.model.without_effect(name)],
            lambda found, cost=current.cost: found.cost - cost < bench.search.missed,
            first=4,
            then=12,
            along=Along(renewals=1),
            ceiling=current.misfit,
        )
        if without.cost - current.cost < bench.policy.least_gain:
            current = without
    return current


def reconsidered(bench: Bench, current: Fit, rounds: Sequence[tuple[Candidate, ...]]) -> Grown:
    """Without earlier effects with a clock of their own that the newest, a law of the servo, outweighs by far: they
    were found in what it had bent, and a round beside it finds again what is there.
    """
    newest = rounds[-1][0]
    least = bench.policy.outweighed * newest.gain
    leaders = [ranked[0] for ranked in rounds[:-1] if ranked[0].name in current.model.names]
    early = [c.name for c in leaders if c.name in BY_NAME and is_clocked(c.name) and c.gain < least]
    if not early or is_clocked(newest.name):
        return current, list(rounds)
    model = current.model
    for name in early:
        model = model.without_effect(name)
    return bench.fit(model, 20), [ranked for ranked in rounds if ranked[0].name not in early]
