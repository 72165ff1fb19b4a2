"""Every effect from its own starts, where a screening found nothing to add."""

from dataclasses import replace

import pytest
from servo import Watched, all_but, bench_of

from ers_mj.effects import BY_NAME
from ers_mj.selection.budget import SEARCH
from ers_mj.selection.sweep import SIZED, any_body, joined, of_one_body, of_two_bodies, swept

FEW = all_but("bias_torque", "quadratic_drag", "hinge_moment_cubic")


def test_a_sweep_finds_what_secants_miss(pushed):
    """From its own start, whatever that makes worse on the way; no more is returned than the screening found."""
    bench = bench_of(pushed, exclude=FEW)
    best = max(swept(bench, pushed.fit), key=lambda c: c.gain)
    (size,) = dict(best.fit.model.effects)["bias_torque"]
    assert best.name == "bias_torque" and size == pytest.approx(0.06, rel=0.3) and best.gain > 2.0
    again = swept(bench, pushed.fit, [best])
    assert not [c for c in again if c.name == "bias_torque" and c.gain > best.gain + 0.1]
    worse = replace(best, gain=1.0)
    assert joined([worse], [best]) == [best] == joined([best], [worse])


def test_a_sweep_goes_on_from_the_best_starts_only(pushed):
    """Of eight dead zones two: the others are left after a glance. What waves is not swept where a secant would have
    shown it.
    """

    def far(model):
        return abs(dict(model.effects)["drive_dead_zone"][0] - 1.0)

    bench = Watched(
        pushed.traces,
        1.0,
        exclude=all_but("drive_dead_zone"),
        answer=lambda model: replace(pushed.fit, model=model, cost=far(model)),
    )
    swept(bench, pushed.fit)
    starts = BY_NAME["drive_dead_zone"].starts(pushed.fit.model.scales)
    glance, rest = SEARCH.sweep_glance, SEARCH.sweep - SEARCH.sweep_glance
    assert [steps for _, steps in bench.asked] == [glance] * len(starts) + [rest] * SEARCH.go_on
    nearest = sorted(abs(p[0] - 1.0) for p in starts)[: SEARCH.go_on]
    assert [far(model) for model, _ in bench.asked[len(starts) :]] == nearest
    assert {"sensor_nonlinearity", "periodic_gust", "quadratic_drag"} <= {*SIZED} and "drive_dead_zone" not in SIZED


def test_a_sweep_ends_when_enough_has_been_simulated(pushed):
    def begun(end):
        bench = bench_of(pushed, exclude=all_but("bias_torque", "backlash"))
        base = replace(pushed.fit, model=replace(pushed.fit.model, effort=bench.budget.effort))
        return [c.name for c in swept(bench, base, end=end)], bench.budget.spent

    assert begun(0) == ([], 0)
    names, spent = begun(1)
    assert names == ["bias_torque"] and spent > 0  # one body first


@pytest.mark.parametrize(
    "kinds, names",
    [
        (any_body, {"bias_torque", "backlash", "shaft_compliance"}),
        (of_one_body, {"bias_torque"}),
        (of_two_bodies, {"backlash", "shaft_compliance"}),
    ],
)
def test_a_sweep_of_one_body_leaves_two_out(pushed, kinds, names):
    bench = Watched(
        pushed.traces,
        1.0,
        exclude=all_but("bias_torque", "backlash", "shaft_compliance"),
        answer=lambda model: replace(pushed.fit, model=model),
    )
    assert swept(bench, pushed.fit, kinds=kinds) == []
    assert {model.names for model, _ in bench.asked} == {(name,) for name in names}
