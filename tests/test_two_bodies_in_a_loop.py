"""A motor and a load behind a firmware's loop: at rest under a weight, under another load, and with the sensors on
either side.
"""

import math

import numpy as np
import pytest
from test_position_loop import LIMITED, run_of, steps_of

from ers_mj.effects.backlash import Backlash
from ers_mj.effects.gravity_imbalance import GravityImbalance
from ers_mj.effects.shaft_compliance import ShaftCompliance
from ers_mj.plants.mujoco.looped import LoopedPlant
from ers_mj.plants.mujoco.plant import MechanicalPlant
from ers_mj.plants.reduced import lowered
from ers_mj.position_loop.model import SIDES, LoopModel
from ers_mj.position_loop.two_bodies import other_sides

WEIGHT = (GravityImbalance.name, np.array([6.0, 20.0]))
PARTED = {
    "shaft": (ShaftCompliance.name, np.array([6.0, 0.1, 0.4, 0.5, np.inf])),
    "hardening shaft": (ShaftCompliance.name, np.array([6.0, 0.1, 0.4, 0.5, 0.004])),
    "play": (Backlash.name, np.array([0.02, 0.6, 0.5, 60.0, 0.5])),
}
HELD = {"K": 900.0, "I": 800.0, "a_2": 20.0, "c_2": 2.0}


def still(seconds: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    t = np.arange(0.0, seconds, 0.01)
    return t, np.full(t.size, 0.3)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("parted", PARTED)
def test_a_servo_that_holds_a_weight_begins_at_rest(parted, side):
    model = LoopModel(HELD, (), (WEIGHT, PARTED[parted]), side)
    t, r = still()
    load, _, motor, _ = model.motion(run_of(t, r, start=0.3))[0]
    asked = load if side == "load" else motor  # of an integral, which leaves no error
    shown = model.predicted(run_of(t, np.full(t.size, asked), start=0.3))
    assert abs(load - motor) > 0.002
    assert shown[0] == 0.3
    assert np.max(np.abs(shown - 0.3)) < 1e-6


@pytest.mark.parametrize("parted", PARTED)
def test_the_shaft_bears_what_friction_does_not(parted):
    model = LoopModel(HELD, (), (WEIGHT, PARTED[parted]))
    run = run_of(*still(), start=0.3)
    c, effects = model.plant_of(run)
    c = type(c)(*lowered(c, effects)[0])
    theta, _, theta_m, _ = model.motion(run)[0]
    over = abs(theta_m - theta) - c.gap
    borne = c.k_twist * over * (1.0 + c.harden * over**2)
    weight = 6.0 * math.sin(0.3) + 20.0 * math.cos(0.3)
    assert borne == pytest.approx(weight - (1.0 - c.phi) * 2.0, rel=1e-6)


def test_what_friction_holds_twists_nothing():
    model = LoopModel(HELD | {"c_2": 60.0}, (), (WEIGHT, PARTED["play"]))
    motion = model.motion(run_of(*still(), start=0.3))
    assert motion[0, 0] == motion[0, 2]


@pytest.mark.parametrize("side", SIDES)
def test_mujoco_begins_there_too(side):
    values = LIMITED | {"tau_s": 0.0}
    model = LoopModel(values, (), (WEIGHT, PARTED["shaft"]), side)
    t, r = steps_of(3)
    run = run_of(t, r)
    plant = LoopedPlant(MechanicalPlant(*model.plant_of(run)), model.of(run)[0])
    seen = plant.simulate(t, r, (0.0, 0.0), 0.0)
    ours = model.predicted(run)
    assert np.sqrt(np.mean((seen - ours) ** 2)) < 0.01 * np.std(ours)


def test_a_heavier_load_leaves_the_shaft_and_the_motor_as_they_are():
    """Told against an inertia that is twice as large."""
    model = LoopModel(LIMITED | {"rotor": 0.5}, (), (PARTED["shaft"],))
    light = run_of(*steps_of(1))
    heavy = type(light)(**{**{f: getattr(light, f) for f in light.__dataclass_fields__}, "inertia": 2.5})
    assert model.lightness(heavy) == pytest.approx(0.5)
    one, other = (type(c)(*lowered(c, fx)[0]) for c, fx in (model.plant_of(light), model.plant_of(heavy)))
    assert 2.0 * other.k_twist == pytest.approx(one.k_twist)
    assert 2.0 * other.d_twist == pytest.approx(one.d_twist)
    assert 2.0 * other.rho == pytest.approx(one.rho)


def test_the_sensors_are_tried_on_the_other_sides():
    model = LoopModel(LIMITED, tuple(LIMITED), (PARTED["shaft"],), "link")
    starts = other_sides(model)
    assert [{start.side for start in one} for one in starts] == [{"load"}, {"motor"}]
    assert {start["K"] for start in starts[0]} == {450.0, 900.0, 1800.0}
    assert other_sides(model.without_effect(ShaftCompliance.name)) == []
