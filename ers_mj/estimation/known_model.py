"""A datasheet as a model that can be fitted: its values and effects, and which of its numbers a recording may tell."""

from __future__ import annotations

from collections.abc import Sequence

from ers_mj.data.prepared import Trace
from ers_mj.errors import InputError
from ers_mj.estimation.scales import scales_of
from ers_mj.servo.datasheet import LUMPED, Datasheet
from ers_mj.servo.model import Model
from ers_mj.servo.simulation import inertia_of, kernel_effects


def model_of(
    datasheet: Datasheet, traces: Sequence[Trace], is_angle: bool, *, inductance: bool = False, current: bool = False
) -> Model:
    """The datasheet's model with its effects, which stay as they are; Eq. (6)'s letters are free, where they are not
    zero.

    Args:
        datasheet: the servo; a model.toml brings effects and what was refitted.
        traces: recordings that set the scales.
        is_angle: whether the output is an angle in rad.
        inductance: whether the datasheet's L acts, whose time constant is then free, and the back-EMF's share of the
            damping.
        current: whether the current is measured, which makes that share free, and the acceleration that an ampere
            makes.

    Raises:
        InputError: the datasheet does not tell b.
    """
    values = {
        "a_1": 0.0,
        "a_2": 0.0,
        "c_1": 0.0,
        "c_2": 0.0,
        "theta_0": 0.0,
        "tau_e": 0.0,
        "emf_share": 0.0,
        **datasheet.to_lumped(),
        **datasheet.baseline,
    }
    if "b" not in values:
        raise InputError(
            f"{datasheet.name or 'the datasheet'}: cannot be simulated, it needs b, or J, K_t and R from which b"
            " follows"
        )
    values = {"ampere": values["b"], **values, **({} if inductance else {"tau_e": 0.0})}
    effects = kernel_effects(datasheet.effects, inertia_of(datasheet))
    held = {"theta_0"} if values["a_1"] == values["c_1"] == 0 else set()
    free = [name for name in LUMPED if values[name] != 0 and name not in held]
    free += ["tau_e"] if values["tau_e"] > 0 else []
    free += ["emf_share"] if 0 < values["emf_share"] < 1 and (values["tau_e"] > 0 or current) else []
    free += ["ampere"] if current else []
    return Model(
        values,
        tuple(free),
        effects,
        scales=scales_of(traces, values, is_angle, None),
        frozen=tuple(name for name, _ in effects),
    )
