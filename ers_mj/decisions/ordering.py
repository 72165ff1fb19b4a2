"""Which of the candidates of a round leads?"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from ers_mj.decisions.acceptance import Offer
from ers_mj.decisions.thresholds import POLICY, Policy

Chances = Callable[[Sequence[Offer]], Mapping[str, float]]  # of explanations, if one of them is true


def stands_alone(offer: Offer, others: Sequence[Offer], apart: Sequence[float], policy: Policy = POLICY) -> bool:
    """Whether a law buys ``alone`` times what any other of its round does, those aside that are one with it or leave
    the same in all blocks: chance, forks of stick and slip and a law of somewhat another form offer much the same to
    several, what acts offers it to its own. ``apart`` is the summed difference of block scores from each of the
    ``others``.
    """
    if not offer.is_effect or offer.clocked:
        return False
    return all(
        offer.gain >= policy.alone * other.gain or other.name in offer.kin or distance < policy.same * offer.gain
        for other, distance in zip(others, apart, strict=True)
    )


def rivals_of(offers: Sequence[Offer], policy: Policy = POLICY) -> list[Offer]:
    """The offers that the first one does not beat clearly, itself among them."""
    tie = max(policy.tie, policy.near_tie * offers[0].gain)
    least = max(offers[0].worth(policy) - tie, 0.0)
    return [offer for offer in offers if offer.worth(policy) > least]


def likeliest_first(
    offers: Sequence[Offer],
    really: Mapping[str, str],
    curves: Mapping[str, str],
    chances: Chances,
    policy: Policy = POLICY,
) -> list[Offer]:
    """Of rivals the most probable leads, together with those that are one with it: which of them the worth prefers may
    rest on one stick or slip.

    What has a clock of its own leads only where no law of the servo itself explains ``clocked`` of what it does: a
    swing bends to whatever a repeated excitation leaves over, a friction of each recording's own to any law of its
    speed. ``really`` names by name the effect of which an offer's numbers are a form, ``curves`` that of which it is
    one that changes along the travel.
    """
    if not offers:
        return []
    ranked = _lawful_first(offers, policy)
    gains = {offer.name: offer.gain for offer in ranked}

    def is_a_form(offer: Offer) -> bool:
        other = really[offer.name]
        return other != offer.name and gains.get(other, 0.0) >= policy.nearly * offer.gain

    ranked = sorted(ranked, key=is_a_form)
    rivals = [o for o in rivals_of(ranked, policy) if really[o.name] != ranked[0].name or o is ranked[0]] or ranked[:1]
    name = likeliest(rivals, curves, chances(rivals), policy)
    first = next(offer for offer in rivals if offer.name == name)
    return [first, *(offer for offer in ranked if offer is not first)]


def _lawful_first(offers: Sequence[Offer], policy: Policy) -> list[Offer]:
    """The offers, laws of the servo that explain enough before one that has a clock of its own and leads."""
    if not offers[0].clocked:
        return list(offers)
    enough = policy.clocked * offers[0].gain
    return sorted(offers, key=lambda o: o.clocked or o.gain < enough or o.z < policy.least_z)


def likeliest(
    rivals: Sequence[Offer], curves: Mapping[str, str], chance: Mapping[str, float], policy: Policy = POLICY
) -> str:
    """The most probable of what is not clocked, or else of all; the probabilities of those that are one with it count
    as its own, but beside what is a form of one of them that changes along the travel.
    """

    def likelihood(offer: Offer) -> tuple[bool, float, float]:
        together = sum(chance[name] for name in offer.kin if name in chance)
        return not offer.clocked, together, chance[offer.name]

    first = max(rivals, key=likelihood)
    plain = max(chance[name] for name in first.kin if name in chance)
    curved = (o.name for o in rivals if o.is_effect and curves.get(o.name) in first.kin)
    return next((name for name in curved if chance[name] >= policy.curved * plain), first.name)
