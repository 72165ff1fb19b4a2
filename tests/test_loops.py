"""Loops over frequency: describing functions, margins, limit cycles."""

import math
from dataclasses import replace

import control
import numpy as np
import pytest

from ers_mj.control.controllers import CONTROLLERS, PidGains, Servo
from ers_mj.control.frequency.cycle import balanced, lasting, passed, predicted, simulated
from ers_mj.control.frequency.describing import (
    contact,
    controller_response,
    coulomb,
    leaning,
    preload,
    rubbing,
    saturation,
)
from ers_mj.control.frequency.linear import coefficients, linearised
from ers_mj.control.frequency.loop import ask, close_loop, judged
from ers_mj.control.trial import sampled
from ers_mj.effects.quantities import Coefficients
from ers_mj.servo.datasheet import read_datasheet
from ers_mj.servo.simulation import build_plant

SHEET = read_datasheet("table1")
FREE = replace(SHEET, parameters={**SHEET.parameters, "F_c": 0.0, "T_LH": 0.0})
HOME = SHEET.parameters["theta_0"]
SPRINGY = ("backlash", {"gap": math.radians(0.5), "rho": 0.64, "phi": 0.0, "f_contact": 40.0, "zeta": 0.2})
RATE = 2000.0


# -- describing functions ---------------------------------------------------------------------------------------------

PHASE = 2 * np.pi * (np.arange(40_000) + 0.5) / 40_000


def first_harmonic(force):
    return 2 * np.mean(force * np.sin(PHASE)) + 2j * np.mean(force * np.cos(PHASE))


def test_describing_functions_are_first_harmonics():
    E, w = 0.02, 30.0
    theta, speed = E * np.sin(PHASE), E * w * np.cos(PHASE)
    assert coulomb(7.0, E) == pytest.approx(first_harmonic(7.0 * np.sign(speed)) / E, rel=1e-4)
    assert (
        preload(7.0, E, 0.012) == pytest.approx(first_harmonic(7.0 * np.sign(theta + 0.012)) / E, rel=1e-3)
        and preload(7.0, E, 0.03) == 0.0
    )
    assert (
        saturation(1.5, 4.0)
        == pytest.approx(first_harmonic(np.clip(4.0 * np.sin(PHASE), -1.5, 1.5)).real / 4.0, rel=1e-6)
        and saturation(4, 1.5) == 1
    )
    depth = np.abs(theta) - 0.008
    force = np.where(depth > 0, np.maximum(900 * depth + 12 * speed * np.sign(theta), 0), 0) * np.sign(theta)
    assert contact(900.0, 12.0, 0.008, np.array([E]), w)[0] == pytest.approx(first_harmonic(force) / E, rel=1e-3)
    x = 0.008 / E
    closed = 900 * (1 - 2 / np.pi * (np.arcsin(x) + x * np.sqrt(1 - x * x)))
    assert contact(900.0, 0.0, 0.008, np.array([E]), w)[0] == pytest.approx(closed, rel=1e-4)


def test_under_many_sines_friction_and_preload_are_what_gauss_makes_of_them():
    x = np.random.default_rng(0).normal(0.0, 0.3, 2_000_000)
    assert rubbing(5.0, 0.3, 1 / (2 * np.pi)).imag == pytest.approx(np.mean(5.0 * np.sign(x) * x) / 0.09, rel=0.01)
    assert leaning(5.0, 0.3, 0.2) == pytest.approx(np.mean(5.0 * np.sign(x + 0.2) * x) / 0.09, rel=0.01)


def pid_by_hand(f_hz, rate, gains=PidGains(), filter_s=5e-4):
    """C(z) of the PID with its backward sums, differences and filter, the spring's compensation in it [V/rad]."""
    z, h, new, servo = np.exp(2j * np.pi * f_hz / rate), 1 / rate, 1 - math.exp(-1 / (rate * filter_s)), Servo.of(FREE)
    difference = new * (1 - 1 / z) / h / (1 - (1 - new) / z)
    return math.degrees(1) * (gains.P + gains.I * h / (1 - 1 / z) + gains.D * difference) - servo.a_1 / servo.b


def test_a_linear_law_is_described_as_itself():
    law = CONTROLLERS["pid"](Servo.of(FREE), RATE)
    f_hz = np.geomspace(0.5, 900, 9)
    np.testing.assert_allclose(controller_response(law, HOME + 0.1, 0.02, f_hz), pid_by_hand(f_hz, RATE), rtol=3e-3)


def test_friction_compensation_undoes_the_friction_of_the_plant():
    with_, without = (CONTROLLERS["pid"](Servo.of(sheet), RATE) for sheet in (SHEET, FREE))
    f_hz, E = np.array([10.0, 30.0]), math.radians(3.0)
    difference = controller_response(with_, HOME + 1.0, E, f_hz) - controller_response(without, HOME + 1.0, E, f_hz)
    servo = Servo.of(SHEET)
    np.testing.assert_allclose(servo.b * difference, -coulomb(servo.c_2, E) * np.ones(2), rtol=0.15)


# -- margins ----------------------------------------------------------------------------------------------------------


def test_margins_are_those_of_the_rational_loop():
    plant = build_plant(FREE)
    linear = linearised(plant, RATE, HOME + 0.17)
    loop = close_loop(ask(CONTROLLERS["pid"](Servo.of(FREE), RATE), HOME + 0.17, 0.01), linear, coefficients(plant))
    z, h, new, servo = control.tf("z"), 1 / RATE, 1 - math.exp(-1 / (RATE * 5e-4)), Servo.of(FREE)
    z.dt = h
    C = math.degrees(1) * (5 + 1.2 * h * z / (z - 1) + 0.1 * new / h * (z - 1) / (z - (1 - new))) - servo.a_1 / servo.b
    L = control.ss2tf(linear.held) * C
    omega = 2 * np.pi * loop.f_hz
    exact = L(np.exp(1j * omega * h))
    S = 1 / (1 + exact)
    gain, phase, _, _, crossing, _ = control.stability_margins(L)
    assert loop.gain_margin_db == pytest.approx(
        20 * math.log10(gain), abs=0.1
    ) and loop.gain_crossover_hz == pytest.approx(crossing / (2 * math.pi), rel=0.01)
    assert loop.phase_margin_deg == pytest.approx(phase, abs=0.5) and loop.sensitivity_peak == pytest.approx(
        np.abs(S).max(), rel=0.01
    )
    alpha, gain_db, phase_deg = control.disk_margins(control.tf2ss(L), omega)
    assert loop.disk_margin == pytest.approx(alpha, rel=0.01)
    assert loop.disk_gain_margin_db == pytest.approx(gain_db, rel=0.01) and loop.disk_phase_margin_deg == pytest.approx(
        phase_deg, rel=0.01
    )
    T = np.abs(exact * S)
    assert loop.bandwidth_hz == pytest.approx(loop.f_hz[np.argmax(T < T[0] / math.sqrt(2))], rel=0.03) and loop.stable


def test_a_gain_beyond_the_margin_is_unstable_in_the_loop_too():
    plant = build_plant(FREE)
    linear, servo = linearised(plant, RATE, HOME), Servo.of(FREE)
    f_hz = np.geomspace(0.5, 950, 500)
    at = lambda factor: judged(
        "pid",
        "reduced",
        f_hz,
        linear.response(f_hz),
        pid_by_hand(f_hz, RATE, PidGains(*(factor * x for x in (5, 1.2, 0.1)))),
    )
    limit = at(1.0).gain_range[1]
    for factor, holds in ((0.85 * limit, True), (1.2 * limit, False)):
        assert at(factor).stable is holds
        law = CONTROLLERS["pid"](servo, RATE, 1e9, pid=PidGains(5 * factor, 1.2 * factor, 0.1 * factor))
        _, theta = simulated(law, sampled(plant, RATE, (HOME + 0.01, 0.0)), (), plant.terminal, HOME, 0.01, 0.5)
        assert bool(np.isfinite(theta).all() and np.abs(theta[-200:]).max() < 0.01) is holds


# -- limit cycles -----------------------------------------------------------------------------------------------------


def test_the_cycle_of_a_relay_is_the_textbooks():
    """1/G + N = 0 with N = 4/(pi E) and G = K/(s (s/p + 1)^2): w = p, E = 2 K/(pi p); and it lasts."""
    K, p = 5.0, 2 * math.pi * 20.0
    s = lambda f: 2j * math.pi * f
    (found,) = balanced(lambda f, E: s(f) * (s(f) / p + 1) ** 2 / K + 4 / (math.pi * E))
    assert (
        found.f_hz == pytest.approx(20.0, rel=1e-6)
        and found.amplitude == pytest.approx(2 * K / (math.pi * p), rel=1e-6)
        and found.lasting
    )


def cycles_of(datasheet, kind):
    """(predicted that last, simulated) of the plain PID of the bar: 2 V/deg, 1.2, 0.05, 2 kHz, filter 0.5 ms, contact
    of 40 Hz and 0.2, 0.64 of J at the motor.
    """
    plant, reduced = (build_plant(datasheet, plant=name, effects=[SPRINGY]) for name in (kind, "reduced"))
    law = CONTROLLERS["pid"](Servo.of(FREE), RATE, pid=PidGains(P=2.0, D=0.05))
    seen, _ = simulated(law, sampled(plant, RATE, (HOME + 0.03, 0.0)), plant.effects, plant.terminal, HOME, 0.03, 2.0)
    return [c for c in predicted(law, coefficients(reduced), HOME) if c.lasting], seen


@pytest.mark.parametrize("kind", ["reduced", "mujoco"])
def test_the_cycle_of_a_play_is_predicted(kind):
    """The bar: frequency and amplitude within 20 %; with Table 1's friction and preload none is predicted and none is
    seen.
    """
    (told,), seen = cycles_of(FREE, kind)
    assert told.f_hz == pytest.approx(seen.f_hz, rel=0.2) and told.amplitude == pytest.approx(seen.amplitude, rel=0.2)
    assert cycles_of(SHEET, kind) == ([], None)


def test_nothing_is_asked_beyond_half_the_sample_rate():
    law = CONTROLLERS["pid"](Servo.of(FREE), 100.0)
    assert all(c.f_hz < 50.0 for c in predicted(law, coefficients(build_plant(FREE)), HOME))


def test_only_what_goes_on_is_a_cycle():
    t = np.arange(4000) / 1000.0
    sine = 0.01 * np.sin(2 * np.pi * 23.4 * t)
    found = lasting(sine, 1e-3)
    assert found.f_hz == pytest.approx(23.4, rel=1e-3) and found.amplitude == pytest.approx(0.01, rel=0.01)
    assert (
        lasting(sine * np.exp(-t), 1e-3) is None
        and lasting(0.001 * sine, 1e-3) is None
        and lasting(np.where(t > 2, np.nan, sine), 1e-3) is None
    )


def test_a_shaft_that_hardens_passes_more_the_wider_it_swings():
    """k (1 + 3/4 (A / twist_2)^2) of a cube; a linear spring's where it hardly twists."""
    c = Coefficients(two_body=1.0, k_twist=1e4, harden=1e4)
    assert passed(c, 0.0, 1e-6) == pytest.approx(1e4, rel=1e-6)
    assert passed(c, 0.0, 1.75e4 * 0.01) == pytest.approx(1.75e4, rel=2e-3)
