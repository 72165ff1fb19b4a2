"""What every export target is: a name, the file that it writes, and what that file does not carry, a sentence each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ers_mj.export.servo import Servo


@dataclass(frozen=True)
class Written:
    """A file that a target wrote.

    Attributes:
        content: of the file.
        losses: what it does not carry, or does otherwise, a sentence each.
    """

    content: bytes
    losses: tuple[str, ...]


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
