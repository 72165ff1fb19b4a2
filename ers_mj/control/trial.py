"""Trials: every controller on every plant over every reference, under the same conditions.

datasheet -> plant, sampled;  datasheet (or another) -> Servo -> controller
reference -> closed loop -> run -> measures
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, cast

import numpy as np

from ers_mj.control.closed_loop import Run, Sampled, Sensor, close
from ers_mj.control.controllers import Controller, Gains, PidGains, Servo
from ers_mj.control.controllers.base import FILTER_S
from ers_mj.control.firmware import as_known, largest_drive, run_firmware, told_numbers
from ers_mj.control.metrics import Measures, measured
from ers_mj.control.own_law import law_of
from ers_mj.control.references import CASES, Reference, named, read_reference
from ers_mj.effects import BY_NAME
from ers_mj.errors import InputError
from ers_mj.plants.reduced import ReducedModel
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.simulation import EffectSettings, build_plant

if TYPE_CHECKING:
    from ers_mj.plants.mujoco.plant import MechanicalPlant

    Plant = ReducedModel | MechanicalPlant  # what a loop can be closed around

Progress = Callable[[str, float], None]
PLANTS = ("reduced", "mujoco")


@dataclass(frozen=True)
class Conditions:
    """What all trials of one call have alike, SI; ``effects`` are added to the plant and unknown to the controllers."""

    amplitude: float = math.radians(10.0)
    start: float = math.radians(15.0)
    rate_hz: float = 10_000.0
    u_max: float = 24.0
    gap: float = 0.0
    linkage: str = "constant"
    inductance: bool = False
    noise: float = 0.0
    seed: int = 0
    filter_s: float = FILTER_S
    gains: Gains = Gains()
    pid: PidGains = PidGains()
    effects: EffectSettings = ()

    def as_document(self) -> dict:
        """As the key `conditions`."""
        plain = asdict(self) | {
            "gains": self.gains.as_document(),
            "pid": self.pid.as_document(),
            "effects": [{"name": name, "parameters": dict(values)} for name, values in self.effects],
        }
        units = {
            "amplitude": "amplitude_rad",
            "start": "start_rad",
            "u_max": "u_max_V",
            "gap": "gap_rad",
            "noise": "noise_rad",
        }
        return {units.get(key, key): x for key, x in plain.items()}


@dataclass(frozen=True, eq=False)
class Trial:
    """One controller on one plant over one reference."""

    controller: str
    plant: str
    case: str
    run: Run
    measures: Measures

    def as_document(self) -> dict:
        """As an entry of `trials`."""
        return {"controller": self.controller, "plant": self.plant, "case": self.case, **self.measures.as_document()}


def plant_under(conditions: Conditions, datasheet: Datasheet, plant: str) -> Plant:
    """The plant of this name under these conditions; only MuJoCo's has another linkage than the constant one."""
    built = build_plant(
        datasheet,
        plant=plant,
        effects=conditions.effects,
        gap=conditions.gap,
        inductance=conditions.inductance,
        linkage=conditions.linkage if plant == "mujoco" else "constant",
    )
    return cast("Plant", built)


def sampled(plant: Plant, rate_hz: float, start: tuple[float, float]) -> Sampled:
    """A plant that is given its voltage sample by sample.

    Raises:
        InputError: its command is later than a loop keeps samples.
    """
    refuse_late(plant, rate_hz, 1_000_000)
    if isinstance(plant, ReducedModel):
        from ers_mj.plants.sampled_reduced import SampledReduced

        return SampledReduced(plant, rate_hz, start)
    from ers_mj.plants.mujoco.sampled import SampledMuJoCo

    return SampledMuJoCo(plant, rate_hz, start)


def refuse_late(plant: Plant, rate_hz: float, most: int) -> None:
    """Raise InputError where the plant's dead time is more than ``most`` samples."""
    late = sum(BY_NAME[name].dead_time(values) for name, values in plant.effects)
    if late * rate_hz > most:
        raise InputError(
            f"a dead time of {late:g} s is {late * rate_hz:.3g} samples at {rate_hz:g} Hz, {most} at most were expected"
        )


def references(cases: Sequence[str | Reference], servo: Servo, conditions: Conditions) -> list[Reference]:
    """The references of names and files; those that are some already stay as they are.

    Raises:
        InputError: a file is no reference, or two references have one name.
    """
    found = [
        (
            case
            if isinstance(case, Reference)
            else named(case, conditions.amplitude, conditions.start, conditions.rate_hz)
            if case in CASES
            else read_reference(case, servo, conditions.u_max)
        )
        for case in cases
    ]
    names = [reference.name for reference in found]
    if len(set(names)) < len(names):
        raise InputError(
            f"two references are called {next(n for n in names if names.count(n) > 1)}, a name for each was expected"
        )
    return found


def try_out(
    datasheet: Datasheet,
    controllers: Sequence[str],
    plants: Sequence[str],
    cases: Sequence[str | Reference],
    conditions: Conditions = Conditions(),
    *,
    design: Datasheet | None = None,
    progress: Progress = lambda text, fraction: None,
) -> list[Trial]:
    """Run every combination.

    Args:
        datasheet: the plant; one with a [loop] is run under its own firmware, whatever the controllers.
        controllers, plants, cases: names; a controller may be a Python file, a case a file or a reference.
        conditions: of all trials.
        design: what the controllers know of the plant; the datasheet itself where None.
        progress: told (text, fraction).

    Raises:
        InputError: the datasheet, an effect or a reference cannot be used.
    """
    ampere = datasheet.to_lumped().get("ampere")
    if datasheet.loop:
        known, built = as_known(datasheet), {}
        conditions = replace(conditions, u_max=largest_drive(datasheet))
    else:
        known = Servo.of(design or datasheet)
        built = {name: plant_under(conditions, datasheet, name) for name in plants}
    wanted = [
        (aim, plant, controller)
        for aim in references(cases, known, conditions)
        for plant in plants
        for controller in controllers
    ]
    trials = []
    for k, (aim, plant, controller) in enumerate(wanted):
        progress(f"{controller} on the {plant} plant, {aim.name}", k / len(wanted))
        if datasheet.loop:
            run = run_firmware(datasheet, plant, aim, start_of(aim, conditions))
        else:
            run = run_once(built[plant], controller, known, aim, conditions)
        trials.append(Trial(controller, plant, aim.name, run, measured(run, conditions.u_max, ampere)))
    return trials


def make_controller(name: str, known: Servo, rate_hz: float, conditions: Conditions) -> Controller:
    """A controller, new, of the conditions' limit, filter and gains."""
    law = law_of(name)
    options = {law.takes: getattr(conditions, law.takes)} if law.takes else {}
    return law(known, rate_hz, conditions.u_max, filter_s=conditions.filter_s, **options)


def sentence_of(name: str, datasheet: Datasheet) -> str:
    """What a law of this name is, on this plant."""
    return "The servo's own loop, as its [loop] has it." if datasheet.loop else law_of(name).sentence


def gains_of(name: str, design: Datasheet, conditions: Conditions) -> str:
    """The gains with which a law of this name runs that knows this datasheet, in words; empty where it has none."""
    if design.loop:
        return told_numbers(design)
    law = law_of(name)
    if not law.takes:
        return ", ".join(f"{key} {x:.4g}" for key, x in law.told_gains(Servo.of(design)).items())
    told = getattr(conditions, law.takes).as_document()
    return ", ".join(f"{key} {x if isinstance(x, str) else format(x, '.4g')}" for key, x in told.items())


def start_of(aim: Reference, conditions: Conditions) -> float:
    """Where a run begins at rest [rad]."""
    return conditions.start if aim.name in CASES else float(aim.theta[0])


def run_once(plant: Plant, controller: str, known: Servo, aim: Reference, conditions: Conditions) -> Run:
    """One controller, new, on one plant, from rest where the conditions or the reference's file have it begin."""
    law = make_controller(controller, known, aim.rate_hz, conditions)
    start = start_of(aim, conditions)
    law.reset(start)
    return close(
        law,
        sampled(plant, aim.rate_hz, (start, 0.0)),
        Sensor(plant.effects, aim.t, conditions.noise, conditions.seed),
        aim,
        plant.terminal,
    )


def needed(aim: Reference, known: Servo) -> float:
    """The largest voltage [V] that a reference asks for where it does not jump, by the model alone."""
    phi, omega = aim.theta - known.theta_0, aim.omega
    wanted = aim.alpha + known.a_1 * phi + known.c_1 * np.sign(phi) + known.a_2 * omega + known.c_2 * np.sign(omega)
    return float(np.abs(wanted).max() / abs(known.b))
