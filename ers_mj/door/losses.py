"""What a model loses on its way into another tool, a sentence each."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from ers_mj.effects import BY_NAME
from ers_mj.errors import refuse_other

if TYPE_CHECKING:
    from ers_mj.plants.mujoco.joint import JointLines
    from ers_mj.plants.mujoco.plant import MechanicalPlant
    from ers_mj.plants.reduced import ReducedModel

TARGETS = ("control", "nonlinear", "mujoco", "joint")


def losses(
    plant: ReducedModel, multibody: Callable[[], MechanicalPlant], lines: Callable[[], JointLines], target: str
) -> tuple[str, ...]:
    """What of a plant does not reach a target.

    Raises:
        InputError: there is no such target.
    """
    refuse_other("target", target, TARGETS)
    if target == "joint":
        return lines().left_out
    if target == "nonlinear":
        lossy = [name for name, _ in plant.effects if BY_NAME[name].holds]
        return tuple(f"{_spoken(name)}: samples that are lost at random" for name in lossy)
    if target == "mujoco":
        built = multibody()
        left = dict.fromkeys([*built.stepped, *(n for n, _ in plant.effects if BY_NAME[n].mjcf.startswith("none"))])
        return tuple(f"{_spoken(name)}: {_reason(name)}" for name in left)
    return (*_constant(plant), *(f"{_spoken(name)}: acts in ways that are not linear" for name in _shaped(plant)))


def _spoken(name: str) -> str:
    return name.replace("_", " ")


def _reason(name: str) -> str:
    return BY_NAME[name].mjcf if name in BY_NAME else "has no MJCF element, the Python stepping of ers-mj applies it"


def _constant(plant: ReducedModel) -> list[str]:
    c = plant.coefficients
    lost = [f"Coulomb friction, {c.c_2_plus:.4g} per inertia: constant while it slips"] if c.c_2_plus > 0 else []
    return lost + ([f"the spring's preload, {c.c_1:.4g} per inertia: constant beside theta_0"] if c.c_1 > 0 else [])


def _shaped(plant: ReducedModel) -> tuple[str, ...]:
    from ers_mj.control.frequency.linear import left_out

    return left_out(plant)
