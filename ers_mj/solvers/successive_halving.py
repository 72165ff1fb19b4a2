"""Successive halving: go a few steps with all, keep what is near, go on with that."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

S = TypeVar("S")
T = TypeVar("T")


@dataclass(frozen=True)
class Stage(Generic[T]):
    """A few steps for each that is left, and those of them that go on, in the order in which they do."""

    advance: Callable[[Any], T]
    keep: Callable[[Sequence[T]], Sequence[T]] = lambda ended: ended


def halved(
    begun: Iterable[Any], stages: Sequence[Stage[T]], each: Callable[[Callable[[Any], T], Iterable[Any]], list[T]]
) -> list[T]:
    """What is left of all that was begun after the last stage."""
    left: Sequence[Any] = list(begun)
    for stage in stages:
        left = stage.keep(each(stage.advance, left))
    return list(left)


def carried_on(
    begun: Iterable[S],
    first: Callable[[S], T],
    is_near: Callable[[T], bool],
    then: Callable[[T], T],
    each: Callable[[Callable[[S], T], Iterable[S]], list[T]],
) -> list[T]:
    """Everything that was begun, a few steps on, and further where it ``is_near`` then."""

    def gone(item: S) -> T:
        ended = first(item)
        return then(ended) if is_near(ended) else ended

    return each(gone, begun)
