"""What every control law owes, and what single ones promise."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ers_mj.control.controllers import CONTROLLERS, Aim, FiniteTime, Gains, Servo, State, parse_gains
from ers_mj.control.controllers.finite_time import sig
from ers_mj.errors import InputError
from ers_mj.servo.datasheet import Datasheet, read_datasheet

SERVO = Servo.of(read_datasheet("table1"))
HOME = SERVO.theta_0
LAWS = sorted(CONTROLLERS)


def first(name, servo=SERVO, off=0.05, at=HOME, **options):
    """The first voltage after a law at rest at ``at`` is told to be ``off`` further."""
    law = CONTROLLERS[name](servo, 1000.0, **options)
    law.reset(at)
    return law.voltage(Aim(at + off), at, 0.0)


def test_the_laws_of_the_paper_come_first_and_ours_is_there():
    assert list(CONTROLLERS)[:5] == ["ftrc", "ftrc-literal", "pid", "pid-ff", "hinf"] and "time-optimal" in CONTROLLERS
    assert all(law.sentence and law.__doc__ for law in CONTROLLERS.values())


@pytest.mark.parametrize("name", LAWS)
def test_a_law_pushes_towards_the_reference_and_stays_within_the_limit(name):
    assert 0 < first(name, off=0.01) <= 24 and -24 <= first(name, off=-0.01) < 0
    assert abs(first(name, off=2.0, u_max=7.0)) == 7.0
    backwards = replace(SERVO, b=-SERVO.b)
    assert first(name, backwards, off=0.01) == pytest.approx(-first(name, off=0.01))


@pytest.mark.parametrize("name", LAWS)
def test_a_law_that_is_reset_begins_anew(name):
    law, rng = CONTROLLERS[name](SERVO, 1000.0), np.random.default_rng(0)
    readings = HOME + 1e-3 * rng.standard_normal(50)
    runs = []
    for _ in range(2):
        law.reset(HOME)
        runs.append([law.voltage(Aim(HOME + 0.02, 0.1, 1.0), y, 1e-3 * k) for k, y in enumerate(readings)])
    assert runs[0] == runs[1] and len(set(runs[0])) > 10


@pytest.mark.parametrize("name", LAWS)
def test_no_law_sees_what_comes(name):
    """Two references that part at sample 30 bring the same voltages until then."""

    def told(after):
        law = CONTROLLERS[name](SERVO, 1000.0)
        law.reset(HOME)
        return [law.voltage(Aim(HOME + (0.01 if k < 30 else after)), HOME, 1e-3 * k) for k in range(40)]

    assert told(0.01)[:30] == told(0.2)[:30] and told(0.01)[30] != told(0.2)[30]


@pytest.mark.parametrize("name", ["ftrc", "pid", "pid-ff"])
def test_the_integral_stands_still_while_the_voltage_is_at_its_limit(name):
    """What it says afterwards is what it says without that time."""
    held, fresh = (CONTROLLERS[name](SERVO, 1000.0, u_max=3.0) for _ in range(2))
    held.reset(HOME)
    fresh.reset(HOME)
    for k in range(500):
        assert held.voltage(Aim(HOME + 1.0), HOME, 1e-3 * k) == 3.0
    assert held.voltage(Aim(HOME), HOME, 0.5) == fresh.voltage(Aim(HOME), HOME, 0.0)


@pytest.mark.parametrize("name", ["ftrc", "ftrc-literal"])
def test_the_finite_time_laws_are_the_papers(name):
    law, x1, x2, x3 = CONTROLLERS[name](SERVO, 1000.0), 0.01, -0.02, 0.3
    q = 97 / 99
    xi_3 = sig(x3, 1 / (2 * q - 1)) + 38 ** (1 / (2 * q - 1)) * (sig(x2, 1 / q) + 0.25 ** (1 / q) * x1)
    feedback = 400 * sig(xi_3, 3 * q - 2)
    aim = Aim(HOME + 0.1, 1.0, 30.0)
    theta, w = aim.theta - x2, aim.omega - x3
    extra = -SERVO.a_1 * x2 - SERVO.a_2 * x3
    if name == "ftrc":
        extra = aim.alpha + SERVO.a_1 * (aim.theta - HOME - x2) + SERVO.a_2 * (aim.omega - x3) + SERVO.c_1 + SERVO.c_2
    assert law.law(State(aim, theta, w, x1, x2, x3)) == pytest.approx((extra + feedback) / SERVO.b)


def test_towards_q_1_the_finite_time_feedback_is_linear():
    law = FiniteTime(Gains(q=1))
    assert law(0.1, 0.2, -0.3) == pytest.approx(400 * (-0.3 + 38 * (0.2 + 0.25 * 0.1)))
    assert law(-0.1, -0.2, 0.3) == -law(0.1, 0.2, -0.3)


def test_printed_gains_are_volts_a_degree_on_table_1_and_the_same_acceleration_elsewhere():
    state = State(Aim(HOME), HOME, 0.0, 0.0, math.radians(1.0), 0.0)
    assert CONTROLLERS["hinf"](SERVO, 1000.0).law(state) == pytest.approx(14.0)
    assert CONTROLLERS["hinf"](replace(SERVO, b=2 * SERVO.b), 1000.0).law(state) == pytest.approx(7.0)
    pid = CONTROLLERS["pid"](SERVO, 1000.0).law(state)
    assert pid == pytest.approx(5.0 + SERVO.c_2 / SERVO.b)  # from rest the friction is compensated in full


def test_friction_is_compensated_by_the_error_at_rest_and_by_the_speed_in_motion():
    assert SERVO.friction(0.0, math.radians(0.01)) == pytest.approx(0.5 * SERVO.c_2)
    assert SERVO.friction(-0.06, 1.0) == -SERVO.c_2 and SERVO.friction(0.04, -1.0) == -SERVO.c_2


def test_a_servo_comes_from_any_model(tmp_path):
    lumped = Datasheet(lumped={"b": 80.0, "c_2": 5.0})
    assert Servo.of(lumped) == Servo(b=80.0, c_2=5.0)
    with pytest.raises(InputError, match="it needs b"):
        Servo.of(Datasheet(parameters={"J": 0.003}))


def test_the_observer_follows_through_stick_and_slip():
    from ers_mj.control.closed_loop import Sensor, close
    from ers_mj.control.references import named
    from ers_mj.control.trial import sampled
    from ers_mj.servo.simulation import build_plant

    plant, aim = build_plant(read_datasheet("table1")), named("ramp", math.radians(10), HOME, 1000.0)
    law = CONTROLLERS["time-optimal"](SERVO, 1000.0)
    law.reset(HOME)
    sensed, sense = [], law.sense
    law.sense = lambda y: sensed.append(sense(y)) or sensed[-1]
    run = close(law, sampled(plant, 1000.0, (HOME, 0.0)), Sensor((), aim.t, math.radians(0.01)), aim)
    angle, speed = np.array(sensed).T
    assert np.sqrt(np.mean((angle - run.theta) ** 2)) < math.radians(0.009)  # below the noise
    assert np.sqrt(np.mean((speed - run.omega) ** 2)) < 0.08  # differences of the readings: 0.25


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("k_9=3", "there is no gain 'k_9'"),
        ("q=1/0", "a number or a fraction"),
        ("q=1/2", "outside"),
        ("k_1=-1", "not above zero"),
        ("gamma_3=0", "seven values above zero"),
        ("q", "a number or a fraction"),
    ],
)
def test_gains_that_cannot_be_are_refused(text, says):
    with pytest.raises(InputError, match=says):
        parse_gains(text)


def test_gains_are_read_over_those_of_eq_40():
    found = parse_gains("q=96/97, k_2=60,gamma_3=30")
    assert (float(found.q), found.k_1, found.k_2, found.gamma[2]) == (96 / 97, 0.25, 60.0, 30.0)
