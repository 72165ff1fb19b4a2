"""The control laws: one a file, found by reading the folder."""

from __future__ import annotations

import importlib
import pkgutil

from ers_mj.control.controllers.base import Aim, Controller, Servo, State
from ers_mj.control.controllers.finite_time import FiniteTime, Gains, parse_gains
from ers_mj.control.controllers.pid import PidGains, parse_pid

FIRST = ("ftrc", "ftrc-literal", "pid", "pid-ff", "hinf")  # the order in which they are told; others follow by name


def _members() -> dict[str, type[Controller]]:
    found = []
    for info in pkgutil.iter_modules(__path__):
        module = importlib.import_module(f"{__name__}.{info.name}")
        found += [
            cls
            for cls in vars(module).values()
            if isinstance(cls, type) and issubclass(cls, Controller) and cls.__module__ == module.__name__ and cls.name
        ]
    found.sort(key=lambda cls: (FIRST.index(cls.name) if cls.name in FIRST else len(FIRST), cls.name))
    return {cls.name: cls for cls in found}


CONTROLLERS = _members()

__all__ = [
    "CONTROLLERS",
    "Aim",
    "Controller",
    "FiniteTime",
    "Gains",
    "PidGains",
    "Servo",
    "State",
    "parse_gains",
    "parse_pid",
]
