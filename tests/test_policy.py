"""Every threshold that decides has a reason, and how much is simulated is counted by whom it is handed to."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import FrozenInstanceError, fields, replace
from types import SimpleNamespace

import numpy as np
import pytest
from servo import TRUTH

from ers_mj.decisions.thresholds import POLICY, Policy, reasons
from ers_mj.plants.effort import Effort
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.selection.budget import SEARCH, Budget


@pytest.mark.parametrize("name", [f.name for f in fields(Policy)])
def test_a_threshold_tells_its_unit_what_it_protects_and_how_it_was_set(name):
    reason = reasons()[name]
    assert reason.unit and reason.protects and reason.set_by
    assert np.isfinite(getattr(POLICY, name))


def test_another_policy_is_handed_in_and_changes_no_other():
    other = replace(POLICY, least_gain=9.0)
    assert other.least_gain == 9.0 != POLICY.least_gain
    with pytest.raises(FrozenInstanceError):
        POLICY.least_gain = 9.0
    with pytest.raises(FrozenInstanceError):
        SEARCH.sweep = 1


def minute(seconds=60.0):
    return SimpleNamespace(t=np.array([0.0, seconds]))


def test_a_budget_grows_with_recordings_longer_than_a_minute():
    short, long = Budget([minute(5.0)]), Budget([minute(), minute()])
    for name in ("sweeps", "raced", "last", "longest"):
        assert getattr(long, name) == 2 * getattr(short, name) > 0
    assert short.raced < short.sweeps < short.last < short.longest and short.spent == 0


def test_budgets_of_two_threads_share_nothing():
    t = np.arange(0.0, 0.5, 1e-3)

    def spent(runs):
        budget = Budget([minute()])
        for _ in range(runs):
            ReducedModel(lumped(TRUTH), effort=budget.effort).simulate(t, np.sin(9.0 * t))
        return budget.spent

    (alone,) = {spent(1) for _ in range(2)}
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(spent, (1, 5, 2, 9))) == [alone * runs for runs in (1, 5, 2, 9)]


def test_a_budget_begins_where_its_count_stands():
    first = Budget([minute()])
    t = np.arange(0.0, 0.5, 1e-3)
    ReducedModel(lumped(TRUTH), effort=first.effort).simulate(t, np.sin(9.0 * t))
    again = Budget([minute()], first.effort)
    assert again.spent == first.spent > 0 and again.last - first.last == first.spent


def test_a_motion_that_chatters_is_counted_by_its_events():
    """A rudder that turns a thousand times a second, and one that swings once."""
    t, servo = np.arange(0.0, 0.5, 5e-4), lumped({**TRUTH, "c_1": 0.0, "c_2": 0.01})
    efforts = [Effort(most=1e9) for _ in range(2)]
    for effort, u in zip(efforts, (3.0 * (-1.0) ** np.arange(t.size), np.sin(9.0 * t)), strict=True):
        ReducedModel(servo, effort=effort).simulate(t, u)
    assert efforts[0].spent > 3 * efforts[1].spent


def test_a_part_of_an_effort_counts_in_the_whole_and_tells_where_it_is_cut():
    whole = Budget([minute()]).effort
    part = Effort(whole, most=100)
    part.add(np.array([0.0, 1.0]), 60)
    assert not part.is_spent and whole.spent == part.spent == 60
    part.add(np.array([0.0, 1.0]), 30, beyond=20)
    assert part.is_spent and Effort(part).is_spent and not whole.is_spent and not whole.is_cut
    assert part.spent == 110 and whole.spent == 90  # the rounds go by what simulations usually take
    part.cut()
    assert whole.is_cut
