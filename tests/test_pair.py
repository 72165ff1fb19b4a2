"""Two effects in the place of one."""

from dataclasses import replace

import numpy as np
import pytest
from servo import SPARSE, all_but, alone, bench_of, having, recorded, started

from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import fit
from ers_mj.selection.comparison import judged
from ers_mj.selection.pair import bending_and_twisting, beside_a_rival, paired


def test_two_rivals_take_the_place_of_what_does_much_of_what_both_do():
    """A friction along the travel beside a spring that hardens, told as a gear that varies and a bent scale."""
    truth = {
        "position_dependent_friction": np.array([25.0, np.inf, np.inf, 0.5, 1.4]),
        "hinge_moment_cubic": np.array([400.0, np.inf]),
    }
    start = started(recorded(list(truth.items()), t=SPARSE))
    bench = bench_of(start)
    leader = alone(start, "variable_ratio", [0.01, -1.0, 0.5])
    wrong = fit(having(leader.fit, "quadratic_drag", [1.0, np.inf]).model, start.traces)
    rivals = [alone(start, name, p) for name, p in truth.items()]
    found, rounds = paired(bench, wrong, [(leader, *rivals), ()])
    assert {*found.model.names} == {*truth} and [ranked[0].name for ranked in rounds] == [*truth]
    for name, p in found.model.effects:
        assert p[0] == pytest.approx(truth[name][0], rel=0.1)
    assert paired(bench, found, [(rivals[0], leader, rivals[1]), ()]) is None

    def blown(some):
        """The fit beside a gust of a thousandth of its start."""
        gust = BY_NAME["periodic_gust"].starts(some.model.scales)[0]
        return having(some, "periodic_gust", np.append(1e-3 * gust[:1], gust[1:]))

    first = judged("periodic_gust", blown(start.fit), start.fit, 1.0)
    later = tuple(replace(c, fit=blown(c.fit)) for c in (leader, *rivals))
    found, rounds = paired(bench, blown(wrong), [(first,), later, ()])  # what has a clock of its own stays
    assert {*found.model.names} == {"periodic_gust", *truth}
    assert [ranked[0].name for ranked in rounds] == ["periodic_gust", *truth]


def test_a_lone_shaft_that_leaves_much_gives_way_to_two_effects_of_one_body(delayed):
    """A springy shaft does a part of what a drive does that delays and sleeps."""
    start, truth = delayed
    delay = alone(start, "input_delay", truth["input_delay"], steps=6)
    springy = BY_NAME["shaft_compliance"].starts(start.fit.model.scales)[0]
    shaft = replace(alone(start, "shaft_compliance", springy, steps=6), gain=delay.gain)
    bench = bench_of(start, exclude=all_but(*truth, "shaft_compliance", "quadratic_drag"))
    found, rounds = beside_a_rival(bench, shaft.fit, [(shaft, delay), ()])
    assert {*found.model.names} == {*truth}
    assert [ranked[0].name for ranked in rounds] == ["input_delay", "drive_dead_zone"]
    assert beside_a_rival(bench, shaft.fit, [(shaft,), ()]) is None
    assert beside_a_rival(bench, delay.fit, [(delay, shaft), ()]) is None


@pytest.mark.parametrize(
    "name, others",
    [("presliding", ["backlash", "shaft_compliance"]), ("backlash", ["presliding"]), ("stribeck", [])],
)
def test_what_bends_and_twists_takes_longest(pushed, name, others):
    assert bending_and_twisting(having(pushed.fit, name).model) == others
