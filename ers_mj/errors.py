"""What the package says when it is given something that it cannot use: one family of exceptions, one sentence each."""

from __future__ import annotations

from collections.abc import Iterable


class ErsError(Exception):
    """Whatever the package raises on purpose. Its text is the sentence that the command line prints: one line, and of
    text from a file nothing that would steer a terminal.
    """

    def __init__(self, message: str):
        super().__init__("".join(c if c.isprintable() else "?" for c in " ".join(message.split())))


class InputError(ErsError, ValueError):
    """Bad input, in one sentence: what was given, what was expected, what exists.

    The message is kept on one line, whatever the text that is quoted in it.
    """


class Unwritable(InputError):
    """A place that results cannot be written to."""

    @classmethod
    def at(cls, place: object, reason: Exception | str, instead: str = "") -> Unwritable:
        """The sentence for this place, what the system says of it, and what to do instead."""
        said = reason.strerror if isinstance(reason, OSError) else None
        return cls(f"{place}: cannot be written ({said or reason}){instead}")


class MissingPackage(ErsError, ImportError):
    """An optional package is needed for what was asked, and is not installed."""


def refuse_other(what: str, value: object, known: Iterable[str]) -> None:
    """Raise InputError where a value is none of those known."""
    if value not in (known := list(known)):
        raise InputError(f"there is no {what} {str(value)[:40]!r}; there are {', '.join(known)}")
