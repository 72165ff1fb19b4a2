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
from ers_mj.position_loop.model import SIDES, LoopModel
from ers_mj.position_loop.terms import SIZES


@dataclass(frozen=True)
class Parting:
    """How far the search goes: starts of each side, steps of the best ones and of a stiffer contact, and how fast
    [1/s] a run follows its log that leads there.
    """

    starts: Halving = Halving(looked=6, first=6, kept=1)
    far: int = 25
    stiffer: int = 10
    following: float = 60.0
    gains: tuple[float, ...] = (1.0, 2.0, 0.5)  # of the loop, from which one with its sensor elsewhere is begun


PARTING = Parting()
LOOP = ("K", "D", "I", "L", "a_2", "c_2")  # letters that come with the loop's gain


def parted(starts: Sequence[LoopModel], data: Data) -> Fit:
    """The fit to which the best run that follows its log leads, the sensors on each side in turn."""
    sides = [[start for start in starts if start.side == side] for side in dict.fromkeys(s.side for s in starts)]
    near = _followed(data)
    found = min((best(side, near, PARTING.far, PARTING.starts) for side in sides), key=_cost)
    return fitted(_stiffened(found, near).model, data, PARTING.far)


def refitted(starts: Sequence[LoopModel], data: Data, steps: int, enough: float) -> Fit:
    """The best fit of several starts; of two bodies that leaves more than ``enough`` noise levels also from where
    following the log leads.
    """
    found = best(starts, data, steps)
    if found.misfit < enough**2 or not found.model.has_two_bodies:
        return found
    return min(found, fitted(best(starts, _followed(data), steps).model, data, steps), key=_cost)


def other_sides(model: LoopModel) -> list[list[LoopModel]]:
    """Starts of two bodies with the sensors of loop and log on each of the other sides, which asks for another gain of
    much the same loop; none of one body.
    """
    if not model.has_two_bodies:
        return []
    asked = [x for x in LOOP if x in model.free]
    stronger = [model.having(**{x: by * model[x] for x in asked}) for by in PARTING.gains]
    return [[replace(start, side=side) for start in stronger] for side in SIDES if side != model.side]


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
