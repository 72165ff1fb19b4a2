"""The search from scratch: which spring, or what in its place, holds the output, begun from regressions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ers_mj.data.prepared import Trace
from ers_mj.decisions.thresholds import POLICY
from ers_mj.effects import BY_NAME, EFFECTS
from ers_mj.effects.quantities import Scales
from ers_mj.errors import InputError
from ers_mj.estimation.fit import descend, fit
from ers_mj.estimation.objective import Fit, cost_of
from ers_mj.estimation.scales import ampere_in, free_in, scales_of
from ers_mj.servo.model import Model

if TYPE_CHECKING:
    from ers_mj.estimation.initial_guess import Guess

OPENING_RATES = (20.0, 5.0)  # observer rates [1/s] of the search from scratch
OPENING_TAU = 1e3  # and the misfit at which its cost turns to logarithms
STARTS = 6, 3  # guesses that are refitted, of the regression for the acceleration and of that for the input
OPENED = {
    "preload": STARTS[0],
    "spring": 2,
    "bare": 2,
}  # of these in a search that is only opened, in which the first has the most terms
BEHIND = 0.25  # of C per block, by which a kind is too far behind to be finished
SPRINGS: Mapping[str, tuple[str, ...]] = {"bare": (), "spring": ("a_1",), "preload": ("a_1", "c_1")}
HOLDING = {effect.name: effect for effect in EFFECTS if effect.holds_place}  # what may stand in a spring's place


def opening(traces: Sequence[Trace], is_angle: bool) -> dict[str, float]:
    """Eq. (6)'s letters from recordings alone, with the springs that these support: near enough for a search to begin,
    not refined.

    What was found with more terms opens the searches with fewer; a search that is far behind is not finished.
    """
    kinds = Kinds.of(traces, {}, is_angle)
    best: dict[str, Fit] = {}
    for kind, count in OPENED.items():
        models = kinds.models(kind, (found.model.values for found in best.values()))
        models.sort(key=lambda model: cost_of(model, traces, OPENING_RATES[0], OPENING_TAU))
        tries = [descend(model, traces, OPENING_RATES[0], OPENING_TAU, 6, 1.0) for model in models[:count]]
        best[kind] = min(tries, key=lambda found: found.cost)
    level = min(found.cost for found in best.values()) + BEHIND * best["bare"].misfit.size
    finished = {
        kind: fit(found.model, traces, rate=OPENING_RATES[1], steps=10)
        for kind, found in best.items()
        if found.cost <= level
    }
    return dict(simplest(finished).model.values)


def simplest(found: Mapping[str, Fit]) -> Fit:
    """The fit with the fewest springs that the data supports."""
    kinds = [kind for kind in SPRINGS if kind in found]
    chosen = found[kinds[0]]
    price = POLICY.support * chosen.misfit.size
    for kind in kinds[1:]:
        if chosen.cost - found[kind].cost > price:
            chosen = found[kind]
    return chosen


@dataclass(frozen=True)
class Kinds:
    """Guesses by what holds the output: the spring terms that they have, and the least that these may be, or an effect
    in their place.
    """

    traces: Sequence[Trace]
    guesses: Sequence[Guess]
    scales: Scales

    @classmethod
    def of(cls, traces: Sequence[Trace], known: Mapping[str, float], is_angle: bool) -> Kinds:
        """Those of recordings, beside what is known.

        Raises:
            InputError: an input of zeros, or too little motion.
        """
        from ers_mj.estimation.initial_guess import (
            guesses,  # brings scipy.signal, which takes a second to import and is needed here alone
        )

        if not any(t.u.any() for t in traces):
            raise InputError("the input is zero throughout: without a datasheet nothing tells what an input does")
        opened = any(t.enable is not None and not t.enable.all() for t in traces)
        shown = opened or any(c.kind == "current" for t in traces for c in t.channels)
        unsaid = {"tau_e": 0.0, "emf_share": 0.5 if shown else 0.0}
        found = [
            guess._replace(values={**unsaid, "ampere": ampere_in(guess.values["b"], traces), **guess.values, **known})
            for guess in guesses(traces, list(HOLDING.values()) if is_angle else ())
        ]
        if not found:
            raise InputError(
                "the output nowhere moves for long enough to guess parameters from it: a longer or livelier recording,"
                " or a datasheet, was expected"
            )
        return cls(traces, found, scales_of(traces, found[0].values, is_angle, None))

    def prepared(self, kind: str, values: Mapping[str, float]) -> dict[str, float]:
        """Values with the spring terms of a kind and no others."""
        least = {"a_1": 1e-3 * self.scales.acceleration / self.scales.position, "c_1": 0.1 * self.scales.acceleration}
        terms = SPRINGS.get(kind, ())
        absent = {name: 0.0 for name in least if name not in terms}
        if not terms:
            absent["theta_0"] = 0.5 * (self.scales.low + self.scales.high)
        return {**values, **{name: max(values[name], least[name]) for name in terms}, **absent}

    def models(self, kind: str, others: Iterable[Mapping[str, float]] = ()) -> list[Model]:
        """The most promising guesses of a kind, prepared, and others."""
        pool = self._pool(kind)
        either = ([guess for guess in pool if guess.of_input is way] for way in (False, True))
        chosen = [guess for some, most in zip(either, STARTS, strict=True) for guess in some[:most]]
        places = [(guess.values, guess.effects) for guess in chosen] + [(values, ()) for values in others]
        return [self._model(kind, values, effects) for values, effects in places]

    def _pool(self, kind: str) -> list[Guess]:
        """The guesses that a kind can begin from."""
        held_by = kind if kind in (*HOLDING, "preload") else "spring"
        pool = [guess for guess in self.guesses if guess.held_by == held_by]
        if pool or kind in HOLDING:
            return pool
        return [guess for guess in self.guesses if not guess.effects]

    def _model(self, kind: str, values: Mapping[str, float], effects: tuple) -> Model:
        prepared = self.prepared(kind, values)
        return Model(prepared, free_in(prepared, self.traces), effects=effects, scales=self.scales)

    def searched(self, kind: str) -> Fit | None:
        """The best of the guesses of a kind, under the scaffold that serves it best, of the two that open best; None
        where there is no guess.
        """
        sprung = kind != "bare"
        at = ((effect.name, effect.scaffold(self.scales, sprung)) for effect in BY_NAME.values())
        scaffolds = [(), *(((name, start),) for name, start in at if start is not None)]
        models = [
            replace(model, effects=(*model.effects, *scaffold)) for model in self.models(kind) for scaffold in scaffolds
        ]
        tries = [descend(model, self.traces, OPENING_RATES[0], OPENING_TAU, 6, 1.0) for model in models]
        tries.sort(key=lambda f: f.cost)
        finals = [fit(f.model, self.traces, rate=OPENING_RATES[1], steps=10) for f in tries[:2]]
        return min(finals, key=lambda f: f.cost, default=None)
