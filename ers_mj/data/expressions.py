"""Arithmetic over the columns of a file: numbers, columns, + - * / and brackets, nothing else.

text -> tokens (the longest column name that fits comes first) -> value, by recursive descent
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

import numpy as np

NUMBER = re.compile(r"\d+(?:\.\d*)?(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?")
INDEX = re.compile(r"\[\s*(\d+)\s*\]")
CONSTANTS = {"pi": np.pi}
DEEPEST = 50  # brackets within brackets

Value = np.ndarray | float
Column = tuple[str, int | None]  # its name, and the element of a column of lists


class Unreadable(ValueError):
    """A text that is no such arithmetic."""


def tokens(text: str, columns: Sequence[str]) -> list[str | float | Column]:
    """Numbers, columns and signs of a text.

    Raises:
        Unreadable: something in it is none of these.
    """
    found: list[str | float | Column] = []
    names = sorted(filter(None, columns), key=len, reverse=True)
    k = 0
    while k < len(text):
        if text[k].isspace():
            k += 1
            continue
        token, k = _token(text, k, names)
        found.append(token)
    return found


def _token(text: str, k: int, names: Sequence[str]) -> tuple[str | float | Column, int]:
    """The token that begins at place k, and where the next one may."""
    name = next((c for c in names if text.startswith(c, k)), "")
    number = NUMBER.match(text, k)
    if name and (number is None or len(name) >= number.end() - k):
        index = INDEX.match(text, k + len(name))
        return (name, int(index[1]) if index else None), index.end() if index else k + len(name)
    if number is not None:
        return float(number[0]), number.end()
    if (constant := next((c for c in CONSTANTS if text.startswith(c, k)), "")) != "":
        return CONSTANTS[constant], k + len(constant)
    if text[k] in "+-*/()":
        return text[k], k + 1
    raise Unreadable(text[k:])


def columns_of(found: Sequence[str | float | Column]) -> list[Column]:
    """The columns among tokens."""
    return [token for token in found if isinstance(token, tuple)]


def value(found: Sequence[str | float | Column], column: Callable[[Column], np.ndarray]) -> Value:
    """What tokens come to, each column by its values (N,).

    Raises:
        Unreadable: the tokens are no whole expression.
    """
    parser = _Parser(list(found), column)
    result = parser.sum(0)
    if parser.rest:
        raise Unreadable(str(parser.rest[-1]))
    return result


class _Parser:
    """Takes tokens from the left."""

    def __init__(self, found: list[str | float | Column], column: Callable[[Column], np.ndarray]):
        self.rest, self.column = found[::-1], column

    def sum(self, depth: int) -> Value:
        total = self._product(depth)
        while self.rest and self.rest[-1] in ("+", "-"):
            sign = self.rest.pop()
            term = self._product(depth)
            with np.errstate(all="ignore"):
                total = total + term if sign == "+" else total - term
        return total

    def _product(self, depth: int) -> Value:
        total = self._factor(depth)
        while self.rest and self.rest[-1] in ("*", "/"):
            sign = self.rest.pop()
            other = self._factor(depth)
            if sign == "/" and np.any(np.asarray(other) == 0.0):
                raise Unreadable("a division by zero")
            with np.errstate(all="ignore"):  # what is not finite is told of the column, with its row
                total = total * other if sign == "*" else total / other
        return total

    def _factor(self, depth: int) -> Value:
        if not self.rest or depth > DEEPEST:
            raise Unreadable("it ends too early")
        token = self.rest.pop()
        if isinstance(token, tuple):
            return self.column(token)
        if isinstance(token, float):
            return token
        if token in ("+", "-"):
            other = self._factor(depth + 1)
            return other if token == "+" else -other
        if token != "(":
            raise Unreadable(token)
        total = self.sum(depth + 1)
        if not self.rest or self.rest.pop() != ")":
            raise Unreadable("a bracket stays open")
        return total
