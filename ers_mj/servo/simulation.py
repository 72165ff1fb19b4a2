"""Recordings with known truth: a datasheet, effects in the units of a reader, an input, and what a sensor then shows.

datasheet + effects [SI] -> lumped model [per inertia] -> motion -> sensor -> columns of a recording
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from types import MappingProxyType
from typing import Protocol

import numpy as np

from ers_mj.effects import BY_NAME, Effect, Parameter
from ers_mj.effects.input_delay import InputDelay
from ers_mj.effects.quantities import Coefficients
from ers_mj.effects.sensor_quantisation import SensorQuantisation
from ers_mj.errors import InputError
from ers_mj.plants.bare_gap import stiff_play
from ers_mj.plants.printed_play import PrintedPlay, printed_threshold
from ers_mj.plants.reduced import Motion, ReducedModel, lumped
from ers_mj.servo.datasheet import Datasheet

PER_INERTIA = {"torque": "", "damping": " s/{y}", "stiffness": "/{y}", "drag": " s^2/{y}^2", "cubic": "/{y}^3"}
Ends = Mapping[str, tuple[float, float]]  # of parameters, by name
LUMPED_UNIT = {"torque": "{y}/s^2", "damping": "1/s", "stiffness": "1/s^2", "drag": "1/{y}", "cubic": "1/({y}^2 s^2)"}
PLAIN_UNIT = {
    "position": "{y}",
    "speed": "{y}/s",
    "acceleration": "{y}/s^2",
    "input": "{u}",
    "time": "s",
    "frequency": "Hz",
    "phase": "rad",
    "ratio": "-",
    "count": "-",
    "per_position": "1/{y}",
    "per_position_squared": "1/{y}^2",
    "supply": "V",
}
FORCE = {"rad": "N m", "m": "N"}

EffectSettings = Sequence[tuple[str, Mapping[str, float]]]


class Plant(Protocol):
    """What runs freely under a voltage: the reduced model, the MuJoCo plant, Eq. (4) as printed."""

    def simulate(self, t: np.ndarray, u: np.ndarray) -> Motion:
        """Free run from rest at theta_0 under u (N,), held between the samples t (N,) [s]."""


def unit_of(kind: str, output_unit: str = "rad", input_unit: str = "V", has_inertia: bool = True) -> str:
    """The unit in which a parameter of this kind is told: SI where the inertia is known, else per inertia."""
    if kind in PER_INERTIA:
        force = FORCE.get(output_unit) if has_inertia else None
        text = force + PER_INERTIA[kind] if force else LUMPED_UNIT[kind]
    else:
        text = PLAIN_UNIT.get(kind, kind)
    return text.format(y=output_unit, u=input_unit)


def inertia_of(datasheet: Datasheet) -> float:
    """J, by which torques are divided on their way into the lumped model; 1 where the datasheet is lumped already."""
    return float(datasheet.parameters.get("J", 1.0))


def kernel_effects(
    effects: EffectSettings, inertia: float = 1.0, wider: Ends = MappingProxyType({})
) -> tuple[tuple[str, np.ndarray], ...]:
    """Effects as the reduced model takes them: every parameter in its place (k,), torques per inertia.

    Args:
        effects: names, each with its values.
        inertia: J [kg m^2], by which torques are divided.
        wider: the ends of parameters, by name, that may go further than the effect itself says.

    Raises:
        InputError: an effect, a key or a value that does not exist or cannot be.
    """
    twice = [name for name, _ in effects if [other for other, _ in effects].count(name) > 1]
    if twice:
        raise InputError(f"the effect {twice[0]} is given twice, once was expected")
    return tuple((name, _vector(_effect(name), values, inertia, wider)) for name, values in effects)


def build_plant(
    datasheet: Datasheet,
    *,
    plant: str = "reduced",
    effects: EffectSettings = (),
    gap: float | None = None,
    linkage: str = "constant",
    inductance: bool = False,
    play: str = "gap",
    is_angle: bool = True,
) -> Plant:
    """The plant of a datasheet, with ``simulate(t, u)`` from rest at theta_0.

    Args:
        datasheet: the servo, with the effects that its [[effect]] list holds. In MuJoCo one with [parameters] is the
            three-dimensional rudder system, one with [lumped] alone a single joint.
        plant: "reduced", the event-exact Eq. (1)/(5), or "mujoco".
        effects: (name, {key: value}) in SI (torques in N m; per inertia where the datasheet has no J).
        gap: half-width of the play [rad], the same two bodies on either plant (see plants/bare_gap.py).
        linkage: "constant" or, in MuJoCo, "rod".
        inductance: whether the datasheet's L acts.
        play: "gap", two bodies, or "printed", Eq. (4) around the reduced model.
        is_angle: whether the output turns.

    Raises:
        InputError: the datasheet, the effects or the options do not make a plant.
    """
    if datasheet.loop:
        raise InputError(
            f"{datasheet.name or 'the model'}: closes a position loop of its own ([loop]), a servo told a voltage was"
            " expected"
        )
    chosen = kernel_effects([*datasheet.effects, *effects], inertia_of(datasheet))
    c = lumped(_values(datasheet, inductance))
    if plant != "mujoco" and linkage != "constant":
        raise InputError(f"the reduced model has the constant linkage only, a {linkage} linkage needs --plant mujoco")
    if gap and (plays := [name for name, _ in chosen if BY_NAME[name].is_play]):
        raise InputError(f"the play is given twice, as gap and as the effect {plays[0]}, once was expected")
    if play == "printed":
        return _printed(c, plant, chosen, gap)
    if plant == "mujoco":
        from ers_mj.plants.mujoco.bodies import bodily
        from ers_mj.plants.mujoco.plant import MechanicalPlant

        shape = bodily(datasheet.parameters, is_angle, c.b)
        return MechanicalPlant(c, chosen, parameters=shape, linkage=linkage, gap=gap or 0.0, is_angle=is_angle)
    return ReducedModel(stiff_play(c, gap) if gap else c, chosen)


def _printed(c: Coefficients, plant: str, effects: Sequence, gap: float | None) -> PrintedPlay:
    if plant != "reduced":
        raise InputError(
            "Eq. (4) as printed is a torque's play, which no joint has: --play printed needs --plant reduced"
        )
    if effects:
        raise InputError(
            f"--play printed is Eq. (4) around the bare reduced model, the effect {effects[0][0]} cannot be added"
        )
    if not gap:
        raise InputError("--play printed needs a play, as in --gap 0.5")
    return PrintedPlay(c, printed_threshold(c, gap))


def simulate_recording(
    datasheet: Datasheet,
    t: np.ndarray,
    u: np.ndarray,
    *,
    effects: EffectSettings = (),
    noise: float = 0.0,
    seed: int = 0,
    **options,
) -> dict[str, np.ndarray]:
    """Columns t_s, u_V, theta_rad, each (N,), of a rudder that starts at rest at theta_0.

    Args:
        datasheet, effects: as :func:`build_plant` takes them.
        t, u: time [s] and voltage [V], held from sample to sample.
        noise: standard deviation of the sensor's noise [rad].
        options: plant, gap, linkage, inductance and play, as :func:`build_plant` takes them.

    Raises:
        InputError: the datasheet, the effects or the options cannot be simulated.
    """
    plant = build_plant(datasheet, effects=effects, **options)
    t, u = np.ascontiguousarray(t, float), np.ascontiguousarray(u, float)
    theta = finite(t, plant.simulate(t, u).theta)
    chosen = kernel_effects([*datasheet.effects, *effects], inertia_of(datasheet))
    return {"t_s": t, "u_V": u, "theta_rad": _sensed(t, theta, chosen, noise, seed)}


def finite(t: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """theta (N,) as it is.

    Raises:
        InputError: it is not finite throughout.
    """
    if not np.isfinite(theta).all():
        k = int(np.argmax(~np.isfinite(theta)))
        raise InputError(f"the simulation leaves all bounds at {t[k]:.4g} s, check the input and the effects' values")
    return theta


def _values(datasheet: Datasheet, inductance: bool) -> dict[str, float]:
    """Eq. (6)'s letters with tau_e; what the datasheet does not tell is absent."""
    values = datasheet.to_lumped()
    values |= {key: datasheet.baseline[key] for key in ("tau_e", "emf_share") if key in datasheet.baseline}
    if "b" not in values:
        raise InputError(
            f"{datasheet.name or 'the datasheet'}: cannot be simulated, "
            "it needs b, or J, K_t and R from which b follows"
        )
    if inductance and not values.get("tau_e"):
        raise InputError(f"{datasheet.name or 'the datasheet'}: has no L and R, --inductance on needs both")
    return values if inductance else values | {"tau_e": 0.0}


def _sensed(
    t: np.ndarray, theta: np.ndarray, effects: Iterable[tuple[str, np.ndarray]], noise: float, seed: int
) -> np.ndarray:
    """What the file holds of the true angle (N,) at times t (N,): the sensor, then its noise, then the converter."""
    y = theta
    for name, values in effects:
        y = y if BY_NAME[name].after_noise else BY_NAME[name].measure(values, t, y)
    if noise:
        y = y + noise * np.random.default_rng(seed).standard_normal(y.size)
    for name, values in effects:
        y = BY_NAME[name].measure(values, t, y) if BY_NAME[name].after_noise else y
    return y


# -- effects as a reader gives them ---------------------------------------------------------------------------


def parse_effect(text: str) -> tuple[str, dict[str, float]]:
    """NAME:key=value,key=value -> (NAME, {key: value}).

    Raises:
        InputError: not of this form, or not of this library.
    """
    name, _, listed = text.partition(":")
    effect, values = _effect(name.strip()), {}
    for pair in filter(None, (part.strip() for part in listed.split(","))):
        key, mark, value = (part.strip() for part in pair.partition("="))
        if not mark:
            raise InputError(f"--effect {text}: {pair!r} is not of the form key=value")
        if key in values:
            raise InputError(f"--effect {text}: {key} is given twice")
        values[key] = _number(value, f"--effect {text}: {key}")
    _vector(effect, values, 1.0, {})
    if recorded := [p.name for p in effect.parameters if p.recorded and p.name in values]:
        raise InputError(
            f"--effect {text}: {recorded[0]} acts through what a recording measured, of which a simulation has none"
        )
    return effect.name, values


def delayed(seconds: float) -> tuple[str, dict[str, float]]:
    """The effect of a command that arrives this late."""
    return InputDelay.name, {"T_d": seconds}


def counting(step: float) -> tuple[str, dict[str, float]]:
    """The effect of a sensor that counts in these steps [output unit]."""
    return SensorQuantisation.name, {"step": step}


def has_play(effects: Iterable[tuple[str, object]]) -> bool:
    """Whether one of these effects (name, values) is a play."""
    return any(name in BY_NAME and BY_NAME[name].is_play for name, _ in effects)


def _number(text: str, where: str) -> float:
    try:
        number = float(text)
    except ValueError:
        raise InputError(f"{where} is {text!r}, a number was expected") from None
    if not math.isfinite(number):
        raise InputError(f"{where} is {text}, a finite number was expected")
    return number


def _effect(name: str) -> Effect:
    if name not in BY_NAME:
        raise InputError(f"there is no effect {name[:40]!r}; {_nearest(name, BY_NAME)}there are {', '.join(BY_NAME)}")
    if BY_NAME[name].only_in_loop:
        raise InputError(f"{name}: acts within a position loop only, where a model's [loop] has it")
    return BY_NAME[name]


def _vector(effect: Effect, values: Mapping[str, float], inertia: float, wider: Ends) -> np.ndarray:
    """The parameters (k,) of one effect, what is not given at its declared default."""
    known = {parameter.name: parameter for parameter in effect.parameters}
    _refuse_strangers(effect, values, known)
    _refuse_lacking(effect, values)
    _refuse_halves(effect, values)
    bounded = [_widened(p, *wider.get(p.name, (p.lower, p.upper))) for p in effect.parameters]
    lacking = effect.beside(values.keys())
    given = [
        _checked(effect, p, float(values[p.name])) if p.name in values else absent
        for p, absent in zip(bounded, lacking.tolist(), strict=True)
    ]
    ends = dict(zip(known, given, strict=True))
    if ends.get("lower", -math.inf) >= ends.get("upper", math.inf):
        raise InputError(f"{effect.name}: lower = {ends['lower']:g} is not below upper = {ends['upper']:g}")
    scale = [inertia if p.kind in PER_INERTIA else 1.0 for p in effect.parameters]
    return np.array(given) / np.array(scale)


def _refuse_strangers(effect: Effect, values: Mapping[str, float], known: Iterable[str]) -> None:
    """What the effect has not."""
    for key in values:
        if key not in known:
            raise InputError(
                f"{effect.name}: there is no parameter {key[:40]!r}; {_nearest(key, known)}"
                f"there are {_meanings(effect.parameters)}"
            )


def _refuse_lacking(effect: Effect, values: Mapping[str, float]) -> None:
    """Without what it does nothing."""
    needed = [p.name for p in effect.parameters if p.positive and p.absent == 0 and p.name not in values]
    if needed or not values:
        what = " and ".join(needed) or "one or more"
        raise InputError(f"{effect.name}: needs {what} of its parameters {_meanings(effect.parameters)}")
    for group in effect.needs:
        if not values.keys() & set(group):
            raise InputError(
                f"{effect.name}: does nothing with {', '.join(values)} alone, expected {' or '.join(group)} too"
            )


def _refuse_halves(effect: Effect, values: Mapping[str, float]) -> None:
    """What says something only together."""
    for group in effect.together:
        if lacking := [key for key in group if key not in values and values.keys() & set(group)]:
            raise InputError(
                f"{effect.name}: {', '.join(key for key in group if key in values)} given without"
                f" {' and '.join(lacking)}, expected {', '.join(group)} together"
            )


def _widened(p: Parameter, lower: float, upper: float) -> Parameter:
    return replace(p, lower=min(p.lower, lower), upper=max(p.upper, upper))


def _checked(effect: Effect, parameter: Parameter, x: float) -> float:
    if parameter.positive and x <= 0:
        raise InputError(
            f"{effect.name}: {parameter.name} = {x:g} is not above zero (leave the effect out for none of it)"
        )
    if not parameter.lower <= x <= parameter.upper:
        raise InputError(
            f"{effect.name}: {parameter.name} = {x:g} lies outside {parameter.lower:g} .. {parameter.upper:g}"
        )
    return x


def _meanings(parameters: Iterable[Parameter]) -> str:
    return ", ".join(f"{p.name} ({p.meaning}, {unit_of(p.kind)})" for p in parameters)


def _nearest(word: str, known: Iterable[str]) -> str:
    near = get_close_matches(word, list(known), n=1, cutoff=0.6)
    return f"did you mean {near[0]}? " if near else ""
