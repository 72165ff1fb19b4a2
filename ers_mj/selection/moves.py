"""What a selection did, move by move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ers_mj.effects import BY_NAME
from ers_mj.estimation.objective import Fit
from ers_mj.selection.comparison import Candidate
from ers_mj.servo.model import Model

Rounds = Sequence[Sequence[Candidate]]
Grown = tuple[Fit, list[tuple[Candidate, ...]]]  # a model, and the rounds that lead to it


@dataclass(frozen=True)
class Move:
    """One move: its ``kind`` (add, drop, swap, pair, sweep, widen or restart), the effects before and after it, what it
    gained in C, whether it was ``accepted``, and why.

    A restart fits the same effects again from another place.
    """

    kind: str
    before: tuple[str, ...]
    after: tuple[str, ...]
    gain: float
    accepted: bool
    because: str

    def __str__(self) -> str:
        ways = {name: " + ".join(names) or "baseline" for name, names in (("b", self.before), ("a", self.after))}
        way = f"{ways['b']} -> {ways['a']}" if self.accepted else f"{ways['b']} stays"
        return f"{self.kind}: {way}, robust cost {-self.gain:+.2f}: {self.because}"


def less(model: Model, name: str) -> Model:
    """A model without an effect, or without what differs between recordings."""
    if name in BY_NAME:
        return model.without_effect(name)
    return replace(model, states={k: v for k, v in (model.states or {}).items() if k != name} or None)


def rounds_that_count(rounds: int, model: Model) -> int:
    """Of the rounds that led to a model: those for what differs between recordings do not count, nor, once, one whose
    effect a later one made needless.
    """
    effects = rounds - len(model.states or {})
    return effects - (effects > len(model.names))
