"""What solvers/ has in the place of scipy's, which take long to import: against those."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.special import stdtrit

from ers_mj.effects.base import recursive
from ers_mj.solvers.simplex import lowest
from ers_mj.solvers.student import quantile


@pytest.mark.parametrize("freedom", [1, 2, 3, 10, 57, 1000, 5001])
def test_the_quantile_of_student_is_scipys(freedom):
    assert quantile(freedom, 0.975) == pytest.approx(float(stdtrit(freedom, 0.975)), rel=1e-12)


def test_the_simplex_ends_where_scipys_does():
    first, bounds = np.vstack([np.zeros(3), 0.3 * np.eye(3)]), [(-1.2, 1.2)] * 3
    cost = lambda x: float(np.sum((x - [0.4, -0.7, 2.0]) ** 2) + 0.3 * np.sin(5 * x[0]))
    options = {"initial_simplex": first, "maxfev": 200, "xatol": np.inf, "fatol": 1e-8}
    theirs = minimize(cost, first[0], method="Nelder-Mead", bounds=bounds, options=options)
    ours = lowest(cost, first, bounds, most=200, within=1e-8)
    assert ours == pytest.approx(theirs.x, abs=1e-9)


def test_the_simplex_asks_for_no_more_than_it_may():
    asked = []
    lowest(
        lambda x: asked.append(x) or float(x @ x),
        np.vstack([np.ones(2), 2 * np.eye(2)]),
        [(-3, 3)] * 2,
        most=7,
        within=0,
    )
    assert len(asked) == 7


def test_a_recursion_is_the_sum_of_what_is_left_of_every_impulse():
    random = np.random.default_rng(1)
    decay, driven = random.uniform(0.3, 1.0, 300), random.normal(size=300)
    z = [driven[0]]
    for d, v in zip(decay[1:], driven[1:], strict=True):
        z.append(d * z[-1] + v)
    assert recursive(decay, driven) == pytest.approx(np.array(z), rel=1e-12, abs=1e-12)
