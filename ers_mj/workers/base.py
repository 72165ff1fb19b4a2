"""What is handed out, and what comes back."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol


@dataclass(frozen=True)
class Task:
    """`call(*what)`, under a name of its own. It travels to another process: an importable function, plain values."""

    name: str
    call: Callable[..., Any]
    what: tuple[Any, ...]


@dataclass(frozen=True)
class Done:
    """What became of a task: its value, or why there is none, in one sentence."""

    name: str
    value: Any = None
    lost: str = ""


class Crew(Protocol):
    """Whoever works tasks off."""

    def run(self, tasks: Iterable[Task]) -> Iterator[Done]:
        """Every task once, in the order in which they end; tasks are taken as workers come free. What a task raises is
        raised here. Given up early, nothing is left running that can be stopped.
        """

    def close(self) -> None:
        """Let go of the workers."""
