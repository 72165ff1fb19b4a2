"""Which of the candidates of a round leads, by numbers alone."""

from dataclasses import replace

import pytest

from ers_mj.decisions.acceptance import Offer
from ers_mj.decisions.ordering import likeliest, likeliest_first, rivals_of, stands_alone
from ers_mj.decisions.thresholds import POLICY


def law(name, gain, z=3.0, size=6, **kind):
    return Offer(name, gain, z, lost=0.0, best=1.0, size=size, **kind)


def clocked(name, gain):
    return law(name, gain, clocked=True)


def order(offers, really=None, curves=None, chance=None):
    """Names, the likeliest first, where each is as probable as the others unless it is told."""

    def chances(rivals):
        return {o.name: (chance or {}).get(o.name, 1.0 / len(rivals)) for o in rivals}

    really = {**{o.name: o.name for o in offers}, **(really or {})}
    return [o.name for o in likeliest_first(offers, really, curves or {}, chances)]


@pytest.mark.parametrize(
    "other, apart, alone",
    [
        (law("stribeck", 1.3), 9.0, True),
        (law("stribeck", 1.4), 9.0, False),
        (law("stribeck", 1.9), 0.9, True),  # which leaves the same in all blocks
        (law("asymmetric_friction", 1.9), 9.0, True),  # which is one with it
    ],
)
def test_a_law_stands_alone_where_no_other_offers_nearly_as_much(other, apart, alone):
    torque = law("bias_torque", 2.0, kin=frozenset({"bias_torque", "asymmetric_friction"}))
    assert stands_alone(torque, [torque, other], [0.0, apart]) is alone
    assert not stands_alone(replace(torque, clocked=True), [], [])
    assert not stands_alone(replace(torque, is_effect=False), [], [])


def test_rivals_are_those_within_a_tie_of_the_best_worth():
    offers = [law("a", 10.0), law("b", 9.1), law("c", 8.9), law("d", 9.5, size=9)]
    assert [o.name for o in rivals_of(offers)] == ["a", "b"]
    large = [law("a", 1000.0), law("b", 985.0), law("c", 975.0)]
    assert [o.name for o in rivals_of(large)] == ["a", "b"]  # where all is large a tie is a share


def test_of_rivals_the_most_probable_leads():
    offers = [law("a", 10.0), law("b", 9.5), law("c", 8.0)]
    assert order(offers, chance={"a": 0.4, "b": 0.6, "c": 0.9}) == ["b", "a", "c"]
    assert order([]) == [] and order([law("a", -3.0)]) == ["a"]


def test_what_is_one_with_it_counts_for_an_effect():
    kin = frozenset({"delay", "lag"})
    offers = [law("drag", 10.0), law("delay", 9.5, kin=kin), law("lag", 9.5, kin=kin)]
    assert order(offers, chance={"drag": 0.4, "delay": 0.35, "lag": 0.25})[0] == "delay"


def test_what_has_a_clock_of_its_own_leads_only_where_no_law_explains_half_of_it():
    assert order([clocked("gust", 20.0), law("drag", 11.0)]) == ["drag", "gust"]
    assert order([clocked("gust", 20.0), law("drag", 9.0)]) == ["gust", "drag"]
    assert order([clocked("gust", 20.0), law("drag", 11.0, z=POLICY.least_z - 0.1)]) == ["gust", "drag"]
    assert order([law("drag", 11.0), clocked("gust", 10.9)], chance={"gust": 0.9, "drag": 0.1})[0] == "drag"


def test_a_form_of_another_effect_gives_way_where_that_explains_half_of_it():
    shaft, winding = law("shaft", 21.0), law("inductance", 17.0)
    assert order([shaft, winding], really={"shaft": "inductance"}) == ["inductance", "shaft"]
    assert order([shaft, replace(winding, gain=10.0)], really={"shaft": "inductance"})[0] == "shaft"
    assert order([shaft, winding])[0] == "shaft"


@pytest.mark.parametrize("better, first", [(1.0, "bias"), (0.99 * POLICY.curved, "bias"), (POLICY.curved, "gravity")])
def test_what_bends_along_the_travel_must_be_likelier_than_what_is_constant(better, first):
    kin = frozenset({"bias", "one_sided"})
    rivals = [law("bias", 9.0, kin=kin), law("one_sided", 9.0, kin=kin), law("gravity", 9.0)]
    chance = {"bias": 0.4, "one_sided": 0.3, "gravity": 0.4 * better}
    assert likeliest(rivals, {"gravity": "bias"}, chance) == first
    assert likeliest(rivals, {}, {**chance, "gravity": 0.6}) == "bias"  # the two together
