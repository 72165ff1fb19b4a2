"""What was named earlier goes again where it is needed no more."""

from dataclasses import replace

import numpy as np
import pytest
from servo import bench_of, having

from ers_mj.estimation.fit import fit
from ers_mj.selection.comparison import Candidate
from ers_mj.selection.drop import pruned, reconsidered


@pytest.mark.parametrize(
    "newest, gain, kept",
    [
        ("drive_dead_zone", 400.0, ("drive_dead_zone",)),
        ("drive_dead_zone", 50.0, ("load_disturbance", "drive_dead_zone")),
        ("periodic_gust", 400.0, ("load_disturbance", "periodic_gust")),
    ],
)
def test_an_impulse_that_a_later_law_outweighs_is_looked_for_again(pushed, newest, gain, kept):
    """It was found in what the law had bent; beside another one with a clock of its own it stays."""
    current = having(having(pushed.fit, "load_disturbance", [10.0, 1.0, 0.1, 0.0, np.inf]), newest)
    rounds = [
        (Candidate(name, pushed.fit, won, 3.0, 0.0, 1.0),) for name, won in (("load_disturbance", 20.0), (newest, gain))
    ]
    found, left = reconsidered(bench_of(pushed), current, rounds)
    assert found.model.names == kept and tuple(ranked[0].name for ranked in left) == kept


def test_what_pays_no_more_beside_the_newest_goes(pushed):
    """The torque that acts stays, a drag that stands for nothing goes; the newest is not asked, though it is none."""
    model = pushed.fit.model.with_effect("bias_torque", np.array([3.0]))
    model = model.with_effect("quadratic_drag", np.array([1e-3, np.inf]))
    bench = replace(bench_of(pushed), traces=torque_of_three(pushed))
    current = fit(model, bench.traces)
    assert pruned(bench, current, "bias_torque").model.names == ("bias_torque",)
    assert pruned(bench, current, "quadratic_drag") is current


def torque_of_three(pushed):
    """The recordings under a further torque of 3 rad/s^2."""
    model = pushed.fit.model.with_effect("bias_torque", np.array([3.0]))
    noise = [t.y - pushed.fit.model.predict(t, k) for k, t in enumerate(pushed.traces)]
    return [replace(t, y=model.predict(t, k) + e) for k, (t, e) in enumerate(zip(pushed.traces, noise, strict=True))]
