"""A round: who is refitted, from where, and who leads at its end."""

from dataclasses import replace

import numpy as np
import pytest
from servo import NAMES, SPARSE, all_but, bench_of, recorded, started

from ers_mj.decisions.thresholds import POLICY
from ers_mj.estimation.fit import fit
from ers_mj.estimation.objective import tau_of
from ers_mj.plants.inputs import INPUTS
from ers_mj.selection import finishing
from ers_mj.selection.candidates import candidates
from ers_mj.selection.finishing import finished_if_near
from ers_mj.selection.refits import Refits
from ers_mj.selection.screening import Begin


def found(start, *names, **settings):
    """What a round of these effects finds."""
    return candidates(bench_of(start, exclude=all_but(*names)), start.fit, **settings)


def test_further_forms_are_fitted_to_the_end_where_a_few_steps_bring_them_near(pushed):
    """Of two starts of a form the better one, and none of a law that a few steps leave far behind."""
    traces = recorded([("bias_torque", np.array([6.0]))])
    base = fit(pushed.fit.model, traces)
    refits = Refits(replace(bench_of(pushed, tau=tau_of(base.misfit)), traces=traces), base)
    begun = [
        (name, Begin(base.model.with_effect(name, np.array(p)), {}))
        for name, p in (("bias_torque", [4.0]), ("bias_torque", [-60.0]), ("sensor_lag", [0.002, np.inf]))
    ]
    ((_, kept),) = refits.finished(begun[:1])
    ((name, best),) = finished_if_near(refits, begun, {"bias_torque": kept})
    assert refits.won(kept) > 10.0 * POLICY.least_gain
    assert name == "bias_torque" and refits.total(best) < refits.total(kept) + 0.1


def test_a_race_ends_when_enough_has_been_simulated():
    start = started(recorded([("input_delay", np.array([0.012]))], names=("multisine", "steps"), t=SPARSE))
    efforts, told = [], []
    for last in (np.inf, 0.0):
        bench = bench_of(start, exclude=all_but("input_delay", "inductance", "sensor_lag", "drive_dead_zone"))
        base = replace(start.fit, model=replace(start.fit.model, effort=bench.budget.effort))
        told.append(candidates(bench, base, least=POLICY.least_gain, last=last))
        efforts.append(bench.budget.spent)
    assert efforts[1] < 0.8 * efforts[0]
    assert told[1] and told[1][0].gain > 0.5 * told[0][0].gain > POLICY.least_gain  # what was begun is told


def test_a_soft_knee_is_found_that_a_plain_clip_does_little_of(monkeypatch):
    """A drive that gives in long before its supply is told from the first as what it is: a clip does too little of it
    to be carried on.
    """
    knee = max(float(np.max(np.abs(INPUTS[name](SPARSE)))) for name in NAMES)
    start = started(recorded([("voltage_saturation", np.array([knee, 6.0]))], t=SPARSE))
    monkeypatch.setattr(finishing, "wider", lambda *_: [])
    best = found(start, "voltage_saturation")[0]
    assert dict(best.fit.model.effects)["voltage_saturation"] == pytest.approx([knee, 6.0], rel=0.1)


@pytest.mark.parametrize(
    "name, truth",
    [
        ("hinge_moment_cubic", [300.0, 0.5]),
        ("hinge_moment_cubic", [300.0, np.inf]),  # begun as a plain cubic, one that stays one gets no second number
        ("quadratic_drag", [1.0, 2.4]),
    ],
)
def test_a_law_gets_a_second_number_where_it_has_one(name, truth):
    """A hinge moment that grows more slowly, a drag of an exponent of its own."""
    start = started(recorded([(name, np.array(truth))], t=SPARSE))
    assert dict(found(start, name)[0].fit.model.effects)[name] == pytest.approx(truth, rel=0.1)


def test_what_cannot_be_scaled_is_refitted_from_all_its_starts(plain):
    peak = max(float(np.abs(t.u).max()) for t in plain.traces)
    start = started(recorded([("voltage_saturation", np.array([0.93 * peak, np.inf]))], t=SPARSE))
    best, *others = found(start, "voltage_saturation", "current_limit", "supply_sag", "drive_dead_zone")
    clip = next(c for c in (best, *others) if c.name == "voltage_saturation")
    assert clip.gain == pytest.approx(best.gain, abs=0.01)  # without inductance a limit of the current is the same
    assert dict(clip.fit.model.effects)[clip.name][0] == pytest.approx(0.93 * peak, rel=0.01)


def test_nothing_is_looked_for_where_no_explanation_could_buy_enough(plain):
    bench = bench_of(plain)
    base = replace(plain.fit, model=replace(plain.fit.model, effort=bench.budget.effort))
    assert candidates(bench, base, least=POLICY.least_gain) == [] and bench.budget.spent == 0
