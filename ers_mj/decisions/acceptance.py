"""Which candidate of a round is named? The numbers and their reasons stand in thresholds.py."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ers_mj.decisions.thresholds import POLICY, Policy


@dataclass(frozen=True)
class Offer:
    """What a candidate offers: its gain in C after everything was refitted, the paired z-score of that gain over the
    blocks, the C that the blocks lose which it makes worse, what it wins in the block that it serves best, the number
    of fitted numbers of the whole model; and of what kind it is.

    ``is_effect`` is false of what differs between recordings; ``once`` tells what acts in one recording only,
    ``clocked`` what has a clock of its own, ``kin`` the names that are one with it, its own among them.
    """

    name: str
    gain: float
    z: float
    lost: float
    best: float
    size: int
    is_effect: bool = True
    once: bool = False
    clocked: bool = False
    kin: frozenset[str] = frozenset()

    def __post_init__(self):
        if self.name not in self.kin:
            object.__setattr__(self, "kin", self.kin | {self.name})

    def worth(self, policy: Policy = POLICY) -> float:
        """Gain less the price of the numbers."""
        return self.gain - policy.parameter_price * self.size


@dataclass(frozen=True)
class Bar:
    """What must be bought in a round: the ``usual`` gain, the ``faint`` one of what stands alone, that of what
    ``drifts`` from one recording to the next, the ``z``-score; whether a block is ``outstanding`` among much that is
    left, and whether an effect is named ``beside``.
    """

    usual: float
    faint: float
    drifts: float
    z: float
    outstanding: bool
    beside: bool


def bar(left: float, named: int, dear: bool, in_order: bool, outstanding: bool, policy: Policy = POLICY) -> Bar:
    """The bar where a model with so many ``named`` effects leaves C ``left``; a good part of that where the model stays
    wrong (not ``in_order``). What is ``dear`` to simulate has no faint effects beside it, and what differs between
    recordings names no physics, so that it need be no share of what is left.
    """
    usual_share = policy.third_share if named >= policy.fewer_effects else policy.least_share
    share = (usual_share if in_order else policy.good_part) * left
    usual = policy.later_gain if named else policy.least_gain
    faint = policy.faint_gain if named and not dear else usual
    z = policy.later_z if named else policy.least_z
    return Bar(max(usual, share), max(faint, share), usual, z, outstanding, named > 0)


def asked(
    offers: Sequence[Offer], alone: Sequence[bool], bar: Bar, policy: Policy = POLICY
) -> tuple[Offer | None, str]:
    """What is named in a round, and why; None where nothing is asked for.

    The first that is asked for, and that one alone which leads where nothing is named yet. ``alone`` says of each offer
    whether it stands alone (see ordering.py). An impulse shows that something is missing; where the law that leads
    explains more of it by a tie, that is named, and beside an effect a law that is asked for as well and explains
    more.
    """
    wanted = [
        offer
        for offer, stands_alone in zip(offers, alone, strict=True)
        if (offer is offers[0] or bar.beside and offer.is_effect)
        and is_asked_for(offer, bar, policy, least_of(offer, stands_alone, bar, policy))
    ]
    if not wanted:
        return None, f"no effect lowers the robust cost by {bar.usual:.3g} beyond chance"
    first = wanted[0]
    if first.once:
        return _beside_an_impulse(first, offers[0], wanted[1:], policy)
    return first, f"it lowers the robust cost by {first.gain:.3g}, {bar.usual:.3g} is asked"


def least_of(offer: Offer, stands_alone: bool, bar: Bar, policy: Policy = POLICY) -> float:
    """What an offer must buy: less where it stands alone, is steady, or differs between recordings."""
    if not offer.is_effect:
        return bar.drifts
    is_faint = offer.gain < bar.usual and (stands_alone or is_steady(offer, policy))
    return bar.faint if is_faint else bar.usual


def _beside_an_impulse(impulse: Offer, leader: Offer, others: Sequence[Offer], policy: Policy) -> tuple[Offer, str]:
    """An impulse that is asked for, or a law in its place."""
    if leader is not impulse and leader.is_effect and leader.worth(policy) > impulse.worth(policy) + policy.tie:
        return leader, "a law explains more than the impulse that is asked for"
    law = next((o for o in others if not o.once and o.worth(policy) > impulse.worth(policy)), None)
    return (law, "a law explains more than an impulse") if law else (impulse, "no law explains an impulse")


def is_asked_for(offer: Offer, bar: Bar, policy: Policy = POLICY, least: float | None = None) -> bool:
    """Whether a gain matters and is more than chance: over the blocks, or, of what acts in few of them, since hardly
    any is worse.

    An impulse must gain ``once``, or take away what no fork of stick and slip makes (``peak``): that is enough where
    little else is left, so that the ``least`` gain is no share of it, and where a block is outstanding among much that
    is.
    """
    least = bar.usual if least is None else least
    if offer.once:
        if offer.best < math.log(policy.peak):
            return offer.gain >= max(least, policy.once)
        least = min(least, policy.once) if bar.outstanding else least
        return offer.gain >= (least if least > policy.least_gain else policy.near_least * least)
    lost = policy.lost_of_ample if offer.gain >= policy.ample * least else policy.lost
    return offer.gain >= least and (offer.z >= bar.z or offer.lost <= lost * offer.gain)


def holds(gain: float, left: float, blocks: int, is_sprung: bool, policy: Policy = POLICY) -> bool:
    """Whether a baseline with an effect in the spring's place is the better one, by its gain over so many ``blocks``.

    Over one with a spring, ``is_sprung``, a rival on equal terms, by what supports a spring. Over one without it must
    take so much of the C that is ``left`` that nothing else need be compared with it: a good part, or half of the
    squared error nearly everywhere.
    """
    much = 0.0 if is_sprung else min(policy.good_part * left, -math.log(1.0 - policy.half) * blocks)
    return gain >= max(policy.least_gain, policy.support * blocks, much)


def is_steady(offer: Offer, policy: Policy = POLICY) -> bool:
    """Whether a law of the servo buys little, but nearly everywhere."""
    return not offer.clocked and offer.gain >= policy.steady and offer.z >= policy.steady
