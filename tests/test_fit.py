"""A fit: where it ends, and what it tells of a search that was given up."""

from dataclasses import replace

import numpy as np
import pytest

from ers_mj.decisions.explained import cost
from ers_mj.estimation import descent
from ers_mj.estimation.fit import fit
from ers_mj.selection.budget import Budget


def test_a_search_that_is_given_up_still_tells_the_cost_that_was_asked_for(pushed):
    far = replace(pushed.fit.model, values={**pushed.fit.model.values, "a_1": 2.5, "b": 7.0})
    left = fit(far, pushed.traces, tau=1.0, steps=1, ceiling=pushed.fit.misfit)
    assert float(np.exp(np.mean(np.log(left.misfit + 1.0)))) > 10.0  # it ended at a stage far above
    assert left.cost == pytest.approx(cost(left.misfit, 1.0))


def test_a_search_ends_at_what_it_may_simulate_and_says_so(pushed, monkeypatch):
    effort, values = Budget(pushed.traces).effort, pushed.fit.model.values
    far = replace(
        pushed.fit.model, values={**values, "a_1": 2.0 * values["a_1"], "b": 0.5 * values["b"]}, effort=effort
    )
    whole = fit(far, pushed.traces)
    assert not effort.is_cut and whole.model.effort is effort
    monkeypatch.setattr(descent, "EFFORT", replace(descent.EFFORT, most=0.4 * effort.spent))
    before = effort.spent
    part = fit(far, pushed.traces)
    assert effort.is_cut and part.model.effort is effort and part.cost >= whole.cost
    assert effort.spent - before < before
