"""Where else a refit of a round may begin."""

from dataclasses import replace

import numpy as np
from servo import having

from ers_mj.effects import BY_NAME
from ers_mj.estimation.objective import residuals
from ers_mj.selection.multistart import more_starts, other_forms, other_waves, wider
from ers_mj.selection.screening import Begin

SHAFT = np.array([80.0, 0.2, 0.6, 0.2, np.inf])


def test_a_wider_effect_begins_where_its_limit_ended(pushed):
    model, traces = pushed.fit.model, pushed.traces
    starts = BY_NAME["backlash"].grown("shaft_compliance", SHAFT, model.scales)
    one, other = (
        residuals(model.with_effect(name, p), traces, 5.0)
        for name, p in (("shaft_compliance", SHAFT), ("backlash", starts[0]))
    )
    apart = np.sqrt(np.mean((one - other) ** 2))
    assert apart < 0.2 * np.sqrt(np.mean((one - residuals(model, traces, 5.0)) ** 2))
    assert not BY_NAME["backlash"].grown("bias_torque", np.array([0.5]), model.scales)


def test_a_shaft_may_harden_once_it_is_there(pushed):
    shaft = having(pushed.fit, "shaft_compliance", SHAFT)
    (grown,) = (
        begin.model for name, begin in wider({"shaft_compliance": shaft}, ("backlash",)) if name == "shaft_compliance"
    )
    assert 0.0 < dict(grown.effects)["shaft_compliance"][4] < np.inf
    assert not wider({"shaft_compliance": replace(shaft, model=grown)}, ("backlash",))


def test_other_laws_wave_with_the_period_that_leads(pushed):
    """Not those of its class, which are told apart by their periods, nor beside what does not wave."""
    scales = pushed.fit.model.scales
    period = 0.4 * (scales.high - scales.low)

    def waves(name, *p, exclude=()):
        return other_waves({name: having(pushed.fit, name, p)}, exclude)

    wave, dent = [0.5, np.inf, np.inf, period, 0.3], [0.5, 0.1, 0.05, np.inf, np.inf]
    begun = waves("position_dependent_friction", *wave)
    names = {name for name, _ in begun}
    assert names >= {"sensor_nonlinearity", "transmission_ripple"}
    assert not names & {"position_dependent_friction", "periodic_gust"}
    assert all(period in dict(begin.model.effects)[name] and begin.model.names == (name,) for name, begin in begun)
    fewer = waves("position_dependent_friction", *wave, exclude=("sensor_nonlinearity",))
    assert {name for name, _ in fewer} == names - {"sensor_nonlinearity"}
    assert not waves("position_dependent_friction", *dent) and not other_waves({"gain": pushed.fit}, ())
    ripple = waves("transmission_ripple", 0.05, period, 0.0, np.inf, np.inf, np.inf)
    assert "cogging" not in {name for name, _ in ripple}


def test_forms_are_compared_at_the_end(pushed):
    """Of a supply that sags, the law by duty beside that by current, whichever was ahead after a few steps; each form
    once.
    """
    ways = [
        np.array([bridge, whole, np.inf, T_c, 14.0, 24.0])
        for bridge, whole, T_c in ((np.inf, 0.2, 0.1), (0.2, np.inf, 0.1), (0.3, np.inf, 0.1), (0.2, np.inf, np.inf))
    ]
    begins = [Begin(pushed.fit.model.with_effect("supply_sag", p), {}) for p in ways]
    finished = {"supply_sag": replace(pushed.fit, model=begins[0].model), "gain": pushed.fit}
    assert [begin for _, begin in other_forms(finished, {"supply_sag": begins})] == [begins[1], begins[3]]


def test_a_start_that_a_secant_made_too_small_is_no_end(pushed):
    """Of laws with few starts these count as they are as well, promised or not, of what happens once or takes long
    none; what is found does not hang on the secant's size.
    """
    model = pushed.fit.model
    small = {
        (name, 0): [Begin(model.with_effect(name, np.array([1e-3])), {})] for name in ("bias_torque", "quadratic_drag")
    }
    names = ["bias_torque", "quadratic_drag", "position_dependent_friction", "load_disturbance", "presliding"]
    begun = more_starts(model, names, ["bias_torque", "load_disturbance"], small)
    own = {name: BY_NAME[name].starts(model.scales)[0][0] for name in ("bias_torque", "quadratic_drag")}
    assert [(name, dict(b.model.effects)[name][0]) for name, b in begun] == [
        ("bias_torque", 1e-3),
        ("bias_torque", own["bias_torque"]),
        ("quadratic_drag", own["quadratic_drag"]),
    ]
