"""The fit of a motor and a load with a play or a shaft between them.

Where such bodies bounce, free runs fork: a little more of any number, and the next contact is another one. The errors
of runs that follow the log have far fewer minima, and lead to where a free run is fitted to the end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.effects import BY_NAME
from ers_mj.position_loop.fit import Data, Fit, Halving, best, fitted
from ers_mj.position_loop.model import LoopModel
from ers_mj.position_loop.terms import SIZES


@dataclass(frozen=True)
class Parting:
    """How far the search goes: starts of each side, steps of the best ones and of a stiffer contact, and how fast
    [1/s] a run follows its log that leads there.
    """

    starts: Halving = Halving(looked=8, first=6, kept=2)
    far: int = 25
    stiffer: int = 10
    following: float = 60.0


PARTING = Parting()


def parted(starts: Sequence[LoopModel], data: Data, enough: float) -> Fit:
    """The best fit, the sensors on each side in turn; where free runs leave more than ``enough`` noise levels, also
    from where following the log leads.
    """
    sides = [[start for start in starts if start.side == side] for side in dict.fromkeys(s.side for s in starts)]

    def on_each(data: Data) -> Fit:
        return min((_stiffened(best(s, data, PARTING.far, PARTING.starts), data) for s in sides), key=_cost)

    found = on_each(data)
    if found.misfit < enough**2:
        return found
    return min(found, fitted(on_each(_followed(data)).model, data, PARTING.far), key=_cost)


def refitted(starts: Sequence[LoopModel], data: Data, steps: int, enough: float) -> Fit:
    """The best fit of several starts; of two bodies that leaves more than ``enough`` noise levels also from where
    following the log leads.
    """
    found = best(starts, data, steps)
    if found.misfit < enough**2 or not found.model.has_two_bodies:
        return found
    return min(found, fitted(best(starts, _followed(data), steps).model, data, steps), key=_cost)


def _followed(data: Data) -> Data:
    return replace(data, following=PARTING.following)


def _cost(fit: Fit) -> float:
    return fit.cost


def _stiffened(fit: Fit, data: Data) -> Fit:
    """The best fit with a stiff contact of those begun from one with a soft contact, each stiffer than the last; a fit
    without a play as it is.
    """
    found = [fit]
    for contact in SIZES.contacts[1:]:
        model = found[-1].model
        play = next((e for e in model.effects if BY_NAME[e[0]].is_play), None)
        if play is None:
            return fit
        found.append(fitted(model.with_effect(play[0], np.array([*play[1][:3], *contact])), data, PARTING.stiffer))
    return min(found[1:], key=_cost)
