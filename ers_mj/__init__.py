"""ers-mj: find, name and model the physics that a servo simulation leaves out.

    import ers_mj as ers

    run = ers.from_arrays(t=t, theta_rad=theta, u_V=u)     # or ers.read("run.csv")
    found = ers.diagnose(run, "servo.toml")                # verdict, missing physics, improved model
    plant = found.model.to_control()                       # also to_nonlinear(), to_mujoco(), joint_lines()

What `__all__` lists is the documented interface. Everything is loaded when it is first used: the import itself loads
neither numpy nor MuJoCo, and compiles nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ers_mj.data.recording import Recording as Recording
    from ers_mj.door.diagnosing import Diagnosis as Diagnosis
    from ers_mj.door.diagnosing import diagnose as diagnose
    from ers_mj.door.identifying import Identification as Identification
    from ers_mj.door.identifying import identify as identify
    from ers_mj.door.model import Model as Model
    from ers_mj.door.model import load_model as load_model
    from ers_mj.door.reading import from_arrays as from_arrays
    from ers_mj.door.reading import read as read
    from ers_mj.door.simulating import Simulation as Simulation
    from ers_mj.door.simulating import simulate as simulate
    from ers_mj.door.validating import Validation as Validation
    from ers_mj.door.validating import validate as validate
    from ers_mj.errors import ErsError as ErsError
    from ers_mj.errors import InputError as InputError
    from ers_mj.errors import MissingPackage as MissingPackage
    from ers_mj.plants.mujoco.joint import JointLines as JointLines
    from ers_mj.servo.datasheet import Datasheet as Datasheet

__version__ = "0.1.0"

__all__ = [
    "read",
    "from_arrays",
    "diagnose",
    "identify",
    "simulate",
    "validate",
    "load_model",
    "Recording",
    "Datasheet",
    "Model",
    "JointLines",
    "Diagnosis",
    "Identification",
    "Simulation",
    "Validation",
    "ErsError",
    "InputError",
    "MissingPackage",
]
_HOMES = {
    "data.recording": ("Recording",),
    "door.diagnosing": ("Diagnosis", "diagnose"),
    "door.identifying": ("Identification", "identify"),
    "door.model": ("Model", "load_model"),
    "door.reading": ("from_arrays", "read"),
    "door.simulating": ("Simulation", "simulate"),
    "door.validating": ("Validation", "validate"),
    "errors": ("ErsError", "InputError", "MissingPackage"),
    "plants.mujoco.joint": ("JointLines",),
    "servo.datasheet": ("Datasheet",),
}


def __getattr__(name: str) -> Any:
    """What is asked for, loaded now (PEP 562)."""
    home = next((home for home, names in _HOMES.items() if name in names), None)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has {', '.join(__all__)}")
    found = getattr(importlib.import_module(f"{__name__}.{home}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
