"""What is known of a servo, in whatever form it is given."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any, Protocol

from ers_mj.errors import InputError
from ers_mj.servo.datasheet import Datasheet, datasheet_of, read_datasheet


class Described(Protocol):
    """What has a datasheet, as a model does."""

    @property
    def datasheet(self) -> Datasheet:
        """What is known of it."""


Known = str | os.PathLike[str] | Mapping[str, Any] | Datasheet | Described | None


def known(given: Known) -> Datasheet | None:
    """The datasheet behind a path, "table1", a mapping laid out as the TOML, a datasheet or a model; None for None.

    Raises:
        InputError: it is none of these, or cannot be meant.
    """
    if given is None:
        return None
    if isinstance(given, Datasheet):
        datasheet_of({"parameters": given.parameters, "lumped": given.lumped, "baseline": given.baseline}, given.name)
        return given
    if isinstance(given, str | os.PathLike):
        return read_datasheet(given)
    if isinstance(given, Mapping):
        return datasheet_of(given)
    sheet = getattr(given, "datasheet", None)
    if not isinstance(sheet, Datasheet):
        raise InputError(f"{type(given).__name__} was given, a path, a mapping, a datasheet or a model was expected")
    return sheet


def known_plant(given: Known) -> Datasheet | None:
    """As ``known``, of a servo that is told a voltage.

    Raises:
        InputError: the model closes a position loop of its own.
    """
    sheet = known(given)
    if sheet is not None and sheet.loop:
        raise InputError(
            f"{sheet.name or 'the model'}: closes a position loop of its own ([loop]), which goes with recordings of a"
            " position command, and into simulate, trial, frequency, view and export"
        )
    return sheet
