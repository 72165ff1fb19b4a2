"""What the package says when it is given something that it cannot use: one family of exceptions, one sentence each."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import wraps
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")
LONGEST = 300  # characters of a sentence about a file


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


def brief(function: Callable[P, T]) -> Callable[P, T]:
    """Keep the sentence of an InputError that a function raises short, whatever names and values it quotes: its
    beginning says where, its end what was expected.
    """

    @wraps(function)
    def called(*given: P.args, **named: P.kwargs) -> T:
        try:
            return function(*given, **named)
        except InputError as error:
            if len(text := str(error)) <= LONGEST:
                raise
            raise type(error)(f"{text[: LONGEST - 85]} ... {text[-80:]}") from None

    return called


def refuse_other(what: str, value: object, known: Iterable[str]) -> None:
    """Raise InputError where a value is none of those known."""
    if value not in (known := list(known)):
        raise InputError(f"there is no {what} {str(value)[:40]!r}; there are {', '.join(known)}")
