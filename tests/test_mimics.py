"""Which laws without a name take the place of what is named."""

from dataclasses import replace

import numpy as np
from servo import recorded, started

from ers_mj.decisions.policy import POLICY
from ers_mj.estimation.fit import fit
from ers_mj.selection import confounders
from ers_mj.selection.confounders import without_confounders
from ers_mj.selection.stepwise import Selection


def test_one_law_without_a_name_takes_the_place_of_all_names(monkeypatch):
    """A damping along the travel, told as three that explain it together, none of which alone gives way to it."""
    start = started(recorded([("uneven_damping", np.array([5.0, 3.0, 0.3, np.inf, np.inf, np.inf]))]))
    model = start.fit.model
    for name, p in (
        ("quadratic_drag", [0.5, np.inf]),
        ("sensor_nonlinearity", [0.05, 0.05, np.inf, np.inf, np.inf]),
        ("asymmetric_friction", [1.0, 0.5, np.inf, np.inf]),
    ):
        model = model.with_effect(name, np.array(p))
    told = Selection(start.fit, fit(model, start.traces), (), 1.0, start.traces)
    screen = confounders.screen

    def beside_nothing(*arguments):
        """Nothing promises anything beside what is named."""
        return replace(screen(*arguments), begins={})

    monkeypatch.setattr(confounders, "screen", beside_nothing)
    selection, suspects = without_confounders(told, start.traces, 1)
    assert [c.name for c in suspects] == ["uneven_damping"] and not selection.chosen.model.names
    two = replace(told, chosen=fit(model.without_effect("quadratic_drag"), start.traces))
    forked = two.chosen.cost > POLICY.forked
    assert bool(without_confounders(two, start.traces, 1)[1]) is forked
