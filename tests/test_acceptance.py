"""Which candidate of a round is named, by numbers alone."""

from dataclasses import replace

import pytest

from ers_mj.decisions.acceptance import Bar, Offer, asked, bar, is_asked_for, is_steady, least_of
from ers_mj.decisions.thresholds import POLICY

FIRST = Bar(usual=3.0, faint=3.0, drifts=3.0, z=1.7, outstanding=False, beside=False)
LATER = Bar(usual=4.0, faint=1.5, drifts=4.0, z=2.0, outstanding=False, beside=True)


def law(name="stribeck", gain=5.0, z=3.0, lost=0.0, best=3.0, **kind):
    return Offer(name, gain, z, lost, best, size=7, **kind)


def impulse(gain=5.0, best=4.0, **kind):
    return Offer("load_disturbance", gain, 1.0, 0.1, best, size=7, once=True, clocked=True, **kind)


def named(offers, bar, alone=None, policy=POLICY):
    found, because = asked(offers, alone or [False] * len(offers), bar, policy)
    assert because
    return found.name if found else None


@pytest.mark.parametrize(
    "gain, z, lost, wanted",
    [
        (8.8, 1.6, 2.0, True),
        (8.8, 1.6, 3.0, False),
        (5.0, 1.6, 1.2, False),
        (5.0, 1.8, 1.2, True),
        (2.9, 4.0, 0.0, False),
    ],
)
def test_what_acts_in_few_blocks_may_lose_more_where_it_wins_much(gain, z, lost, wanted):
    """As a stop that one recording reaches does, whose z-score cannot be large."""
    assert is_asked_for(law(gain=gain, z=z, lost=lost), FIRST) is wanted


@pytest.mark.parametrize(
    "gain, best, outstanding, left, wanted",
    [
        (6.1, 3.0, False, 3.0, True),
        (5.9, 3.0, False, 3.0, False),  # below the peak it must gain more than a law
        (1.6, 3.5, False, 3.0, True),  # above it half of what a law must, where little else is left
        (1.4, 3.5, False, 3.0, False),
        (6.1, 3.5, False, 9.0, False),  # but all of what matters where that is a share of much
        (6.1, 3.5, True, 9.0, True),  # unless its block stands out of that
        (5.9, 3.5, True, 9.0, False),
    ],
)
def test_an_impulse_gains_much_or_what_no_fork_makes(gain, best, outstanding, left, wanted):
    at = replace(FIRST, usual=left, faint=left, outstanding=outstanding)
    assert is_asked_for(impulse(gain, best), at) is wanted


@pytest.mark.parametrize("gain, first", [(9.9, "drive_dead_zone"), (4.9, "load_disturbance")])
def test_an_impulse_gives_way_to_a_law_that_explains_more(gain, first):
    """The law loses too much elsewhere to be asked for by itself; that something is missing the impulse has shown."""
    dead = law("drive_dead_zone", gain, z=1.7, lost=0.4 * gain)
    assert named([dead, impulse(4.4)], LATER) == first
    assert named([dead], LATER) is None
    assert named([dead, impulse(4.4)], replace(LATER, beside=False)) is None  # the first round names its leader or none


@pytest.mark.parametrize("gain, first", [(8.1, "voltage_saturation"), (8.7, "load_disturbance")])
def test_an_impulse_gives_way_to_a_law_that_is_asked_for_as_well(gain, first):
    """Not where nothing is named yet, since what has no law may look like both."""
    offers = [impulse(gain), law("end_stop", 5.3, 1.0, 4.0), law("voltage_saturation", 8.4, 2.1, 0.1)]
    assert named(offers, LATER) == first
    assert named(offers, FIRST) == "load_disturbance"


def test_of_laws_the_first_that_is_asked_for_is_named():
    dear = law("backlash", 9.0, z=1.0, lost=5.0)
    offers = [dear, law("quadratic_drag", 6.0), law("cogging", 8.0)]
    assert named(offers, LATER) == "quadratic_drag" and named(offers, FIRST) is None
    level = law("friction_level", 9.0, is_effect=False, clocked=True)
    assert named([dear, level], LATER) is None and named([level, dear], LATER) == "friction_level"
    assert named([level], replace(LATER, usual=50.0, faint=50.0)) == "friction_level"  # be much left or little
    assert "3" in asked([law(gain=1.0)], [False], FIRST)[1]  # says what was asked


@pytest.mark.parametrize(
    "gain, z, clocked, wanted",
    [(3.6, 3.3, False, True), (3.6, 2.7, False, False), (2.8, 4.0, False, False), (3.6, 3.3, True, False)],
)
def test_beside_an_effect_a_law_may_buy_less_where_it_buys_it_nearly_everywhere(gain, z, clocked, wanted):
    """What differs between recordings is no law."""
    one = law("drive_dead_zone", gain, z, 0.5, 0.4, clocked=clocked)
    assert is_steady(one) is wanted
    assert (named([one], LATER) is not None) is wanted
    assert least_of(one, False, LATER) == (LATER.faint if wanted else LATER.usual)


def test_beside_an_effect_a_law_may_buy_less_where_it_stands_alone():
    faint = law(gain=2.0, z=2.5)
    assert named([faint], LATER) is None and named([faint], LATER, alone=[True]) == "stribeck"
    assert named([replace(faint, gain=1.4)], LATER, alone=[True]) is None
    assert named([replace(faint, z=1.9, lost=1.0)], LATER, alone=[True]) is None  # nor by chance


def test_the_bar_rises_with_what_is_left_and_what_is_named():
    assert bar(0.0, 0, False, True, False) == Bar(3.0, 3.0, 3.0, POLICY.least_z, False, False)
    assert bar(0.0, 1, False, True, True) == Bar(4.0, 1.5, 4.0, POLICY.later_z, True, True)
    assert bar(0.0, 1, True, True, False).faint == 4.0  # beside what is dear nothing is faint
    for count, in_order, share in ((0, True, 0.1), (1, True, 0.1), (2, True, 1 / 6), (2, False, POLICY.good_part)):
        at = bar(100.0, count, False, in_order, False)
        assert at.usual == at.faint == pytest.approx(100.0 * share)
        assert at.drifts == bar(0.0, count, False, in_order, False).usual


def test_another_policy_asks_something_else():
    strict = replace(POLICY, least_gain=10.0, parameter_price=1.0)
    assert bar(0.0, 0, False, True, False, strict).usual == 10.0
    assert law(gain=5.0).worth() == pytest.approx(5.0 - 7 * 0.25) and law(gain=5.0).worth(strict) == -2.0
