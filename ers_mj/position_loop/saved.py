"""A servo with its loop from a model.toml, and recordings simulated with it."""

from __future__ import annotations

import numpy as np

from ers_mj.effects.quantities import Coefficients
from ers_mj.errors import InputError
from ers_mj.plants.loop_numbers import LoopNumbers
from ers_mj.plants.mujoco.looped import LoopedPlant
from ers_mj.plants.mujoco.plant import MechanicalPlant
from ers_mj.position_loop.model import LETTERS, WIDER, LoopModel
from ers_mj.position_loop.runs import Run
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.simulation import kernel_effects

MUJOCO_STEP = 2.5e-4  # [s]


def model_of(datasheet: Datasheet) -> LoopModel:
    """The servo of a model.toml with a [loop].

    Raises:
        InputError: it has none, or an effect in it that does not exist.
    """
    if not datasheet.loop:
        raise InputError(f"{datasheet.name}: has no [loop], a model of a position command was expected")
    lumped = {k: v for k, v in datasheet.lumped.items() if k in LETTERS}
    effects = kernel_effects(datasheet.effects, wider=WIDER)
    return LoopModel({**lumped, **datasheet.loop}, (), effects, datasheet.loop_sensor)


def loop_of(datasheet: Datasheet) -> tuple[Coefficients, tuple[tuple[str, np.ndarray], ...], LoopNumbers]:
    """The plant behind the loop, of an input of 1 acceleration, the effects in it, and the firmware's numbers.

    Raises:
        InputError: as `model_of` does.
    """
    model, still = model_of(datasheet), np.zeros(2)
    run = Run("still", np.array([0.0, 1.0]), still, still, still > 0, still < 1, 1.0, 0.0, (0.0, 0.0), 0.0)
    c, effects = model.plant_of(run)
    return c, tuple(effects), model.of(run)[0]


def looped_plant(datasheet: Datasheet, is_angle: bool = True) -> LoopedPlant:
    """The servo in MuJoCo, its loop around one joint of inertia 1."""
    c, effects, numbers = loop_of(datasheet)
    return LoopedPlant(MechanicalPlant(c, effects, is_angle=is_angle, timestep=MUJOCO_STEP), numbers)


def motion_of(
    datasheet: Datasheet, t: np.ndarray, r: np.ndarray, plant: str, start: tuple[float, float], before: float
) -> np.ndarray:
    """Free run (N, 4) of a servo with its loop: load's angle and speed, motor side's angle, drive.

    Args:
        datasheet: a model.toml with a [loop].
        t, r: time [s] from 0 and reference [output unit], each (N,).
        plant: "reduced", or "mujoco": a stepped controller around the MuJoCo plant.
        start, before: (angle, speed) that the log shows at first, and the reference before the first sample.
    """
    if plant == "mujoco":
        return looped_plant(datasheet, datasheet.output_unit in ("", "rad")).motion(t, r, start, before)
    still = np.ones(t.size, bool)
    run = Run("simulated", t, np.ascontiguousarray(r, float), r, still, still, 1.0, 0.0, start, before)
    return model_of(datasheet).motion(run)


def simulate_loop(
    datasheet: Datasheet, t: np.ndarray, r: np.ndarray, *, plant: str = "reduced", noise: float = 0.0, seed: int = 0
) -> np.ndarray:
    """What the sensor reads (N,) [output unit] of a servo that rests at the first reference.

    Args:
        datasheet: a model.toml with a [loop].
        t, r: time [s] and reference [output unit], each (N,).
        plant: "reduced", or "mujoco": a stepped controller around the MuJoCo plant.
        noise, seed: standard deviation [output unit] of the sensor's noise, and its seed.
    """
    motion = motion_of(datasheet, t - t[0], r, plant, (float(r[0]), 0.0), float(r[0]))
    return model_of(datasheet).logged(motion) + noise * np.random.default_rng(seed).standard_normal(t.size)
