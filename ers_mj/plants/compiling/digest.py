"""What a compiled function is made of: its own code, that of what is put into it, and the numbers that they read."""

from __future__ import annotations

import hashlib
import types
from collections.abc import Callable, Iterator

import numpy as np


def digest_of(function: Callable, apart: Callable[[object], str | None], *beside: str) -> str:
    """A digest that changes with a function's code, and with everything that the code reads.

    ``apart`` tells the name and signature of what is compiled apart and only called, and None of anything else;
    ``beside`` is digested as well.
    """
    made = hashlib.sha256()
    for told in (*beside, *_function(function, apart, set())):
        made.update(told.encode() + b"\n")
    return made.hexdigest()[:20]


def read_by(function: Callable) -> Iterator[tuple[str, object]]:
    """(name, value) of every global and enclosed variable that a function's code names."""
    for cell, name in zip(function.__closure__ or (), function.__code__.co_freevars, strict=True):
        yield name, cell.cell_contents
    names = {name for code in _codes(function.__code__) for name in code.co_names}
    for name in sorted(names & function.__globals__.keys()):
        value = function.__globals__[name]
        yield name, value
        if isinstance(value, types.ModuleType) and value.__name__ not in ("math", "numpy"):
            yield from ((f"{name}.{own}", getattr(value, own)) for own in sorted(names & vars(value).keys()))


def _codes(code: types.CodeType) -> Iterator[types.CodeType]:
    """A code and those within it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _codes(constant)


def _function(function: Callable, apart, seen: set[int]) -> Iterator[str]:
    if id(function) in seen:
        return
    seen.add(id(function))
    for code in _codes(function.__code__):
        constants = [c for c in code.co_consts if not isinstance(c, types.CodeType)]
        yield repr((code.co_code, code.co_names, code.co_varnames, code.co_freevars, constants))
    for name, value in read_by(function):
        yield name
        yield from _value(value, apart, seen)


def _value(value: object, apart, seen: set[int]) -> Iterator[str]:
    """What cannot be told otherwise is told by its address: it is compiled anew in every process, never run stale."""
    called = apart(value)
    if called is not None:
        yield called
    elif isinstance(value, np.ndarray):
        yield f"{value.dtype.descr} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
    elif isinstance(value, types.ModuleType):
        yield value.__name__
    elif hasattr(value, "py_func"):
        yield from _function(value.py_func, apart, seen)
    elif isinstance(value, types.FunctionType):
        yield from _function(value, apart, seen)
    elif isinstance(value, tuple):
        for each in value:
            yield from _value(each, apart, seen)
    elif isinstance(value, type) and hasattr(value, "_fields"):
        yield f"{value.__qualname__} {value._fields}"
    elif isinstance(value, (type, types.BuiltinFunctionType)):
        yield value.__qualname__
    else:
        yield repr(value)
