"""Laws that a screening passes over, refitted where what leads may hide them."""

import numpy as np
import pytest
from servo import NAMES, SPARSE, TRUTH, all_but, alone, bench_of, recorded, started

from ers_mj.effects import BY_NAME
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.selection.overlooked import refit_the_overlooked
from ers_mj.selection.refits import Refits
from ers_mj.selection.screening import Screened, screen

NOTHING = Screened({}, {}, 0.0, 8)  # was promised


def test_the_kin_of_a_law_that_leads_is_refitted_though_its_secant_promises_nothing():
    """A limit does nothing until it is passed; what sags does much of what it does, and leads."""
    start = started(recorded([("current_limit", np.array([300.0, np.inf]))], t=SPARSE))
    sag = alone(start, "supply_sag", BY_NAME["supply_sag"].starts(start.fit.model.scales)[0])
    refits = Refits(bench_of(start, exclude=["voltage_saturation"]), start.fit)
    best = {"supply_sag": sag.fit}
    refit_the_overlooked(refits, best, NOTHING, {}, 0.0)
    assert {*best} == {"supply_sag", "current_limit"}
    assert refits.total(best["current_limit"]) < refits.total(sag.fit)
    assert dict(best["current_limit"].model.effects)["current_limit"][0] == pytest.approx(300.0, rel=0.01)


def test_a_stop_that_is_touched_once_is_no_impulse():
    """Only the steps reach it, and the rudder sticks there. Where its secant, taken from a stop too early, promises
    nothing, an impulse explains as much. One touch tells where the stop is less well than how far the rudder came.
    """
    values = {**TRUTH, "c_2": 60.0}
    free = {name: ReducedModel(lumped(values)).simulate(SPARSE, INPUTS[name](SPARSE)).theta for name in NAMES}
    upper = free["steps"].max() - 0.01
    start = started(recorded([("end_stop", np.array([-np.inf, upper, 60.0, 0.3]))], values=values, t=SPARSE), values)
    struck = screen(bench_of(start, exclude=all_but("load_disturbance")), [start.fit.model], False, False)
    refits = Refits(bench_of(start, exclude=all_but("end_stop", "drive_dead_zone", "load_disturbance")), start.fit)
    impulse = refits.on(struck.begins["load_disturbance"][0][0], 20)
    best = {"load_disturbance": impulse}
    assert refits.won(impulse) > refits.bench.policy.least_gain
    refit_the_overlooked(refits, best, NOTHING, {}, 3.0)
    assert refits.total(best["end_stop"]) < refits.total(impulse)
    assert dict(best["end_stop"].model.effects)["end_stop"][1] == pytest.approx(upper, abs=2e-3)


def test_nothing_is_looked_for_beside_what_gains_little(pushed):
    refits, best = Refits(bench_of(pushed), pushed.fit), {"quadratic_drag": pushed.fit}
    refit_the_overlooked(refits, best, NOTHING, {}, 3.0)
    assert {*best} == {"quadratic_drag"}
