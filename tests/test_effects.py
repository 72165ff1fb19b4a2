"""What every member of the effects folder owes: a complete declaration, parameters within bounds, and nesting."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from servo import TRUTH
from test_reduced import SCALES, T, table_1

from ers_mj.effects import BY_NAME, EFFECTS, EQUIVALENT
from ers_mj.errors import InputError
from ers_mj.estimation.baseline import baseline
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.selection.multistart import wider
from ers_mj.servo.datasheet import Datasheet, read_datasheet
from ers_mj.servo.simulation import simulate_recording, unit_of

ids = {"ids": lambda e: e.name}


@pytest.mark.parametrize("effect", EFFECTS, **ids)
def test_a_member_declares_itself(effect):
    assert (
        effect.name and effect.sentence and effect.parameters and type(effect).__doc__ and effect.mjcf and effect.apart
    )
    assert effect.subsystem in ("drive", "transmission", "load", "sensor")
    text = effect.describe({p.name: "1" for p in effect.parameters})
    assert "{" not in text
    assert all(p.meaning and unit_of(p.kind) for p in effect.parameters)


@pytest.mark.parametrize("effect", EFFECTS, **ids)
def test_starts_lie_within_bounds(effect):
    for start in effect.starts(SCALES):
        assert len(start) == len(effect.parameters)
        for value, p in zip(start, effect.parameters):
            assert not np.isfinite(value) or p.lower <= value <= p.upper
            assert not p.positive or value > 0


@pytest.mark.parametrize("effect", [e for e in EFFECTS if e.starts(SCALES) and e.name != "backlash"], **ids)
def test_an_absent_effect_leaves_the_motion_alone(effect):
    u = INPUTS["multisine"](T)
    values = np.where(effect.absent() == 0, 1e-12, effect.absent())
    if effect.name == "stribeck":
        values = np.array([1e-12, 0.1, 1.0, np.inf])
    motion = ReducedModel(table_1().coefficients, [(effect.name, values)]).simulate(T, u).theta
    assert np.degrees(np.max(np.abs(motion - table_1().simulate(T, u).theta))) < 2e-4


@pytest.mark.parametrize("effect", [e for e in EFFECTS if e.only_in_loop], **ids)
def test_what_acts_within_a_loop_alone_is_refused_without_one(effect):
    values = {p.name: 0.3 for p in effect.parameters}
    with pytest.raises(InputError, match="acts within a position loop"):
        simulate_recording(read_datasheet("table1"), T, 0 * T, effects=[(effect.name, values)])


@pytest.mark.parametrize("effect", [e for e in EFFECTS if not (e.only_in_loop or e.tabled)], **ids)
def test_what_a_reader_may_give_acts_and_leaves_numbers(effect):
    """Any of an effect's numbers, however few, are refused or change the recording: none is swallowed in silence."""
    starts = effect.starts(SCALES)
    starts += [more for p in starts for more in effect.grown(effect.name, p, SCALES)]
    typical = {
        p.name: min((abs(float(s[k])) for s in starts if np.isfinite(s[k]) and s[k] != 0), default=0.3)
        for k, p in enumerate(effect.parameters)
    }
    typical |= {"rate": 5.0, "tau_max": 0.01}
    settable = [p.name for p in effect.parameters if not p.recorded]
    t, u = T[:1500], INPUTS["multisine"](T[:1500])
    sheet = read_datasheet("table1")
    plain = simulate_recording(sheet, t, u)["theta_rad"]
    accepted = 0
    for size in range(1, len(settable) + 1):
        for names in combinations(settable, size):
            values = {name: typical[name] for name in names}
            try:
                theta = simulate_recording(sheet, t, u, effects=[(effect.name, values)])["theta_rad"]
            except InputError:
                continue
            accepted += 1
            assert np.max(np.abs(theta - plain)) > 1e-6, values  # nor is it where there is no number
    assert accepted > 0


def test_equivalence_classes_hold_known_names_once():
    names = [n for group in EQUIVALENT for n in group]
    assert len(names) == len(set(names))
    assert set(BY_NAME) & set(names)


CURRENT = [e for e in EFFECTS if e.subsystem in ("drive", "transmission") and e.follows_current and e.name != "cogging"]


@pytest.mark.parametrize("effect", CURRENT, **ids)
def test_an_open_circuit_feels_nothing_of_the_current(effect):
    off, c = np.zeros(T.size, bool), table_1().coefficients
    with_it, without = (
        ReducedModel(c, chosen).simulate(T, np.zeros(T.size), (0.5, 8.0), enable=off).theta
        for chosen in ([(effect.name, effect.starts(SCALES)[0])], [])
    )
    assert np.degrees(np.max(np.abs(with_it - without))) < 1e-6


def test_a_bristle_is_begun_with_damping_that_fades_where_it_was_lost(pushed):
    scales, effect = pushed.fit.model.scales, BY_NAME["presliding"]
    lasting, fading = (np.array([1e-3, 0.1, w_d, *3 * [np.inf]]) for w_d in (10.0 * scales.speed, 0.1 * scales.speed))
    assert [p[0] == 1e-3 and p[2] < scales.speed for p in effect.grown("presliding", lasting, scales)] == [
        True,
        False,
        False,
    ]
    assert not any(p[2] < np.inf for p in effect.grown("presliding", fading, scales))


def test_wider_forms_begin_near_the_plain_one(pushed):
    """Half of a Stribeck friction is left at the same speed, a difference of friction in motion stays, a push is as
    strong over its time; what is wide already is not widened.
    """
    scales = pushed.fit.model.scales
    plain = {
        "stribeck": [40.0, 0.6, 1.4, np.inf],
        "asymmetric_friction": [30.0, 1.0, np.inf, np.inf],
        "load_disturbance": [100.0, 1.0, 0.3, 0.0, np.inf],
    }
    wide = {name: BY_NAME[name].grown(name, np.array(p), scales) for name, p in plain.items()}
    level = [
        law.friction(tuple(law.constants(np.array(p), None)), 0.0, 0.0, 0.6 * np.log(2.0) ** (1.0 / 1.4), 0.0, 1.0)
        for law in [BY_NAME["stribeck"]]
        for p in (plain["stribeck"], wide["stribeck"][0])
    ]
    assert level == pytest.approx([20.0, 20.0])
    fast, slow = (
        BY_NAME["asymmetric_friction"].friction(
            tuple(BY_NAME["asymmetric_friction"].constants(wide["asymmetric_friction"][0], None)),
            50.0,
            0.0,
            w,
            0.0,
            1.0,
        )
        for w in (10.0 * scales.speed, 0.0)
    )
    assert fast == pytest.approx(50.0) and slow == pytest.approx(35.0)
    push = wide["load_disturbance"][0]
    assert push[0] * push[4] == pytest.approx(100.0 * 0.3) and np.isinf(push[2])
    assert BY_NAME["load_disturbance"].grown("load_disturbance", push, scales)[0] == pytest.approx(
        plain["load_disturbance"]
    )
    assert not any(
        BY_NAME[name].grown(name, some[0], scales) for name, some in wide.items() if name != "load_disturbance"
    )


def test_a_gust_keeps_its_phases_in_a_wider_form(pushed):
    """They differ between recordings: with one phase for all, what a swell adds would be lost in what they lose."""
    model, gust = pushed.fit.model, BY_NAME["periodic_gust"]
    model = model.with_effect("periodic_gust", gust.starts(model.scales)[0])
    model.local["periodic_gust"][:, 0] = phases = np.arange(len(model.local["periodic_gust"])) + 0.3
    forms = [
        model.with_form("periodic_gust", p)
        for p in gust.grown("periodic_gust", dict(model.effects)["periodic_gust"], model.scales)
    ]
    assert len(forms) > 2 and all(
        np.array_equal(form.local["periodic_gust"][:, 0], phases) and form.names == model.names for form in forms
    )
    begun = [
        begin.model
        for name, begin in wider({"periodic_gust": replace(pushed.fit, model=model)}, ())
        if name == "periodic_gust"
    ]
    assert len(begun) == len(forms) and all(np.array_equal(some.local["periodic_gust"][:, 0], phases) for some in begun)


def test_a_gust_may_swell_more_slowly_than_it_may_swing(pushed):
    """A swing of less than three cycles bends to any drift; what swells once within the recording has the cycles of its
    wave to tell it.
    """
    model = pushed.fit.model
    starts = BY_NAME["periodic_gust"].grown(
        "periodic_gust", BY_NAME["periodic_gust"].starts(model.scales)[0], model.scales
    )
    forms = [model.with_effect("periodic_gust", start) for start in starts if np.isfinite(start[5])]
    swings, swells = (
        [next(f.lower for f in form.layout() if (f.owner, f.name) == ("periodic_gust", name)) for form in forms]
        for name in ("f", "f_s")
    )
    assert (
        swings == pytest.approx([3.0 / model.scales.duration] * len(forms))
        and max(swells) < 0.5 / model.scales.duration
    )
    assert not any(form.at_bound(f) for form in forms for f in form.layout() if f.name == "f_s")


def test_a_torque_too_slow_for_cogging_is_the_gears(pushed):
    """Behind a gear of 20 a motor that cogs thrice a turn has a period of 0.105 rad at the output; without a gear any
    period may be its own.
    """
    scales = replace(pushed.fit.model.scales, low=-0.3, high=0.3, cog=2 * np.pi / 60.0)
    cogs, gears = (list(BY_NAME[name].starts(scales)) for name in ("cogging", "transmission_ripple"))
    torques = [p for p in gears if np.isfinite(p[3])]
    assert max(p[1] for p in cogs) <= scales.cog < min(p[1] for p in torques) and len(torques) < len(gears)
    assert not any(np.isfinite(p[3]) for p in BY_NAME["transmission_ripple"].starts(replace(scales, cog=np.inf)))


def test_a_torque_that_returns_must_be_seen_to_return(pushed):
    """Two periods of it: less is any smooth torque. A friction that changes along the travel may be slower."""
    model, ripple = pushed.fit.model, BY_NAME["transmission_ripple"]
    travel = 2.0 * model.scales.position
    longest = {
        name: (
            next(f.upper for f in model.with_effect(name, p).layout() if (f.owner, f.name) == (name, "period")) / travel
        )
        for name, p in (
            ("cogging", [1.0, 0.1, 0.0, np.inf, np.inf]),
            ("transmission_ripple", [np.inf, 0.1, 0.0, 1.0, np.inf, np.inf]),
            ("position_dependent_friction", [1.0, np.inf, np.inf, 0.1, 0.0]),
        )
    }
    assert longest["cogging"] == longest["transmission_ripple"] == pytest.approx(1 / 2) and longest[
        "position_dependent_friction"
    ] == pytest.approx(1.25)
    assert [
        len(ripple.grown(ripple.name, np.array([np.inf, turns * travel, 0.0, 1.0, np.inf, np.inf]), model.scales))
        for turns in (0.9, 1.03)
    ] == [2, 0]


def test_a_datasheets_gear_bounds_the_period_of_cogging(pushed):
    sheet = Datasheet(parameters={"n": 20.0}, lumped=TRUTH)
    assert baseline(pushed.traces, sheet, True, 1).fit.model.scales.cog == pytest.approx(2 * np.pi / 60.0)
    assert pushed.fit.model.scales.cog == np.inf


def test_an_uneven_gears_torque_is_the_one_of_a_cog():
    u, c = INPUTS["multisine"](T), lumped(TRUTH)
    wave = [5.0, 0.2, 0.4, 0.3, 1.0]
    gear, cog = (
        ReducedModel(c, [(name, np.array(p))]).simulate(T, u).theta
        for name, p in (("transmission_ripple", [np.inf, 0.2, 0.4, 5.0, 0.3, 1.0]), ("cogging", wave))
    )
    assert np.allclose(gear, cog, atol=1e-9)
    with pytest.raises(InputError, match="ripple and A are both given"):
        ReducedModel(c, [("transmission_ripple", np.array([0.1, 0.2, 0.4, 5.0, np.inf, np.inf]))]).simulate(T, u)


def test_a_gears_ratio_may_swing_twice_a_period():
    """Without back-EMF and friction's switching the torque is the drive's, by the swing."""
    name, k, drive = "transmission_ripple", 2 * np.pi / 0.2, 7.0
    law, effect = BY_NAME[name].torque, BY_NAME[name]
    p = effect.constants(np.array([0.05, 0.2, 0.4, np.inf, 0.3, 1.0]), lumped({**TRUTH}))
    theta = np.linspace(-0.3, 0.3, 7)
    swing = 0.05 * (np.sin(k * theta + 0.4) + 0.3 * np.sin(2 * (k * theta + 0.4) + 1.0))
    assert [law(p, x, 0.0, drive, 0.0) for x in theta] == pytest.approx(list(swing * drive))
    wider = effect.grown(name, np.array([0.05, 0.2, 0.4, np.inf, np.inf, np.inf]), replace(SCALES, low=-1.0, high=1.0))
    assert [tuple(np.isfinite(q)) for q in wider] == 2 * [(True, True, True, False, True, True)]


@pytest.mark.parametrize(
    "name, values, sizes",
    [
        ("sensor_nonlinearity", {"bend": 0.01, "twist": 0.2}, ["bend", "twist"]),
        ("sensor_nonlinearity", {"A": 0.01, "period": 0.1, "phase": 0.0}, ["A"]),
        ("sensor_lag", {"T": 1e-3, "T_d": 1e-3}, ["T", "T_d"]),
        ("stribeck", {"dF_s": 0.1, "v_s": 0.2}, ["dF_s"]),
        ("gravity_imbalance", {"g_s": 0.0, "g_c": 1.0}, ["g_s", "g_c"]),
        ("end_stop", {"lower": 0.1, "f_stop": 80.0}, []),
    ],
)
def test_what_tells_how_large_an_effect_is_may_be_any_of_its_terms(name, values, sizes):
    effect = BY_NAME[name]
    p = np.array([values.get(parameter.name, np.inf) for parameter in effect.parameters])
    assert [effect.parameters[k].name for k in effect.sizes(p)] == sizes


@pytest.mark.parametrize("lag, told", [(1e-5, "input_delay"), (2e-3, "sensor_lag")])
def test_a_dead_time_without_a_lag_is_told_as_a_delay(lag, told):
    assert BY_NAME["sensor_lag"].really(np.array([lag, 1e-2]), 1.0) == told
    assert BY_NAME["sensor_lag"].really(np.array([lag, np.inf]), 1.0) == "sensor_lag"


def test_an_effect_is_narrower_without_what_may_be_absent():
    none = np.inf
    load, stop, site = (BY_NAME[n] for n in ("load_dependent_friction", "end_stop", "position_dependent_friction"))
    wide = np.array([0.1, none, 0.5, 0.02, 1.0])
    assert [p.tolist() for p in load.narrower(wide)] == [[0.1, none, 0.5, none, none], [0.1, none, none, 0.02, 1.0]]
    assert not load.narrower(load.narrower(load.narrower(wide)[0])[0])  # the share itself stays
    assert [p[:2].tolist() for p in stop.narrower(np.array([-1.0, 1.0, 40.0, 0.3]))] == [[-none, 1.0], [-1.0, none]]
    assert not site.narrower(np.array([1.0, 2.0, 3.0, none, none]))  # a place or a period it needs


def test_a_reading_that_no_output_explains_is_no_number_and_no_warning():
    behind = BY_NAME["sensor_nonlinearity"].behind(
        np.array([0.0, -1e3, np.inf, np.inf, np.inf]), np.linspace(-1.0, 1.0, 5)
    )
    assert behind[2] == 0.0 and not np.isfinite(behind[[0, 4]]).any()
