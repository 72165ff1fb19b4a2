"""Which laws without a name take the place of what is named."""

from dataclasses import replace

import numpy as np
import pytest
from servo import SPARSE, bench_of, having, recorded, started

from ers_mj.decisions.thresholds import POLICY
from ers_mj.effects import SUSPECTS
from ers_mj.estimation.fit import fit
from ers_mj.selection.budget import SEARCH
from ers_mj.selection.confounders import in_place_of_all, without_confounders
from ers_mj.selection.stepwise import Selection


@pytest.fixture(scope="module")
def uneven():
    """A damping along the travel, and the three names that it was told as: they explain it together."""
    start = started(recorded([("uneven_damping", np.array([5.0, 3.0, 0.3, np.inf, np.inf, np.inf]))], t=SPARSE))
    told = having(start.fit, "quadratic_drag", [0.5, np.inf])
    told = having(told, "sensor_nonlinearity", [0.05, 0.05, np.inf, np.inf, np.inf])
    told = having(told, "asymmetric_friction", [1.0, 0.5, np.inf, np.inf])
    return start, fit(told.model, start.traces)


def test_one_law_without_a_name_takes_the_place_of_all_names(uneven):
    """None of them alone need give way to it."""
    start, told = uneven
    bench = bench_of(start)
    found, (suspect,) = in_place_of_all(bench, told, start.fit)
    assert suspect.name == "uneven_damping" and found.model.names == ("uneven_damping",)
    few = replace(bench, search=replace(SEARCH, many=3), policy=replace(POLICY, forked=np.inf))
    assert in_place_of_all(few, told, start.fit) == (told, [])  # where they are few and leave little


def test_what_is_left_without_a_name_is_told_as_a_suspect(uneven):
    start, _ = uneven
    nothing = Selection(start.fit, start.fit, (), 1.0, start.traces)
    selection, (suspect,) = without_confounders(nothing, start.traces, 1)
    assert selection is nothing and suspect.name == "uneven_damping"


def test_a_law_with_a_name_that_explains_all_stays(pushed):
    assert SUSPECTS
    named = fit(having(pushed.fit, "bias_torque", [0.06]).model, pushed.traces)
    selection = Selection(pushed.fit, named, (), 1.0, pushed.traces)
    assert without_confounders(selection, pushed.traces, 1) == (selection, ())
