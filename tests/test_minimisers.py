"""Every minimiser over every test problem: it comes down, stays within bounds and budget, and is the same by seed."""

import numpy as np
import pytest

from ers_mj.errors import InputError
from ers_mj.identification.minimisers import LS, MINIMISERS
from ers_mj.identification.minimisers.iga import IGA, ranked, sigmoid

BUDGET = 3000


class Problem:
    """A sum of squares, with what it was asked."""

    def __init__(self, residuals):
        self.residuals_of, self.points = residuals, []

    def residuals(self, x):
        self.points.append(np.array(x))
        return self.residuals_of(np.asarray(x))

    def __call__(self, x):
        return np.array([float(e @ e) for e in map(self.residuals, x)])


PROBLEMS = {
    "sphere": (lambda x: x - 0.3, 1e-4),
    "rosenbrock": (lambda x: np.concatenate([10.0 * (x[1:] - x[:-1] ** 2), 1.0 - x[:-1]]), 5.0),
    "rastrigin": (lambda x: np.concatenate([x, np.sqrt(20.0) * np.sin(np.pi * x)]), 12.0),
}
LOWER, UPPER = np.full(3, -2.0), np.full(3, 3.0)
ALL = pytest.mark.parametrize("method", MINIMISERS)


def solved(method, problem, seed=1, budget=BUDGET, **options):
    asked = Problem(PROBLEMS[problem][0])
    return MINIMISERS[method].minimise(asked, LOWER, UPPER, seed=seed, budget=budget, **options), asked


@ALL
@pytest.mark.parametrize("problem", PROBLEMS)
def test_it_comes_down_within_bounds_and_budget(method, problem):
    found, asked = solved(method, problem)
    points = np.array(asked.points)
    assert found.value < PROBLEMS[problem][1]
    assert np.isclose(found.value, asked(found.x[None])[0]) and not found.x.flags.writeable
    assert np.all(points >= LOWER - 1e-9) and np.all(points <= UPPER + 1e-9)
    assert found.evaluations == len(points) <= BUDGET
    assert (
        np.all(np.diff(found.trace[:, 1]) <= 0)
        and found.trace[-1, 1] == found.value
        and found.trace[-1, 0] == found.evaluations
    )


@ALL
def test_the_seed_decides(method):
    one, two, other = (solved(method, "rastrigin", seed, 300)[0] for seed in (3, 3, 4))
    assert np.array_equal(one.x, two.x) and np.array_equal(one.trace, two.trace) and not np.array_equal(one.x, other.x)


@ALL
@pytest.mark.parametrize("budget", [1, 57, 200])
def test_the_budget_is_never_exceeded(method, budget):
    found, asked = solved(method, "rosenbrock", budget=budget)
    assert len(asked.points) == found.evaluations <= budget and np.isfinite(found.value)


@ALL
def test_a_good_start_is_not_lost(method):
    start = np.array([0.99, 0.98, 0.96])
    found, asked = solved(method, "rosenbrock", budget=400, start=start)
    first = asked(start[None])[0]
    assert method in ("cma",) or found.value <= first * (1 + 1e-9)


@ALL
def test_values_that_are_not_finite_are_passed_over(method):
    def holed(x):
        return np.where(x[0] > 1.0, np.nan, x)

    found = MINIMISERS[method].minimise(Problem(holed), LOWER, UPPER, budget=600, seed=2)
    assert found.value < 0.5 and found.x[0] <= 1.0


def test_empty_bounds_and_a_plain_function_for_least_squares_are_refused():
    with pytest.raises(InputError, match="enclose nothing"):
        MINIMISERS["iga"].minimise(lambda x: x.sum(axis=1), [0, 1], [1, 1])
    with pytest.raises(InputError, match="needs an objective with residuals"):
        LS().minimise(lambda x: x.sum(axis=1), [0, 0], [1, 1])


def test_least_squares_stops_at_the_target_and_starts_again_above_it():
    deep, shallow = Problem(PROBLEMS["rastrigin"][0]), Problem(PROBLEMS["rastrigin"][0])
    deep.target, shallow.target = 1e-12, 1e9
    found = [LS(attempts=30).minimise(p, LOWER, UPPER, seed=0, budget=5000) for p in (deep, shallow)]
    assert found[0].evaluations > 2 * found[1].evaluations and found[0].value < found[1].value


def test_the_printed_equations():
    chances = ranked(10, 1.5)
    assert (
        np.isclose(chances.sum(), 1)
        and np.isclose(chances[0], 1.5 / 10)
        and np.isclose(chances[-1], 0.5 / 10)
        and np.allclose(np.diff(chances, 2), 0)
    )
    assert (
        np.isclose(sigmoid(0.9, 0.6, 0.25), 0.75)
        and abs(sigmoid(0.9, 0.6, 1.0) - 0.6) < 1e-6
        and abs(sigmoid(0.9, 0.6, 0.0) - 0.9) < 0.01
    )


def test_an_elite_is_never_lost():
    """Without elitism the best of a generation may be worse than that of the one before; with it never."""

    def bests(elitist):
        seen = []

        def objective(x):
            values = (x**2).sum(axis=1)
            seen.append(values.min())
            return values

        IGA(size=10, mutation=(1.0, 1.0), elitist=elitist).minimise(objective, LOWER, UPPER, seed=0, budget=600)
        return np.array(seen)

    free = bests(False)
    assert np.any(free[1:] > np.minimum.accumulate(free)[:-1])
    kept = IGA(size=10, mutation=(1.0, 1.0)).minimise(lambda x: (x**2).sum(axis=1), LOWER, UPPER, seed=0, budget=600)
    assert kept.value < free[-1]
