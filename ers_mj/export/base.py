"""What every export target is: a name, the file that it writes, and what that file does not carry, a sentence each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np

from ers_mj.effects.quantities import Coefficients
from ers_mj.export.portable import Portable, portable
from ers_mj.plants.position_loop import LoopNumbers
from ers_mj.plants.reduced import ReducedModel
from ers_mj.servo.datasheet import Datasheet


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
        """Where it rests without an input [output unit]."""
        return 0.0 if self.loop else self.coefficients.theta_0

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


@dataclass(frozen=True)
class Written:
    """A file that a target wrote.

    Attributes:
        content: of the file.
        losses: what it does not carry, or does otherwise, a sentence each.
        beside: further files, by name.
    """

    content: bytes
    losses: tuple[str, ...]
    beside: Mapping[str, bytes] = field(default_factory=dict)


class Target:
    """One tool that a model goes to."""

    name: ClassVar[str] = ""
    file: ClassVar[str] = ""
    tool: ClassVar[str] = ""  # what reads the file, for the catalogue

    def write(self, servo: Servo) -> Written:
        """The file.

        Raises:
            InputError: the tool cannot take such a servo at all.
        """
        raise NotImplementedError
