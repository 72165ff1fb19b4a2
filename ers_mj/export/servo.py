"""A model on its way out: its plant, its firmware's loop, its units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ers_mj.effects.quantities import Coefficients
from ers_mj.errors import InputError
from ers_mj.export.portable import Portable, portable
from ers_mj.plants.loop_numbers import LoopNumbers
from ers_mj.plants.reduced import ReducedModel
from ers_mj.position_loop.saved import loop_of
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.simulation import build_plant


@dataclass(frozen=True)
class Servo:
    """A model on its way out.

    Attributes:
        sheet: as its file has it.
        coefficients, effects: the plant; behind a position loop its input is an acceleration.
        loop: the firmware's numbers, or None.
        inertia: J at the joint [kg m^2, or kg], or None where torques are told per inertia only.
        output_unit, input_unit: rad, m or V; V, %, N m, A, or the output's where a position is commanded.
        signals: names of input and output, with their units.
    """

    sheet: Datasheet
    coefficients: Coefficients
    effects: Sequence[tuple[str, np.ndarray]]
    loop: LoopNumbers | None
    inertia: float | None
    output_unit: str
    input_unit: str
    signals: tuple[str, str]

    @property
    def name(self) -> str:
        """Where it comes from."""
        return self.sheet.name or "servo"

    @property
    def is_angle(self) -> bool:
        """Whether the output turns."""
        return self.output_unit == "rad"

    @property
    def rest(self) -> float:
        """Where it begins [output unit]: theta_0; behind a loop 0, or midway between stops that 0 is not within."""
        if self.loop is None:
            return self.coefficients.theta_0
        lower, upper = self.lowered.lower, self.lowered.upper
        return 0.0 if lower < 0.0 < upper else 0.5 * (lower + upper)

    @property
    def held(self) -> float:
        """The input under which it begins [input unit]."""
        return self.rest if self.loop else 0.0

    @cached_property
    def plant(self) -> ReducedModel:
        """The reduced plant, without the loop."""
        return ReducedModel(self.coefficients, self.effects)

    @cached_property
    def lowered(self) -> Coefficients:
        """The coefficients with every effect in place."""
        return Coefficients(*map(float, self.plant._lowered[0]))

    @cached_property
    def portable(self) -> Portable:
        """The same as plain numbers and text."""
        return portable(self.coefficients, self.effects, self.loop, self.is_angle)


def servo_of(
    sheet: Datasheet, output_unit: str, input_unit: str, signals: tuple[str, str], inductance: bool | None = None
) -> Servo:
    """A model in the units of its recordings; the winding's time constant acts where a diagnosis has found one, unless
    ``inductance`` says otherwise.

    Raises:
        InputError: the datasheet does not make a plant, or an input that does nothing.
    """
    if sheet.loop:
        (c, effects, numbers), out = loop_of(sheet), signals[1]
        told = "theta_ref_rad" if output_unit == "rad" else f"{out.split('_')[0]}_ref_{output_unit}"
        return Servo(sheet, c, effects, numbers, sheet.parameters.get("J"), output_unit, output_unit, (told, out))
    wound = sheet.baseline.get("tau_e", 0.0) > 0 if inductance is None else inductance
    plant = build_plant(sheet, inductance=wound)
    assert isinstance(plant, ReducedModel)
    if plant.coefficients.b == 0:
        raise InputError(f"{sheet.name or 'the model'}: b is 0, a servo whose input does nothing cannot be exported")
    J = sheet.parameters.get("J")
    return Servo(sheet, plant.coefficients, tuple(plant.effects), None, J, output_unit, input_unit, signals)
