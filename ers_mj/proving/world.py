"""All that the proof draws: the rudder of MuJoCo and the families beside it, in turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from zlib import crc32

from ers_mj.errors import InputError
from ers_mj.proving import case, making
from ers_mj.proving.families.direct import DIRECT
from ers_mj.proving.families.gimbal import GIMBAL
from ers_mj.proving.families.hobby import HOBBY
from ers_mj.proving.families.position import POSITION
from ers_mj.proving.families.screw import SCREW
from ers_mj.proving.families.strain_wave import STRAIN_WAVE
from ers_mj.proving.families.throttle import THROTTLE
from ers_mj.proving.plans import Plan, planned

FAMILIES = {f.name: f for f in (HOBBY, DIRECT, SCREW, THROTTLE, STRAIN_WAVE, GIMBAL, POSITION)}
RUDDER = "rudder"
NAMES = (RUDDER, *FAMILIES)
"""Of all families, in the order in which cases go round them."""


def chosen(names: Sequence[str] | None) -> tuple[str, ...]:
    """These families in the order of NAMES; all where none is named.

    Raises:
        InputError: one of them is none.
    """
    wrong = [name for name in names or () if name not in NAMES]
    if wrong:
        raise InputError(f"{wrong[0]!r} is no family, there are {', '.join(NAMES)}")
    return tuple(name for name in NAMES if name in names) if names else NAMES


def plans(count: int, seed: int, families: Sequence[str] = NAMES) -> list[Plan]:
    """Cases go round the families. A case of a family and a number in it is the same whatever else is asked for; the
    rudder's are those of a proof of as many rudders.
    """
    turns = [(families[k % len(families)], k // len(families)) for k in range(count)]
    rudders = case.plans(sum(name == RUDDER for name, _ in turns), seed)
    return [
        replace(rudders[number], index=k)
        if name == RUDDER
        else Plan(k, *planned(_seed(seed, name), number, FAMILIES[name].effects, FAMILIES[name].outside), name, number)
        for k, (name, number) in enumerate(turns)
    ]


def make(plan: Plan, seed: int) -> tuple[dict[str, str], dict]:
    """({file name: text} that is handed out, the truth) of one case."""
    if plan.family == RUDDER:
        return case.make(plan, seed)
    return making.make(FAMILIES[plan.family], plan, [*_seed(seed, plan.family), 9, plan.number])


def _seed(seed: int, family: str) -> list[int]:
    return [seed, crc32(family.encode())]
