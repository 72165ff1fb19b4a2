"""What a round asks for, by numbers alone."""

from dataclasses import replace

import numpy as np
import pytest

from ers_mj.decisions import acceptance
from ers_mj.decisions.acceptance import Bar, Offer
from ers_mj.decisions.policy import POLICY
from ers_mj.effects import BY_NAME
from ers_mj.selection.comparison import Candidate, stands_alone

BESIDE = Bar(usual=4.0, faint=1.5, z=2.0, outstanding=False, beside=True)


def named(ranked, bar):
    """The name that these candidates are asked for at this bar, None where none is."""
    alone = [c.gain < bar.usual and stands_alone(c, ranked) for c in ranked]
    offer, because = acceptance.asked([c.offer for c in ranked], alone, bar)
    assert because
    return offer and offer.name


def beside(found, name):
    """A fit with the first start of an effect beside it."""
    scales = replace(found.model.scales, hot=((0, 1.0, 0.1),))
    return replace(found, model=found.model.with_effect(name, BY_NAME[name].starts(scales)[0]))


@pytest.mark.parametrize(
    "gain, z, lost, asked",
    [
        (8.8, 1.6, 2.0, True),
        (8.8, 1.6, 3.0, False),
        (5.0, 1.6, 1.2, False),
        (5.0, 1.8, 1.2, True),
        (2.9, 4.0, 0.0, False),
    ],
)
def test_what_acts_in_few_blocks_may_lose_more_where_it_wins_much(gain, z, lost, asked):
    """As a stop that one recording reaches does, whose z-score cannot be large."""
    bar = Bar(usual=3.0, faint=3.0, z=1.7, outstanding=False, beside=False)
    assert acceptance.is_asked_for(Offer("end_stop", gain, z, lost, 4.0, 8), bar) is asked


@pytest.mark.parametrize("gain, first", [(9.9, "drive_dead_zone"), (4.9, "load_disturbance")])
def test_a_knock_gives_way_to_a_law_that_explains_more(pushed, gain, first):
    """The law loses too much elsewhere to be asked for by itself; that something is missing the knock has shown."""
    dead, knocked = (beside(pushed.fit, name) for name in ("drive_dead_zone", "load_disturbance"))
    ranked = [
        Candidate("drive_dead_zone", dead, gain, 1.7, 0.4 * gain, 3.0),
        Candidate("load_disturbance", knocked, 4.4, 1.0, 0.1, 4.0),
    ]
    assert named(ranked, BESIDE) == first
    assert named(ranked[:1], BESIDE) is None


@pytest.mark.parametrize("gain, first", [(8.1, "voltage_saturation"), (8.3, "load_disturbance")])
def test_a_knock_gives_way_to_a_law_that_is_asked_for_as_well(pushed, gain, first):
    """It chooses its moment, so that it must be well ahead; not where nothing is named yet, since what has no law may
    look like both.
    """
    delayed = beside(pushed.fit, "input_delay")
    ranked = [
        Candidate("load_disturbance", delayed, gain, 1.4, 0.0, 3.0),
        Candidate("end_stop", delayed, 5.3, 1.0, 4.0, 3.0),
        Candidate("voltage_saturation", delayed, 5.2, 1.5, 0.1, 3.0),
    ]
    assert named(ranked, BESIDE) == first
    assert named(ranked, Bar(3.0, 3.0, 1.7, outstanding=False, beside=False)) == "load_disturbance"


@pytest.mark.parametrize(
    "name, gain, z, asked",
    [
        ("drive_dead_zone", 3.6, 3.3, True),
        ("drive_dead_zone", 3.6, 2.7, False),
        ("drive_dead_zone", 2.8, 4.0, False),
        ("gain", 3.6, 3.3, False),
    ],
)
def test_beside_an_effect_a_law_may_buy_less_where_it_buys_it_nearly_everywhere(pushed, name, gain, z, asked):
    """A rival buys nearly as much, so that it does not stand alone; what differs between recordings is no law."""
    dead = beside(pushed.fit, "drive_dead_zone")
    rival = replace(dead, misfit=dead.misfit + 1.0)
    ranked = [Candidate(name, dead, gain, z, 0.5, 0.4), Candidate("stribeck", rival, 0.9 * gain, 2.0, 0.5, 0.4)]
    assert (named(ranked, BESIDE) == name) is asked
    assert named(ranked, Bar(4.0, 4.0, 1.7, outstanding=False, beside=False)) is None


def test_where_the_model_stays_wrong_a_further_effect_must_take_a_good_part():
    """Of 100 C that are left a tenth is enough in order, a sixth of a third effect, and a good part out of order; of
    hardly any what is more than chance. What is dear to simulate has no faint effects beside it.
    """

    def gains(left, named, dear=False, in_order=True):
        bar = acceptance.bar(left, named, dear, in_order, outstanding=False)
        return bar.usual, bar.faint

    assert gains(100.0, 1) == pytest.approx((10.0, 10.0))
    assert gains(100.0, 2) == pytest.approx((100.0 / 6, 100.0 / 6))
    assert gains(100.0, 1, in_order=False) == pytest.approx((100.0 * POLICY.good_part, 100.0 * POLICY.good_part))
    assert gains(0.1, 1) == (POLICY.later_gain, POLICY.faint_gain)
    assert gains(0.1, 1, dear=True) == (POLICY.later_gain, POLICY.later_gain)
    assert gains(0.1, 0) == (POLICY.least_gain, POLICY.least_gain)


def test_an_impulse_must_gain_more_than_a_fork_makes():
    """Or take away what no fork of stick and slip makes in a block: that is enough where little else is left, or where
    that block is outstanding among much that is.
    """
    usual = Bar(POLICY.least_gain, POLICY.least_gain, 1.7, outstanding=False, beside=False)
    much = replace(usual, usual=20.0, faint=20.0)
    peak = float(np.log(POLICY.peak))

    def asked(gain, best, bar):
        return acceptance.is_asked_for(Offer("load_disturbance", gain, 0.0, 9.0, best, 9, once=True), bar)

    assert not asked(POLICY.once - 0.1, peak - 0.1, usual) and asked(POLICY.once + 0.1, peak - 0.1, usual)
    assert asked(POLICY.least_gain, peak + 0.1, usual) and not asked(POLICY.once + 0.1, peak + 0.1, much)
    assert asked(POLICY.once + 0.1, peak + 0.1, replace(much, outstanding=True))
