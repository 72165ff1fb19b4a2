"""What a selection in a position loop compared, chose and left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from ers_mj.effects import BY_NAME
from ers_mj.position_loop.fit import Fit
from ers_mj.position_loop.terms import present


@dataclass(frozen=True)
class Compared:
    """A candidate of a round: its gain over the model at hand after everything was refitted, to all runs in the end or
    only at first.
    """

    name: str
    fit: Fit
    gain: float
    is_final: bool = False

    @property
    def is_transmission(self) -> bool:
        """Whether it parts the motor from the load."""
        return self.name in BY_NAME and BY_NAME[self.name].subsystem == "transmission"


@dataclass(frozen=True)
class Left:
    """What a term of the answer buys: its gain over the best refit without it."""

    name: str
    gain: float
    fit: Fit


@dataclass(frozen=True)
class Selection:
    """The bare loop, the answer, each round's candidates (the best first), and what each term of the answer buys."""

    base: Fit
    chosen: Fit
    rounds: tuple[tuple[Compared, ...], ...]
    left: tuple[Left, ...] = ()
    loads: tuple[tuple[str, Fit], ...] = field(default=(), repr=False)

    @property
    def named(self) -> tuple[Left, ...]:
        """The named effects, the one that buys most first."""
        names = present(self.chosen.model)
        return tuple(sorted((x for x in self.left if x.name in names), key=lambda x: -x.gain))


def in_order(candidates: Sequence[Compared]) -> list[Compared]:
    """Those that were refitted to the end first, of these the one that buys most."""
    return sorted(candidates, key=lambda c: (not c.is_final, -c.gain))
