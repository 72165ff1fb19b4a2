"""A fit: where it ends, and what it tells of a search that was given up."""

from dataclasses import replace

import numpy as np
import pytest

from ers_mj.decisions.explained import cost
from ers_mj.estimation.fit import fit


def test_a_search_that_is_given_up_still_tells_the_cost_that_was_asked_for(pushed):
    far = replace(pushed.fit.model, values={**pushed.fit.model.values, "a_1": 2.5, "b": 7.0})
    left = fit(far, pushed.traces, tau=1.0, steps=1, ceiling=pushed.fit.misfit)
    assert float(np.exp(np.mean(np.log(left.misfit + 1.0)))) > 10.0  # it ended at a stage far above
    assert left.cost == pytest.approx(cost(left.misfit, 1.0))
