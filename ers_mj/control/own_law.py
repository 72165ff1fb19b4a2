"""Control laws by name: the members of `controllers`, or a class of one's own in a Python file."""

from __future__ import annotations

import importlib.util
from functools import lru_cache
from pathlib import Path

from ers_mj.control.controllers import CONTROLLERS, Controller
from ers_mj.errors import InputError, refuse_other

SUFFIX = ".py"


def is_own(name: str) -> bool:
    """Whether a name is that of a Python file."""
    return name.endswith(SUFFIX)


def law_of(name: str) -> type[Controller]:
    """The law of this name, or the one class derived from `Controller` that a Python file holds.

    Raises:
        InputError: there is no such law or file, or the file holds none, several, or fails as it is run.
    """
    if not is_own(name):
        refuse_other("controller", name, CONTROLLERS)
        return CONTROLLERS[name]
    return _read(str(Path(name).resolve()), name)


@lru_cache
def _read(path: str, name: str) -> type[Controller]:
    if not Path(path).is_file():
        raise InputError(f"{name}: there is no such file, a Python file with a class derived from Controller")
    spec = importlib.util.spec_from_file_location(f"own_law_{Path(path).stem}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # whatever a file of somebody's own raises
        told = " ".join(f"{type(error).__name__}: {error}".split())
        raise InputError(f"{name}: cannot be run ({told[:200]})") from None
    found = [x for x in vars(module).values() if isinstance(x, type) and issubclass(x, Controller)]
    own = [x for x in found if x.__module__ == module.__name__]
    if len(own) != 1:
        held = ", ".join(x.__name__ for x in own) or "none"
        raise InputError(
            f"{name}: one class derived from ers_mj.control.controllers.Controller was expected, not {held}"
        )
    return own[0]
