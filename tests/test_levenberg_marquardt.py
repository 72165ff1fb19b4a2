"""Levenberg-Marquardt, on problems that are no servo."""

from dataclasses import dataclass

import numpy as np
import pytest

from ers_mj.solvers.levenberg_marquardt import Damping, Descent


@dataclass(frozen=True)
class Place:
    z: np.ndarray
    e: np.ndarray
    cost: float


class LeastSquares:
    """Half the sum of the squares of some residuals."""

    def __init__(self, residuals, jacobian, lower=-np.inf):
        self.residuals, self.jacobian, self.lower = residuals, jacobian, lower

    def reach(self, z):
        z = np.maximum(z, self.lower)
        e = self.residuals(z)
        return Place(z, e, 0.5 * float(e @ e) if np.all(np.isfinite(e)) else np.inf)

    def normal(self, point, slopes):
        return slopes.T @ slopes, slopes.T @ point.e

    def step(self, point, curvature, slope, damping):
        return -np.linalg.solve(curvature + damping * np.diag(np.diag(curvature)), slope)

    def descent(self, z, rule=Damping()):
        return Descent(self, self.reach(np.array(z, float)), rule)

    def renew(self, descent):
        descent.renew(np.asfortranarray(self.jacobian(descent.point.z)))


LINE = np.array([[1.0, 2.0], [3.0, -1.0], [0.5, 0.5]])
TRUE = np.array([1.5, -0.5])
PLANE = LeastSquares(lambda z: LINE @ (z - TRUE), lambda z: LINE)
VALLEY = LeastSquares(  # Rosenbrock's
    lambda z: np.array([10.0 * (z[1] - z[0] ** 2), 1.0 - z[0]]),
    lambda z: np.array([[-20.0 * z[0], 10.0], [-1.0, 0.0]]),
)


def settled(problem, z, steps=2000, least=1e-16):
    """Where a descent ends that takes its slopes anew whenever they do not keep what they promise, and the number of
    Jacobians.
    """
    descent, jacobians = problem.descent(z), 0
    for _ in range(steps):
        if descent.slopes is None:
            problem.renew(descent)
            jacobians += 1
        step = descent.advance(8)
        if step is None or step.gain < least:
            if descent.fresh or step is not None and step.fresh:
                break
            descent.slopes = None
    return descent.point, jacobians


def test_a_quadratic_is_solved_in_a_step():
    descent = PLANE.descent([40.0, -70.0], Damping(first=1e-12))
    PLANE.renew(descent)
    before = descent.point.cost
    step = descent.advance(1)
    assert descent.point.z == pytest.approx(TRUE, abs=1e-8)
    assert step.fresh and step.gain == pytest.approx(before) == pytest.approx(step.promised)


@pytest.mark.parametrize("begin", [(-1.2, 1.0), (30.0, -40.0), (-100.0, 5.0)])
def test_a_bent_valley_is_followed_to_its_end(begin):
    end, jacobians = settled(VALLEY, begin)
    assert end.z == pytest.approx([1.0, 1.0], abs=1e-6)
    assert jacobians < 30


def test_updated_slopes_keep_the_secant_condition():
    """What the last step changed is what the updated slopes say of it; across it they say what they said."""
    descent = VALLEY.descent([-1.2, 1.0], Damping(keeps=-np.inf))
    VALLEY.renew(descent)
    before, old = descent.point, descent.slopes.copy()
    step = descent.advance(8)
    moved, across = descent.point.z - before.z, np.array([[0.0, -1.0], [1.0, 0.0]]) @ (descent.point.z - before.z)
    assert step.fresh and not descent.fresh
    assert descent.slopes @ moved == pytest.approx(descent.point.e - before.e)
    assert descent.slopes @ across == pytest.approx(old @ across)


def test_slopes_that_do_not_keep_their_promise_are_taken_anew():
    descent = VALLEY.descent([-1.2, 1.0], Damping(keeps=np.inf))
    VALLEY.renew(descent)
    assert descent.advance(8).gain > 0 and descent.slopes is None


def test_where_there_is_no_cost_no_step_ends():
    """Beyond the edge everything is infinite: the damping rises until a step stays within, and none is accepted that
    does not lower the cost.
    """

    def residuals(z):
        return z - 3.0 if z[0] < 1.0 else np.array([np.nan])

    edge = LeastSquares(residuals, lambda z: np.ones((1, 1)))
    descent, costs = edge.descent([0.0]), []
    for _ in range(30):
        edge.renew(descent)
        if descent.advance(20) is None:
            break
        costs.append(descent.point.cost)
    assert np.all(np.isfinite(costs)) and np.all(np.diff(costs) < 0) and 0.9 < descent.point.z[0] < 1.0
    lost = LeastSquares(lambda z: np.full(1, np.inf), lambda z: np.ones((1, 1))).descent([0.0])
    lost.renew(np.ones((1, 1), order="F"))
    before = lost.point
    assert lost.advance(5) is None and lost.point is before


def test_the_damping_rises_while_the_cost_does_and_falls_again():
    rule = Damping()
    descent = PLANE.descent([0.0, 0.0], rule)
    PLANE.renew(descent)
    descent.advance(1)
    assert descent.damping == rule.first / rule.lowered
    wrong = LeastSquares(PLANE.residuals, lambda z: -LINE).descent([0.0, 0.0])  # slopes that lead uphill
    wrong.renew(np.asfortranarray(-LINE))
    assert wrong.advance(3) is None and wrong.damping == pytest.approx(rule.first * rule.raised**3)


def test_numbers_at_their_bound_stay_there():
    bound = LeastSquares(PLANE.residuals, PLANE.jacobian, lower=np.array([2.0, -5.0]))
    end, _ = settled(bound, [4.0, 4.0])
    assert end.z[0] == 2.0 and end.cost < bound.reach(np.array([2.0, 0.0])).cost + 1e-9
