"""`randomisation.json`: how sure a model is, as ranges and as an ensemble of servos for domain randomisation."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.errors import InputError
from ers_mj.export.base import Target, Written
from ers_mj.export.mujoco_joint import OwnJoint
from ers_mj.export.servo import Servo, servo_of
from ers_mj.servo.datasheet import Datasheet


@dataclass(frozen=True)
class Ensemble:
    """How many servos are drawn, and from what."""

    members: int = 64  # servos, the model itself among them
    seed: int = 0  # of their draw
    sigmas: float = 1.959964  # standard deviations in half a 95 % interval
    tries: int = 20  # draws of a servo that can be, before the model's own number stands


ENSEMBLE = Ensemble()
INDEPENDENT = (
    "every number is drawn by itself: what recordings tell only together (a gain and a friction that rise as one) is"
    " drawn apart, so the ensemble is wider than the servo's own uncertainty"
)
ONE_UNIT = "this is how sure the model of one unit is, not how units differ: identify several for that"
NO_INTERVALS = (
    "the model carries no intervals (a datasheet, or a file of an earlier version): nothing is drawn, the ensemble is"
    " the model itself; diagnose its recordings again for them"
)
IMPOSSIBLE = "draws that no servo can be are taken again; after {tries} the model's own number stands"


class Randomisation(Target):
    """Ranges of the identified numbers, and sampled servos in the terms of a MuJoCo joint."""

    name, file, tool = "randomisation", "randomisation.json", "domain randomisation"

    def write(self, servo: Servo) -> Written:
        document = document_of(servo)
        content = json.dumps(document, indent=1, allow_nan=False) + "\n"
        lost = (
            (INDEPENDENT, IMPOSSIBLE.format(tries=ENSEMBLE.tries), ONE_UNIT)
            if document["ranges"]
            else (NO_INTERVALS, ONE_UNIT)
        )
        return Written(content.encode(), lost)


def document_of(servo: Servo) -> dict:
    """{"ranges": {name: {"value", "low", "high"}}, "ensemble": [{"parameters", "joint", "actuator"}]} and what they are
    of; the first member is the model itself.
    """
    sheet, random = servo.sheet, np.random.default_rng(ENSEMBLE.seed)
    values = identified(sheet)
    ranges = {
        name: {"value": values[name], "low": low, "high": high}
        for name, (low, high) in sheet.intervals.items()
        if name in values
    }
    members = [_member(servo, {})]
    members += [_drawn(servo, ranges, random) for _ in range(ENSEMBLE.members - 1 if ranges else 0)]
    return {
        "version": 1,
        "model": servo.name,
        "verdict": sheet.verdict or None,
        "input": servo.signals[0],
        "output": servo.signals[1],
        "inertia": servo.inertia,
        "units": "joint and actuator as in MuJoCo, SI; per inertia (J = 1) where inertia is null",
        "seed": ENSEMBLE.seed,
        "ranges": ranges,
        "ensemble": members,
    }


def identified(sheet: Datasheet) -> dict[str, float]:
    """The model's own numbers, by the names that intervals have."""
    found = ((name, _value(sheet, name)) for name in sheet.intervals)
    return {name: x for name, x in found if x is not None}


def _value(sheet: Datasheet, name: str) -> float | None:
    """A number of the model by the name that its interval has."""
    effect, _, parameter = name.rpartition(".")
    home: Mapping[str, float] = dict(sheet.effects).get(effect, {}) if effect else {
        **sheet.baseline, **sheet.to_lumped(), **sheet.loop,
    }  # fmt: skip
    return home.get(parameter)


def with_values(sheet: Datasheet, values: Mapping[str, float]) -> Datasheet:
    """The model with other numbers, by the names that intervals have."""
    lumped, loop, baseline = dict(sheet.lumped), dict(sheet.loop), dict(sheet.baseline)
    effects = [(name, dict(own)) for name, own in sheet.effects]
    for key, x in values.items():
        effect, _, parameter = key.rpartition(".")
        home = next((own for name, own in effects if name == effect), None)
        if home is None:
            home = next((table for table in (loop, baseline, lumped) if parameter in table), lumped)
        home[parameter] = x
    return replace(sheet, lumped=lumped, loop=loop, baseline=baseline, effects=tuple(effects))


def _drawn(servo: Servo, ranges: Mapping[str, Mapping[str, float]], random: np.random.Generator) -> dict:
    for _ in range(ENSEMBLE.tries):
        values = {name: _draw(row["value"], row["low"], row["high"], random) for name, row in ranges.items()}
        try:
            return _member(servo, values)
        except InputError:
            continue
    return _member(servo, {})


def _draw(value: float, low: float, high: float, random: np.random.Generator) -> float:
    """Within the interval, as near to the value as its two halves say; of a positive number by its logarithm."""
    z = float(np.clip(random.standard_normal(), -ENSEMBLE.sigmas, ENSEMBLE.sigmas)) / ENSEMBLE.sigmas
    end = high if z > 0 else low
    if low > 0 and value > 0:
        return value * math.exp(abs(z) * math.log(end / value))
    return value + abs(z) * (end - value)


def _member(servo: Servo, values: Mapping[str, float]) -> dict:
    """One servo: its numbers, and the joint and the actuator that it makes."""
    sheet = with_values(servo.sheet, values)
    lines = OwnJoint(servo_of(sheet, servo.output_unit, servo.input_unit, servo.signals)).lines
    told = values or identified(servo.sheet)
    return {
        "parameters": dict(told),
        "joint": _numbers(lines.joint),
        "actuator": {"kind": lines.kind, **_numbers(lines.actuator)},
    }


def _numbers(attributes: Mapping[str, object]) -> dict[str, object]:
    return {name: x for name, x in attributes.items() if not isinstance(x, str)}
