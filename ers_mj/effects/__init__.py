"""The library of missing physics: one effect a file, found by reading the folder."""

from __future__ import annotations

import importlib
import pkgutil

from ers_mj.effects.base import Drive, Effect, Friction, Load, Parameter, Sensor, Transmission
from ers_mj.effects.quantities import Coefficients, Scales, Twin


def _members() -> tuple[Effect, ...]:
    """Every effect of this folder, ordered along the signal, then by name."""
    families = (Drive, Transmission, Friction, Load, Sensor)
    found = []
    for info in pkgutil.iter_modules(__path__):
        module = importlib.import_module(f"{__name__}.{info.name}")
        found += [
            cls()
            for cls in vars(module).values()
            if isinstance(cls, type) and issubclass(cls, Effect) and cls.__module__ == module.__name__ and cls.name
        ]
    return tuple(sorted(found, key=lambda e: ([isinstance(e, f) for f in families].index(True), e.name)))


EFFECTS: tuple[Effect, ...] = _members()
BY_NAME: dict[str, Effect] = {effect.name: effect for effect in EFFECTS}
SUSPECTS: tuple[str, ...] = tuple(effect.name for effect in EFFECTS if not (effect.named or effect.tabled))
TABLES: tuple[str, ...] = tuple(effect.name for effect in EFFECTS if effect.tabled)

EQUIVALENT: tuple[frozenset[str], ...] = (
    frozenset({"bias_torque", "asymmetric_friction"}),
    frozenset({"inductance", "input_delay", "sensor_lag"}),
    frozenset({"voltage_saturation", "current_limit", "supply_sag"}),
    frozenset({"cogging", "transmission_ripple"}),
)

__all__ = [
    "BY_NAME",
    "EFFECTS",
    "EQUIVALENT",
    "SUSPECTS",
    "TABLES",
    "Coefficients",
    "Drive",
    "Effect",
    "Friction",
    "Load",
    "Parameter",
    "Scales",
    "Sensor",
    "Transmission",
    "Twin",
]
