"""The event-exact integrator against an independent scheme, against itself at a finer step, and in the stick band."""

import os
import subprocess
import sys
import textwrap

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import cont2discrete

from ers_mj.effects import EFFECTS
from ers_mj.effects.quantities import Coefficients, Scales, coupled
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.proving import quick
from ers_mj.servo.datasheet import read_datasheet

TABLE_1 = read_datasheet("table1")
T = np.arange(0.0, 2.0, 1e-3)
BRIEF = T[:1200]  # where the independent scheme takes a far smaller step
SCALES = Scales(
    position=0.4,
    low=0.15,
    high=0.4,
    speed=4.0,
    acceleration=110.0,
    input=10.0,
    sample_time=1e-3,
    noise=1e-4,
    quantum=0.0,
    is_angle=True,
)


def table_1(**changes):
    return ReducedModel(lumped({**TABLE_1.to_lumped(), **changes}))


@pytest.mark.parametrize("inductance", [1.6e-3, 2e-4])
@pytest.mark.parametrize("name", ["multisine", "chirp", "ramp", "steps"])
def test_baseline_equals_an_independent_scheme_at_a_far_smaller_step(name, inductance):
    u = INPUTS[name](T)
    parameters = dict(TABLE_1.parameters) | {"L": inductance}
    truth = quick.simulate(parameters, [], T, u, step=1e-5, stand=0.0).true
    ours = table_1(tau_e=inductance / parameters["R"]).simulate(T, u).theta
    assert np.degrees(np.max(np.abs(ours - truth))) < 1e-3


@pytest.mark.parametrize("x_s_deg, delta", [(1.0, 1.5), (0.2, 1.5), (0.2, 2.0), (0.04, 1.5), (0.2, 0.8)])
@pytest.mark.parametrize("name", ["multisine", "steps"])
def test_presliding_equals_an_independent_dahl(name, x_s_deg, delta):
    u, shape = INPUTS[name](BRIEF), {"form": "Dahl", "bristle_damping_ratio": 0.0, "delta": delta}
    dahl = {"label": "presliding", "strength": x_s_deg, "shape": shape}
    truth = quick.simulate(dict(TABLE_1.parameters), [dahl], BRIEF, u, step=5e-6, stand=0.0).true
    ours = (
        ReducedModel(
            table_1().coefficients,
            [("presliding", np.array([np.radians(x_s_deg), 0.0, np.inf, delta, np.inf, np.inf]))],
        )
        .simulate(BRIEF, u)
        .theta
    )
    assert np.degrees(np.max(np.abs(ours - truth))) < 3e-3


@pytest.mark.parametrize("x_s_deg, w_d", [(1.0, np.inf), (0.2, np.inf), (0.2, 0.15)])
@pytest.mark.parametrize("name", ["multisine", "steps"])
def test_presliding_equals_an_independent_lugre(name, x_s_deg, w_d):
    form = {"form": "LuGre", "v_d_rad_s": w_d} if np.isfinite(w_d) else {"form": "LuGre, constant bristle damping"}
    u, shape = INPUTS[name](BRIEF), {**form, "bristle_damping_ratio": 0.4}
    lugre = {"label": "presliding", "strength": x_s_deg, "shape": shape}
    truth = quick.simulate(dict(TABLE_1.parameters), [lugre], BRIEF, u, step=5e-6, stand=0.0).true
    ours = (
        ReducedModel(table_1().coefficients, [("presliding", np.array([np.radians(x_s_deg), 0.4, w_d, *3 * [np.inf]]))])
        .simulate(BRIEF, u)
        .theta
    )
    assert np.degrees(np.max(np.abs(ours - truth))) < 3e-3


@pytest.mark.parametrize("x_s_deg, delta", [(1.0, 1.5), (0.1, 1.0)])
@pytest.mark.parametrize("name", ["multisine", "steps"])
def test_a_shaft_beside_a_bristle_equals_an_independent_scheme(name, x_s_deg, delta):
    """At a far smaller step, of other numbers: there the rudder's bristle is as stiff as if it bore the motor's
    friction as well.
    """
    J, rho, phi, k, zeta = TABLE_1.parameters["J"], 0.6, 0.3, 30.0, 0.1
    dahl = {
        "label": "presliding",
        "strength": x_s_deg,
        "shape": {"form": "Dahl", "bristle_damping_ratio": 0.0, "delta": delta},
    }
    shaft = {
        "label": "shaft_compliance",
        "strength": np.degrees(1.0 / k),
        "shape": {"zeta": zeta, "motor_friction_share": phi},
    }
    u, shares = INPUTS[name](T), {"motor_inertia_share": rho, "motor_damping_share": rho}
    truth = quick.simulate(dict(TABLE_1.parameters) | shares, [shaft, dahl], T, u, step=5e-6, stand=0.0).true
    effects = [
        (
            "shaft_compliance",
            np.array([np.sqrt(k / J) / (2.0 * np.pi), zeta * np.sqrt(rho * (1.0 - rho)), rho, phi, np.inf]),
        ),
        ("presliding", np.array([(1.0 - phi) * np.radians(x_s_deg), 0.0, np.inf, delta, np.inf, np.inf])),
    ]
    ours = ReducedModel(table_1().coefficients, effects).simulate(T, u).theta
    rigid = ReducedModel(table_1().coefficients, effects[:1]).simulate(T, u).theta
    assert np.sqrt(np.mean((ours - truth) ** 2)) < 0.05 * np.sqrt(np.mean((rigid - truth) ** 2))


@pytest.mark.parametrize(
    "label, strength, shape, ours",
    [
        ("load_dependent_friction", 0.08, {"form": "motor torque"}, [0.08, *4 * [np.inf]]),
        (
            "cogging",
            0.04,
            {"cycles_per_motor_rev": 4, "phase": 0.7},
            [-0.04 / 0.0031, 2.0 * np.pi / (4 * 22.26), 0.7, np.inf, np.inf],
        ),
    ],
    ids=["friction", "cogging"],
)
@pytest.mark.parametrize("name", ["multisine", "steps"])
def test_a_law_acts_on_its_own_body_beside_a_shaft(name, label, strength, shape, ours):
    """The motor's share of a friction, and what the motor's magnets make of its own angle, equal an independent scheme
    at a far smaller step.
    """
    J, rho, phi, k, zeta = TABLE_1.parameters["J"], 0.6, 0.3, 30.0, 0.1
    shaft = {
        "label": "shaft_compliance",
        "strength": np.degrees(1.0 / k),
        "shape": {"zeta": zeta, "motor_friction_share": phi},
    }
    u, shares = INPUTS[name](BRIEF), {"motor_inertia_share": rho, "motor_damping_share": rho}
    law = {"label": label, "strength": strength, "shape": shape}
    truth, plain = (
        quick.simulate(dict(TABLE_1.parameters) | shares, some, BRIEF, u, step=5e-6, stand=0.0).true
        for some in ([shaft, law], [shaft])
    )
    effects = [
        (
            "shaft_compliance",
            np.array([np.sqrt(k / J) / (2.0 * np.pi), zeta * np.sqrt(rho * (1.0 - rho)), rho, phi, np.inf]),
        ),
        (label, np.array(ours)),
    ]
    found = ReducedModel(table_1().coefficients, effects).simulate(BRIEF, u).theta
    assert np.degrees(np.max(np.abs(found - truth))) < 1e-3 < 0.01 * np.degrees(np.max(np.abs(plain - truth)))


@pytest.mark.parametrize("name", ["multisine", "chirp", "ramp", "steps"])
def test_eq_5_is_the_limit_of_vanishing_inductance(name):
    u = INPUTS[name](T)
    limit, small = (table_1(tau_e=tau).simulate(T, u).theta for tau in (0.0, 1e-6))
    assert np.degrees(np.max(np.abs(limit - small))) < 1e-3


@pytest.mark.parametrize("effect", [e for e in EFFECTS if e.starts(SCALES)], ids=lambda e: e.name)
def test_every_effect_moves_the_rudder_and_has_converged(effect):
    """A step ten times finer moves theta by less than 1e-3 deg, while the effect itself moves it far more."""
    u = INPUTS["multisine"](T)
    model = ReducedModel(table_1().coefficients, [(effect.name, effect.starts(SCALES)[0])])
    coarse, fine = model.simulate(T, u).measured, model.simulate(T, u, refine=10).measured
    assert np.degrees(np.max(np.abs(coarse - fine))) < 1e-3
    assert np.degrees(np.max(np.abs(coarse - table_1().simulate(T, u).measured))) > 1e-2


def test_nothing_creeps_in_the_stick_band():
    c = table_1().coefficients
    u = np.full(T.size, 0.9 * (c.c_1 + c.c_2_plus) / c.b)
    assert np.ptp(table_1().simulate(T, u).theta) == 0.0
    away = table_1().simulate(
        T, 0.9 * c.c_2_plus / c.b * np.ones(T.size) + (c.c_1 + c.a_1 * 0.1) / c.b, start=(c.theta_0 + 0.1, 0.0)
    )
    assert np.ptp(away.theta) == 0.0


def test_a_bent_bristle_holds_still():
    """Constant forces bend it once, by about x_s at nine tenths of the friction, and it does not creep; the preload's
    corner still holds.
    """
    c = table_1().coefficients
    sprung = ReducedModel(c, [("presliding", np.array([0.008, 0.2, *4 * [np.inf]]))])
    t = np.arange(0.0, 4.0, 1e-3)
    away = sprung.simulate(
        t, (0.3 * c.c_2_plus + c.c_1 + c.a_1 * 0.1) / c.b * np.ones(t.size), start=(c.theta_0 + 0.1, 0.0)
    ).theta
    assert 0.3 * 0.008 < away[-1] - away[0] < 2 * 0.008
    assert np.ptp(away[2000:]) < 1e-9
    assert np.ptp(sprung.simulate(T, np.full(T.size, 0.9 * c.c_1 / c.b)).theta) == 0.0


def test_a_rudder_that_bounces_in_the_corner_on_its_bristle_is_simulated_to_the_end():
    """At 200 Hz, under a friction that hardly changes along the travel, it bounces there more than EVENT_BUDGET times a
    sample.
    """
    c = lumped({"a_1": 36.0, "c_1": 188.0, "c_2": 112.0, "theta_0": 0.263, "a_2": 92.0, "b": 138.0, "tau_e": 0.00115})
    t = np.arange(0.0, 7.5, 5e-3)
    bristle = ("presliding", np.array([0.00096, 0.018, np.inf, 1.41, np.inf, np.inf]))
    alone, wavy = (
        ReducedModel(c, [bristle, *more]).simulate(t, 0.3 * INPUTS["multisine"](t)).theta
        for more in ([], [("position_dependent_friction", np.array([0.2, np.inf, np.inf, 0.18, 0.0]))])
    )
    assert np.all(np.isfinite(wavy)) and np.max(np.abs(wavy - alone)) < 0.05 * np.ptp(alone)


def test_it_breaks_away_where_friction_and_preload_end():
    c = table_1().coefficients
    for factor, moves in ((0.999, False), (1.001, True)):
        u = np.full(T.size, factor * (c.c_1 + c.c_2_plus) / c.b)
        assert bool(np.ptp(table_1().simulate(T, u).theta) > 0) is moves


def test_the_result_is_a_smooth_function_of_the_parameters():
    """Second differences shrink with the square of the step: no grid effects from event times."""
    u = INPUTS["multisine"](T)

    def theta(e):
        return table_1(c_2=TABLE_1.to_lumped()["c_2"] * (1 + e)).simulate(T, u).theta

    bend = [np.max(np.abs(theta(e) - 2 * theta(0.0) + theta(-e))) for e in (1e-4, 5e-5)]
    assert bend[1] < 0.35 * bend[0]


def test_a_delay_of_one_sample_shifts_the_input_by_one_sample():
    u = INPUTS["chirp"](T)
    late = ReducedModel(table_1().coefficients, [("input_delay", np.array([1e-3]))]).simulate(T, u).theta
    shifted = table_1().simulate(T, np.concatenate([u[:1], u[:-1]])).theta
    assert np.max(np.abs(late - shifted)) < 1e-9


@pytest.mark.parametrize(
    "effects",
    [
        [],
        [("gravity_imbalance", np.array([10.0, 4.0]))],
        [("presliding", np.array([0.004, 0.5, np.inf, np.inf, np.inf, np.inf]))],
    ],
    ids=["spring", "gravity", "bristle"],
)
def test_what_begins_at_rest_was_told_nothing_that_moves_it_before(effects):
    """A step at the first sample arrives after the dead time, not before the recording; one that holds it may."""
    late, start = [*effects, ("input_delay", np.array([0.0335]))], (TABLE_1.to_lumped()["theta_0"], 0.0)
    plant = ReducedModel(table_1().coefficients, late)
    rest = plant.before(0.0, 10.0, start)
    held = plant.simulate(T, np.full(T.size, rest), start).theta
    assert 0.0 < rest < 10.0 and np.ptp(held) < 1e-9
    steps = plant.simulate(T, np.full(T.size, 10.0), start).theta
    assert np.allclose(steps[:34], held[:34], atol=1e-9, rtol=0.0) and np.ptp(steps[34:60]) > 0.01
    assert plant.before(0.0, 10.0, (start[0], 0.1)) == 10.0


def test_a_rigid_play_of_no_width_is_no_play():
    """Backlash with a tiny gap and a stiff contact tends to the one-body motion."""
    u = INPUTS["chirp"](T)
    one = table_1().simulate(T, u).theta
    two = [
        ReducedModel(table_1().coefficients, [("backlash", np.array([gap, 0.5, 0.2, 400.0, 1.0]))]).simulate(T, u).theta
        for gap in (4e-3, 1e-3)
    ]
    size = [np.sqrt(np.mean((x - one) ** 2)) for x in two]
    assert size[1] < 0.5 * size[0]


def linear_motion(c, u):
    """theta - theta_0 (N,) from rest by the matrix exponential: (theta, w), (theta_m, w_m) of a shaft, and j of a
    winding.
    """
    if c.two_body:
        k, d, mine, its = c.k_twist, c.d_twist, (1.0 - c.rho), c.rho
        A = np.array(
            [
                [0, 1, 0, 0],
                [-(c.a_1 + k) / mine, -((1.0 - c.beta) * c.a_mech_plus + d) / mine, k / mine, d / mine],
                [0, 0, 0, 1],
                [k / its, d / its, -k / its, -(c.beta * c.a_mech_plus + d) / its],
            ]
        )
    else:
        its, A = 1.0, np.array([[0.0, 1.0], [-c.a_1, -c.a_mech_plus]])
    n, driven = A.shape[0], A.shape[0] - 1
    B = np.zeros((n, 1))
    if c.tau_e > 0:
        A, B = np.pad(A, (0, 1)), np.zeros((n + 1, 1))
        A[driven, n], A[n, driven], A[n, n], B[n, 0] = 1.0 / its, -c.a_emf / c.tau_e, -1.0 / c.tau_e, c.b / c.tau_e
    else:
        A[driven, driven] -= c.a_emf / its
        B[driven, 0] = c.b / its
    F, G = cont2discrete((A, B, np.eye(A.shape[0]), np.zeros((A.shape[0], 1))), T[1], "zoh")[:2]
    x, out = np.zeros(A.shape[0]), []
    for v in u:
        out.append(x[0])
        x = F @ x + G[:, 0] * v
    return np.array(out)


@pytest.mark.parametrize("name", ["steps", "multisine"])
@pytest.mark.parametrize("tau", [0.0, 9.4e-4])
@pytest.mark.parametrize(
    "effects", [(), [("shaft_compliance", np.array([20.0, 0.1, 0.55, 0.15, np.inf]))]], ids=["rigid", "shaft"]
)
def test_without_dry_friction_it_is_the_linear_system_from_rest_on(name, tau, effects):
    """From rest at theta_0, where no force says which way it will go."""
    model = ReducedModel(table_1(c_1=0.0, c_2=0.0, tau_e=tau).coefficients, effects)
    c, u = Coefficients(*model._lowered[0]), INPUTS[name](T)
    assert np.degrees(np.max(np.abs(model.simulate(T, u).theta - c.theta_0 - linear_motion(c, u)))) < 1e-7


def test_an_inductance_that_falls_with_the_current_obeys_its_equation():
    c = table_1(c_1=0.0, c_2=0.0, tau_e=0.0).coefficients
    u, half = np.full(300, 12.0), 300.0
    t = 1e-3 * np.arange(u.size)

    def slope(t, x):
        faster = min(1.0 + (x[2] / half) ** 2, 4.0)
        return x[1], -c.a_1 * x[0] - c.a_mech_plus * x[1] + x[2], (c.b * 12.0 - c.a_emf * x[1] - x[2]) / 0.004 * faster

    exact = solve_ivp(slope, (0.0, t[-1]), np.zeros(3), t_eval=t, rtol=1e-9, atol=1e-10).y
    falls, stays = (
        ReducedModel(c, [("inductance", np.array([0.004, j]))]).simulate(t, u).theta - c.theta_0 for j in (half, np.inf)
    )
    assert np.max(np.abs(falls - exact[0])) < 0.02 * np.max(np.abs(stays - exact[0]))


def test_a_motor_that_creeps_to_rest_at_the_limit_of_its_friction_lets_the_servo_go_on():
    rng = np.random.default_rng(1)
    t = np.arange(0.0, 3.0, 2e-3)
    for _ in range(30):
        c = Coefficients(
            a_1=rng.uniform(0, 100),
            a_mech_plus=2.9,
            a_mech_minus=2.9,
            a_emf=rng.uniform(10, 100),
            b=88.0,
            c_2_plus=130.0,
            c_2_minus=130.0,
            tau_e=2e-3,
        )
        c = coupled(
            c, f=rng.uniform(15, 60), zeta=rng.uniform(0.1, 0.5), rho=rng.uniform(0.2, 0.8), phi=rng.uniform(0.1, 0.6)
        )
        u = np.repeat(rng.uniform(-8, 8, 6), 250)
        assert np.all(np.isfinite(ReducedModel(c).theta(t, u, (0.1, 0.0))))


def test_a_shaft_that_hardens_obeys_its_equations():
    model = ReducedModel(
        table_1(c_1=0.0, c_2=0.0, tau_e=0.0).coefficients,
        [("shaft_compliance", np.array([12.0, 0.1, 0.55, 0.15, 0.02]))],
    )
    c, u = Coefficients(*model._lowered[0]), np.full(T.size, 6.0)

    def slope(t, x):
        twist, rate = x[2] - x[0], x[3] - x[1]
        push = (2.0 * np.pi * 12.0) ** 2 * twist * (1.0 + (twist / 0.02) ** 2) + c.d_twist * rate
        a = (-c.a_1 * x[0] - 0.45 * c.a_mech_plus * x[1] + push) / 0.45
        return x[1], a, x[3], (c.b * 6.0 - c.a_emf * x[3] - 0.55 * c.a_mech_plus * x[3] - push) / 0.55

    exact = solve_ivp(slope, (0.0, T[-1]), np.zeros(4), t_eval=T, rtol=1e-9, atol=1e-10).y
    assert np.max(np.abs(exact[2] - exact[0])) > 0.02
    assert np.degrees(np.max(np.abs(model.simulate(T, u).theta - c.theta_0 - exact[0]))) < 1e-3


def test_a_shaft_that_hardens_without_bound_ends_the_motion():
    """Each step makes it stiffer, and the next one needs more Runge-Kutta steps than a lifetime has; up to there the
    motion is told.
    """
    shaft = ("shaft_compliance", np.array([9.5, 0.7, 0.39, 0.48, 7.8e-5]))
    plant, t = ReducedModel(table_1().coefficients, [shaft]), np.arange(100) / 200.0
    calm, thrown = (plant.theta(t, np.full(t.size, 4.0), (plant.coefficients.theta_0, speed)) for speed in (0.0, 1e5))
    assert np.isfinite(calm).all() and np.isfinite(thrown[0]) and np.isnan(thrown[-1])


def test_a_delay_that_ends_just_before_a_sample_leaves_the_steps_as_long():
    """Those that look for events within a stiffening shaft: as short as the rest of the sample they took a thousand
    times as many.
    """
    program = """
    from types import SimpleNamespace
    from ers_mj.plants.kernel.cuts import cut, longest_step
    far = float("inf")
    given = dict(lawful=0, creep=0.0, fall=0.0, two_body=1, k_twist=4e4, rho=0.5, upper=far, lower=-far)
    for delay in (0.4e-3, 0.9999e-3):
        c = SimpleNamespace(delay=delay, **given)
        print(longest_step(c, cut(c, 1e-3, 1), 1) >= 0.5e-3)
    """
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)], env=environment, capture_output=True, text=True
    )
    assert done.stdout.split() == ["True", "True"], done.stderr
