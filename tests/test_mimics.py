"""Which laws without a name take the place of what is named."""

import numpy as np

from ers_mj.data.prepared import trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.estimation.baseline import baseline
from ers_mj.estimation.fit import fit
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.selection import confounders as mimics
from ers_mj.selection.confounders import unmasked
from ers_mj.selection.stepwise import Selection
from ers_mj.servo.datasheet import Datasheet

T = np.arange(0.0, 3.0, 1e-3)
TRUTH = {"a_1": 25.0, "a_2": 50.0, "b": 70.0, "c_1": 135.0, "c_2": 115.0, "theta_0": 0.2625}


def test_one_law_without_a_name_takes_the_place_of_all_names(monkeypatch):
    """A damping along the travel, told as three that explain it together, none of which alone gives way to it."""
    traces = []
    for k, name in enumerate(("multisine", "steps", "chirp")):
        y = (
            ReducedModel(lumped(TRUTH), [("uneven_damping", np.array([5.0, 3.0, 0.3, np.inf, np.inf, np.inf]))])
            .simulate(T, INPUTS[name](T))
            .measured
        )
        traces.append(
            trace_of(
                from_arrays(
                    T, INPUTS[name](T), y + 1.5e-4 * np.random.default_rng(k).standard_normal(T.size), name=name
                ),
                None,
            )
        )
    start = baseline(traces, Datasheet(lumped=TRUTH), True, 1)
    model = start.fit.model
    for name, p in (
        ("quadratic_drag", [0.5, np.inf]),
        ("sensor_nonlinearity", [0.05, 0.05, np.inf, np.inf, np.inf]),
        ("asymmetric_friction", [1.0, 0.5, np.inf, np.inf]),
    ):
        model = model.with_effect(name, np.array(p))
    told = Selection(start.fit, fit(model, start.traces), (), 1.0, start.traces)
    monkeypatch.setattr(mimics, "_in_its_place", lambda *_: [])
    selection, suspects = unmasked(told, start.traces, 1)
    assert [c.name for c in suspects] == ["uneven_damping"] and not selection.chosen.model.names
    monkeypatch.setattr(mimics, "MANY", 3)
    monkeypatch.setattr(mimics, "FORKED", np.inf)
    assert unmasked(told, start.traces, 1) == (told, ())
