"""The finite-time law's conditions, bound and search."""

import json
import math
from dataclasses import replace
from fractions import Fraction

import pytest

from ers_mj import cli
from ers_mj.control.controllers import Gains
from ers_mj.control.gains import conditions, freed, lyapunov, search, settling_bound
from ers_mj.errors import InputError


def test_97_of_99_gives_the_printed_m():
    assert conditions(Gains()) == pytest.approx((0.00756, 5.7595, 0.000356), rel=2e-3)
    assert tuple(float(f"{m:.4g}") for m in conditions(Gains())) == (0.007563, 5.760, 0.0003556)


def test_96_of_97_gives_others():
    assert conditions(replace(Gains(), q=Fraction(96, 97))) == pytest.approx((0.1122, 7.0497, 0.00471), rel=1e-3)


def test_the_bound_is_finite_and_useless():
    assert 5e5 < settling_bound(Gains(), math.radians(10)) < 6e5
    assert (
        settling_bound(replace(Gains(), k_1=50.0), 0.1) is None and settling_bound(replace(Gains(), q=1), 0.1) is None
    )


@pytest.mark.parametrize("x", [(0.1, 0.0, 0.0), (0.0, -0.1, 0.0), (0.0, 0.0, 0.2), (0.01, -0.02, 0.3)])
def test_the_lyapunov_function_is_positive_and_within_its_bound(x):
    gains = Gains()
    q, (x1, x2, _) = float(gains.q), x
    from ers_mj.control.controllers import FiniteTime
    from ers_mj.control.controllers.finite_time import sig

    xi_2 = sig(x2, 1 / q) + gains.k_1 ** (1 / q) * x1
    xi_3 = FiniteTime(gains).xi_3(*x)
    assert 0 < lyapunov(gains, *x) <= 2 * (x1**2 + xi_2**2 + xi_3**2) * 1.1
    assert lyapunov(gains, *x) == pytest.approx(lyapunov(gains, *(-z for z in x)))


def test_free_parameters_make_conditions_hold_where_they_can():
    failing = replace(Gains(), k_2=200.0, k_3=2100.0)
    assert min(conditions(failing)) < 0 < min(conditions(freed(failing)))
    assert min(conditions(freed(replace(Gains(), k_1=500.0)))) < 0


def test_the_search_takes_the_smallest_gain_that_settles_in_time():
    found = search(0.05, lambda gains: 3.5 / gains.k_2)
    assert found.gains.k_2 == pytest.approx(70.0, rel=0.01) and found.settling <= 0.05 and min(found.m) > 0
    with pytest.raises(InputError, match="the quickest take 100 ms"):
        search(0.05, lambda gains: 0.1)
    with pytest.raises(InputError, match="no l and gamma"):
        search(0.05, lambda gains: 3.5 / gains.k_2, replace(Gains(), k_1=500.0))


# -- the command -------------------------------------------------------------------------------------------------------


def test_the_command_checks(capsys):
    assert cli.main(["gains", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (
        told["feasible"]
        and told["m"] == pytest.approx([0.00756, 5.7595, 0.000356], rel=2e-3)
        and told["settling_time_s"] < 0.1
    )
    assert cli.main(["gains", "--gains", "k_1=50"]) == 1
    out = capsys.readouterr().out
    assert "do not hold" in out and "m_1 = -" in out and "bound" not in out


def test_the_command_searches(capsys):
    assert cli.main(["gains", "--settling-ms", "60", "--json", "--rate-hz", "1000"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert min(told["m"]) > 0 and 0.05 < told["settling_time_s"] <= 0.06 and told["gains"]["k_2"] > 38
    assert cli.main(["gains", "--settling-ms", "1", "--rate-hz", "500"]) == 2
    assert "the quickest take" in capsys.readouterr().err
