"""Two roads, one answer: every effect's law in the reduced model and its MJCF realisation give the same motion."""

import numpy as np
import pytest
from test_mechanical import EQ_1, EQ_5, SHEET, rms_deg
from test_reduced import SCALES

from ers_mj.effects import BY_NAME, EFFECTS
from ers_mj.plants.bare_gap import rigid_play
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.mujoco.plant import MechanicalPlant
from ers_mj.plants.reduced import ReducedModel

T = np.arange(0.0, 1.2, 1e-3)
STEP, FINE = 1e-4, 5e-5  # [s] of the twin, and where the effect itself is of such a size
TOLERANCE = 0.05  # of the effect's own size
VISIBLE = 0.2  # [deg] RMS
# where the first start of an effect is too small to be seen beside the two plants' own difference, or has not all of
# its terms
SIZES = {
    "inductance": [0.008, 300.0],
    "input_delay": [0.0043],
    "backlash": [0.012, 0.6, 0.2, 120.0, 0.2],
    "stribeck": [40.0, 0.6, 1.4, np.inf],
    "end_stop": [0.15, 0.35, 100.0, 0.3],
    "sensor_quantisation": [0.0213],
    "voltage_saturation": [5.0, 8.0],
    "load_disturbance": [150.0, 0.6, 0.5, 0.0, np.inf],
    "sensor_dropout": [4.0, 0.08],
    "sensor_lag": [0.01, 0.0103],
    "cogging": [22.0, 0.125, 0.0, 0.3, 1.0],
    "sensor_nonlinearity": [0.2, 0.1, np.inf, np.inf, np.inf],
    "shaft_compliance": [12.0, 0.1, 0.6, 0.2, 0.03],
    "torque_saturation": [0.5, 24.0],
    "running_in": [0.5, 0.5],
    "thermal_drift": [0.4, 0.6, 10.0],
    "uneven_damping": [5.0, 3.0, 0.3, np.inf, np.inf, np.inf],
    "unexplained_torque": [-0.3, 0.075, 40.0, -30.0, 20.0, 40.0, -10.0, -40.0, 30.0, 0.0, 20.0],
    "unexplained_friction": [-0.3, 0.075, 60.0, -30.0, 20.0, 50.0, -40.0, -40.0, 30.0, 0.0, 20.0],
    "unexplained_drag": [4.0, 40.0, -20.0, -30.0, 20.0, 60.0, 50.0, 0.0, -30.0, 10.0, 40.0],
}
# a bristle's twin takes steps of its own, each applied from outside: less of it is long enough to tell
BRIEF = {"presliding": T[:800]}


def command(name, t=T):
    """The input from its second second on, in which the rudder goes far."""
    return INPUTS[name](t + 1.0)


def values(effect):
    return np.array(SIZES[effect.name]) if effect.name in SIZES else effect.starts(SCALES)[0]


OPEN = [e for e in EFFECTS if not e.only_in_loop]


@pytest.mark.parametrize("effect", OPEN, ids=lambda e: e.name)
@pytest.mark.parametrize("road", ["rudder", "lumped"])
def test_law_and_twin_agree(effect, road):
    assert effect.mjcf, "how a MuJoCo model shows the effect"
    t = BRIEF.get(effect.name, T)
    u = command("steps" if effect.name == "stribeck" else "multisine", t)
    chosen = [(effect.name, values(effect))]
    law, without = ReducedModel(EQ_5, chosen).simulate(t, u), ReducedModel(EQ_5).simulate(t, u)
    parameters = SHEET.parameters if road == "rudder" else None
    step = FINE if effect.name == "inductance" else STEP
    twin = MechanicalPlant(EQ_5, chosen, parameters=parameters, timestep=step).simulate(t, u)
    size = rms_deg(law.measured - without.measured)
    assert size > VISIBLE
    if effect.subsystem == "sensor":  # what the sensor does to one and the same angle
        assert np.array_equal(twin.measured, effect.measure(chosen[0][1], t, twin.theta))
    else:
        assert rms_deg(twin.measured - law.measured) < TOLERANCE * size


def test_several_effects_at_once_agree():
    chosen = [
        (e.name, values(e))
        for e in EFFECTS
        if e.name
        in (
            "voltage_saturation",
            "quadratic_drag",
            "asymmetric_friction",
            "load_dependent_friction",
            "gravity_imbalance",
            "end_stop",
        )
    ]
    u = command("multisine")
    law, without = ReducedModel(EQ_1, chosen).simulate(T, u), ReducedModel(EQ_1).simulate(T, u)
    twin = MechanicalPlant(EQ_1, chosen, parameters=SHEET.parameters, timestep=STEP).simulate(T, u)
    assert rms_deg(twin.theta - law.theta) < TOLERANCE * rms_deg(law.theta - without.theta)


def test_a_broken_twin_is_noticed():
    """A drag that is a tenth too strong in one of the two plants fails the bar above."""
    drag = next(e for e in EFFECTS if e.name == "quadratic_drag")
    u, p = command("multisine"), values(drag)
    law, without = ReducedModel(EQ_5, [(drag.name, p)]).simulate(T, u), ReducedModel(EQ_5).simulate(T, u)
    twin = MechanicalPlant(EQ_5, [(drag.name, 1.1 * p)], parameters=SHEET.parameters, timestep=STEP).simulate(T, u)
    assert rms_deg(twin.theta - law.theta) > TOLERANCE * rms_deg(law.theta - without.theta)


def test_both_plants_read_the_recordings_own_clock():
    gust = next(e for e in EFFECTS if e.name == "periodic_gust")
    chosen, late, u = [(gust.name, values(gust))], T + 0.37, command("multisine")
    law, early = ReducedModel(EQ_5, chosen).simulate(late, u), ReducedModel(EQ_5, chosen).simulate(T, u)
    twin = MechanicalPlant(EQ_5, chosen, timestep=STEP).simulate(late, u)
    assert rms_deg(law.theta - early.theta) > VISIBLE
    assert rms_deg(twin.theta - law.theta) < TOLERANCE * rms_deg(law.theta - early.theta)


def plain_form(name, p):
    """Without the last number that is there, and what says something only together with it."""
    effect = BY_NAME[name]
    names = [parameter.name for parameter in effect.parameters]
    last = max(k for k, x in enumerate(p) if np.isfinite(x))
    gone = next((group for group in effect.together if names[last] in group), names[last : last + 1])
    return [np.inf if some in gone else v for some, v in zip(names, p, strict=True)]


@pytest.mark.parametrize(
    ("name", "p"),
    [
        ("presliding", [0.005, 0.1, np.inf, 1.5, np.inf, np.inf]),
        ("presliding", [0.005, 0.1, np.inf, 2.0, np.inf, np.inf]),
        ("presliding", [0.02, 0.1, np.inf, 0.7, np.inf, np.inf]),
        ("presliding", [*4 * [np.inf], 0.5, 0.05]),
        ("current_limit", [80.0, 0.3]),
        ("inductance", [0.008, 60.0]),
        ("hinge_moment_cubic", [300.0, 0.2]),
        ("quadratic_drag", [1.0, 2.6]),
        ("asymmetric_friction", [30.0, 0.0, 0.2, 0.5]),
        ("stribeck", [80.0, 0.6, 2.0, 0.5]),
        ("load_disturbance", [250.0, 0.6, 0.5, 0.0, 0.1]),
        ("load_dependent_friction", [0.3, 60.0, *3 * [np.inf]]),
        ("periodic_gust", [40.0, 1.3, 0.4, 0.3, 0.5, 0.4, 1.0]),
    ],
)
def test_another_form_agrees(name, p):
    """What the last number given, absent in the plain form, makes of an effect, is in the twin as well: a bristle's
    exponent, what flows beyond a limit.
    """
    t = BRIEF.get(name, T)
    u = command("multisine", t)
    law, plain = (ReducedModel(EQ_5, [(name, np.array(some))]).simulate(t, u) for some in (p, plain_form(name, p)))
    twin = MechanicalPlant(EQ_5, [(name, np.array(p))], parameters=SHEET.parameters, timestep=STEP).simulate(t, u)
    size = rms_deg(law.theta - plain.theta)
    assert size > VISIBLE
    assert rms_deg(twin.theta - law.theta) < TOLERANCE * size


def test_a_shaft_beside_a_play_softens_its_contact():
    """Both at once are one play with the shaft's spring, in either plant and whichever is named first."""
    both = [
        ("backlash", np.array([0.012, 0.6, 0.2, 120.0, 0.2])),
        ("shaft_compliance", np.array([20.0, 0.2, 0.6, 0.2, np.inf])),
    ]
    u = command("multisine")
    law, stiff = ReducedModel(EQ_5, both).simulate(T, u), ReducedModel(EQ_5, both[:1]).simulate(T, u)
    twin = MechanicalPlant(EQ_5, both, parameters=SHEET.parameters, timestep=STEP).simulate(T, u)
    assert rms_deg(law.theta - stiff.theta) > VISIBLE
    assert rms_deg(twin.theta - law.theta) < TOLERANCE * rms_deg(law.theta - stiff.theta)
    assert rms_deg(ReducedModel(EQ_5, both[::-1]).simulate(T, u).theta - law.theta) < 1e-9


@pytest.mark.parametrize(
    "second", [("shaft_compliance", [25.0, 0.1, 0.6, 0.2, 0.02]), ("backlash", [0.012, 0.6, 0.2, 120.0, 0.2])]
)
@pytest.mark.parametrize("bristle", [[0.01, 0.3, *4 * [np.inf]], [0.01, 0.3, 1.0, 1.5, np.inf, np.inf]])
def test_two_bodies_beside_a_bristle_agree(second, bristle):
    """What the bristle changes beside a play or a shaft is the same in either plant, whichever is named first."""
    both, t = [(second[0], np.array(second[1])), ("presliding", np.array(bristle))], BRIEF["presliding"]
    u = command("multisine", t)
    law, rigid = ReducedModel(EQ_5, both).simulate(t, u), ReducedModel(EQ_5, both[:1]).simulate(t, u)
    twin = MechanicalPlant(EQ_5, both, parameters=SHEET.parameters, timestep=STEP).simulate(t, u)
    assert rms_deg(law.theta - rigid.theta) > VISIBLE
    assert rms_deg(twin.theta - law.theta) < TOLERANCE * rms_deg(law.theta - rigid.theta)
    assert rms_deg(ReducedModel(EQ_5, both[::-1]).simulate(t, u).theta - law.theta) < 1e-9


@pytest.mark.parametrize(
    "name",
    [
        "cogging",
        "supply_sag",
        "thermal_drift",
        "variable_ratio",
        "load_dependent_friction",
        "stribeck",
        "position_dependent_friction",
    ],
)
@pytest.mark.parametrize("road", ["rudder", "lumped"])
def test_a_law_acts_on_its_own_body_in_either_plant(name, road):
    """Beside a soft shaft a drive's law acts on the motor, at its own angle and speed, and a friction on each body by
    its share.
    """
    both = [("shaft_compliance", np.array([12.0, 0.1, 0.6, 0.4, np.inf])), (name, values(BY_NAME[name]))]
    u = command("steps" if BY_NAME[name].friction else "multisine")
    law, plain = ReducedModel(EQ_1, both).simulate(T, u), ReducedModel(EQ_1, both[:1]).simulate(T, u)
    twin = MechanicalPlant(EQ_1, both, parameters=SHEET.parameters if road == "rudder" else None).simulate(T, u)
    assert rms_deg(law.theta - plain.theta) > VISIBLE
    assert rms_deg(twin.theta - law.theta) < TOLERANCE * rms_deg(law.theta - plain.theta)


def test_a_shaft_beside_a_play_does_not_harden():
    shaft, play = (
        lambda c: BY_NAME["shaft_compliance"].coefficients(np.array([20.0, 0.2, 0.6, 0.2, 0.01]), c),
        lambda c: BY_NAME["backlash"].coefficients(np.array([0.012, 0.6, 0.2, 120.0, 0.2]), c),
    )
    assert shaft(EQ_5).harden == pytest.approx(1e4)
    assert shaft(play(EQ_5)).harden == play(shaft(EQ_5)).harden == shaft(rigid_play(EQ_5, 0.01)).harden == 0.0
